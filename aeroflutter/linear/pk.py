"""Flutter by the p-k method on tabulated aerodynamic forces, modes followed over the airspeed.

``[(V/b)² p² M + (V/b) p C + K - ½ rho V² Q(k)] q = 0`` with ``k = Im p``, ``p`` per unit of
``tau = V t/b`` (Hassig, J. Aircraft 8(11), 1971). Nothing is approximated but the interpolation of
``Q`` between the reduced frequencies of the table, so this is the check of a rational
approximation. The aerodynamic forces are those of undamped motion: only crossings are exact.

A mode is a curve of ``(V, p, q)`` and is followed as one, by Newton's method from a tangent, in
steps short enough that its shape stays the same from one to the next. Where a frequency goes to
zero the curve ends.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from aeroflutter.analysis import Result, is_case
from aeroflutter.bracket import bracketed_root
from aeroflutter.errors import InputError
from aeroflutter.linear.rootlocus import Crossing
from aeroflutter.model.elsewhere.modal import Modes
from aeroflutter.model.system import Complex, Real

__all__ = ["PKOptions", "PKResult", "pk_method"]

_NEUTRAL = 1e-9  # |Re| below this fraction of |lambda| is round-off, not damping
_ALIKE = 0.9  # of the shape of a mode and its successor, one step on
_NEAR = 0.02  # relative distance of a root from its prediction
_HALVINGS = 14  # of a step before a mode is given up
_STATIONS = 5  # airspeeds at which all roots are looked for


@dataclass(frozen=True, kw_only=True)
class PKOptions:
    """Options of :func:`pk_method`.

    Parameters
    ----------
    low, high : float, optional
        Airspeeds, m/s; those of which the table speaks by default.
    points : int
        Airspeeds listed.

    Raises
    ------
    InputError
        Names the option that is out of range.
    """

    low: float | None = None
    high: float | None = None
    points: int = 201

    def __post_init__(self) -> None:
        problems = []
        for name in ("low", "high"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                problems.append(f"{name}: must be a positive finite speed, got {value!r}")
        if self.low is not None and self.high is not None and not self.low < self.high:
            problems.append(f"low, high: need low < high, got {self.low:g} and {self.high:g}")
        if self.points < 2:
            problems.append(f"points: needs at least 2 speeds, got {self.points!r}")
        if problems:
            raise InputError(problems)


@dataclass(frozen=True, kw_only=True, eq=False)
class PKResult(Result):
    """Result of :func:`pk_method`.

    Attributes
    ----------
    flutter : Crossing or None
        The lowest crossing from damped to growing; speeds are in m/s.
    crossings : tuple of Crossing
        All of them, by speed.
    divergence : float or None
        Lowest speed at which the steady air forces balance the springs.
    speeds : array (m,)
    roots : complex array (m, modes)
        ``lambda = V p/b`` in rad/s, followed by mode; NaN where a mode has no oscillating root.
    semichord : float
    table : tuple of float
        Lowest and highest reduced frequency of the table.
    """

    flutter: Crossing | None
    crossings: tuple[Crossing, ...]
    divergence: float | None
    speeds: Real
    roots: Complex
    semichord: float
    table: tuple[float, float]

    @property
    def damping(self) -> Real:
        """``g = 2 Re lambda/|Im lambda|`` (m, modes), as V-g diagrams show it."""
        return np.asarray(2.0 * self.roots.real / np.abs(self.roots.imag))

    @property
    def frequency_hz(self) -> Real:
        """``Im lambda/2π`` (m, modes)."""
        return np.asarray(self.roots.imag / (2 * np.pi))

    @property
    def k(self) -> Real:
        """Reduced frequencies (m, modes)."""
        return np.asarray(self.roots.imag * self.semichord / self.speeds[:, None])

    @property
    def outside(self) -> Real:
        """Whether a root lies beyond the table (m, modes), where ``Q`` is continued."""
        return np.asarray((self.k < self.table[0]) | (self.k > self.table[1]))


@dataclass(frozen=True)
class _State:
    """A point on the curve of a mode."""

    V: float
    root: complex
    shape: Complex


def pk_method(modes: Modes | Any, options: PKOptions | None = None) -> PKResult:
    """Roots of the p-k equation over the airspeed, crossings and divergence.

    Parameters
    ----------
    modes : Modes
        With all springs in their stiffness; or a case of a modal model.
    options : PKOptions, optional

    Raises
    ------
    InputError
        If the range of speeds is empty, or the case has no modal model.

    Notes
    -----
    Between the reduced frequencies of the table and beyond them ``Q`` is as
    :meth:`~aeroflutter.model.elsewhere.forces.TabulatedForces.at` says. A mode that no air force
    touches has no damping to lose: round-off of its real part is not taken for a crossing.
    """
    if is_case(modes):
        case: Any = modes
        modal = None if case.imported is None else case.imported.modal
        if modal is None:
            raise InputError(f'{case.source}: model.kind: p-k needs air forces over k, "modal"')
        return pk_method(modal.whole(), options).about(case=case)
    options = options or PKOptions()
    low, high = modes.speeds if None in (options.low, options.high) else (0.0, 0.0)
    low = low if options.low is None else options.low
    high = high if options.high is None else options.high
    if not low < high:
        raise InputError([f"low, high: need low < high, got {low:g} and {high:g}"])
    equation = _Equation(modes)
    grid = np.linspace(low, high, options.points)
    tracks: list[dict[int, _State]] = []
    for place in np.unique(np.linspace(0, grid.size - 1, _STATIONS).astype(int)):
        for start in equation.roots_at(float(grid[place])):
            if not any(_same(track.get(int(place)), start) for track in tracks):
                tracks.append(_curve(equation, grid, int(place), start))
    tracks.sort(key=lambda track: (min(track), track[min(track)].root.imag))
    roots = np.full((grid.size, len(tracks)), np.nan + 1j * np.nan)
    for j, track in enumerate(tracks):
        for i, state in track.items():
            roots[i, j] = state.root
    crossings = sorted(
        (one for track in tracks for one in _crossings(equation, grid, track)),
        key=lambda crossing: crossing.speed,
    )
    return PKResult(
        flutter=next((one for one in crossings if one.growing), None),
        crossings=tuple(crossings),
        divergence=equation.divergence(low, high),
        speeds=grid,
        roots=roots,
        semichord=modes.semichord,
        table=(float(modes.forces.k[0]), float(modes.forces.k[-1])),
    )


class _Equation:
    """``T(lambda, V) q = 0`` and its derivatives, ``lambda`` in rad/s."""

    def __init__(self, modes: Modes) -> None:
        self.modes, self.n = modes, modes.forces.modes
        self.top = float(modes.forces.k[-1])

    def matrix(self, root: complex, V: float, Q: Complex) -> Complex:
        """``lambda² M + lambda C + K - ½ rho V² Q``."""
        modes = self.modes
        pressure = 0.5 * modes.density * V**2
        return np.asarray(root**2 * modes.M + root * modes.C + modes.K - pressure * Q)

    def corrected(self, V: float, root: complex, shape: Complex) -> _State | None:
        """The root and shape at a speed by Newton's method, if it converges."""
        modes, n = self.modes, self.n
        fixed = shape.conj() / np.vdot(shape, shape)
        for _ in range(12):
            k = modes.semichord * root.imag / V
            if k <= 0:
                return None
            jacobian, left = self._linear(V, root, shape, fixed)
            step = np.linalg.solve(jacobian, -np.concatenate([left.real, left.imag]))
            change = step[: n + 1] + 1j * step[n + 1 :]
            shape, root = shape + change[:n], root + change[n]
            if abs(change[n]) <= 1e-13 * abs(root) and np.abs(change[:n]).max() < 1e-9:
                return _State(V, complex(root), shape) if root.imag > 0 else None
        return None

    def _linear(
        self, V: float, root: complex, shape: Complex, fixed: Complex
    ) -> tuple[Real, Complex]:
        """Jacobian over the real and imaginary parts of (q, lambda), and the residual."""
        modes, n = self.modes, self.n
        k = modes.semichord * root.imag / V
        Q, dQ = modes.forces.at(k), modes.forces.slope(k)
        T = self.matrix(root, V, Q)
        by_root = (2 * root * modes.M + modes.C) @ shape
        by_omega = -0.5 * modes.density * V * modes.semichord * (dQ @ shape)
        holomorphic = np.zeros((n + 1, n + 1), dtype=complex)
        holomorphic[:n, :n], holomorphic[:n, n], holomorphic[n, :n] = T, by_root, fixed
        jacobian = np.block(
            [[holomorphic.real, -holomorphic.imag], [holomorphic.imag, holomorphic.real]]
        )
        jacobian[:n, -1] += by_omega.real
        jacobian[n + 1 : 2 * n + 1, -1] += by_omega.imag
        return jacobian, np.append(T @ shape, fixed @ shape - 1.0)

    def tangent(self, state: _State) -> tuple[complex, Complex]:
        """Derivatives of root and shape with respect to the speed."""
        modes, n, V = self.modes, self.n, state.V
        k = modes.semichord * state.root.imag / V
        Q, dQ = modes.forces.at(k), modes.forces.slope(k)
        fixed = state.shape.conj() / np.vdot(state.shape, state.shape)
        jacobian, _ = self._linear(V, state.root, state.shape, fixed)
        force = modes.density * V * (Q - 0.5 * k * dQ) @ state.shape
        step = np.linalg.solve(jacobian, np.concatenate([force.real, [0.0], force.imag, [0.0]]))
        change = step[: n + 1] + 1j * step[n + 1 :]
        return complex(change[n]), change[:n]

    def roots_at(self, V: float) -> Iterator[_State]:
        """All oscillating roots at a speed: where a sorted frequency of the pencil meets its k.

        Sorted by frequency the eigenvalues are continuous functions of the ``k`` at which ``Q`` is
        taken, so that signs of their difference tell.
        """
        modes, n = self.modes, self.n
        top = 1.2 * modes.semichord * float(modes.wind_off[-1]) / V
        k = np.unique(
            np.concatenate([np.geomspace(1e-4, max(top, self.top), 240), modes.forces.k[1:]])
        )
        Q = modes.forces.at(k)
        pencil = np.zeros((k.size, 2 * n, 2 * n), dtype=complex)
        pencil[:, :n, n:] = np.eye(n)
        stiffness = modes.K - 0.5 * modes.density * V**2 * Q
        pencil[:, n:, :n] = -np.linalg.solve(modes.M, stiffness)
        pencil[:, n:, n:] = -np.linalg.solve(modes.M, modes.C)
        values, vectors = np.linalg.eig(pencil)
        order = np.argsort(values.imag, axis=1)
        sorted_values = np.take_along_axis(values, order, axis=1)
        ahead = sorted_values.imag * modes.semichord / V - k[:, None]
        for i, j in zip(*np.nonzero((ahead[:-1] > 0) & (ahead[1:] <= 0)), strict=True):
            at = i if abs(ahead[i, j]) < abs(ahead[i + 1, j]) else i + 1
            shape = vectors[at, :n, order[at, j]]
            shape = shape / np.linalg.norm(shape)
            found = self.corrected(V, complex(sorted_values[at, j]), shape)
            if found is not None:
                yield found

    def divergence(self, low: float, high: float) -> float | None:
        """The lowest speed in the range at which ``K - ½ rho V² Q(0)`` is singular."""
        from scipy.linalg import eig

        modes = self.modes
        ratios = eig(modes.forces.Q[0].real, modes.K, right=False, homogeneous_eigvals=True)
        top, bottom = ratios
        real = (np.abs(bottom) > 1e-9) & (np.abs(top) > 1e-9 * np.abs(bottom) / high**2)
        values = bottom[real] / top[real]
        kept = values[(np.abs(values.imag) < 1e-9 * np.abs(values)) & (values.real > 0)].real
        speeds = np.sort(np.sqrt(2.0 * kept / modes.density))
        inside = speeds[(speeds >= low) & (speeds <= high)]
        return float(inside[0]) if inside.size else None


def _same(old: _State | None, new: _State) -> bool:
    return old is not None and abs(old.root - new.root) < 1e-6 * abs(new.root)


def _curve(equation: _Equation, grid: Real, place: int, start: _State) -> dict[int, _State]:
    """A mode through one of its points, up and down over the grid as far as it goes."""
    track = {place: start}
    for places in (range(place + 1, grid.size), range(place - 1, -1, -1)):
        state = start
        for i in places:
            found = _followed(equation, state, float(grid[i]))
            if found is None:
                break
            track[i] = state = found
    return track


def _followed(equation: _Equation, state: _State, V: float, depth: int = 0) -> _State | None:
    """The same mode at another speed, in as many steps as it takes."""
    by_root, by_shape = equation.tangent(state)
    step = V - state.V
    guess = state.root + step * by_root
    if guess.imag > 0:
        found = equation.corrected(V, guess, state.shape + step * by_shape)
        if found is not None and _alike(state, found, guess):
            return found
    if depth == _HALVINGS:
        return None
    middle = _followed(equation, state, state.V + 0.5 * step, depth + 1)
    return None if middle is None else _followed(equation, middle, V, depth + 1)


def _alike(old: _State, new: _State, guess: complex) -> bool:
    sizes = float(np.linalg.norm(old.shape) * np.linalg.norm(new.shape))
    overlap = float(abs(np.vdot(old.shape, new.shape)))
    return bool(overlap > _ALIKE * sizes and abs(new.root - guess) < _NEAR * abs(new.root))


def _crossings(equation: _Equation, grid: Real, track: dict[int, _State]) -> Iterator[Crossing]:
    """Where the damping of a mode changes its sign; round-off has none."""
    places = [i for i in sorted(track) if abs(track[i].root.real) > _NEUTRAL * abs(track[i].root)]
    for i, j in itertools.pairwise(places):
        first, last = track[i], track[j]
        if (first.root.real > 0) == (last.root.real > 0):
            continue
        between = {first.V: first, last.V: last}

        def damping(V: float, known: dict[float, _State] = between) -> float:
            nearest = known[min(known, key=lambda one: abs(one - V))]
            found = nearest if nearest.V == V else _followed(equation, nearest, V)
            if found is None:
                return float("nan")
            known[V] = found
            return found.root.real

        V = bracketed_root(damping, float(grid[i]), float(grid[j]))
        at: complex = between[V].root if V in between else first.root
        yield Crossing(
            speed=V,
            k=at.imag * equation.modes.semichord / V,
            growing=bool(last.root.real > 0),
        )
