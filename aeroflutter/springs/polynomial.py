"""Springs whose moment is a polynomial, even orders included."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from aeroflutter.errors import InputError
from aeroflutter.springs.base import Array, Describing, Spring, check_factor

__all__ = ["Polynomial"]

HIGHEST = 16  # degree up to which the describing function is written out


@dataclass(frozen=True, slots=True)
class Polynomial(Spring):
    """F = β₁ α + β₂ α² + β₃ α³ + …

    Parameters
    ----------
    beta
        Coefficients β₁, β₂, …, per power of a radian, at least one and at most 16.
    """

    beta: tuple[float, ...] = (1.0,)
    kind: ClassVar[str] = "polynomial"

    def __post_init__(self) -> None:
        given: Any = self.beta
        if isinstance(given, str) or not isinstance(given, (Sequence, np.ndarray)):
            raise InputError(f"beta: must be a list of numbers, not {given!r}")
        try:
            beta = tuple(float(value) for value in given)
        except (TypeError, ValueError):
            raise InputError("beta: must hold numbers only") from None
        if not 1 <= len(beta) <= HIGHEST:
            raise InputError(f"beta: needs 1 to {HIGHEST} coefficients, not {len(beta)}")
        if not np.all(np.isfinite(beta)):
            raise InputError("beta: must hold finite numbers only")
        object.__setattr__(self, "beta", beta)

    def polynomial(self) -> tuple[float, ...]:
        """The coefficients."""
        return self.beta

    @property
    def scale(self) -> float:
        """Least pitch at which a term of higher order equals the linear one; 1 without such."""
        first = abs(self.beta[0]) or 1.0
        sizes = [
            (first / abs(b)) ** (1.0 / i) for i, b in enumerate(self.beta[1:], start=1) if b != 0.0
        ]
        size = min(sizes, default=1.0)
        return size if np.isfinite(size) else 1.0

    @property
    def odd(self) -> bool:
        """Whether all coefficients of even order vanish."""
        return not any(self.beta[1::2])

    def moment(self, alpha: ArrayLike, memory: ArrayLike = 0.0) -> Array:
        """Restoring moment F at pitch `alpha` (radians); `memory` is ignored."""
        pitch = np.asarray(alpha, dtype=float)
        value = np.zeros(np.broadcast_shapes(pitch.shape, np.shape(memory)))
        for b in reversed(self.beta):
            value = pitch * (b + value)
        return value

    def describing(self, amplitude: ArrayLike, bias: ArrayLike = 0.0) -> Describing:
        """Describing function under α = bias + amplitude·sin θ."""
        from aeroflutter.generated import switched as forms

        return Describing(*forms.polynomial(amplitude, bias, self.beta))

    def scaled(self, factor: float) -> Self:
        """The spring with pitch and moment both multiplied by `factor`."""
        f = check_factor(factor)
        return type(self)(tuple(b / f**i for i, b in enumerate(self.beta)))

    def span(self) -> tuple[float, float]:
        """Where no term of higher order exceeds the linear one; it is nonlinear everywhere."""
        return -self.scale, self.scale

    def slope_range(self) -> tuple[float, float]:
        """Smallest and largest dF/dα over all pitches, infinite where it has no bound."""
        slope = np.polynomial.Polynomial([i * b for i, b in enumerate(self.beta, start=1)]).trim()
        with np.errstate(over="ignore", invalid="ignore"):
            turns = slope.deriv().roots()
        if not np.all(np.abs(turns) < 1e100):  # a coefficient is next to nothing
            return -np.inf, np.inf
        real = turns[np.abs(turns.imag) <= 1e-9 * (1.0 + np.abs(turns))].real
        values = slope(np.append(real, 0.0))
        low, high = float(values.min()), float(values.max())
        if slope.degree() > 0:
            leading = float(slope.coef[-1])
            low = -np.inf if leading < 0.0 or slope.degree() % 2 else low
            high = np.inf if leading > 0.0 or slope.degree() % 2 else high
        return low, high
