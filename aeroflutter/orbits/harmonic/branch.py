"""Branches of cycles by harmonic balance, followed in speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from aeroflutter.analysis import analysis
from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.model.lure import AnyFamily, LureFamily, as_family, as_lure
from aeroflutter.orbits.continuation import ContinuationOptions, correct
from aeroflutter.orbits.describing import DescribingCurve, DescribingOptions, describing_curve
from aeroflutter.orbits.harmonic.assemble import assemble
from aeroflutter.orbits.harmonic.balance import AMPLITUDE, FREQUENCY, SPEED, Balance, Cycle
from aeroflutter.orbits.harmonic.channels import channels_of
from aeroflutter.orbits.harmonic.options import HarmonicOptions
from aeroflutter.orbits.harmonic.result import Bifurcation, HarmonicBranch
from aeroflutter.orbits.harmonic.stability import Stability
from aeroflutter.orbits.harmonic.swings import harmonic_swings
from aeroflutter.orbits.harmonic.walk import Curve, TooFewHarmonics, follow
from aeroflutter.orbits.spectrum import test_functions
from aeroflutter.springs import Spring, Springs, alone, each, simplify

__all__ = ["continue_branch", "harmonic_balance", "harmonic_families", "solve_cycle", "sinusoid"]

Real = NDArray[np.float64]

_FIRST = 7  # harmonics to begin with, where their number is automatic
_SMALL = 0.02  # distortion below which a describing function is a good start
_NOTHING = 1e-9  # distortion of a motion on one straight piece, which may touch its end
_SCALE_SPEED = 0.3
_STRIDE = 0.2
_LOCATED = 1e-8  # ln amplitude: the multipliers are not known any better
_WALKED = 1e-7  # size of the last Newton update on a walk; its error is about the square


@analysis()
def harmonic_balance(
    family: AnyFamily, spring: Springs, options: HarmonicOptions | None = None
) -> HarmonicBranch:
    """The family of cycles that the describing function meets at the lowest speed.

    Parameters
    ----------
    family : Family or LureFamily
    spring : Spring, or a sequence of them
        Any law; degenerate ones are simplified first. Of several springs one an output.
    options : HarmonicOptions, optional

    Raises
    ------
    ConvergenceError
        If the describing function has no cycle to start from, or the start does not converge.

    Examples
    --------
    >>> from aeroflutter import Hysteresis, SectionFamily, TypicalSection
    >>> branch = harmonic_balance(SectionFamily(TypicalSection(omega_bar=0.8)),
    ...                           Hysteresis(1.0, 0.2))
    >>> round(branch.onset.speed_ratio, 5)
    0.92151
    """
    branches = harmonic_families(family, spring, options, most=1)
    return branches[0]


@analysis()
def harmonic_families(
    family: AnyFamily,
    spring: Springs,
    options: HarmonicOptions | None = None,
    *,
    most: int | None = None,
) -> tuple[HarmonicBranch, ...]:
    """Every family of cycles that starts from a family of the describing function.

    Parameters
    ----------
    family, spring, options
        As for :func:`harmonic_balance`.
    most
        Families after which to stop.

    Returns
    -------
    tuple of HarmonicBranch
        In the order of the describing function's families; two of them that turn out to be one
        branch are returned once.

    Raises
    ------
    ConvergenceError
        If there is no cycle to start from, or no start converges.
    """
    options, spring = options or HarmonicOptions(), simple(spring)
    found: list[HarmonicBranch] = []
    starts, failures = _all_starts(family, spring, options)
    for number, symmetric, start in starts:
        try:
            if any(_contains(family, spring, branch, start, symmetric) for branch in found):
                continue
            with np.errstate(over="ignore", invalid="ignore"):  # a step too far is an error below
                branch = continue_branch(
                    family, spring, start, options, symmetric=symmetric, number=number
                )
        except ConvergenceError as error:
            failures.append(f"family {number}: {error.reason}")
            continue
        found.append(branch)
        if len(found) == most:
            break
    if not found:
        raise ConvergenceError("; ".join(failures) or "the describing function has no cycles")
    return tuple(found)


def _all_starts(
    family: AnyFamily, spring: Springs, options: HarmonicOptions
) -> tuple[list[tuple[int, bool, Cycle]], list[str]]:
    """Number, symmetry and start of every family that is known by sinusoids; what they note."""
    if isinstance(spring, Sequence):
        from aeroflutter.orbits.describing.several import joint_starts

        return joint_starts(family, spring, options)
    family = as_lure(family)
    curve = describing_curve(
        family,
        spring,
        DescribingOptions(points=24, speed_ratio_range=options.speed_ratio_range),
    )
    return _starts(family, spring, curve, options), list(curve.notes)


def continue_branch(
    family: AnyFamily,
    spring: Springs,
    start: Cycle,
    options: HarmonicOptions | None = None,
    *,
    symmetric: bool | None = None,
    number: int = 0,
    flutter: float | None = None,
) -> HarmonicBranch:
    """The family of cycles through the one to which `start` converges.

    Parameters
    ----------
    start : Cycle
        A guess; a sinusoid (:func:`sinusoid`) will often do.
    symmetric : bool, optional
        Whether only odd harmonics take part; by default where the spring is odd.

    Raises
    ------
    ConvergenceError
        If the start does not converge.
    """
    options, spring = options or HarmonicOptions(), simple(spring)
    if symmetric is None:
        symmetric = is_odd(spring) if options.symmetric is None else options.symmetric
    flutter = flutter_speed(family) if flutter is None else flutter
    count = options.harmonics or _enough(family, spring, start, options, symmetric, flutter)
    while True:
        last = options.harmonics is not None or count >= options.max_harmonics
        balance = Balance(family, spring, count, symmetric, leading(family, spring, start))
        stability = Stability(balance) if options.stability else None
        try:
            curve = _follow(balance, start, options, stability, flutter, endless=last)
        except TooFewHarmonics as too_few:
            count = min(options.max_harmonics, _more(count, too_few.truncation, options))
            continue
        if not curve.states:
            raise ConvergenceError("the spring is linear along the whole branch")
        return assemble(balance, curve, stability, flutter, options.tolerance, number)


def _enough(
    family: AnyFamily,
    spring: Springs,
    start: Cycle,
    options: HarmonicOptions,
    symmetric: bool,
    flutter: float | None,
) -> int:
    """Harmonics that should do, from a quick walk with few, corrected with more."""
    strides = replace(options, max_step=max(_STRIDE, options.max_step))
    count = min(_FIRST, options.max_harmonics)
    lead = leading(family, spring, start)
    balance = Balance(family, spring, count, symmetric, lead)
    curve = _follow(balance, start, strides, None, flutter, endless=True)
    points = [state.x for state in curve.states]
    steep = [abs(s.tangent[SPEED]) > abs(s.tangent[AMPLITUDE]) for s in curve.states]
    held = [SPEED if so else AMPLITUDE for so in steep]
    while True:
        needed = [
            balance.sufficient(x, 0.8 * options.tolerance, options.max_harmonics) for x in points
        ]
        if max(needed, default=0) <= count:
            return count
        count = max(needed)
        cycles = [balance.unpack(x) for x in points]
        balance = Balance(family, spring, count, symmetric, lead)
        points = [_held(balance, *pair) for pair in zip(cycles, held, strict=True)]


def _held(balance: Balance, cycle: Cycle, index: int) -> Real:
    """A cycle corrected with one unknown held, or as it is where that fails."""
    x = balance.pack(cycle)
    try:
        return correct(balance, x, np.eye(x.size)[index], _NEWTON)[0]
    except ConvergenceError:
        return x


def solve_cycle(
    family: AnyFamily,
    spring: Springs,
    guess: Cycle,
    *,
    hold: str = "speed",
    options: HarmonicOptions | None = None,
    symmetric: bool | None = None,
) -> Cycle:
    """A single cycle at the speed, or with the first harmonic, of a guess.

    Parameters
    ----------
    hold : "speed" or "amplitude"
        What the guess's value is kept of.

    Raises
    ------
    ConvergenceError
        If Newton's method does not converge, or `max_harmonics` do not suffice.
    """
    options, spring = options or HarmonicOptions(), simple(spring)
    if hold not in ("speed", "amplitude"):
        raise InputError(f'hold: must be "speed" or "amplitude", not {hold!r}')
    if symmetric is None:
        symmetric = is_odd(spring) if options.symmetric is None else options.symmetric
    count = options.harmonics or min(_FIRST, options.max_harmonics)
    while True:
        balance = Balance(family, spring, count, symmetric, leading(family, spring, guess))
        fixed = np.eye(balance.unknowns)[SPEED if hold == "speed" else AMPLITUDE]
        x, _ = correct(balance, balance.pack(guess), fixed, _NEWTON)
        guess = balance.unpack(x)
        truncation = balance.truncation(x)
        if options.harmonics is not None or truncation <= options.tolerance:
            return replace(guess, swings=partial(harmonic_swings, balance.family, guess))
        if count >= options.max_harmonics:
            raise ConvergenceError(
                f"max_harmonics: {count} harmonics leave out {truncation:.1e} of the amplitude, "
                f"tolerance {options.tolerance:.1e}",
                guess,
            )
        count = min(options.max_harmonics, _more(count, truncation, options))


def simple(spring: Springs) -> Spring | tuple[Spring, ...]:
    """The springs with degenerate laws simplified; one alone is no sequence."""
    return alone([simplify(one) for one in each(spring)])


def is_odd(spring: Springs) -> bool:
    """Whether all springs are odd, so that the mirror image of a cycle is one, too."""
    return all(one.odd for one in each(spring))


def leading(family: AnyFamily, spring: Springs, cycle: Cycle) -> int:
    """The channel whose first harmonic is the largest, in units of its own size."""
    springs = each(spring)
    if len(springs) == 1:
        return 0
    firsts = [channel.springs[0] for channel in channels_of(as_family(family), springs)]
    return int(np.argmax([abs(cycle.motions[i, 1]) / springs[i].scale for i in firsts]))


def sinusoid(amplitude: float, bias: float, omega: float, speed: float) -> Cycle:
    """The sinusoid of a describing function as a guess."""
    return Cycle(np.array([bias, -1j * amplitude]), omega, speed)


_NEWTON = ContinuationOptions(tolerance=1e-11, max_newton=25)


def _follow(
    balance: Balance,
    start: Cycle,
    options: HarmonicOptions,
    stability: Stability | None,
    flutter: float | None,
    *,
    endless: bool,
) -> Curve:
    """The curve through a start."""
    unit = flutter or balance.family.search_range[1]
    low, high = (value / unit for value in balance.family.search_range)
    low, high = max(low, options.speed_ratio_range[0]), min(high, options.speed_ratio_range[1])
    x = _started(balance, start)
    n = balance.unknowns
    lowest, highest, scale = np.full(n, -np.inf), np.full(n, np.inf), np.ones(n)
    size, first = balance.spring.scale, float(np.exp(x[AMPLITUDE]))
    lowest[AMPLITUDE] = np.log(min(0.01 * size, 0.9 * first))
    highest[AMPLITUDE] = np.log(max(options.largest * size, 1.1 * first))
    lowest[SPEED], highest[SPEED] = np.log(unit * max(low, 1e-6)), np.log(unit * high)
    scale[SPEED], scale[FREQUENCY] = _SCALE_SPEED, _SCALE_SPEED
    walking = ContinuationOptions(
        step=min(options.step, options.max_step),
        tolerance=_WALKED,
        max_step=options.max_step,
        max_states=options.max_states,
        low=lowest,
        high=highest,
        scale=scale,
        folds={"fold": SPEED % n},
        locate=_LOCATED,
    )
    tests = test_functions(stability.spectrum) if stability else {}
    return follow(balance, x, walking, tests, np.inf if endless else options.tolerance)


def _started(balance: Balance, start: Cycle) -> Real:
    """A start corrected at its own amplitude; at its speed where the curve turns in that."""
    x, unit = balance.pack(start), np.eye(balance.unknowns)
    try:
        return correct(balance, x, unit[AMPLITUDE], _NEWTON)[0]
    except ConvergenceError:
        return correct(balance, x, unit[SPEED], _NEWTON)[0]


def _more(count: int, truncation: float, options: HarmonicOptions) -> int:
    """Harmonics that should suffice, if what is left out falls with their third power."""
    factor = (1.2 * truncation / options.tolerance) ** (1 / 3)
    return int(np.ceil(count * min(2.0, max(1.2, factor)))) | 1


def _starts(
    family: LureFamily, spring: Spring, curve: DescribingCurve, options: HarmonicOptions
) -> list[tuple[int, bool, Cycle]]:
    """Of each of the describing function's families the cycle that it should know best."""
    found = []
    largest = options.largest * spring.scale
    for one in curve.families:
        if one.mirror_of is not None:
            continue
        symmetric = spring.odd and not one.biased
        if options.symmetric is not None:
            symmetric = options.symmetric
        own = (curve.family == one.number) & (curve.amplitude <= largest)
        rows = np.flatnonzero(own & (curve.distortion > _NOTHING))  # else it hardly switches
        good = rows[curve.distortion[rows] < _SMALL]
        largest_first = good[np.argsort(-curve.amplitude[good])]
        straightest_first = rows[np.argsort(curve.distortion[rows])]
        for i in (*largest_first, *straightest_first):
            cycle = sinusoid(curve.amplitude[i], curve.bias[i], curve.k[i], curve.speed[i])
            balance = Balance(family, spring, 1, symmetric)
            if not balance.answer(balance.pack(cycle)).straight:
                found.append((one.number, symmetric, cycle))
                break
    return found


def _contains(
    family: AnyFamily, spring: Springs, branch: HarmonicBranch, start: Cycle, symmetric: bool
) -> bool:
    """Whether the cycle that a start leads to is already on a branch."""
    if branch.symmetric != symmetric:
        return False
    lead = leading(family, spring, branch.cycles[0])
    balance = Balance(family, spring, branch.harmonics, symmetric, lead)
    fixed = np.eye(balance.unknowns)[AMPLITUDE]
    x, _ = correct(balance, balance.pack(start), fixed, _NEWTON)
    points = np.array([balance.pack(cycle) for cycle in branch.cycles])
    away = np.linalg.norm(points - x, axis=1)
    i = int(np.argmin(away))
    step = np.linalg.norm(np.diff(points, axis=0), axis=1).max(initial=0.0)
    if away[i] > 2.0 * step:  # Newton's method may come from afar to another branch
        return False
    near, _ = correct(balance, _at_amplitude(points, i, x[AMPLITUDE]), fixed, _NEWTON)
    return bool(np.max(np.abs(near - x)) < 1e-6)


def _at_amplitude(points: Real, i: int, wanted: float) -> Real:
    guess = points[i].copy()
    guess[AMPLITUDE] = wanted
    return guess


def asymmetric_branch(
    family: AnyFamily,
    spring: Springs,
    branch: HarmonicBranch,
    bifurcation: Bifurcation,
    options: HarmonicOptions | None = None,
) -> HarmonicBranch:
    """One of the two mirror branches that leave a symmetric one where it loses its symmetry.

    Raises
    ------
    InputError
        If the bifurcation does not break a symmetry.
    ConvergenceError
        If no asymmetric cycle is found beside it.
    """
    if bifurcation.kind != "symmetry-breaking" or not branch.symmetric:
        raise InputError("bifurcation: needs a symmetry-breaking of a symmetric branch")
    options, spring = options or HarmonicOptions(), simple(spring)
    count = options.harmonics or branch.harmonics
    lead = leading(family, spring, bifurcation.cycle)
    balance = Balance(family, spring, count, symmetric=False, lead=lead)
    x = balance.pack(bifurcation.cycle)
    orders = np.concatenate((balance.orders[balance.rest], balance.orders[balance.oscillating]))
    even = orders % 2 == 0
    J = balance.jacobian(x)[:, 1:-2][:, even]
    direction = np.zeros(x.size)
    direction[1:-2][even] = np.linalg.svd(J)[2][-1]
    for size in (0.02, 0.05, 0.1):
        try:
            start, _ = correct(balance, x + size * direction, direction, _NEWTON)
        except ConvergenceError:
            continue
        return continue_branch(
            family,
            spring,
            balance.unpack(start),
            replace(options, harmonics=count),
            symmetric=False,
            flutter=branch.flutter_speed,
        )
    raise ConvergenceError("no asymmetric cycle was found beside the symmetry-breaking")
