"""Long motions by Dormand and Prince's method of order 8, compiled: an oracle for end states.

It shares nothing with the package but the matrices of a system and the parameters of a spring. Laws
are written anew from their definitions, the tableau is SciPy's (`dop853_coefficients`), and steps
are chosen as Hairer, Norsett and Wanner do. A leg ends where y leaves the piece of a static law, or
where the slider of a hinge begins or ceases to move: found by bisection on steps of the method
itself, of other lengths, not on an interpolant.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.integrate._ivp import dop853_coefficients as tableau

from aeroflutter import Bilinear, Cubic, Freeplay, Hysteresis, Spring, Table

__all__ = ["Law", "law_of", "march"]

Array = NDArray[np.float64]

STAGES = tableau.N_STAGES
A, B, C = (np.ascontiguousarray(t) for t in (tableau.A[:STAGES, :STAGES], tableau.B, tableau.C))
E3, E5 = tableau.E3[:STAGES].copy(), tableau.E5[:STAGES].copy()
STATIC, LOOP, CUBIC = 0, 1, 2
STICK, UP, DOWN = 0, 1, 2
INSIDE = 8  # places within a step at which an edge is looked for
DOUBT = 0.02  # of its rise: how far a cubic may be off before they are
EDGE = 1e-12  # of the scale: what is beyond an edge
HALVINGS = 60


class Law(NamedTuple):
    """A spring: its kind and numbers.

    Attributes
    ----------
    breaks, slopes, offsets
        Of a static law; β₁ and β₃ of a cubic are its slopes.
    loop
        v1, v2, lowest and highest h of a hinge.
    scale
        Size.
    """

    kind: int
    breaks: Array
    slopes: Array
    offsets: Array
    loop: Array
    scale: float


def law_of(spring: Spring) -> Law:
    """A spring from its definition."""
    none = np.zeros(0)
    if isinstance(spring, Cubic):
        return Law(CUBIC, none, np.array([spring.beta1, spring.beta3]), none, none, spring.scale)
    if isinstance(spring, Hysteresis):
        up, down = (spring.v_off + side * spring.delta_v / 2 for side in (1, -1))
        low, high = (spring.h_off + side * spring.delta_h / 2 for side in (-1, 1))
        return Law(LOOP, none, none, none, np.array([up, down, low, high]), spring.scale)
    if isinstance(spring, Freeplay):
        left, right = (spring.centre + side * spring.gap / 2 for side in (-1, 1))
        points, moments, outer = [left, right], [0.0, 0.0], (1.0, 1.0)
    elif isinstance(spring, Bilinear):
        points = [spring.alpha_f, spring.alpha_f + spring.delta]
        moments, outer = [spring.m0, spring.m0 + spring.m_f * spring.delta], (1.0, 1.0)
    elif isinstance(spring, Table):
        points, moments = list(spring.pitch), list(spring.moments)
        rises = np.diff(moments) / np.diff(points)
        outer = (float(rises[0]), float(rises[-1]))
    else:
        raise TypeError(spring.kind)
    slopes = np.array([outer[0], *(np.diff(moments) / np.diff(points)), outer[1]])
    near = np.array([0, *range(len(points))])
    offsets = np.array(moments)[near] - slopes * np.array(points)[near]
    return Law(STATIC, np.array(points), slopes, offsets, none, spring.scale)


@numba.njit(cache=True)
def output(c, x):
    """c x."""
    total = 0.0
    for j in range(x.size):
        total += c[j] * x[j]
    return total


@numba.njit(cache=True)
def rate(system, input_, c, law, x, k, u, out):
    """x' with the law k y - u, or that of a cubic."""
    y = output(c, x)
    force = k * y - u
    if law.kind == CUBIC:
        force = law.slopes[0] * y + law.slopes[1] * y * y * y
    for i in range(x.size):
        total = -input_[i] * force
        for j in range(x.size):
            total += system[i, j] * x[j]
        out[i] = total


@numba.njit(cache=True)
def stages(system, input_, c, law, x, k, u, h, K, new):
    """One step: the stages, and the state after it; K[0] is known."""
    n = x.size
    z = np.empty(n)
    for s in range(1, STAGES):
        for i in range(n):
            total = 0.0
            for r in range(s):
                total += A[s, r] * K[r, i]
            z[i] = x[i] + h * total
        rate(system, input_, c, law, z, k, u, K[s])
    for i in range(n):
        total = 0.0
        for s in range(STAGES):
            total += B[s] * K[s, i]
        new[i] = x[i] + h * total


@numba.njit(cache=True)
def error_of(K, h, x, new, rtol, atol):
    """The error of a step in tolerances."""
    fifth, third = 0.0, 0.0
    for i in range(x.size):
        e5, e3 = 0.0, 0.0
        for s in range(STAGES):
            e5 += E5[s] * K[s, i]
            e3 += E3[s] * K[s, i]
        size = atol + rtol * max(abs(x[i]), abs(new[i]))
        fifth += (e5 / size) ** 2
        third += (e3 / size) ** 2
    if fifth == 0.0 and third == 0.0:
        return 0.0
    return abs(h) * fifth / np.sqrt((fifth + 0.01 * third) * x.size)


@numba.njit(cache=True)
def edges(law, mode, memory):
    """Slope and load of the present piece, and the y between which it holds."""
    if law.kind == STATIC:
        low = law.breaks[mode - 1] if mode > 0 else -np.inf
        high = law.breaks[mode] if mode < law.breaks.size else np.inf
        return law.slopes[mode], -law.offsets[mode], low, high
    if law.kind == CUBIC:
        return 0.0, 0.0, -np.inf, np.inf
    up, down, least, most = law.loop
    if mode == UP:
        return 0.0, -up, -np.inf, most + up
    if mode == DOWN:
        return 0.0, -down, least + down, np.inf
    high = memory + up if memory < most else np.inf
    low = memory + down if memory > least else -np.inf
    return 1.0, memory, low, high


@numba.njit(cache=True)
def side(law, mode, c, swing, x, low, high):
    """-1 or 1 where a state is beyond the lower or upper edge, 2 where a slider turns, else 0."""
    y, beyond = output(c, x), EDGE * law.scale
    if y > high + beyond:
        return 1
    if y < low - beyond:
        return -1
    if law.kind == LOOP and mode != STICK:
        v = output(swing, x)
        if (mode == UP and v < 0.0) or (mode == DOWN and v > 0.0):
            return 2
    return 0


@numba.njit(cache=True)
def after(law, mode, memory, where, y):
    """Mode and memory after an edge."""
    if law.kind == STATIC:
        return mode + where, memory
    up, down, least, most = law.loop
    if mode == STICK:
        return (UP if where == 1 else DOWN), memory
    if where == 2:
        return STICK, min(max(y - (up if mode == UP else down), least), most)
    return STICK, (most if mode == UP else least)


@numba.njit(cache=True)
def march(  # noqa: C901
    system, input_, c, law, x, memory, time, parts, rtol, step, still, far
):
    """Extremes of y over equal parts of a motion.

    Parameters
    ----------
    system, input_, c, law
        x' = A x - b F(c x), and F.
    x, memory
        The start; x is left as the end.
    time, parts
        Length, and into how many parts it is divided.
    rtol, step
        Tolerance, and the longest step.
    still, far
        Largest |x'| of a motion at rest, and |y| beyond which it has left.

    Returns
    -------
    array (parts, 2)
        Zeros from where it rests on, infinities from where it has left.
    """
    n = x.size
    K, new, probe, trial = np.empty((STAGES, n)), np.empty(n), np.empty(n), np.empty((STAGES, n))
    swing, slope = np.zeros(n), np.empty(n)
    for j in range(n):
        for i in range(n):
            swing[j] += c[i] * system[i, j]
    found = np.zeros((parts, 2))
    mode, y = 0, output(c, x)
    if law.kind == STATIC:
        while mode < law.breaks.size and y >= law.breaks[mode]:
            mode += 1
    elif law.kind == LOOP:
        memory = min(max(memory, y - law.loop[0]), y - law.loop[1])
        memory = min(max(memory, law.loop[2]), law.loop[3])
    atol = 0.0
    for j in range(n):
        atol = max(atol, 1e-3 * rtol * abs(x[j]))
    t, h, stuck = 0.0, 0.01 * step, 0
    for part in range(parts):
        end, lowest, highest = time * (part + 1) / parts, np.inf, -np.inf
        while t < end:
            k, u, low, high = edges(law, mode, memory)
            now = side(law, mode, c, swing, x, low, high)
            if now != 0:
                mode, memory = after(law, mode, memory, now, output(c, x))
                stuck += 1
                if stuck > 100:
                    found[part:] = np.nan
                    return found
                continue
            rate(system, input_, c, law, x, k, u, K[0])
            fastest = 0.0
            for j in range(n):
                fastest = max(fastest, abs(K[0, j]))
            if fastest < still:
                return found
            h = min(h, step)
            cut = min(h, end - t)
            stages(system, input_, c, law, x, k, u, cut, K, new)
            error = error_of(K, cut, x, new, rtol, atol)
            if error > 1.0:
                h = cut * max(0.2, 0.9 * error ** (-0.125))
                continue
            trial[0] = K[0]
            rate(system, input_, c, law, new, k, u, slope)
            y, v, y_end, v_end = output(c, x), output(c, K[0]), output(c, new), output(c, slope)
            least, most, rise = min(y, y_end), max(y, y_end), y_end - y
            for j in range(1, INSIDE):  # a cubic through both ends
                s = j / INSIDE
                bend = s * (1.0 - s) * ((1.0 - s) * (cut * v - rise) - s * (cut * v_end - rise))
                least, most = min(least, y + s * rise + bend), max(most, y + s * rise + bend)
            lowest, highest = min(lowest, least), max(highest, most)
            room = DOUBT * (abs(rise) + cut * (abs(v) + abs(v_end)))
            begin, leaves = 0.0, 0.0
            if (
                least - room < low
                or most + room > high
                or (mode != STICK and law.kind == LOOP and (v * v_end <= 0.0))
            ):
                for j in range(1, INSIDE + 1):
                    place = cut * j / INSIDE
                    if j < INSIDE:
                        stages(system, input_, c, law, x, k, u, place, trial, probe)
                    else:
                        probe[:] = new
                    if side(law, mode, c, swing, probe, low, high) != 0:
                        leaves = place
                        break
                    begin = place
            if leaves > 0.0:
                for _ in range(HALVINGS):
                    middle = 0.5 * (begin + leaves)
                    if middle <= begin or middle >= leaves:
                        break
                    stages(system, input_, c, law, x, k, u, middle, trial, probe)
                    if side(law, mode, c, swing, probe, low, high) != 0:
                        leaves = middle
                    else:
                        begin = middle
                stages(system, input_, c, law, x, k, u, leaves, trial, probe)
                where = side(law, mode, c, swing, probe, low, high)
                x[:] = probe
                t += leaves
                if where != 0:
                    mode, memory = after(law, mode, memory, where, output(c, x))
                continue
            x[:] = new
            t = end if cut == end - t else t + cut
            stuck = 0
            if cut == h:
                h *= min(5.0, 0.9 * max(error, 1e-8) ** (-0.125))
            if not abs(output(c, x)) < far:
                found[part:, 0], found[part:, 1] = -np.inf, np.inf
                return found
        found[part, 0], found[part, 1] = lowest, highest
    return found
