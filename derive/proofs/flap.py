"""Proofs about the flap: Theodorsen's functions, the loads, the inertia, and a locked hinge."""

from __future__ import annotations

from functools import cache

import sympy as sp

from derive import symbols as s
from derive.configuration import TYPICAL_SECTION
from derive.equations import SecondOrder, lagrange, second_order
from derive.flap import C_HINGE, FLAP, I_BETA, S_BETA, SECTION_WITH_FLAP
from derive.proofs.same import Proof, check_same
from derive.thin_airfoil import ThinAirfoilForces, corner_potential, generalised_forces, pairing


def theodorsen_constants(c: sp.Expr) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Theodorsen's T2, T3 and T5 for a hinge at c, as NACA Report 496 prints them."""
    root, arc = sp.sqrt(1 - c**2), sp.acos(c)
    T2 = c * root**2 - root * (1 + c**2) * arc + c * arc**2
    T3 = (
        -(c**2 + sp.Rational(1, 8)) * arc**2
        + c * root * arc * (7 + 2 * c**2) / 4
        - root**2 * (5 * c**2 + 4) / 8
    )
    T5 = -(root**2) - arc**2 + 2 * c * root * arc
    return T2, T3, T5


def _constants(a: sp.Expr, c: sp.Expr) -> dict[int, sp.Expr]:
    """Theodorsen's constants T1 to T13 as the report prints them."""
    root, arc = sp.sqrt(1 - c**2), sp.acos(c)
    third, eighth = sp.Rational(1, 3), sp.Rational(1, 8)
    T = {
        1: -third * root * (2 + c**2) + c * arc,
        4: -arc + c * root,
        7: -(eighth + c**2) * arc + eighth * c * root * (7 + 2 * c**2),
        8: -third * root * (2 * c**2 + 1) + c * arc,
        10: root + arc,
        11: arc * (1 - 2 * c) + root * (2 - c),
        12: root * (2 + c) - arc * (2 * c + 1),
    }
    T[2], T[3], T[5] = theodorsen_constants(c)
    T[9] = (third * root**3 + a * T[4]) / 2
    T[13] = -(T[7] + (c - a) * T[1]) / 2
    return T


@cache
def _air() -> ThinAirfoilForces:
    shapes = tuple(coordinate.shape for coordinate in SECTION_WITH_FLAP.coordinates)
    return generalised_forces(shapes)


@cache
def _equations() -> SecondOrder:
    return second_order(SECTION_WITH_FLAP)


def logarithm() -> None:
    """Differentiate the kernel; put the corner and the trailing edge into what is left by parts."""
    here, there = sp.symbols("theta theta_1", real=True)
    kernel = sp.log(sp.sin((here + there) / 2)) - sp.log(sp.sin((here - there) / 2))
    slope = sp.sin(here) / (sp.cos(there) - sp.cos(here))
    t, u = sp.symbols("t u", positive=True)  # tangents of the halves of the two angles

    def rational(expression: sp.Expr) -> sp.Expr:
        halves = {here: 2 * sp.atan(t), there: 2 * sp.atan(u)}
        return sp.cancel(sp.expand_trig(sp.expand_trig(expression.subs(halves))).rewrite(sp.Pow))

    check_same("slope of the kernel", sp.simplify(rational(kernel.diff(there) - slope)), 0)
    check_same("kernel at the trailing edge", sp.expand_log(kernel.subs(there, 0)), 0)
    # what multiplies the logarithm vanishes with the distance from the corner
    x, c = sp.symbols("x c", positive=True)
    check_same("strip at the corner", sp.limit((x - c) * sp.log(x - c), x, c, "+"), 0)


def corner_integrals() -> None:
    """Differentiate the pairings of ramp and step by the place of the hinge."""
    ramp = FLAP.shape
    step = ramp.slope()
    T2, T3, T5 = theodorsen_constants(C_HINGE)
    pairs = ((step, step, T5), (step, ramp, T2), (ramp, ramp, T3))
    found = []
    for left, right, T in pairs:
        found.append(pairing(left, right))
        check_same("sum of the series", found[-1], -T / (2 * sp.pi))
    step_step, step_ramp, ramp_ramp = found
    at_hinge = [corner_potential(shape.polynomial, sp.acos(C_HINGE)) for shape in (step, ramp)]
    check_same("step on step", step_step.diff(C_HINGE), -2 * at_hinge[0])
    check_same("step on ramp", step_ramp.diff(C_HINGE), -at_hinge[1] - step_step)
    check_same("ramp on ramp", ramp_ramp.diff(C_HINGE), -2 * step_ramp)
    for value in found:
        check_same("hinge at the trailing edge", value.subs(C_HINGE, 1), 0)


def flap_loads() -> None:
    """Compare with the matrices of T functions in Conner et al. (1997), after NACA Report 496."""
    a, c, pi = s.A_H, C_HINGE, sp.pi
    T = _constants(a, c)
    half, eighth = sp.Rational(1, 2), sp.Rational(1, 8)
    mass = [
        [pi, -pi * a, -T[1]],
        [-pi * a, pi * (eighth + a**2), 2 * T[13]],
        [-T[1], 2 * T[13], -T[3] / pi],
    ]
    damping = [
        [0, pi, -T[4]],
        [0, pi * (half - a), T[1] - T[8] - (c - a) * T[4] + T[11] / 2],
        [0, -2 * T[9] - T[1] + T[4] * (a - half), -T[4] * T[11] / (2 * pi)],
    ]
    stiffness = [[0, 0, 0], [0, 0, T[4] + T[10]], [0, 0, (T[5] - T[4] * T[10]) / pi]]
    check_same("apparent mass", _air().mass, sp.Matrix(mass))
    check_same("damping of the air", _air().damping, sp.Matrix(damping))
    check_same("stiffness of the air", _air().stiffness, sp.Matrix(stiffness))
    check_same("lag", _air().lag, sp.Matrix([2 * pi, -2 * pi * (a + half), T[12]]))
    check_same("downwash of position", _air().w_q, sp.Matrix([[0, 1, T[10] / pi]]))
    rates = sp.Matrix([[1, half - a, T[11] / (2 * pi)]])
    check_same("downwash of rates", _air().w_v, rates)


def inertia() -> None:
    """Compare the kinetic energy with that of masses at two places ahead of the hinge, two behind.

    Every mass moves as the mode shapes say; supports move in heave alone.
    """
    masses = sp.symbols("m_1:5", positive=True)
    places = sp.symbols("x_1:5", real=True)
    behind = (False, False, True, True)
    b, supports = s.SEMICHORD, sp.Symbol("m_s", positive=True)
    heave, pitch, flap = (item.displacement for item in SECTION_WITH_FLAP.coordinates)
    energy = supports * heave.diff() ** 2 / 2
    for m, x, on_flap in zip(masses, places, behind, strict=True):
        shapes = [item.shape for item in SECTION_WITH_FLAP.coordinates]
        motions = [heave.diff() / b, pitch.diff(), flap.diff() if on_flap else sp.Integer(0)]
        rate = sum(z.polynomial.subs(s.X, x) * q for z, q in zip(shapes, motions, strict=True))
        energy += m * (b * rate) ** 2 / 2

    def moment(power: int, about: sp.Expr, only_flap: bool) -> sp.Expr:
        items = zip(masses, places, behind, strict=True)
        return sum(m * (b * (x - about)) ** power for m, x, on in items if on or not only_flap)

    values = {
        s.MASS_IN_HEAVE: supports + sum(masses),
        s.STATIC_MOMENT: moment(1, s.A_H, only_flap=False),
        s.INERTIA: moment(2, s.A_H, only_flap=False),
        S_BETA: moment(1, C_HINGE, only_flap=True),
        I_BETA: moment(2, C_HINGE, only_flap=True),
    }
    check_same("kinetic energy", SECTION_WITH_FLAP.kinetic.subs(values), energy)


def locked_flap() -> None:
    """Take the flap's row and column away; every coordinate's own scale stays as it was."""
    section = second_order(TYPICAL_SECTION)
    for name, matrix in vars(section).items():
        rows, columns = matrix.shape
        check_same(name, getattr(_equations(), name)[:rows, :columns], matrix)
    rows = zip(lagrange(SECTION_WITH_FLAP), lagrange(TYPICAL_SECTION), strict=False)
    for with_flap, without in rows:
        check_same("Lagrange's equation", with_flap.subs(FLAP.displacement, 0).doit(), without)


def symmetry() -> None:
    """Put every row back into units of energy: mass and springs are symmetric, in air and out."""
    eq = _equations()
    scales = [item.scale for item in SECTION_WITH_FLAP.coordinates]
    units = sp.diag(*(scale / scales[0] for scale in scales))
    for name in ("structural_mass", "apparent_mass", "S"):
        matrix = units * getattr(eq, name)
        check_same(f"symmetry of {name}", matrix, matrix.T)


PROOFS = (
    Proof(
        "corner potential",
        r"By parts, the potential at a corner is elementary: "
        r"$\partial L/\partial\theta' = \sin\theta/(\cos\theta' - \cos\theta)$.",
        logarithm,
    ),
    Proof(
        "corner integrals",
        "Pairings of shapes with a corner sum up the potentials at the corner; they are "
        "Theodorsen's $T_2$, $T_3$ and $T_5$.",
        corner_integrals,
    ),
    Proof(
        "flap loads",
        "The loads of the flap are Theodorsen's, with his $T_1$ to $T_{13}$.",
        flap_loads,
    ),
    Proof(
        "flap inertia",
        "The kinetic energy is that of any masses that move as the mode shapes say.",
        inertia,
    ),
    Proof(
        "locked flap",
        "With the flap locked every matrix is the one of the section in pitch and heave.",
        locked_flap,
    ),
    Proof(
        "symmetry",
        "Mass and springs are symmetric once every row is put back into units of energy.",
        symmetry,
    ),
)
