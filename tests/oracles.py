"""Independent ways to the same answers: written from the equations, using none of the package.

Each function follows the equations of motion as the literature prints them, so that a mistake in
the derivation and one here would have to be the same mistake.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
import scipy.optimize


def impedance(section, a, b, speed, stiffness, p):
    """B(p) of thesis eq. 3.10 with the Laplace lift and moment of eqs. 3.21-3.22, row by row."""
    mu, a_h, x, r2 = section.mu, section.a_h, section.x_alpha, section.r_alpha**2
    ratio = section.omega_bar / speed
    phi = 1 - sum(ai * p / (p + bi) for ai, bi in zip(a, b, strict=True))
    downwash = np.array([p, 1 + (0.5 - a_h) * p])
    lift = np.pi * np.array([p**2, -a_h * p**2 + p]) + 2 * np.pi * phi * downwash
    moment = np.pi * (0.5 + a_h) * phi * downwash + 0.5 * np.pi * np.array(
        [a_h * p**2, -(a_h**2) * p**2 - (0.5 - a_h) * p - p**2 / 8]
    )
    structure = np.array(
        [
            [p**2 + 2 * section.zeta_xi * ratio * p + ratio**2, x * p**2],
            [x / r2 * p**2, p**2 + 2 * section.zeta_alpha / speed * p + stiffness / speed**2],
        ]
    )
    return structure + np.array([lift / (np.pi * mu), -2 * moment / (np.pi * mu * r2)])


def determinant_root(section, a, b, speed, stiffness, guess, steps=60):
    """A root of det B(p) by Newton's method in the complex plane, derivative by central step.

    The poles of det B at -b_i are cleared first: a root may lie next to one.
    """
    p = complex(guess)

    def value(q):
        poles = np.prod([q + bi for bi in b])
        return poles * np.linalg.det(impedance(section, a, b, speed, stiffness, q))

    for _ in range(steps):
        h = 1e-6 * max(abs(p), 1e-3)
        change = value(p) * 2 * h / (value(p + h) - value(p - h))
        p -= change
        if abs(change) < 1e-15 * abs(p):
            break
    return p


def crossings_by_kronecker(family, stiffness, low, high):
    """Every (speed, k) at which a pair of roots is purely imaginary, by linear algebra alone.

    Two roots of A(U) - N b c sum to zero exactly where the Kronecker sum of the matrix with itself
    is singular. It is quadratic in U, so all such speeds are generalised eigenvalues.
    """
    A0, A1, A2, b2, c = family.terms
    eye = np.eye(c.size)
    K0, K1, K2 = (
        np.kron(term, eye) + np.kron(eye, term)
        for term in (A0, A1, A2 - stiffness * np.outer(b2, c))
    )
    m = K0.shape[0]
    zero, one = np.zeros((m, m)), np.eye(m)
    left, right = np.block([[zero, one], [-K2, -K1]]), np.block([[one, zero], [zero, K0]])
    speeds = scipy.linalg.eigvals(left, right)
    real = np.isfinite(speeds) & (np.abs(speeds.imag) < 1e-4 * np.abs(speeds))
    found: list[tuple[float, float]] = []
    for speed in np.sort(speeds[real].real):
        if not low < speed < high:
            continue
        roots = np.linalg.eigvals(family.at(float(speed)).closed(stiffness))
        size = np.abs(roots).max()
        oscillatory = roots[roots.imag > 1e-5 * size]
        if oscillatory.size == 0:
            continue
        root = oscillatory[np.argmin(np.abs(oscillatory.real))]
        if abs(root.real) < 1e-5 * size and not any(
            abs(speed - s) < 1e-5 * s and abs(root.imag - k) < 1e-4 * k for s, k in found
        ):
            found.append((float(speed), float(root.imag)))
    return found


def loop_stiffness(amplitude, delta_v, delta_h):
    """N of a hysteresis loop about zero: the thesis's formula, Jenkins' loop below it."""

    def saturation(g):
        g = np.clip(g, -1.0, 1.0)
        return 2 / np.pi * (np.arcsin(g) + g * np.sqrt(1 - g**2))

    friction, gap = delta_v / 2, min(delta_h / 2, amplitude - delta_v / 2)
    if gap <= 0:
        return complex(1.0)
    parallel = 0.5 * (
        2 - saturation((friction + gap) / amplitude) + saturation((friction - gap) / amplitude)
    )
    return complex(parallel, 4 * friction * gap / (np.pi * amplitude**2))


def describing_cycle(section, a, b, delta_v, delta_h, amplitude, guess):
    """(speed, k) of the cycle of one amplitude: det B(jk) = 0, real and imaginary part."""
    stiffness = loop_stiffness(amplitude, delta_v, delta_h)

    def residual(unknown):
        value = np.linalg.det(impedance(section, a, b, unknown[0], stiffness, 1j * unknown[1]))
        return [value.real, value.imag]

    found, _, status, message = scipy.optimize.fsolve(residual, guess, xtol=1e-13, full_output=True)
    assert status == 1 or max(map(abs, residual(found))) < 1e-12, message
    return found


def lowest_speeds(section, a, b, delta_v, delta_h, guess, top, count=400):
    """Every local minimum (speed, amplitude) of speed over amplitude, from the smallest loop up."""
    # Fine near the smallest loop, where the speed falls fast.
    amplitudes = delta_v / 2 * (1 + np.geomspace(1e-6, 2 * top / delta_v, count))
    cycles = [np.asarray(guess, dtype=float)]
    for amplitude in amplitudes:
        cycles.append(describing_cycle(section, a, b, delta_v, delta_h, amplitude, cycles[-1]))
    speeds = np.array(cycles[1:])[:, 0]
    found = []
    for i in 1 + np.flatnonzero((speeds[1:-1] < speeds[:-2]) & (speeds[1:-1] < speeds[2:])):
        near = cycles[i + 1]
        best = scipy.optimize.minimize_scalar(
            lambda size, near=near: describing_cycle(section, a, b, delta_v, delta_h, size, near)[
                0
            ],
            bounds=(amplitudes[i - 1], amplitudes[i + 1]),
            method="bounded",
            options={"xatol": 1e-9},
        )
        found.append((best.fun, best.x))
    return np.array(found)
