"""Rest at a corner of the law: what certifies that a motion comes to it though it always switches.

About a rest x_e, where y = y_e, a static law is F = F_e + k (y - y_e) + φ(y - y_e) with the least
slope k of all chords from there, and φ lies in a sector: 0 <= φ(e) e <= κ e². Lur'e and Postnikov's

    V = (x - x_e)ᵀ P (x - x_e) + 2 q ∫ φ de

falls along every motion on which y stays within the sector, if the matrix

    [ KᵀP + P K      w - P b          ]
    [ (w - P b)ᵀ     -2/κ - 2 q c b   ],    K = A - k b c,   wᵀ = c + q c K,

is negative definite. It is so for some P if Re (1 + jωq) G(jω) + 1/κ > 0 for all ω, with
G = c (jω - K)⁻¹ b (Popov); then P solves a Riccati equation. Here q is taken from samples of ω, P
from the equation, and what is believed is the matrix alone. Where V is small enough for y to stay
within the sector, no motion leaves, and all of them come to rest.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from aeroflutter.motion.step_tables import balance
from aeroflutter.springs._kernel_columns import HIGH, OFFSET, SLOPE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.model.lure import LureSystem
    from aeroflutter.motion.smooth_laws import SmoothLoop
    from aeroflutter.springs import PieceTable, Spring

    Array = NDArray[np.float64]

__all__ = ["Basin", "Loop", "absolutely_stable", "basins_of", "joint_basin", "smooth_basin"]

ROUND_OFF = 1e-12  # of a rest, in sizes of the law
NEAR = 0.1  # distance of a rest from the nearest corner over that from the next
DEFINITE = 1e-12  # eigenvalues of a definite matrix of unit diagonal, at least
POPOV = np.concatenate(([0.0], np.outer(np.logspace(-3, 5, 33), [1.0, -1.0]).ravel()))
ROOMS = np.array([10.0, 3.0, 1.0, 0.3, 0.1, 0.03, 0.01])  # of a smooth law, in its scale
SAMPLES = np.concatenate((-np.linspace(0.01, 1.0, 100), np.linspace(0.01, 1.0, 100)))
SPREAD = 0.01  # of the range of its chords, for what lies between samples
SLACKS = 10.0 ** np.arange(-3.0, -12.0, -1.5)  # what is added to the Riccati equation


class Loop(NamedTuple):
    """x' = A x - b F(c x) + d: (n, n), (n,), (n,), (n,)."""

    A: Array
    b: Array
    c: Array
    d: Array


class Basin(NamedTuple):
    """A motion with (x - centre)ᵀ form (x - centre) < 1 comes to rest at the centre.

    Attributes
    ----------
    centre, form
        (n,) and (n, n).
    rest
        y there.
    """

    centre: Array
    form: Array
    rest: float


def basins_of(
    loop: Loop, piece: PieceTable, rests: NDArray[np.bool_], centres: Array
) -> list[Basin]:
    """Basins of the rests that lie at corners of a static law, or next to one.

    Parameters
    ----------
    loop, piece
        The linear part and the law.
    rests, centres
        Whether each piece, if it went on for ever, is stable, (k,), and where it rests, (k, n).
    """
    found: list[Basin] = []
    breaks = piece.rows[:-1, HIGH]
    if piece.memory or breaks.size == 0:
        return found
    edges = np.concatenate(([-np.inf], breaks, [np.inf]))
    values = centres @ loop.c
    slack = ROUND_OFF * piece.size
    own = rests & (values >= edges[:-1] - slack) & (values <= edges[1:] + slack)
    for i in np.flatnonzero(own):
        x, y = centres[i], float(values[i])
        order = np.argsort(np.abs(breaks - y))
        away = np.append(np.abs(breaks - y)[order], np.inf)
        corner = int(order[0])
        known = any(abs(one.rest - y) <= slack for one in found)
        close = away[0] <= NEAR * min(away[1], max(piece.size, abs(y)))
        if known or not close or not np.all(rests[corner : corner + 2]):
            continue
        for room in (np.inf, away[1]) if np.all(rests) else (away[1],):
            form = absolutely_stable(loop, *_sector(piece, y, room), room)
            if form is not None:
                found.append(Basin(x, form, y))
                break
    return found


def _sector(piece: PieceTable, y: float, room: float) -> tuple[float, float]:
    """Least and largest slope of the chords from the law at y to where it is within `room`."""
    breaks, slopes, offsets = piece.rows[:-1, HIGH], piece.rows[:, SLOPE], piece.rows[:, OFFSET]
    ends = np.array([y - room, y + room]) if np.isfinite(room) else np.empty(0)
    at = np.concatenate((breaks[np.abs(breaks - y) < room], [y], ends))
    place = np.searchsorted(breaks, at)
    F = slopes[place] * at + offsets[place]
    far = np.abs(at - y) > 1e3 * ROUND_OFF * piece.size
    chords = (F - F[at == y][0])[far] / (at - y)[far]
    steps = 1e3 * ROUND_OFF * piece.size * np.array([-1.0, 1.0])
    found = np.concatenate((chords, slopes[np.searchsorted(breaks, y + steps)]))
    if not np.isfinite(room):
        found = np.append(found, piece.outside)
    return float(found.min()), float(found.max())


@lru_cache(maxsize=64)
def smooth_basin(system: LureSystem, spring: Spring, y: float, size: float) -> Basin | None:
    """Basin of the rest of a smooth law at y, as wide as one of a few.

    Parameters
    ----------
    system, spring
        The loop, without a load.
    y
        Where it rests.
    size
        Scale of the law.
    """
    F, step = float(spring.moment(y)), 1e-6 * size
    slope = float(spring.moment(y + step) - spring.moment(y - step)) / (2.0 * step)
    n = system.order
    loop = Loop(system.A, system.b, system.c, np.zeros(n))
    closed = system.closed(slope)
    if not np.linalg.eigvals(closed).real.max() < 0.0:
        return None
    x = np.linalg.solve(closed, system.b * (F - slope * y))
    for room in size * ROOMS:
        e = room * SAMPLES
        chords = np.append((np.asarray(spring.moment(y + e)) - F) / e, slope)
        widened = SPREAD * float(np.ptp(chords))
        low, high = float(chords.min()) - widened, float(chords.max()) + widened
        if all(np.linalg.eigvals(system.closed(k)).real.max() < 0.0 for k in (low, high)):
            form = absolutely_stable(loop, low, high, float(room))
            if form is not None:
                return Basin(x, form, y)
    return None


def joint_basin(loop: SmoothLoop, rest: Array) -> Basin | None:
    """Basin of a rest of several laws, as wide as one of a few; loops stick in it.

    Within a distance of every output the laws differ from their tangents F' by φ_i of a cone,
    |φ_i| <= κ_i |e_i|. V = eᵀ P e falls for all of them if, with any τ_i > 0,

        [ KᵀP + P K + Σ τ_i κ_i² c_iᵀ c_i     -P B      ]
        [ -Bᵀ P                               -diag(τ)  ]

    is negative definite, K being the matrix of small motions. P solves Lyapunov's equation.

    Parameters
    ----------
    loop
        The loop.
    rest
        Where it rests, (N,).
    """
    from scipy.linalg import solve_continuous_lyapunov

    K, y, x, h = loop.linear(rest), loop.outputs(rest), loop.state(rest), loop.memories(rest)
    values = np.linalg.eigvals(K)
    if not values.real.max() < -DEFINITE * np.abs(values).max():
        return None
    unit = balance(K)
    D, B, C = K * unit[None, :] / unit[:, None], loop.system.B / unit[:, None], loop.system.C * unit
    P = solve_continuous_lyapunov(D.T, -np.eye(x.size))
    P = 0.5 * (P + P.T)
    F, slopes = loop.moments(rest), loop.slopes(rest)
    scales = np.array([one.scale for one in loop.springs])
    widest = np.full(scales.size, np.inf)
    for i in loop.held:
        widest[i] = np.min(np.abs(np.subtract(loop.window(int(i), rest), y[i])))
    if not np.all(widest > ROUND_OFF * scales):
        return None
    for part in ROOMS:
        rooms = np.minimum(part * scales, widest)
        chords = [
            (np.asarray(one.moment(at + away, held)) - force) / away - slope
            for one, at, held, away, force, slope in zip(
                loop.springs, y, h, rooms[:, None] * SAMPLES, F, slopes, strict=True
            )
        ]
        kappa = (1.0 + SPREAD) * np.max(np.abs(chords), axis=1) + 1e-9 * (1.0 + np.abs(slopes))
        tau = np.linalg.norm(P @ B, axis=0) / (kappa * np.linalg.norm(C, axis=1))
        cone = (C.T * (tau * kappa**2)) @ C
        falls = np.block([[D.T @ P + P @ D + cone, -P @ B], [-(P @ B).T, -np.diag(tau)]])
        if _definite(-falls) and _definite(P):
            reach = np.sum(C.T * np.linalg.solve(P, C.T), axis=0) / rooms**2
            return Basin(x, P * float(reach.max()) / np.outer(unit, unit), float(y[0]))
    return None


def absolutely_stable(loop: Loop, low: float, high: float, room: float) -> Array | None:
    """The form of a basin within `room` of a rest, if V exists for all chords in [low, high].

    Parameters
    ----------
    loop
        The linear part.
    low, high
        Slopes of the sector.
    room
        Distance of y from its rest up to which they hold; infinity for everywhere.
    """
    K, kappa = loop.A - low * np.outer(loop.b, loop.c), high - low
    unit = balance(K)
    D, b, c = K * unit[None, :] / unit[:, None], loop.b / unit, loop.c * unit
    kappa = max(kappa, 1e-6 * max(abs(low), abs(high), 1.0))
    for q in _multipliers(D, b, c, kappa):
        P = _lyapunov(D, b, c, kappa, q)
        if P is None:
            continue
        lower = P + min(q, 0.0) * kappa * np.outer(c, c)
        if not np.isfinite(room):
            return np.zeros_like(P)
        upper = P + max(q, 0.0) * kappa * np.outer(c, c)
        reach = float(c @ np.linalg.solve(lower, c))
        return np.asarray(upper * (reach / room**2) / np.outer(unit, unit))
    return None


def _multipliers(D: Array, b: Array, c: Array, kappa: float) -> Array:
    """A few q for which Popov's inequality holds at samples of ω, the best first."""
    size = float(np.abs(np.linalg.eigvals(D)).max())
    roots = np.concatenate(
        [np.linalg.eigvals(D - part * kappa * np.outer(b, c)) for part in np.linspace(0, 1, 5)]
    )
    around = roots.imag[:, None] + roots.real[:, None] * np.linspace(-6.0, 6.0, 25)
    w = np.abs(np.concatenate((around.ravel(), np.linspace(0.0, 3.0 * size, 200))))
    G = np.linalg.solve(1j * w[:, None, None] * np.eye(b.size) - D, b[:, None])[..., 0] @ c
    q = POPOV / size
    margin = np.min(G.real + q[:, None] * (1j * w * G).real + 1.0 / kappa, axis=1)
    merit = np.where(margin > 0.0, margin / (1.0 + np.abs(q)), -np.inf)
    best = np.argsort(-merit, kind="stable")[:3]
    return np.asarray(q[best[np.isfinite(merit[best])]])


def _lyapunov(D: Array, b: Array, c: Array, kappa: float, q: float) -> Array | None:
    """P for which V falls, or None."""
    from scipy.linalg import solve_continuous_are

    w, gamma = c + q * (c @ D), 2.0 / kappa + 2.0 * q * float(c @ b)
    if not gamma > 0.0:
        return None
    for slack in SLACKS * float(np.abs(D).max()):
        try:
            P = solve_continuous_are(
                D, b[:, None], slack * np.eye(b.size), np.array([[-gamma]]), s=-w[:, None]
            )
        except (np.linalg.LinAlgError, ValueError):
            continue
        P = 0.5 * (P + P.T)
        falls = np.block([[D.T @ P + P @ D, (w - P @ b)[:, None]], [(w - P @ b)[None], -gamma]])
        lower = P + min(q, 0.0) * kappa * np.outer(c, c)
        if _definite(-falls) and _definite(lower):
            return np.asarray(P)
    return None


def _definite(M: Array) -> bool:
    """Whether a symmetric matrix is positive definite beyond its round-off."""
    diagonal = np.diag(M)
    if not np.all(diagonal > 0.0):
        return False
    size = np.sqrt(diagonal)
    return bool(np.linalg.eigvalsh(M / np.outer(size, size)).min() > DEFINITE)
