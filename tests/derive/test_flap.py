"""A third degree of freedom as data: the flap's matrices are Theodorsen's, its module runs.

Theodorsen's constants T1 to T13 as in NACA Report 496 (1935); matrices as in Conner, Tang, Dowell
& Virgin, J. Fluids and Structures 11 (1997). The derivation gets most of them from one mode shape.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy as sp

from derive import symbols as s
from derive.equations import SecondOrder, second_order
from derive.flap import C_HINGE, FLAP, SECTION_WITH_FLAP
from derive.modules import section_module
from derive.proofs import emitted
from derive.proofs import flap as flap_proofs
from derive.proofs.flap import theodorsen_constants
from derive.proofs.same import ProofError
from derive.thin_airfoil import Shape, generalised_forces, pairing

PLACES = [(-0.5, 0.5), (-0.4, 0.3), (0.2, -0.1)]


@cache
def equations() -> SecondOrder:
    return second_order(SECTION_WITH_FLAP)


@cache
def air() -> Any:
    shapes = tuple(coordinate.shape for coordinate in SECTION_WITH_FLAP.coordinates)
    return generalised_forces(shapes)


def constants(a: float, c: float) -> dict[int, float]:
    root, arc = np.sqrt(1 - c * c), np.arccos(c)
    T = {
        1: -root * (2 + c * c) / 3 + c * arc,
        3: -(1 / 8 + c * c) * arc**2
        + c * root * arc * (7 + 2 * c * c) / 4
        - root**2 * (5 * c * c + 4) / 8,
        4: -arc + c * root,
        5: -(root**2) - arc**2 + 2 * c * root * arc,
        7: -(1 / 8 + c * c) * arc + c * root * (7 + 2 * c * c) / 8,
        8: -root * (2 * c * c + 1) / 3 + c * arc,
        10: root + arc,
        11: arc * (1 - 2 * c) + root * (2 - c),
        12: root * (2 + c) - arc * (2 * c + 1),
    }
    T[9] = (root**3 / 3 + a * T[4]) / 2
    T[13] = -(T[7] + (c - a) * T[1]) / 2
    return T


@pytest.mark.parametrize(("a", "c"), PLACES)
def test_loads_are_theodorsens(a: float, c: float) -> None:
    T, pi = constants(a, c), np.pi

    def numbers(matrix: sp.Matrix) -> np.ndarray:
        return np.array(matrix.subs({s.A_H: a, C_HINGE: c}).evalf(), dtype=float)

    mass = [
        [pi, -pi * a, -T[1]],
        [-pi * a, pi * (1 / 8 + a * a), 2 * T[13]],
        [-T[1], 2 * T[13], -T[3] / pi],
    ]
    damping = [
        [0, pi, -T[4]],
        [0, pi * (0.5 - a), T[1] - T[8] - (c - a) * T[4] + T[11] / 2],
        [0, -2 * T[9] - T[1] + T[4] * (a - 0.5), -T[4] * T[11] / (2 * pi)],
    ]
    stiffness = [[0, 0, 0], [0, 0, T[4] + T[10]], [0, 0, (T[5] - T[4] * T[10]) / pi]]
    np.testing.assert_allclose(numbers(air().mass), mass, atol=1e-14)
    np.testing.assert_allclose(numbers(air().damping), damping, atol=1e-14)
    np.testing.assert_allclose(numbers(air().stiffness), stiffness, atol=1e-14)
    lag = [[2 * pi], [-2 * pi * (a + 0.5)], [T[12]]]
    np.testing.assert_allclose(numbers(air().lag), lag, atol=1e-14)
    np.testing.assert_allclose(numbers(air().w_q), [[0, 1, T[10] / pi]], atol=1e-14)
    np.testing.assert_allclose(numbers(air().w_v), [[1, 0.5 - a, T[11] / (2 * pi)]], atol=1e-14)


@pytest.mark.parametrize("c", [-0.1, 0.3, 0.7])
def test_looked_up_constants_are_sums_of_the_series(c: float) -> None:
    """T5, T2 and T3 are sums over the potential's sine series, whose tails fall as n^-3 to n^-5."""
    top = np.arccos(c)
    n = np.arange(1, 200_001)

    def sine_coefficients(offset: int) -> np.ndarray:
        """Integrals of sin(m theta) sin(theta) times 1 or (cos(theta) - c) up to the hinge."""

        def cosine(k: np.ndarray) -> np.ndarray:
            return np.where(k == 0, top, np.sin(k * top) / np.where(k == 0, 1, k))

        plain = (cosine(n - 1) - cosine(n + 1)) / 2
        if offset == 0:
            return plain
        lower = (cosine(n - 2) - cosine(n)) / 2
        upper = (cosine(n) - cosine(n + 2)) / 2
        return (lower + upper) / 2 - c * plain

    step, ramp = sine_coefficients(0), sine_coefficients(1)
    T2, T3, T5 = (float(value) for value in theodorsen_constants(sp.Float(c)))
    for left, right, T in ((step, step, T5), (step, ramp, T2), (ramp, ramp, T3)):
        series = np.sum(2 / (np.pi * n) * left * right)
        assert abs(series + T / (2 * np.pi)) < 1e-10


def test_reciprocity() -> None:
    """A hinge at the leading edge makes the flap the whole chord, turned about its nose."""
    flap = Shape(s.X - C_HINGE, start=C_HINGE)
    whole = Shape(s.X + 1)
    heave = Shape(sp.Integer(1))
    one_way = pairing(heave, flap).subs(C_HINGE, -1)
    assert sp.simplify(one_way - pairing(heave, whole)) == 0
    assert sp.simplify(pairing(flap, heave) - pairing(heave, flap)) == 0
    both_ways = pairing(flap, flap).subs(C_HINGE, -1)
    assert sp.simplify(both_ways - pairing(whole, whole)) == 0
    with pytest.raises(NotImplementedError, match="two corners"):
        pairing(flap, Shape(s.X - 1, start=sp.Rational(9, 10)))


def test_section_is_the_corner_of_the_flapped_one() -> None:
    from derive.configuration import TYPICAL_SECTION

    section = second_order(TYPICAL_SECTION)
    for name in ("structural_mass", "apparent_mass", "C0", "C1"):
        corner = getattr(equations(), name)[:2, :2]
        assert sp.simplify(corner - getattr(section, name)) == sp.zeros(2, 2), name


def test_module_of_the_flapped_section_runs() -> None:
    """Emitted by the same templates, nine states for three lag terms, against the symbols."""
    source = section_module(SECTION_WITH_FLAP, equations())
    assert max(map(len, source.splitlines())) <= 100
    emitted.check_section(source, SECTION_WITH_FLAP, equations())
    module = emitted.load("flap", source)
    assert module.COORDINATES == ("xi", "alpha", "beta")
    assert module.NONLINEAR == 2


def test_locked_flap_flutters_as_the_section_does() -> None:
    """A hinge a thousand times stiffer than the pitch spring: flutter speed within 1e-5."""
    from scipy.optimize import brentq

    module = emitted.load("flap", section_module(SECTION_WITH_FLAP, equations()))
    par = {
        "mu": 100.0,
        "a_h": -0.5,
        "x_alpha": 0.25,
        "r_alpha": 0.5,
        "omega_bar": 0.2,
        "zeta_alpha": 0.0,
        "zeta_xi": 0.0,
        "c_h": 0.6,
        "x_beta": 0.0025,
        "r_beta": 0.05,
        "omega_beta_bar": 300.0,
        "zeta_beta": 0.0,
    }
    lags = {"a": [0.165, 0.335], "b": [0.0455, 0.3]}

    def growth(U: float) -> float:
        coefficients = module.characteristic_coefficients(**par, **lags, speed=U, stiffness=1.0)
        roots = np.roots(coefficients)
        slow = roots[(np.abs(roots) < 2.0) & (np.abs(roots.imag) > 1e-6)]
        return float(slow.real.max())

    assert abs(brentq(growth, 5.0, 7.0) - 6.28509) < 1e-4


def _double_exponential(low: Any, high: Any) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights on (low, high) that take an integrable singularity at either end."""
    t = np.linspace(-3.4, 3.4, 161)
    x = np.tanh(np.pi / 2 * np.sinh(t))
    weight = np.pi / 2 * np.cosh(t) / np.cosh(np.pi / 2 * np.sinh(t)) ** 2 * (t[1] - t[0])
    low, high = np.asarray(low)[..., None], np.asarray(high)[..., None]
    return (low + high) / 2 + (high - low) / 2 * x, (high - low) / 2 * weight


@pytest.mark.parametrize("c", [-0.9, -0.4, 0.0, 0.35, 0.5, 0.8, 0.95])
def test_corner_pairings_by_quadrature(c: float) -> None:
    """The double integral with its logarithm, over flaps of any size: T5, T2 and T3 to 1e-12."""
    top = np.arccos(c)
    here, outer = _double_exponential(0.0, top)
    total = {}
    for low, high in ((np.zeros_like(here), here), (here, np.full_like(here, top))):
        there, inner = _double_exponential(low, high)
        ends = (np.abs(np.sin((here[:, None] + sign * there) / 2)) for sign in (1, -1))
        up, down = (np.maximum(end, 1e-300) for end in ends)  # nodes may round to an end
        kernel = np.log(up / down) / np.pi
        weight = outer[:, None] * inner * np.sin(here)[:, None] * np.sin(there) * kernel
        for name, left, right in (
            ("step on step", 1.0, 1.0),
            ("step on ramp", 1.0, np.cos(there) - c),
            ("ramp on ramp", np.cos(here)[:, None] - c, np.cos(there) - c),
        ):
            total[name] = total.get(name, 0.0) + float(np.sum(weight * left * right))
    ramp = FLAP.shape
    step = ramp.slope()
    for name, pair in (
        ("step on step", (step, step)),
        ("step on ramp", (step, ramp)),
        ("ramp on ramp", (ramp, ramp)),
    ):
        derived = float(pairing(*pair).subs(C_HINGE, sp.Float(c, 30)))
        assert abs(total[name] - derived) < 1e-12, name


@pytest.mark.parametrize("c", [-0.9, 0.0, 0.5, 0.95])
def test_loads_on_whole_chord_shapes_by_quadrature(c: float) -> None:
    """What a flap does to heave and pitch: single integrals of their smooth potentials."""
    a = -0.3
    theta, weight = _double_exponential(0.0, np.arccos(c))
    x, root = np.cos(theta), np.sin(theta)
    # potentials over V b of the downwashes 1 and x - a on the whole chord (Theodorsen 1935)
    heave, pitch = root, root * (x / 2 - a)
    values = air().mass.subs({s.A_H: a, C_HINGE: sp.Float(c, 30)}).evalf(20)
    for row, potential in enumerate((heave, pitch)):
        direct = 2 * np.sum(weight * root * (x - c) * potential)
        assert abs(float(values[row, 2]) - direct) < 1e-12
        assert abs(float(values[2, row]) - direct) < 1e-12
    rear = np.sum(weight * (1 + x) * (x - c)) / np.pi
    assert abs(float(air().w_v.subs(C_HINGE, sp.Float(c, 30))[0, 2]) - rear) < 1e-12


KINETIC = SECTION_WITH_FLAP.kinetic
_RATES = [coordinate.displacement.diff() for coordinate in SECTION_WITH_FLAP.coordinates]


@pytest.mark.parametrize("pair", [(0, 1), (0, 2), (1, 2), (2, 2)])
def test_wrong_coupling_is_noticed(pair: tuple[int, int], monkeypatch: pytest.MonkeyPatch) -> None:
    """Every term of the kinetic energy, doubled, the static moment of the flap among them."""
    product = _RATES[pair[0]] * _RATES[pair[1]]
    coefficient = sp.expand(KINETIC).coeff(product)
    assert coefficient != 0
    wrong = replace(SECTION_WITH_FLAP, kinetic=KINETIC + coefficient * product)
    monkeypatch.setattr(flap_proofs, "SECTION_WITH_FLAP", wrong)
    with pytest.raises(ProofError, match="kinetic energy"):
        flap_proofs.inertia()


def test_inertia_of_two_plates() -> None:
    """Emitted mass matrix against integrals over a wing and a flap of given mass per length."""
    module = emitted.load("flap", section_module(SECTION_WITH_FLAP, equations(), laplace=False))
    a, c, supports = -0.3, 0.4, 0.7
    x, weight = np.polynomial.legendre.leggauss(20)
    wing, flap = (-1 + (c + 1) * (x + 1) / 2), (c + (1 - c) * (x + 1) / 2)
    places = np.concatenate([wing, flap])
    masses = np.concatenate([3.0 * weight * (c + 1) / 2, 1.1 * weight * (1 - c) / 2])
    shapes = np.array([np.ones(40), places - a, np.where(places > c, places - c, 0.0)])
    whole = masses.sum()
    energy = (shapes * masses) @ shapes.T / whole
    found = module.structural_mass(
        a_h=a,
        x_alpha=energy[0, 1],
        r_alpha=np.sqrt(energy[1, 1]),
        c_h=c,
        x_beta=energy[0, 2],
        r_beta=np.sqrt(energy[2, 2]),
        heave_mass=1.0 + supports,
    )
    energy[0, 0] += supports
    scales = np.array([1.0, energy[1, 1], energy[2, 2]])
    np.testing.assert_allclose(found * scales[:, None], energy, rtol=1e-13)
