"""The one door of the analyses: a linear system whose outputs are fed back through springs.

``x' = A x - B F(C x) + d``, where ``F`` holds the restoring moments of ``m`` springs, each of one
output and possibly with memory. Nothing behind this door knows how many states there are or that
an output is a pitch angle.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aeroflutter.errors import InputError

if TYPE_CHECKING:
    import control

__all__ = [
    "System",
    "bordered",
    "inverse_transfer",
    "inverse_transfer_gradient",
    "solved",
    "transfer",
]

_RADIUS, _AROUND = 1e-3, 8  # of the circle about a singular point, and how many points of it
_HUGE = 1e12  # of a solution over its right side: no more than round-off tells it from others
_TINY = 1e-9  # of the largest root of A, below which one is zero

Real = NDArray[np.float64]
Complex = NDArray[Any]  # of complex numbers


@dataclass(frozen=True, eq=False)
class System:
    """Linear system closed by ``m`` springs, ``x' = A x - B F(C x) + d``.

    Parameters
    ----------
    A : array (n, n)
        Springs that are linear are part of it.
    B : array (n, m)
        What the moment of every spring does to the state.
    C : array (m, n)
        Rows that pick the coordinates of the springs, ``y = C x``.
    d : array (n,), optional
        Constant load; zero by default.
    names : tuple of str, optional
        Names of the ``m`` outputs, such as ``"pitch"``; ``y1 … ym`` by default. Two springs in
        one coordinate have one name.
    units : tuple of str, optional
        Their units: ``"rad"`` (the default), ``"semichord"`` or ``"m"``.
    state_names : tuple of str, optional
        ``x1 … xn`` by default.

    Raises
    ------
    InputError
        If the shapes do not fit or an entry is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> system = System(np.array([[0.0, 1.0], [-1.0, -0.2]]), np.array([[0.0], [1.0]]),
    ...                 np.array([[1.0, 0.0]]))
    >>> complex(system.transfer(0.0)[0, 0])
    (1+0j)
    """

    A: Real
    B: Real
    C: Real
    d: Real | None = None
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    state_names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.d is None:
            object.__setattr__(self, "d", np.zeros(len(self.A)))
        for name in ("A", "B", "C", "d"):
            value = np.array(getattr(self, name), dtype=float)
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        problems = self._problems()
        if problems:
            raise InputError(problems)
        for name, count, default in (
            ("names", self.outputs, [f"y{i + 1}" for i in range(self.outputs)]),
            ("units", self.outputs, ["rad"] * self.outputs),
            ("state_names", self.order, [f"x{i + 1}" for i in range(self.order)]),
        ):
            given = tuple(getattr(self, name)) or tuple(default)
            object.__setattr__(self, name, given)
            if len(given) != count:
                raise InputError([f"{name}: need {count} names, got {len(given)}"])

    def _problems(self) -> list[str]:
        n, m = self.A.shape[-1] if self.A.ndim else 0, self.C.shape[0] if self.C.ndim else 0
        shapes = [value.shape for value in (self.A, self.B, self.C, self.load)]
        problems = []
        if n == 0 or shapes != [(n, n), (n, m), (m, n), (n,)]:
            shown = ", ".join(map(str, shapes))
            problems.append(f"A, B, C, d: need shapes (n, n), (n, m), (m, n), (n,), got {shown}")
        if not all(np.all(np.isfinite(value)) for value in (self.A, self.B, self.C, self.load)):
            problems.append("A, B, C, d: every entry must be finite")
        return problems

    @property
    def order(self) -> int:
        """Number of states."""
        return int(self.A.shape[0])

    @property
    def outputs(self) -> int:
        """Number of springs."""
        return int(self.C.shape[0])

    @property
    def load(self) -> Real:
        """The constant load ``d`` (n,)."""
        assert self.d is not None  # filled in by __post_init__
        return self.d

    def transfer(self, s: ArrayLike) -> Complex:
        """``G(s) = C (sI - A)^-1 B`` (…, m, m) at every ``s`` (any shape)."""
        return transfer(self.A, self.B, self.C, s)

    def inverse_transfer(self, s: ArrayLike) -> Complex:
        """``G(s)^-1`` (…, m, m) at every ``s`` (any shape), finite at the poles of ``G``."""
        return inverse_transfer(self.A, self.B, self.C, s)

    def closed(self, slopes: ArrayLike) -> NDArray[Any]:
        """``A - B diag(N) C`` with every spring replaced by a linear one.

        Parameters
        ----------
        slopes : array (…, m), real or complex
            Stiffness N of each.

        Returns
        -------
        array (…, n, n)
        """
        return np.asarray(self.A - (self.B * np.asarray(slopes)[..., None, :]) @ self.C)

    def absorb(self, linear: Mapping[int, float]) -> System:
        """The system with some springs linear: they are in ``A``, their outputs are gone.

        Parameters
        ----------
        linear : mapping of int to float
            Stiffness by number of output.
        """
        keep = [i for i in range(self.outputs) if i not in linear]
        slopes = np.array([linear.get(i, 0.0) for i in range(self.outputs)])
        return System(
            self.closed(slopes),
            self.B[:, keep],
            self.C[keep],
            self.load,
            tuple(self.names[i] for i in keep),
            tuple(self.units[i] for i in keep),
            self.state_names,
        )

    def single(self, output: int, slopes: ArrayLike) -> System:
        """The system with one spring, the others linear.

        Parameters
        ----------
        output : int
            Number of the output whose spring stays.
        slopes : array (m,)
            Stiffness of the others; the entry of ``output`` itself is not used.
        """
        values = np.asarray(slopes, dtype=float)
        return self.absorb({i: values[i] for i in range(self.outputs) if i != output})

    def to_control(self) -> control.StateSpace:
        """The system from moments to outputs, ``G(s)``, as a python-control StateSpace."""
        import control

        return control.ss(
            self.A,
            self.B,
            self.C,
            np.zeros((self.outputs, self.outputs)),
            states=list(self.state_names),
        )

    @classmethod
    def from_control(
        cls,
        system: control.StateSpace,
        names: tuple[str, ...] = (),
        units: tuple[str, ...] = (),
    ) -> System:
        """The loop in which a python-control system is closed by ``-F(y)``.

        Raises
        ------
        InputError
            If the system has not as many inputs as outputs, is in discrete time, or has direct
            feedthrough (the loop would be algebraic).
        """
        if not hasattr(system, "A"):
            raise InputError(["system: must be a StateSpace; control.ss(system) makes it one"])
        problems = []
        if system.ninputs != system.noutputs:
            problems.append("system: must have as many inputs as outputs, one pair a spring")
        elif np.any(system.D):
            problems.append("system: D must be zero, or the loop with the spring is algebraic")
        if system.isdtime(strict=True):
            problems.append("system: must be in continuous time")
        if problems:
            raise InputError(problems)
        return cls(system.A, system.B, system.C, None, names, units, tuple(system.state_labels))


def transfer(A: Complex, B: Real, C: Real, s: ArrayLike) -> Complex:
    """``C (sI - A)^-1 B`` (…, m, m) for stacked systems, ``s`` broadcast against the stack."""
    at = np.asarray(s, dtype=complex)
    resolvent = at[..., None, None] * np.eye(A.shape[-1]) - A
    return np.asarray(C @ np.linalg.solve(resolvent, B.astype(complex)))


def bordered(A: Real, B: Real, C: Real, s: Complex) -> Complex:
    """``[[sI - A, B], [C, 0]]``, regular at the poles of G, for stacked A, B, C and s."""
    n, m = B.shape[-2:]
    shape = np.broadcast_shapes(A.shape[:-2], s.shape)
    matrix = np.zeros((*shape, n + m, n + m), dtype=complex)
    matrix[..., :n, :n] = -A
    matrix[..., np.arange(n), np.arange(n)] += s[..., None]
    matrix[..., :n, n:] = B
    matrix[..., n:, :n] = C
    return matrix


def solved(matrix: Complex, right: Complex) -> Complex:
    """Solutions of stacked equations, the least where they have many.

    That is so for :func:`bordered` where springs share a coordinate, and at roots of ``A`` that are
    hidden from the inputs or the outputs.
    """
    try:
        found: Complex = np.asarray(np.linalg.solve(matrix, right))
        if np.all(np.abs(found) < _HUGE * max(float(np.max(np.abs(right))), 1e-300)):
            return found
    except np.linalg.LinAlgError:
        pass
    return np.asarray(np.linalg.pinv(matrix) @ right)


def inverse_transfer(A: Real, B: Real, C: Real, s: ArrayLike) -> Complex:
    """``G(s)^-1`` for stacked systems.

    Parameters
    ----------
    A : array (..., n, n)
    B : array (..., n, m)
    C : array (..., m, n)
    s : complex array, broadcast against the stack

    Returns
    -------
    array (..., m, m)
        Solves ``(sI - A) X + B g = 0, C X = I``, so that ``g = -G^-1``; no pole of G interferes,
        nor does a root of ``A`` that is none, hidden from the inputs or from the outputs.
    """

    def value(at: Complex) -> Complex:
        n, m = B.shape[-2:]
        matrix = bordered(A, B, C, at)
        unit = np.zeros((*matrix.shape[:-1], m), dtype=complex)
        unit[..., n:, :] = np.eye(m)
        return np.asarray(-np.linalg.solve(matrix, unit)[..., n:, :])

    return _there_or_around(value, A, s, _shape(A, B, s))


def inverse_transfer_gradient(
    A: Real, B: Real, C: Real, dA: Real, dB: Real, dC: Real, s: ArrayLike
) -> tuple[Complex, Complex, Complex]:
    """``G(s)^-1`` with its derivatives with respect to ``s`` and to the speed.

    Parameters
    ----------
    A, dA : array (..., n, n)
        System matrices and their derivative with respect to the speed.
    B, dB : array (..., n, m)
    C, dC : array (..., m, n)
    s : complex array, broadcast against the stack

    Returns
    -------
    value, d_ds, d_dU : arrays (..., m, m)
    """

    def value(at: Complex) -> Complex:
        n = B.shape[-2]
        inverse = np.linalg.inv(bordered(A, B, C, at))
        columns, rows = inverse[..., :, n:], inverse[..., n:, :]
        d_ds = rows[..., :n] @ columns[..., :n, :]
        forcing = dB @ columns[..., n:, :] - dA @ columns[..., :n, :]
        d_dU = rows[..., :n] @ forcing + rows[..., n:] @ dC @ columns[..., :n, :]
        return np.array([-columns[..., n:, :], d_ds, d_dU])

    found = _there_or_around(value, A, s, (3, *_shape(A, B, s)))
    return found[0], found[1], found[2]


def _shape(A: Real, B: Real, s: ArrayLike) -> tuple[int, ...]:
    m = B.shape[-1]
    return (*np.broadcast_shapes(A.shape[:-2], np.shape(s)), m, m)


def _there_or_around(
    value: Callable[[Complex], Complex], A: Real, s: ArrayLike, shape: tuple[int, ...]
) -> Complex:
    """A function at ``s``, or its mean over a small circle about it where its equations fail.

    At a root of ``A`` that is hidden from the inputs or the outputs ``1/G`` is analytic, but the
    equations that give it are singular. NaN where they are so all around.
    """
    at = np.asarray(s, dtype=complex)
    try:
        return value(at)
    except np.linalg.LinAlgError:
        pass
    roots = np.sort(np.abs(np.linalg.eigvals(A)), axis=-1)
    least = np.where(roots > _TINY * roots[..., -1:], roots, np.inf).min(axis=-1)
    size = np.where(np.abs(at) > 0.0, np.abs(at), np.where(np.isfinite(least), least, 1.0))
    turns = np.exp(2j * np.pi * (np.arange(_AROUND) + 0.5) / _AROUND)
    around = [at + _RADIUS * size * turn for turn in turns]
    try:
        return np.asarray(np.mean([value(one) for one in around], axis=0))
    except np.linalg.LinAlgError:
        return np.full(shape, np.nan + 0j)
