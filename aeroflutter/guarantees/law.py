"""What the bounds need to know of a spring: its odd law about a centre, split as F = s y - u(y).

Outside its nonlinear range an odd piecewise-linear spring has one slope s, and u = s y - F is
bounded there. The memory of the hysteresis loop is such a u with s = 1. In both cases u is
Lipschitz in the supremum norm, and two motions near a sin θ have the same u except on the part
of the cycle where the motion is in, or within reach of, the nonlinear range.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aeroflutter.guarantees import _kernel_first as kernel
from aeroflutter.model.lure import LureFamily, integrates
from aeroflutter.orbits.harmonic.moment import answer
from aeroflutter.springs import Cubic, Hysteresis, Pieces, PiecewiseLinear, Spring, Table, simplify

__all__ = ["Law", "Unfit", "law_of"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_ROUND_OFF = 1e-12


class Unfit(Exception):
    """The hypotheses of the bounds do not hold; the message says which."""


@dataclass(frozen=True, eq=False)
class Law:
    """An odd law about a centre.

    Attributes
    ----------
    spring
        The odd spring.
    centre
        Pitch of its centre, which is the bias of the cycles in question, radians.
    stiffness
        s: slope outside the nonlinear range.
    lipschitz
        Lipschitz constant of u in the supremum norm; infinite where there is none.
    bound
        Largest |u|; infinite where there is none.
    edge
        Pitch at which the nonlinear range ends (D + δ for a loop).
    start
        Pitch at which a motion coming from outside enters it (D - δ for a loop, -edge for a
        static spring).
    """

    spring: Spring
    centre: float
    stiffness: float
    lipschitz: float
    bound: float
    edge: float
    start: float

    @property
    def memory(self) -> bool:
        """Whether the spring has memory."""
        return isinstance(self.spring, Hysteresis)

    def slopes(self, reach: Real) -> tuple[Real, Real]:
        """Smallest and largest incremental slope for pitches up to `reach`, same shape."""
        if isinstance(self.spring, Cubic):
            ends = self.spring.beta1 + 3 * self.spring.beta3 * reach**2
            return np.minimum(ends, self.spring.beta1), np.maximum(ends, self.spring.beta1)
        p, q = self.spring.slope_range()
        return np.full(reach.shape, p), np.full(reach.shape, q)

    def harmonics(self, amplitude: Real, highest: int) -> Complex:
        """Harmonics F_k of the answer to a sin θ for k = 1, 3, … `highest`, shape (m, n)."""
        rows = [
            answer(self.spring, np.array([0.0, -1j * a])).moment(highest + 1)[1::2]
            for a in amplitude
        ]
        return np.array(rows)

    def first_harmonic(self, Y: Complex) -> Complex:
        """First harmonic (m,) of the answer to motions with harmonics Y (m, H+1)."""
        samples = 1 << int(np.ceil(np.log2(4 * Y.shape[1])))
        if isinstance(self.spring, Hysteresis):
            return np.asarray(
                kernel.of_loop(Y, samples, self.spring.delta_v / 2, self.spring.delta_h / 2)
            )
        if isinstance(self.spring, Cubic):  # y³ does not alias onto the first harmonic
            y = np.fft.irfft(0.5 * samples * Y, samples, axis=1)
            return np.asarray(np.fft.rfft(self.spring.moment(y), axis=1)[:, 1] * 2 / samples)
        p = _pieces(self.spring)
        return np.asarray(kernel.of_static(Y, samples, p.breaks, p.slopes, p.offsets))

    def variation(self, amplitude: Real) -> Real:
        """Bound on the total variation of dF/dθ over the period under a sin θ.

        |F_k| is at most this over π k².
        """
        if isinstance(self.spring, Cubic):
            return np.zeros_like(amplitude)  # there is nothing above the third harmonic
        if self.memory:
            return 8.0 * amplitude
        slopes = _pieces(self.spring).slopes
        jumps = np.abs(np.diff(slopes)).sum()
        return 4.0 * amplitude * (np.abs(slopes).max() + jumps)

    def active(self, amplitude: Real, reach: Real) -> Real:
        """Width of the stretch of each half period on which u may differ between two motions.

        The motions are a sin θ give or take `reach`. π, the whole half period, where such a
        motion may turn back inside the range.
        """
        enter = (self.start - reach) / amplitude
        leave = (self.edge + reach) / amplitude
        width = np.arcsin(np.clip(leave, -1, 1)) - np.arcsin(np.clip(enter, -1, 1))
        return np.where(leave < 1, width, np.pi)


def law_of(family: LureFamily, spring: Spring) -> Law:
    """The odd law whose half-wave symmetric cycles can be bounded.

    Raises
    ------
    Unfit
        Where the law has no centre of symmetry, or the loop does not balance there.
    """
    odd, centre, load = _centred(simplify(spring))
    if abs(load) > _ROUND_OFF * odd.scale or (centre != 0.0 and not integrates(family)):
        raise Unfit("the offset makes the cycle asymmetric: it is not half-wave symmetric")
    if isinstance(odd, Hysteresis):
        D, delta = odd.delta_v / 2, odd.delta_h / 2
        return Law(odd, centre, 1.0, 1.0, delta, D + delta, D - delta)
    if isinstance(odd, Cubic):
        return Law(odd, centre, odd.beta1, np.inf, np.inf, np.inf, -np.inf)
    if not isinstance(odd, PiecewiseLinear):
        raise Unfit("no bound is known for this kind of spring")
    p = odd.pieces()
    if p.breaks.size == 0:
        raise Unfit("the spring is linear: it has no isolated cycles")
    s, edge = float(p.slopes[-1]), float(p.breaks[-1])
    bound = float(np.max(np.abs(s * p.breaks - odd.moment(p.breaks))))
    return Law(odd, centre, s, float(np.max(np.abs(s - p.slopes))), bound, edge, -edge)


def _centred(spring: Spring) -> tuple[Spring, float, float]:
    """An odd spring, its centre, and the moment there."""
    if spring.odd:
        return spring, 0.0, 0.0
    if isinstance(spring, Hysteresis):
        return Hysteresis(spring.delta_v, spring.delta_h), spring.centre, spring.v_off
    if isinstance(spring, PiecewiseLinear) and spring.pieces().breaks.size:
        breaks = spring.pieces().breaks
        centre = float(breaks[0] + breaks[-1]) / 2
        load = float(spring.moment(centre))
        odd = _about(spring, centre, load)
        if odd is not None:
            return odd, centre, load
    raise Unfit("the law has no centre of symmetry: the cycle is not half-wave symmetric")


def _about(spring: PiecewiseLinear, centre: float, load: float) -> Spring | None:
    """The law about a point as an odd table, or None where it is not odd there."""
    breaks = spring.pieces().breaks - centre
    room = float(breaks[-1] - breaks[0]) or 1.0
    pitch = np.concatenate(([breaks[0] - room], breaks, [breaks[-1] + room]))
    moments = spring.moment(centre + pitch) - load
    size = np.max(np.abs(np.concatenate((pitch, moments)))) + abs(centre)
    mirrored = np.max(np.abs(pitch + pitch[::-1])), np.max(np.abs(moments + moments[::-1]))
    if max(mirrored) > _ROUND_OFF * size:
        return None
    pitch, moments = 0.5 * (pitch - pitch[::-1]), 0.5 * (moments - moments[::-1])
    return Table(tuple(pitch), tuple(moments))


def _pieces(spring: Spring) -> Pieces:
    if not isinstance(spring, PiecewiseLinear):
        raise Unfit("no bound is known for this kind of spring")
    return spring.pieces()
