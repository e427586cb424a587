"""Pseudo-arclength continuation of the curve residual(x) = 0 of n-1 equations in n unknowns.

The predictor is the tangent, the corrector Newton's method on the hyperplane through the
prediction (Keller 1977). The step follows the number of Newton iterations and the angle by
which the curve turns. Folds and zeros of test functions are bracketed by consecutive states and
then located *on the curve*, by Brent's method along the chord with every trial point corrected.
A curve that turns sharply (by less than a right angle) has a corner there and is followed
around it; where the places of corners are known as zeros of `kinks`, it is led through them, by
any angle, with a tangent from either side. Nothing here knows what the unknowns mean.
"""

from aeroflutter.orbits.continuation.newton import (
    branch_direction,
    branch_test,
    correct,
    tangent_at,
)
from aeroflutter.orbits.continuation.problem import (
    Branch,
    ContinuationOptions,
    Event,
    Problem,
    State,
    Test,
)
from aeroflutter.orbits.continuation.walk import Walk, trace

__all__ = [
    "Branch",
    "ContinuationOptions",
    "Event",
    "Problem",
    "State",
    "Test",
    "Walk",
    "branch_direction",
    "branch_test",
    "correct",
    "tangent_at",
    "trace",
]
