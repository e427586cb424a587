"""Linear flutter by root locus: roots of ``det(pI - A(U) + N B C)`` followed over speed.

Modes are followed by their eigenvectors (`linear.modes`). Crossings of the imaginary axis are
found on each mode, touching ones included, and bracketed to round-off on the eigenvalue. Systems
without damping (quasi-steady aerodynamics) lose stability where two frequencies coalesce; there
the discriminant of the polynomial in ``p^2`` is solved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from aeroflutter.analysis import Result, analysis
from aeroflutter.bracket import bracketed_root
from aeroflutter.errors import InputError
from aeroflutter.linear.modes import Track, closed_matrices, follow, solve_modes
from aeroflutter.model.lure import AnyFamily, Complex, Real, as_family
from aeroflutter.model.system import inverse_transfer

_NEUTRAL = 1e-9  # |Re p| below this fraction of max |p| is round-off, not damping


@dataclass(frozen=True, kw_only=True)
class RootLocusOptions:
    """Options of :func:`root_locus`.

    Parameters
    ----------
    stiffness : float
        Stiffness N that stands for the spring.
    low, high : float, optional
        Range of speeds searched; the family's own ``search_range`` where absent.
    grid : int
        Speeds of the first search, before refinement.

    Raises
    ------
    InputError
        Names the option that is out of range.
    """

    stiffness: float = 1.0
    low: float | None = None
    high: float | None = None
    grid: int = 400

    def __post_init__(self) -> None:
        problems = []
        if not np.isfinite(self.stiffness):
            problems.append(f"stiffness: must be finite, got {self.stiffness!r}")
        if self.grid < 2:
            problems.append(f"grid: needs at least 2 speeds, got {self.grid!r}")
        if self.low is not None and not (np.isfinite(self.low) and self.low > 0):
            problems.append(f"low: must be a positive finite speed, got {self.low!r}")
        if self.high is not None and not np.isfinite(self.high):
            problems.append(f"high: must be a finite speed, got {self.high!r}")
        if problems:
            raise InputError(problems)

    def range(self, family: AnyFamily) -> tuple[float, float]:
        """Speeds between which to search."""
        low, high = family.search_range
        low = low if self.low is None else self.low
        high = high if self.high is None else self.high
        if not low < high and (low, high) != family.search_range:
            raise InputError([f"low, high: need low < high, got {low:g} and {high:g}"])
        return low, high


@dataclass(frozen=True, kw_only=True)
class Crossing:
    """A root on the imaginary axis.

    Attributes
    ----------
    speed, k : float
        Speed U* and reduced frequency Im p.
    growing : bool
        True if the root goes from damped to growing with increasing speed.
    coalescence : bool
        True if two undamped modes meet here.
    """

    speed: float
    k: float
    growing: bool
    coalescence: bool = False

    @property
    def omega_ratio(self) -> float:
        """Frequency over the uncoupled pitch frequency, k U*."""
        return self.k * self.speed


@dataclass(frozen=True, kw_only=True, eq=False)
class RootLocus(Result):
    """Result of :func:`root_locus`.

    Attributes
    ----------
    flutter : Crossing or None
        The lowest crossing from damped to growing.
    crossings : tuple of Crossing
        All of them, by speed.
    divergence : float or None
        Lowest speed at which a real root passes through zero.
    unstable_at_low : bool
        True if an oscillatory root grows already at the lowest speed searched.
    searched : (float, float)
        Range of speeds searched.
    stiffness : float
    speeds : array (m,)
    roots : array (m, n)
        Column j is the same mode at every speed.
    """

    flutter: Crossing | None
    crossings: tuple[Crossing, ...]
    divergence: float | None
    unstable_at_low: bool
    searched: tuple[float, float]
    stiffness: float
    speeds: Real
    roots: Complex


@analysis(spring=False)
def root_locus(
    family: AnyFamily,
    options: RootLocusOptions | None = None,
    *,
    speeds: ArrayLike | None = None,
) -> RootLocus:
    """Roots over speed, every crossing of the imaginary axis, flutter and divergence.

    A family whose range is one speed has its roots there and crosses nothing.

    Parameters
    ----------
    family : Family or LureFamily
    options : RootLocusOptions, optional
    speeds : array (m,), optional
        Speeds at which roots are returned. By default 241 of them from the lowest speed searched
        (or a fiftieth of the flutter speed) to 1.2 times the flutter speed.

    Raises
    ------
    InputError
        If the range is empty or a speed is not positive.

    Examples
    --------
    >>> from aeroflutter import SectionFamily, TypicalSection
    >>> locus = root_locus(SectionFamily(TypicalSection(omega_bar=0.2)))
    >>> round(locus.flutter.speed, 4)
    6.2851
    """
    options = options or RootLocusOptions()
    track = _search(family, options)
    crossings = _crossings(family, options.stiffness, track)
    flutter = _first_growing(crossings)
    shown = _output_speeds(speeds, options.range(family), flutter)
    return RootLocus(
        flutter=flutter,
        crossings=crossings,
        divergence=_divergence(family, options.stiffness, track.speeds),
        unstable_at_low=_unstable_at_low(track),
        searched=options.range(family),
        stiffness=options.stiffness,
        speeds=shown,
        roots=_roots_at(family, options.stiffness, shown),
    )


@analysis(spring=False)
def flutter_point(family: AnyFamily, options: RootLocusOptions | None = None) -> Crossing | None:
    """The lowest crossing from damped to growing, or None if there is none in the range."""
    options = options or RootLocusOptions()
    return _first_growing(_crossings(family, options.stiffness, _search(family, options)))


@analysis(spring=False)
def flutter_speed(family: AnyFamily, stiffness: float = 1.0) -> float | None:
    """Linear flutter speed U*_L for a pitch stiffness, or None if there is none in the range."""
    point = flutter_point(family, RootLocusOptions(stiffness=stiffness))
    return None if point is None else point.speed


def flutter_against_stiffness(
    family: AnyFamily, stiffnesses: ArrayLike, options: RootLocusOptions | None = None
) -> tuple[Real, Real]:
    """Flutter speed and reduced frequency for each pitch stiffness (thesis figure 4.11).

    Returns
    -------
    speeds, ks : arrays (m,)
        NaN where there is no flutter in the range searched.
    """
    options = options or RootLocusOptions()
    points = [
        flutter_point(
            family,
            RootLocusOptions(
                stiffness=float(value), low=options.low, high=options.high, grid=options.grid
            ),
        )
        for value in np.atleast_1d(np.asarray(stiffnesses, dtype=float))
    ]
    found = np.array([(np.nan, np.nan) if p is None else (p.speed, p.k) for p in points])
    return found[:, 0], found[:, 1]


def _search(family: AnyFamily, options: RootLocusOptions) -> Track:
    low, high = options.range(family)
    if low == high:
        return follow(family, options.stiffness, np.array([low]))
    space = np.geomspace if low > 0 else np.linspace
    return follow(family, options.stiffness, space(low, high, options.grid))


def _roots_at(family: AnyFamily, stiffness: float, speeds: Real) -> Complex:
    """Tracked roots at the given speeds only."""
    order = np.argsort(speeds, kind="stable")
    if speeds.size == 1:
        roots: Complex = solve_modes(family, stiffness, speeds).roots
        return np.take_along_axis(roots, np.argsort(-roots.imag, axis=1), axis=1)
    track = follow(family, stiffness, np.unique(speeds))
    found: Complex = track.roots[np.searchsorted(track.speeds, speeds[order])]
    return found[np.argsort(order)]


def _output_speeds(
    speeds: ArrayLike | None, searched: tuple[float, float], flutter: Crossing | None
) -> Real:
    if speeds is None and searched[0] == searched[1]:
        return np.array([searched[0]])
    if speeds is None:
        top = searched[1] if flutter is None else min(1.2 * flutter.speed, searched[1])
        return np.linspace(max(searched[0], top / 50), top, 241)
    chosen = np.atleast_1d(np.asarray(speeds, dtype=float))
    if chosen.size == 0 or not np.all(np.isfinite(chosen) & (chosen > 0)):
        raise InputError(["speeds: must be positive finite numbers, at least one"])
    return chosen


# --- crossings -----------------------------------------------------------------------------------


def _first_growing(crossings: tuple[Crossing, ...]) -> Crossing | None:
    return next((crossing for crossing in crossings if crossing.growing), None)


def _unstable_at_low(track: Track) -> bool:
    roots = track.roots[0]
    return bool(np.any((roots.real > _NEUTRAL * np.abs(roots).max()) & (roots.imag > 0)))


def _crossings(family: AnyFamily, stiffness: float, track: Track) -> tuple[Crossing, ...]:
    if _reversible(family, stiffness, track.speeds):
        found = coalescences(family, stiffness, track.speeds)
    else:
        found = [
            crossing
            for bracket in _brackets(family, stiffness, track)
            if (crossing := _polished(family, stiffness, *bracket)) is not None
        ]
    return tuple(_distinct(sorted(found, key=lambda crossing: crossing.speed)))


def _distinct(crossings: list[Crossing]) -> list[Crossing]:
    kept: list[Crossing] = []
    for crossing in crossings:
        if not any(
            abs(crossing.speed - other.speed) < 1e-9 * other.speed
            and abs(crossing.k - other.k) < 1e-9 * other.k
            for other in kept
        ):
            kept.append(crossing)
    return kept


def _brackets(
    family: AnyFamily, stiffness: float, track: Track
) -> list[tuple[float, float, complex, complex]]:
    """Intervals of speed across which an oscillatory root changes the sign of its damping."""
    U, roots, slopes = track.speeds, track.roots, track.slopes
    found: list[tuple[float, float, complex, complex]] = []
    scale = np.abs(roots).max(axis=1)
    upper = np.minimum(roots[:-1].imag, roots[1:].imag) > _NEUTRAL * scale[1:, None]
    sign, since = _signs(roots, track.noise)
    change = sign[:-1] * sign[1:] < 0
    for i, j in zip(*np.nonzero(upper & change), strict=True):
        last = int(since[i, j])
        found.append((float(U[last]), float(U[i + 1]), roots[last, j], roots[i + 1, j]))
    # damping that first falls and then recovers between two speeds may have crossed in between
    dips = (sign[:-1] * slopes[:-1].real < 0) & (sign[:-1] * slopes[1:].real > 0)
    for i, j in zip(*np.nonzero(upper & ~change & dips & (since[1:] > since[:-1])), strict=True):
        turn = _turning_point(
            family, stiffness, (U[i], U[i + 1]), (roots[i, j], roots[i + 1, j]), float(sign[i, j])
        )
        if turn is not None:
            speed, root = turn
            low, high = float(U[i]), float(U[i + 1])
            found += [(low, speed, roots[i, j], root), (speed, high, root, roots[i + 1, j])]
    return found


def _signs(roots: Complex, noise: Real) -> tuple[Real, Real]:
    """Sign of the damping of every root, and at which speed it was last seen, both (m, n).

    Damping of the size of round-off has the sign that it had before, or none: a mode that no air
    force touches never crosses.
    """
    own = np.where(np.abs(roots.real) > noise, np.sign(roots.real), 0.0)
    places = np.arange(len(roots))[:, None] * np.ones(roots.shape[1], dtype=int)
    since = np.maximum.accumulate(np.where(own != 0.0, places, 0), axis=0)
    return np.take_along_axis(own, since, axis=0), since


def _nearest(family: AnyFamily, stiffness: float, speed: float, guess: complex) -> complex:
    roots = np.linalg.eigvals(closed_matrices(family, stiffness, np.asarray(speed)))
    return complex(roots[np.argmin(np.abs(roots - guess))])


def _between(
    ends: tuple[float, float], roots: tuple[complex, complex]
) -> Callable[[float], complex]:
    return lambda speed: roots[0] + (roots[1] - roots[0]) * (speed - ends[0]) / (ends[1] - ends[0])


def _turning_point(
    family: AnyFamily,
    stiffness: float,
    ends: tuple[float, float],
    roots: tuple[complex, complex],
    sign: float,
) -> tuple[float, complex] | None:
    """The speed of least ``sign * Re p`` between two speeds, if it lies beyond the axis."""
    from scipy.optimize import minimize_scalar

    guess = _between(ends, roots)
    best = minimize_scalar(
        lambda speed: sign * _nearest(family, stiffness, speed, guess(speed)).real,
        bounds=ends,
        method="bounded",
        options={"xatol": 1e-10 * ends[1]},
    )
    if best.fun >= 0:
        return None
    return float(best.x), _nearest(family, stiffness, best.x, guess(best.x))


def _polished(
    family: AnyFamily, stiffness: float, low: float, high: float, first: complex, last: complex
) -> Crossing | None:
    """The crossing in a bracket, to round-off."""
    guess = _between((low, high), (first, last))

    def damping(speed: float) -> float:
        return _nearest(family, stiffness, speed, guess(speed)).real

    if (damping(low) > 0) == (damping(high) > 0):
        return None
    speed = bracketed_root(damping, low, high)
    root = _nearest(family, stiffness, speed, guess(speed))
    if root.imag <= 0:
        return None
    return Crossing(speed=speed, k=root.imag, growing=bool(last.real > first.real))


# --- systems without damping ---------------------------------------------------------------------


def _reversible(family: AnyFamily, stiffness: float, speeds: Real) -> bool:
    """True if with every root p, -p is a root as well, so that stability is lost by coalescence.

    That is so if the traces of all odd powers vanish. The smallest damping must count: undamped
    flutter is not the limit of flutter with little damping.
    """
    closed = closed_matrices(family, stiffness, speeds)
    size = np.abs(closed)
    for power in range(1, closed.shape[-1] + 1, 2):
        trace = np.trace(np.linalg.matrix_power(closed, power), axis1=-2, axis2=-1)
        bound = np.trace(np.linalg.matrix_power(size, power), axis1=-2, axis2=-1)
        if np.any(np.abs(trace) > 1e-13 * bound):
            return False
    return True


def _squares(family: AnyFamily, stiffness: float, speeds: Real) -> Complex:
    """The squares p^2 of the roots of a reversible system, each once, (..., n/2)."""
    closed = closed_matrices(family, stiffness, speeds)
    if closed.shape[-1] == 4:  # p^4 - (tr A²/2) p² + det A, without the detour over a double root
        half = 0.25 * np.trace(closed @ closed, axis1=-2, axis2=-1)
        root = np.sqrt(half**2 - np.linalg.det(closed) + 0j)
        return np.stack((half + root, half - root), axis=-1)
    squares = np.linalg.eigvals(closed).astype(complex) ** 2
    order = np.argsort(squares.real, axis=-1)
    return np.asarray(np.take_along_axis(squares, order, axis=-1)[..., ::2])


def _discriminant(squares: Complex) -> Real:
    i, j = np.triu_indices(squares.shape[-1], 1)
    return np.asarray(np.prod((squares[..., i] - squares[..., j]) ** 2, axis=-1).real)


def coalescences(family: AnyFamily, stiffness: float, speeds: Real) -> list[Crossing]:
    """Where two frequencies of a reversible system meet between neighbours of ascending speeds."""

    def value(speed: float) -> float:
        return float(_discriminant(_squares(family, stiffness, np.asarray(speed))))

    values = _discriminant(_squares(family, stiffness, speeds))
    found = []
    for i in np.nonzero((values[:-1] > 0) != (values[1:] > 0))[0]:
        speed = bracketed_root(value, float(speeds[i]), float(speeds[i + 1]))
        squares = _squares(family, stiffness, np.asarray(speed))
        gaps = np.abs(squares[:, None] - squares[None, :]) + np.diag(np.full(squares.size, np.inf))
        square = squares[np.argmin(gaps.min(axis=1))].real
        if square < 0:
            found.append(
                Crossing(
                    speed=speed,
                    k=float(np.sqrt(-square)),
                    growing=bool(values[i] > 0),
                    coalescence=True,
                )
            )
    return found


# --- divergence ----------------------------------------------------------------------------------


def _divergence(family: AnyFamily, stiffness: float, speeds: Real) -> float | None:
    """Lowest speed at which ``det(1/G(0) + N I)`` changes sign: the static loads balance."""
    whole = as_family(family)

    def balance(speeds: ArrayLike) -> Real:
        A, B, C, _ = whole.stack(speeds)
        static = inverse_transfer(A, B, C, np.zeros(np.shape(speeds))).real
        if static.shape[-1] == 1:
            return static[..., 0, 0] + stiffness
        return np.asarray(np.linalg.det(static + stiffness * np.eye(static.shape[-1])))

    room = max(1.0, abs(stiffness))
    values = balance(speeds)
    values[np.abs(values) < 1e-12 * room] = 0.0
    for i in np.nonzero(values[:-1] * values[1:] < 0)[0]:
        speed = bracketed_root(lambda U: float(balance(U)), float(speeds[i]), float(speeds[i + 1]))
        if abs(balance(speed)) < 1e-6 * room:  # not a pole of 1/G(0)
            return speed
    return None
