"""Distributions of uncertain or designed quantities, and samples of them that can be repeated."""

from __future__ import annotations

import re
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import InputError
from aeroflutter.limits import within

__all__ = ["DESIGNS", "KINDS", "Distribution", "parse_distribution", "sample"]

Array = NDArray[np.float64]

KINDS: dict[str, tuple[str, ...]] = {
    "normal": ("mean", "deviation"),
    "lognormal": ("median", "log_deviation"),
    "uniform": ("low", "high"),
    "triangular": ("low", "mode", "high"),
    "beta": ("low", "high", "a", "b"),
    "choice": (),
}
"""Distributions and their parameters; `choice` takes any number of values, equally likely.

`normal` and `lognormal` take two more numbers: bounds at which the distribution is cut off.
`log_deviation` is the standard deviation of the logarithm.
"""
DESIGNS = ("random", "latin-hypercube", "sobol")
_WRITTEN = re.compile(r"\s*([a-z]+)\s*\((.*)\)\s*")


@dataclass(frozen=True)
class Distribution:
    """A distribution of one quantity.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    parameters : tuple of float
        As named there.
    low, high : float
        Bounds at which it is cut off (not clipped: nothing piles up on them).

    Raises
    ------
    InputError
        If the kind is unknown, or its parameters are too many, too few or not admissible.
    """

    kind: str
    parameters: tuple[float, ...]
    low: float = -np.inf
    high: float = np.inf

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"{self.kind}: unknown distribution; one of {', '.join(KINDS)}")
        names = KINDS[self.kind]
        p = self.parameters
        if not np.all(np.isfinite(p)) or (len(p) != len(names) if names else not p):
            wanted = ", ".join(names) or "one or more values"
            raise InputError(f"{self.kind}: takes {wanted}, all of them finite")
        problem = self._problem()
        if problem:
            raise InputError(f"{self}: {problem}")

    def __str__(self) -> str:
        numbers = list(self.parameters)
        if self.kind in ("normal", "lognormal") and np.isfinite([self.low, self.high]).all():
            numbers += [self.low, self.high]
        return f"{self.kind}({','.join(f'{value:g}' for value in numbers)})"

    def _problem(self) -> str:
        problem = _CHECKS[self.kind](self.parameters)
        if problem:
            return problem
        if not self.low < self.high:
            return f"nothing lies between {self.low:g} and {self.high:g}"
        if self.kind == "choice":
            outside = [v for v in self.parameters if not self.low <= v <= self.high]
            return f"{outside[0]:g} is outside {self.low:g} to {self.high:g}" if outside else ""
        below, up_to = self._mass()
        return "" if below < up_to else f"puts nothing between {self.low:g} and {self.high:g}"

    def within(self, low: float, high: float) -> Distribution:
        """The distribution cut off at further bounds."""
        return replace(self, low=max(self.low, low), high=min(self.high, high))

    def quantile(self, probability: Array) -> Array:
        """Values below which the distribution has these probabilities, (m,) in (0, 1)."""
        if self.kind == "choice":
            count = len(self.parameters)
            place = np.minimum((probability * count).astype(int), count - 1)
            return np.asarray(self.parameters)[place]
        below, up_to = self._mass()
        found = self._frozen().ppf(below + probability * (up_to - below))
        return np.clip(np.asarray(found, dtype=float), self.low, self.high)

    def _mass(self) -> tuple[float, float]:
        frozen = self._frozen()
        return float(frozen.cdf(self.low)), float(frozen.cdf(self.high))

    def _frozen(self) -> Any:
        from scipy import stats

        p = self.parameters
        if self.kind == "normal":
            return stats.norm(p[0], p[1])
        if self.kind == "lognormal":
            return stats.lognorm(p[1], scale=p[0])
        if self.kind == "uniform":
            return stats.uniform(p[0], p[1] - p[0])
        if self.kind == "triangular":
            return stats.triang((p[1] - p[0]) / (p[2] - p[0]), p[0], p[2] - p[0])
        return stats.beta(p[2], p[3], p[0], p[1] - p[0])


_CHECKS = {
    "normal": lambda p: "" if p[1] > 0 else "the deviation must be positive",
    "lognormal": lambda p: "" if min(p) > 0 else "median and log_deviation must be positive",
    "uniform": lambda p: "" if p[0] < p[1] else "low must lie below high",
    "triangular": lambda p: (
        "" if p[0] <= p[1] <= p[2] and p[0] < p[2] else "needs low <= mode <= high, low < high"
    ),
    "beta": lambda p: (
        "" if p[0] < p[1] and min(p[2:]) > 0 else "needs low < high, and a and b positive"
    ),
    "choice": lambda p: "",
}


def parse_distribution(text: str) -> Distribution:
    """A distribution as written on the command line: normal(100, 5) or normal(100, 5, 80, 120).

    Raises
    ------
    InputError
        If it cannot be read, or is none.
    """
    found = _WRITTEN.fullmatch(text)
    if not found:
        raise InputError(
            f'"{text}": must be written as in normal(100,5); one of {", ".join(KINDS)}'
        )
    kind, inside = found.groups()
    try:
        values = tuple(float(part) for part in inside.split(",")) if inside.strip() else ()
    except ValueError:
        raise InputError(f'"{text}": holds something that is not a number') from None
    if kind in ("normal", "lognormal") and len(values) == 4:
        return Distribution(kind, values[:2], values[2], values[3])
    return Distribution(kind, values)


def sample(
    distributions: Mapping[str, Distribution], number: int, seed: int = 0, design: str = "random"
) -> dict[str, Array]:
    """Draw a sample of several quantities, independent of each other.

    Parameters
    ----------
    distributions
        By the name of the quantity.
    number
        Size of the sample N.
    seed
        The same seed gives the same sample. With design "random" a quantity has its own stream
        of numbers: it is drawn the same whatever else varies, and a larger sample begins with
        the smaller one.
    design
        "random", or designs that fill the space more evenly: "latin-hypercube" or "sobol".

    Returns
    -------
    dict
        N values a quantity, (N,).

    Raises
    ------
    InputError
        If the number is less than one, the seed negative or the design unknown.
    """
    problems = []
    if number < 1:
        problems.append(f"sample: must be at least 1, not {number}")
    if seed < 0:
        problems.append(f"seed: must be zero or positive, not {seed}")
    if design not in DESIGNS:
        problems.append(f"design: {design!r} is unknown; one of {', '.join(DESIGNS)}")
    if problems:
        raise InputError(problems)
    within("samples", number, "sample")
    names = list(distributions)
    probability = _probabilities(names, number, seed, design)
    return {
        name: distributions[name].quantile(column)
        for name, column in zip(names, probability, strict=True)
    }


def _probabilities(names: Sequence[str], number: int, seed: int, design: str) -> list[Array]:
    """Numbers in (0, 1), (N,) a name."""
    if design == "random":
        streams = [np.random.default_rng([seed, zlib.crc32(name.encode())]) for name in names]
        return [_inside(stream.random(number)) for stream in streams]
    from scipy.stats import qmc

    generator = np.random.default_rng(seed)
    if design == "sobol":
        exponent = int(np.ceil(np.log2(number)))
        points = qmc.Sobol(len(names), seed=generator).random_base2(exponent)[:number]
    else:
        points = qmc.LatinHypercube(len(names), seed=generator).random(number)
    return [_inside(column) for column in points.T]


def _inside(probability: Array) -> Array:
    tiny = 2.0**-53
    return np.clip(probability, tiny, 1.0 - tiny)
