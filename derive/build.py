"""Everything the derivation writes, as text by path."""

from __future__ import annotations

from pathlib import Path

from derive import indicial
from derive.configuration import TYPICAL_SECTION
from derive.describing_module import describing_module
from derive.emit import render
from derive.equations import quasi_steady, second_order
from derive.flap import SECTION_WITH_FLAP
from derive.modules import (
    houbolt_module,
    indicial_module,
    loads_module,
    quasi_steady_module,
    section_module,
)
from derive.proofs import emitted, flap, houbolt, section, springs, switched
from derive.report import report
from derive.switched_module import switched_module

ROOT = Path(__file__).resolve().parents[1]
PROOFS = {
    "section": section.PROOFS,
    "flap": flap.PROOFS,
    "indicial": indicial.PROOFS,
    "springs": springs.PROOFS,
    "switched": switched.PROOFS,
    "houbolt": houbolt.PROOFS,
}


def build() -> dict[str, str]:
    """Prove every step, then render generated modules and report; paths are from the root.

    Raises
    ------
    derive.proofs.same.ProofError
        If a step, or what was emitted for it, does not hold.
    """
    for proofs in PROOFS.values():
        for proof in proofs:
            proof.run()
    equations = second_order(TYPICAL_SECTION)
    quasi = quasi_steady(equations)
    with_flap = second_order(SECTION_WITH_FLAP)
    modules = {
        "section": section_module(TYPICAL_SECTION, equations),
        "loads": loads_module(TYPICAL_SECTION, equations),
        "quasi_steady": quasi_steady_module(TYPICAL_SECTION, quasi),
        "flap": section_module(SECTION_WITH_FLAP, with_flap, laplace=False),
        "flap_quasi_steady": quasi_steady_module(
            SECTION_WITH_FLAP, quasi_steady(with_flap), laplace=False
        ),
        "describing": describing_module(),
        "switched": switched_module(),
        "houbolt": houbolt_module(),
        "indicial": indicial_module(),
    }
    emitted.check_section(modules["section"], TYPICAL_SECTION, equations)
    emitted.check_loads(modules["loads"], TYPICAL_SECTION, equations)
    emitted.check_quasi_steady(modules["quasi_steady"], TYPICAL_SECTION, quasi)
    emitted.check_section(modules["flap"], SECTION_WITH_FLAP, with_flap)
    emitted.check_quasi_steady(
        modules["flap_quasi_steady"], SECTION_WITH_FLAP, quasi_steady(with_flap)
    )
    emitted.check_describing(modules["describing"])
    emitted.check_switched(modules["switched"])
    emitted.check_houbolt(modules["houbolt"])
    return {
        "generated/__init__.py": render("init.py.j2"),
        **{f"generated/{name}.py": text for name, text in modules.items()},
        "docs/derivation.md": report(equations, quasi, PROOFS),
    }
