"""The emitted equations of a section, chosen by what it is made of."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from itertools import permutations
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from aeroflutter.generated import flap as _flap
from aeroflutter.generated import flap_quasi_steady as _flap_quasi_steady
from aeroflutter.generated import quasi_steady as _quasi_steady
from aeroflutter.generated import section as _section
from aeroflutter.model.aerodynamics import Aerodynamics, Wagner
from aeroflutter.model.section import TypicalSection
from aeroflutter.model.system import Real

__all__ = [
    "COORDINATES",
    "Coordinate",
    "Modes",
    "SectionTerms",
    "coordinates",
    "state_terms",
    "wind_off",
]


class Coordinate(NamedTuple):
    """A degree of freedom of the section: its state, and the unit of its spring's output."""

    state: str
    unit: str


COORDINATES = {
    "heave": Coordinate("xi", "semichord"),
    "pitch": Coordinate("alpha", "rad"),
    "flap": Coordinate("beta", "rad"),
}
"""Coordinates in the order of the states."""


class SectionTerms(NamedTuple):
    """``A(U) = A0 + A1/U + A2/U^2``, ``B(U) = B2/U^2`` and ``C``."""

    A0: Real
    A1: Real
    A2: Real
    B2: Real
    C: Real


class Modes(NamedTuple):
    """Coupled modes of the section without air, nominal springs, undamped.

    ``frequencies`` (n,) over the uncoupled pitch frequency, ascending; ``shapes`` (n, n), a column
    a mode, of unit generalised mass; ``leads`` the coordinate that each mode belongs to.
    """

    frequencies: Real
    shapes: Real
    leads: tuple[str, ...]


def coordinates(section: TypicalSection) -> list[str]:
    """Names of the section's degrees of freedom, in the order of the states."""
    return [name for name in COORDINATES if name != "flap" or section.flap is not None]


def state_terms(
    section: TypicalSection, aerodynamics: Aerodynamics, springs: tuple[int, ...]
) -> SectionTerms:
    """First-order form with the springs of some coordinates, by number, outside of ``A``."""
    values = _parameters(section)
    lags = {}
    if isinstance(aerodynamics, Wagner):
        lags = {"a": np.array(aerodynamics.a), "b": np.array(aerodynamics.b)}
    module = _module(section, steady=not lags)
    terms = SectionTerms(*module.state_terms(**values, **lags, springs=springs))
    if section.damping == "coordinate":
        return terms
    rates = slice(len(coordinates(section)), 2 * len(coordinates(section)))
    A1 = np.zeros_like(terms.A1)
    A1[rates, rates] = -_call(module.mass_inverse, values) @ _modal_damping(section)
    return terms._replace(A1=A1)


def wind_off(section: TypicalSection) -> Modes:
    """Modes without air; each belongs to the coordinate of its largest share of kinetic energy.

    Where two modes claim one coordinate, the assignment is the one to one whose shares add up to
    most.
    """
    mass, springs = _structure(section)
    root = np.linalg.cholesky(mass)
    squares, vectors = np.linalg.eigh(np.linalg.solve(root, np.linalg.solve(root, springs).T))
    shapes = np.linalg.solve(root.T, vectors)
    energy = shapes * (mass @ shapes)  # rows coordinates, columns modes, each adding up to one
    modes = range(len(squares))
    best = max(permutations(modes), key=lambda rows: float(np.sum(energy[rows, modes])))
    return Modes(np.sqrt(squares), shapes, tuple(coordinates(section)[row] for row in best))


def _structure(section: TypicalSection) -> tuple[Real, Real]:
    """Mass and springs of the structure, rows in units of energy: both are symmetric."""
    module, values = _module(section, steady=False), _parameters(section)
    inertia = [1.0, section.r_alpha**2]
    if section.flap is not None:
        inertia.append(section.flap.r_beta**2)
    rows = np.array(inertia)[:, None]
    return rows * _call(module.structural_mass, values), rows * _call(module.spring_terms, values)


def _modal_damping(section: TypicalSection) -> Real:
    """C1 whose modes are the coupled ones without air, each with the ratio of its coordinate."""
    modes = wind_off(section)
    ratios = {"heave": section.zeta_xi, "pitch": section.zeta_alpha}
    if section.flap is not None:
        ratios["flap"] = section.flap.zeta_beta
    rates = 2 * modes.frequencies * np.array([ratios[name] for name in modes.leads])
    mass = _call(_module(section, steady=False).structural_mass, _parameters(section))
    return np.asarray(mass @ (modes.shapes * rates) @ np.linalg.inv(modes.shapes))


def _module(section: TypicalSection, steady: bool) -> ModuleType:
    if section.flap is None:
        return _quasi_steady if steady else _section
    return _flap_quasi_steady if steady else _flap


def _parameters(section: TypicalSection) -> dict[str, float]:
    """Parameters of the emitted functions."""
    names = ("mu", "a_h", "x_alpha", "r_alpha", "omega_bar", "zeta_alpha", "zeta_xi", "heave_mass")
    values: dict[str, float] = {name: getattr(section, name) for name in names}
    if section.flap is not None:
        flap = section.flap
        values |= {"c_h": flap.hinge, "omega_beta_bar": flap.omega_beta}
        values |= {name: getattr(flap, name) for name in ("x_beta", "r_beta", "zeta_beta")}
    return values


def _call(function: Callable[..., Real], values: dict[str, float]) -> Real:
    """An emitted function of the parameters that it takes."""
    taken: dict[str, Any] = {
        name: values[name] for name in inspect.signature(function).parameters if name in values
    }
    return function(**taken)
