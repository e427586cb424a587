"""Command line: ``python -m derive [--check]``."""

from pathlib import Path

from derive.configuration import TYPICAL_SECTION
from derive.describing_module import describing_module
from derive.equations import quasi_steady, second_order
from derive.modules import houbolt_module, quasi_steady_module, section_module

equations = second_order(TYPICAL_SECTION)
Path("generated/section.py").write_text(section_module(TYPICAL_SECTION, equations))
quasi = quasi_steady(equations)
Path("generated/quasi_steady.py").write_text(quasi_steady_module(TYPICAL_SECTION, quasi))
Path("generated/describing.py").write_text(describing_module())
Path("generated/houbolt.py").write_text(houbolt_module())
