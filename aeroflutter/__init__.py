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
    # analyses: each takes a case, a section or a family
    "root_locus": "linear.rootlocus",
    "flutter_speed": "linear.rootlocus",
    "RootLocusOptions": "linear.rootlocus",
    "pk_method": "linear.pk",
    "PKOptions": "linear.pk",
    "describing_curve": "orbits.describing",
    "describing_at": "orbits.describing",
    "DescribingOptions": "orbits.describing",
    "harmonic_balance": "orbits.harmonic",
    "harmonic_families": "orbits.harmonic",
    "HarmonicOptions": "orbits.harmonic",
    "limit_cycles": "orbits.cycles",
    "cycles_at": "orbits.cycles",
    "CycleOptions": "orbits.cycles",
    "loop_test": "guarantees.looptest",
    "LoopTestOptions": "guarantees.looptest",
    "onset": "guarantees.onset",
    "friction_chart": "guarantees.chart",
    "tolerance": "studies.tolerance",
    "largest_gap": "studies.tolerance",
    "least_friction": "studies.tolerance",
    "simulate": "motion",
    "Initial": "motion",
    "SimulateOptions": "motion",
    "there_and_back": "motion.sweeps",
    "chaos": "motion.chaos",
    "chaos_scan": "motion.chaos",
    "ChaosOptions": "motion.chaos",
    "flutter_map": "studies.cases",
    "Axis": "studies.maps",
    "Grid": "studies.maps",
    "MapOptions": "studies.maps",
    "SweepOptions": "studies.maps.sweep",
    "sweep": "studies.sampled",
    "vary": "studies.vary",
    "to_json": "results",
    "to_dataset": "results",
    "to_dataframe": "results",
}

_LATER = {
    "plot": ("plots.drawing", "draw"),
    "dataset": ("results", "to_dataset"),
    "dataframe": ("results", "to_dataframe"),
    "html": ("results.html", "html"),
}
"""Who draws and encodes results: above the analyses, so called by name and only when wanted."""

__all__ = ["__version__", *_EXPORTS]
_former.install()


def __getattr__(name: str) -> Any:
    """Import the module that holds `name` and hand the name over."""
    if name not in _EXPORTS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_EXPORTS[name]}"), name)
    globals()[name] = value
    return value


def _later(name: str) -> Any:
    """The function that does something with results."""
    module, attribute = _LATER[name]
    return getattr(import_module(f"{__name__}.{module}"), attribute)


def __dir__() -> list[str]:
    """Names already imported and those that can be."""
    return sorted({*globals(), *__all__})
