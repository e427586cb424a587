"""Sections with a trailing-edge flap, fed by hand: the wing of Conner et al. and longer ones.

Conner, Tang, Dowell & Virgin, *J. Fluids Struct.* 11 (1997), Table A.1; the unsteady terms are
Theodorsen's (NACA TR 496) with Jones's two exponentials in place of his C(k). Time is in seconds
and speed in m/s: the analyses do not ask.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigh

from aeroflutter.model.lure import LureSystem

Array = NDArray[np.float64]

B, A_H, HINGE, RHO = 0.127, -0.5, 0.5, 1.225
MASS = 1.558 + 2 * 0.47485 / 0.52
S_ALPHA, S_BETA, I_ALPHA, I_BETA = 0.08587, 0.00395, 0.01347, 0.0003264
K_H, K_ALPHA, K_BETA = 2818.8, 37.3, 3.9
DAMPING = (0.0113, 0.01626, 0.0115)  # of the coupled modes, by ascending frequency
JONES_A, JONES_B = np.array([0.165, 0.335]), np.array([0.0455, 0.3])


def theodorsen(c: float, a: float) -> dict[int, float]:
    """Theodorsen's T-functions that the forces need, hinge at c."""
    root, angle = np.sqrt(1 - c * c), np.arccos(c)
    T = {
        1: -root * (2 + c * c) / 3 + c * angle,
        3: -(1 / 8 + c * c) * angle**2
        + c * root * angle * (7 + 2 * c * c) / 4
        - (1 - c * c) * (5 * c * c + 4) / 8,
        4: -angle + c * root,
        5: -(1 - c * c) - angle**2 + 2 * c * root * angle,
        7: -(1 / 8 + c * c) * angle + c * root * (7 + 2 * c * c) / 8,
        8: -root * (2 * c * c + 1) / 3 + c * angle,
        10: root + angle,
        11: angle * (1 - 2 * c) + root * (2 - c),
        12: root * (2 + c) - angle * (2 * c + 1),
    }
    T[9] = 0.5 * (root**3 / 3 + a * T[4])
    T[13] = 0.5 * (-T[7] - (c - a) * T[1])
    return {i: float(value) for i, value in T.items()}


@dataclass(frozen=True, eq=False)
class Flap:
    """x' = A(V) x - b F(flap angle), A quadratic in the speed V.

    Parameters
    ----------
    extra
        Further structural modes, each of two states, above the flap's own; the lift works on them
        and they move the three-quarter chord.
    """

    extra: int = 0
    search_range: tuple[float, float] = (2.0, 30.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_parts", _parts(self.extra))

    @property
    def order(self) -> int:
        """Number of states: q, q' and two lags."""
        return 2 * (3 + self.extra) + 2

    @property
    def c(self) -> Array:
        """Row that picks the flap's angle."""
        return np.eye(self.order)[2]

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states."""
        return tuple(f"x{i + 1}" for i in range(self.order))

    def at(self, speed: float) -> LureSystem:
        """The system at one speed."""
        A, b = self.stack(speed)
        return LureSystem(A, b, self.c, self.state_names)

    def stack(self, speeds: ArrayLike) -> tuple[Array, Array]:
        """A (…, n, n) and b (…, n)."""
        A0, A1, A2, b = self._parts  # type: ignore[attr-defined]
        V = np.asarray(speeds, dtype=float)[..., None, None]
        return A0 + V * A1 + V * V * A2, np.broadcast_to(b, (*V.shape[:-2], b.size)).copy()

    def derivative(self, speeds: ArrayLike) -> tuple[Array, Array]:
        """Their derivatives with respect to speed."""
        _, A1, A2, b = self._parts  # type: ignore[attr-defined]
        V = np.asarray(speeds, dtype=float)[..., None, None]
        return A1 + 2 * V * A2, np.zeros((*V.shape[:-2], b.size))


def _structure(extra: int) -> tuple[Array, Array, Array]:
    """M, C and K with the flap's spring in K."""
    r = B * (HINGE - A_H)
    M = np.array(
        [
            [MASS, S_ALPHA, S_BETA],
            [S_ALPHA, I_ALPHA, I_BETA + r * S_BETA],
            [S_BETA, I_BETA + r * S_BETA, I_BETA],
        ]
    )
    K = np.diag([K_H, K_ALPHA, K_BETA])
    squares, modes = eigh(K, M)
    # eigenvectors of unit modal mass: C = M Φ diag(2 ζ ω) Φᵀ M
    C = M @ modes @ np.diag(2 * np.array(DAMPING) * np.sqrt(squares)) @ modes.T @ M
    n = 3 + extra
    whole = [np.zeros((n, n)) for _ in range(3)]
    for matrix, part in zip(whole, (M, C, K), strict=True):
        matrix[:3, :3] = part
    for i in range(extra):
        w = 2 * np.pi * 30.0 * (1 + 0.4 * i)
        whole[0][3 + i, 3 + i] = MASS
        whole[1][3 + i, 3 + i] = 2 * 0.02 * w * MASS
        whole[2][3 + i, 3 + i] = w * w * MASS
    return whole[0], whole[1], whole[2]


def _parts(extra: int) -> tuple[Array, Array, Array, Array]:
    """A0, A1, A2 and b."""
    T, a, c, b, rho = theodorsen(HINGE, A_H), A_H, HINGE, B, RHO
    M, C, K = _structure(extra)
    n = len(M)
    heave = np.zeros(n)
    heave[0], heave[3:] = 1.0, [0.3 / (1 + i) for i in range(extra)]
    # non-circulatory forces on (h, alpha, beta): - rho b² (Ma q'' + V Ca q' + V² Ka q)
    Ma = np.pi * np.array([[1.0, -a * b, 0], [-a * b, b * b * (1 / 8 + a * a), 0], [0, 0, 0]])
    Ma[0, 2] = Ma[2, 0] = -T[1] * b
    Ma[1, 2] = Ma[2, 1] = 2 * T[13] * b * b
    Ma[2, 2] = -T[3] * b * b / np.pi
    Ca = np.zeros((3, 3))
    Ca[0] = 0, np.pi, -T[4]
    Ca[1] = 0, np.pi * (0.5 - a) * b, (T[1] - T[8] - (c - a) * T[4] + T[11] / 2) * b
    Ca[2] = 0, (-2 * T[9] - T[1] + T[4] * (a - 0.5)) * b, -T[4] * T[11] * b / (2 * np.pi)
    Ka = np.zeros((3, 3))
    Ka[1, 2], Ka[2, 2] = T[4] + T[10], (T[5] - T[4] * T[10]) / np.pi
    spread = np.zeros((3, n))
    spread[0], spread[1, 1], spread[2, 2] = heave, 1.0, 1.0
    # three-quarter-chord downwash w = V p q + r q' and the generalised force of its lift
    p = np.array([0.0, 1.0, T[10] / np.pi]) @ spread
    r = np.array([1.0, b * (0.5 - a), b * T[11] / (2 * np.pi)]) @ spread
    g = rho * b * np.array([-2 * np.pi, 2 * np.pi * b * (a + 0.5), -b * T[12]]) @ spread
    mass = M + rho * b * b * spread.T @ Ma @ spread
    left = np.linalg.inv(mass)
    direct = 1.0 - JONES_A.sum()
    stiff = K.copy()
    stiff[2, 2] = 0.0  # the flap's spring is the feedback
    size = 2 * n + 2
    A0, A1, A2 = (np.zeros((size, size)) for _ in range(3))
    q, v, z = slice(0, n), slice(n, 2 * n), slice(2 * n, size)
    A0[q, v] = np.eye(n)
    A0[v, q], A0[v, v] = -left @ stiff, -left @ C
    A1[v, v] = left @ (-rho * b * b * spread.T @ Ca @ spread + direct * np.outer(g, r))
    A2[v, q] = left @ (-rho * b * b * spread.T @ Ka @ spread + direct * np.outer(g, p))
    # z' = -(V/b) b_i z + w V/b  (z in m/s), W = direct w + Σ a_i b_i z_i
    A2[v, z] = 0.0
    A1[v, z] = np.outer(left @ g, JONES_A * JONES_B)
    A1[z, z] = -np.diag(JONES_B) / b
    A1[z, v] = np.outer(np.ones(2), r) / b
    A2[z, q] = np.outer(np.ones(2), p) / b
    feedback = np.zeros(size)
    feedback[v] = left[:, 2] * K_BETA
    return A0, A1, A2, feedback
