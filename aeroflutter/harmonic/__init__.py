"""Multi-harmonic balance: cycles of any spring, followed in speed, with their stability."""

from aeroflutter.harmonic.balance import Balance, Cycle
from aeroflutter.harmonic.branch import (
    asymmetric_branch,
    continue_branch,
    harmonic_balance,
    harmonic_families,
    sinusoid,
    solve_cycle,
)
from aeroflutter.harmonic.hill import Multipliers, multipliers
from aeroflutter.harmonic.options import HarmonicOptions
from aeroflutter.harmonic.result import Bifurcation, HarmonicBranch, HarmonicOnset

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
