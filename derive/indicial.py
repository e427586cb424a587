"""Indicial functions of more terms: sums of exponentials fitted to Theodorsen's function.

On the imaginary axis an indicial function 1 - sum a_i exp(-b_i tau) is 1 - sum a_i jk/(jk + b_i).
Theodorsen's C(k) has a branch point at k = 0, so no finite sum is C; one of few terms can be near
it at all k at once. The coefficients are those whose greatest error over all k is least, to eight
digits, with C = 1 at k = 0 and 1/2 at infinity kept. They are data here: :func:`fit` finds them
again, and every derivation measures their greatest error afresh.
"""

from __future__ import annotations

from dataclasses import dataclass

import mpmath  # type: ignore[import-untyped]
import sympy as sp

from derive.proofs.same import Proof, ProofError

RANGE = (1e-7, 1e5)  # beyond it C is 1 or 1/2 to six digits, and so is every fit


@dataclass(frozen=True)
class IndicialSet:
    """Coefficients and rates, and a bound of the greatest distance from C(k) over all k."""

    name: str
    source: str
    a: tuple[str, ...]
    b: tuple[str, ...]
    greatest_error: str


SETS = (
    IndicialSet(
        name="jones",
        source="R. T. Jones, NACA Report 681 (1940)",
        a=("0.165", "0.335"),
        b=("0.0455", "0.3"),
        greatest_error="0.0146",
    ),
    IndicialSet(
        name="four-term",
        source="fitted, least greatest error",
        a=("0.01630025", "0.10442321", "0.27182316", "0.10745338"),
        b=("0.0052447224", "0.046014604", "0.1836024", "0.62695235"),
        greatest_error="0.00125",
    ),
    IndicialSet(
        name="six-term",
        source="fitted, least greatest error",
        a=("0.002587636", "0.015223183", "0.064442647", "0.18889872", "0.18831876", "0.040529054"),
        b=(
            "0.00086601372",
            "0.0079222792",
            "0.036982108",
            "0.12110452",
            "0.32226898",
            "0.94356247",
        ),
        greatest_error="0.000206",
    ),
    IndicialSet(
        name="ten-term",
        source="fitted, least greatest error",
        a=(
            "0.00014908933",
            "0.00082026384",
            "0.0030870049",
            "0.0097447527",
            "0.028207682",
            "0.075967121",
            "0.15643876",
            "0.15558037",
            "0.061726544",
            "0.00827841223",
        ),
        b=(
            "5.1347824e-05",
            "0.0004602338",
            "0.0021736926",
            "0.0077149907",
            "0.022982835",
            "0.0599366",
            "0.13793551",
            "0.29271692",
            "0.64447269",
            "1.5405518",
        ),
        greatest_error="1.19e-05",
    ),
)


def _error(item: IndicialSet, k: float) -> float:
    """Distance from Theodorsen's function at one reduced frequency."""
    s = mpmath.mpc(0, k)
    pairs = zip(map(mpmath.mpf, item.a), map(mpmath.mpf, item.b), strict=True)
    fitted = 1 - sum(a * s / (s + b) for a, b in pairs)
    K0, K1 = mpmath.besselk(0, s), mpmath.besselk(1, s)
    return float(abs(fitted - K1 / (K0 + K1)))


def greatest_error(item: IndicialSet, points: int = 240) -> float:
    """Greatest distance over all k: at points even in log k, then by golden section near tops."""
    low, high = map(mpmath.log, RANGE)
    logs = [float(low + (high - low) * i / (points - 1)) for i in range(points)]
    errors = [_error(item, float(mpmath.exp(x))) for x in logs]
    tops = [i for i in range(1, points - 1) if errors[i] >= max(errors[i - 1], errors[i + 1])]
    step = logs[1] - logs[0]
    return max(_top(item, logs[i] - step, logs[i] + step) for i in tops)


def _top(item: IndicialSet, left: float, right: float) -> float:
    """Greatest error between two logarithms of k that hold one top."""
    ratio = (5**0.5 - 1) / 2
    for _ in range(25):
        inner = right - ratio * (right - left), left + ratio * (right - left)
        below, above = (_error(item, float(mpmath.exp(x))) for x in inner)
        left, right = (left, inner[1]) if below > above else (inner[0], right)
    return max(below, above)


def check_sets() -> None:
    """Measure every set against Bessel functions of mpmath; both limits are kept exactly."""
    for item in SETS:
        found, stated = greatest_error(item), float(item.greatest_error)
        if not 0.95 * stated < found <= stated:
            raise ProofError(f"indicial set {item.name}: error {found:.5g}, stated {stated:.5g}")
        total = sum((sp.Rational(a) for a in item.a), sp.Integer(0))
        if total != sp.Rational(1, 2):
            raise ProofError(f"indicial set {item.name}: starts at {1 - total}, not at 1/2")


def fit(terms: int, rounds: int = 80) -> tuple[list[float], list[float]]:
    """Coefficients and rates of least greatest error, by weighted least squares made minimax.

    SciPy's Levenberg-Marquardt moves the logarithms of the rates; the coefficients follow linearly
    (variable projection). Weights grow where the error is large (Lawson's iteration, as in the AAA
    algorithm's minimax variant), until it is level at all its tops.

    Parameters
    ----------
    terms : int
    rounds : int
        Of reweighting.

    Returns
    -------
    a, b : list of float
        By ascending rate.
    """
    import numpy as np
    from scipy.optimize import least_squares
    from scipy.special import kve

    s = 1j * np.geomspace(1e-6, 1e4, 1200)
    C = kve(1, s) / (kve(0, s) + kve(1, s))

    def solved(logs: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coefficients of sum 1/2, and the error of C."""
        parts = -s[:, None] / (s[:, None] + np.exp(logs))
        start, columns = 1 + parts[:, -1] / 2, parts[:, :-1] - parts[:, -1:]
        scaled = weight[:, None] * columns
        wanted = weight * (C - start)
        a = np.linalg.lstsq(
            np.vstack((scaled.real, scaled.imag)), np.append(wanted.real, wanted.imag), rcond=None
        )[0]
        return np.append(a, 0.5 - a.sum()), start + columns @ a - C

    def residual(logs: np.ndarray, weight: np.ndarray) -> np.ndarray:
        error = weight * solved(logs, weight)[1]
        return np.append(error.real, error.imag)

    logs = np.linspace(np.log(0.08 * 0.45**terms), 0.0, terms)
    weight, best = np.ones(s.size), (np.inf, logs, logs)
    for _ in range(rounds):
        logs = least_squares(residual, logs, args=(weight,), xtol=1e-12, ftol=1e-12).x
        a, error = solved(logs, weight)
        size = np.abs(error)
        best = min(best, (float(size.max()), a, logs), key=lambda found: found[0])
        weight = weight * (size / size.mean() + 1e-3) ** 0.35
        weight = np.maximum(weight / weight.max(), 1e-6)
    order = np.argsort(best[2])
    return list(map(float, best[1][order])), list(map(float, np.exp(best[2][order])))


PROOFS = (
    Proof(
        "indicial sets",
        "Every named set of terms is as near to Theodorsen's $C(k)$ as it says, over all $k$.",
        check_sets,
    ),
)
