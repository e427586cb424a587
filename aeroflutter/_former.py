"""Module names of 0.1.0: they go on working, with a warning that says the name of today."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from types import ModuleType
from typing import Any

MOVED = {
    "aerodynamics": "model.aerodynamics",
    "chaos": "motion.chaos",
    "continuation": "orbits.continuation",
    "cycles": "orbits.cycles",
    "cycles.tolerance": "studies.tolerance",
    "dataset": "results.dataset",
    "describing": "orbits.describing",
    "harmonic": "orbits.harmonic",
    "lure": "model.lure",
    "maps": "studies.maps",
    "modes": "linear.modes",
    "orbits.cycles.tolerance": "studies.tolerance",
    "rootlocus": "linear.rootlocus",
    "section": "model.section",
    "timemarch": "motion",
    "validity": "guarantees",
}


class FormerNames(MetaPathFinder, Loader):
    """Finds `aeroflutter.section` where `aeroflutter.model.section` is, and so on."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """The module of today, if `fullname` was one."""
        package, _, name = fullname.partition(".")
        if package != __package__:  # whose modules may have any name
            return None
        inner = ""
        while name not in MOVED:
            name, dot, last = name.rpartition(".")
            if not dot:
                return None
            inner = f".{last}{inner}"
        today = f"{package}.{MOVED[name]}{inner}"
        return ModuleSpec(fullname, self, origin=today) if find_spec(today) else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """The very module that has another name today."""
        assert spec.origin is not None
        warnings.warn(f"{spec.name} is {spec.origin} now", DeprecationWarning, stacklevel=2)
        module = import_module(spec.origin)
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """It has run already: all to be done is to give it back the spec of today's name."""
        assert module.__spec__ is not None
        module.__spec__ = module.__spec__.loader_state


def attribute(package: str, moved: dict[str, str]) -> Callable[[str], Any]:
    """A package's `__getattr__` for names that live elsewhere today: `moved[name]` is where."""

    def get(name: str) -> Any:
        if name not in moved:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        warnings.warn(f"{package}.{name} is in {moved[name]} now", DeprecationWarning, stacklevel=2)
        return getattr(import_module(moved[name]), name)

    return get


def install() -> None:
    """Let the former names be found, before the path of a package that holds the module."""
    sys.meta_path.insert(0, FormerNames())
