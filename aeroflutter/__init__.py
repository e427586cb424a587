"""Flutter and limit cycles of a typical section with a nonlinear pitch spring.

Names are imported on first use (PEP 562), so that `import aeroflutter` costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from aeroflutter import _former

__version__ = "0.1.0"

_EXPORTS = {
    "AeroflutterError": "errors",
    "ConvergenceError": "errors",
    "InputError": "errors",
    "Flap": "model.section",
    "FlapSI": "model.section",
    "Scale": "model.section",
    "TypicalSection": "model.section",
    "QuasiSteady": "model.aerodynamics",
    "Wagner": "model.aerodynamics",
    "System": "model.system",
    "Family": "model.family",
    "FixedModel": "model.family",
    "SampledModel": "model.family",
    "SectionModel": "model.family",
    "FixedFamily": "model.lure",
    "LureFamily": "model.lure",
    "LureSystem": "model.lure",
    "SampledFamily": "model.lure",
    "SectionFamily": "model.lure",
    "Bilinear": "springs",
    "Cubic": "springs",
    "DeadZone": "springs",
    "Freeplay": "springs",
    "Friction": "springs",
    "Hysteresis": "springs",
    "Linear": "springs",
    "Play": "springs",
    "Polynomial": "springs",
    "Relay": "springs",
    "Saturation": "springs",
    "Spring": "springs",
    "Table": "springs",
    "respond": "springs",
    "simplify": "springs",
    "Case": "case.case",
    "load_case": "case.case",
}

__all__ = ["__version__", *_EXPORTS]
_former.install()


def __getattr__(name: str) -> Any:
    """Import the module that holds `name` and hand the name over."""
    if name not in _EXPORTS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_EXPORTS[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Names already imported and those that can be."""
    return sorted({*globals(), *__all__})
