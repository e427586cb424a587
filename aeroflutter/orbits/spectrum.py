"""Floquet multipliers of a cycle, whatever method found them, and the bifurcations they announce.

The test functions vanish at bifurcations of any cycle, so a continuation can locate them; what a
zero is called depends on the multipliers there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aeroflutter.orbits.continuation import Test

__all__ = ["FLIP", "FOLD", "TORUS", "Spectrum", "bifurcation", "test_functions"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

FOLD, FLIP, TORUS = "fold", "flip", "torus"
_REAL = 1e-7  # imaginary part, relative to it, below which an eigenvalue is real


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Eigenvalues of the map that a cycle is a fixed point of.

    Attributes
    ----------
    trivial
        The one along the motion, one but for errors.
    drift
        The one along a continuum of bias; None elsewhere.
    others
        The rest, largest first.
    symmetric
        Whether the map is that of half a period followed by the mirror.
    """

    trivial: complex
    drift: complex | None
    others: Complex
    symmetric: bool

    @classmethod
    def of(cls, trivial: complex, others: Complex, *, symmetric: bool, free: bool) -> Spectrum:
        """From eigenvalues (n-1,), one of which belongs to a continuum of bias where `free`."""
        if not free:
            return cls(trivial, None, others, symmetric)
        index = int(np.argmin(np.abs(others - (-1.0 if symmetric else 1.0))))
        return cls(trivial, complex(others[index]), np.delete(others, index), symmetric)

    @property
    def multipliers(self) -> Complex:
        """Floquet multipliers of the whole period, (n,): the trivial one first."""
        drift = [] if self.drift is None else [self.drift]
        values = np.concatenate(([self.trivial], drift, self.others)).astype(complex)
        return values**2 if self.symmetric else values

    @property
    def stable(self) -> bool:
        """Whether all but the trivial one and the drift lie inside the unit circle."""
        return bool(np.all(np.abs(self.others) < 1.0))

    @property
    def distance(self) -> float:
        """Distance of the nearest of those from the unit circle."""
        return float(np.min(np.abs(np.abs(self.others) - 1.0), initial=np.inf))

    @property
    def flip(self) -> float:
        """Zero where an eigenvalue passes -1: a doubled period, or the symmetry breaks."""
        return _compressed(complex(np.prod(1.0 + self.others)))

    @property
    def torus(self) -> float:
        """Zero where a pair has the product 1: Neimark-Sacker, or a neutral saddle."""
        i, j = np.triu_indices(self.others.size, 1)
        return _compressed(complex(np.prod(1.0 - self.others[i] * self.others[j])))

    @property
    def closest_pair_is_complex(self) -> bool:
        """Whether the pair whose product is nearest to 1 is complex."""
        i, j = np.triu_indices(self.others.size, 1)
        best = self.others[i[np.argmin(np.abs(1.0 - self.others[i] * self.others[j]))]]
        return bool(abs(best.imag) > _REAL * max(1.0, abs(best)))


def _compressed(value: complex) -> float:
    """The value without its decades, which a bracketing search would lose digits to."""
    return float(np.arcsinh(value.real))


def test_functions(spectrum: Callable[[Array], Spectrum]) -> dict[str, Test]:
    """Test functions of the points of a walk, of which `spectrum` knows the eigenvalues."""
    return {
        FLIP: lambda x, tangent: spectrum(x).flip,
        TORUS: lambda x, tangent: spectrum(x).torus,
    }


def bifurcation(name: str, spectrum: Spectrum) -> str:
    """What a zero of a test function (or a fold) is called; empty if nothing happens there."""
    if name == FLIP:
        return "symmetry-breaking" if spectrum.symmetric else "period-doubling"
    if name == TORUS:  # two real eigenvalues whose product is one are no bifurcation
        return "neimark-sacker" if spectrum.closest_pair_is_complex else ""
    return name
