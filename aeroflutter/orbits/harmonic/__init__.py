"""Multi-harmonic balance: cycles of any spring, followed in speed, with their stability."""

from aeroflutter.orbits.harmonic.balance import Balance, Cycle
from aeroflutter.orbits.harmonic.branch import (
    asymmetric_branch,
    continue_branch,
    harmonic_balance,
    harmonic_families,
    sinusoid,
    solve_cycle,
)
from aeroflutter.orbits.harmonic.monodromy import Multipliers, multipliers
from aeroflutter.orbits.harmonic.options import HarmonicOptions
from aeroflutter.orbits.harmonic.result import Bifurcation, HarmonicBranch, HarmonicOnset

__all__ = [
    "Balance",
    "Bifurcation",
    "Cycle",
    "HarmonicBranch",
    "HarmonicOnset",
    "HarmonicOptions",
    "Multipliers",
    "asymmetric_branch",
    "continue_branch",
    "harmonic_balance",
    "harmonic_families",
    "multipliers",
    "sinusoid",
    "solve_cycle",
]
