"""Systems with several springs, and the section with springs in chosen coordinates."""

from __future__ import annotations

import math
from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import impedance

from aeroflutter.errors import InputError
from aeroflutter.model.aerodynamics import QuasiSteady, Wagner
from aeroflutter.model.family import FixedModel, SampledModel, SectionModel
from aeroflutter.model.lure import (
    FixedFamily,
    LureSystem,
    SectionFamily,
    SpringFamily,
    as_family,
    as_system,
)
from aeroflutter.model.section import Scale, TypicalSection
from aeroflutter.model.system import System, inverse_transfer_gradient

SECTION = TypicalSection(
    mu=20.0, a_h=-0.4, x_alpha=0.2, r_alpha=0.55, omega_bar=0.7, zeta_alpha=0.01, zeta_xi=0.02
)
AIRS = [Wagner(), Wagner(a=(), b=()), QuasiSteady()]
S = np.array([0.1 + 0.4j, -0.05 + 0.2j, 0.3])


def random_system(seed: int, n: int = 5, m: int = 3) -> System:
    rng = np.random.default_rng(seed)
    return System(rng.normal(size=(n, n)), rng.normal(size=(n, m)), rng.normal(size=(m, n)))


@pytest.mark.parametrize("m", [1, 2, 3])
def test_transfer_is_python_controls(m):
    system = random_system(m, m=m)
    found = system.transfer(S)
    assert found.shape == (3, m, m)
    for i, s in enumerate(S):
        expected = np.asarray(system.to_control()(s)).reshape(m, m)
        np.testing.assert_allclose(found[i], expected, rtol=1e-9)
    np.testing.assert_allclose(np.linalg.inv(found), system.inverse_transfer(S), rtol=1e-9)


def test_inverse_transfer_at_a_pole_of_the_transfer_function():
    """G = diag(1/s, 1/(s(s + 1))): no number at s = 0, where its inverse is diag(0, 0)."""
    A = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    B, C = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]]), np.eye(3)[:2]
    system = System(A, B, C)
    np.testing.assert_allclose(system.inverse_transfer(0.0), np.zeros((2, 2)), atol=1e-15)
    expected = np.diag([0.3j, 0.3j * (1 + 0.3j)])
    np.testing.assert_allclose(system.inverse_transfer(0.3j), expected, atol=1e-15)


def test_gradient_of_the_inverse_with_outputs_that_depend_on_speed():
    one, two = random_system(1), random_system(2)

    def at(U):
        return System(*(x + U * y for x, y in zip(_matrices(one), _matrices(two), strict=True)))

    U, s, h = 0.3, 0.2 + 0.7j, 1e-6
    value, d_ds, d_dU = inverse_transfer_gradient(*_matrices(at(U)), *_matrices(two), s)
    np.testing.assert_allclose(value, at(U).inverse_transfer(s), rtol=1e-11)
    central = (at(U).inverse_transfer(s + h) - at(U).inverse_transfer(s - h)) / (2 * h)
    np.testing.assert_allclose(d_ds, central, rtol=1e-6, atol=1e-6)
    central = (at(U + h).inverse_transfer(s) - at(U - h).inverse_transfer(s)) / (2 * h)
    np.testing.assert_allclose(d_dU, central, rtol=1e-6, atol=1e-6)


def _matrices(system):
    return system.A, system.B, system.C


def test_springs_that_are_linear_are_absorbed():
    system = replace(random_system(4), d=np.arange(5.0), names=("a", "b", "c"), units=("m",) * 3)
    slopes = np.array([0.5, 2.0, -0.3])
    rest = system.absorb({0: 0.5, 2: -0.3})
    assert rest.names == ("b",)
    assert rest.units == ("m",)
    np.testing.assert_array_equal(rest.load, system.load)
    expected = system.A.copy()
    for i in (0, 2):
        expected -= slopes[i] * np.outer(system.B[:, i], system.C[i])
    np.testing.assert_allclose(rest.A, expected, rtol=1e-14)
    np.testing.assert_allclose(rest.closed([2.0]), system.closed(slopes), rtol=1e-13)
    alone = system.single(1, slopes)
    np.testing.assert_array_equal(alone.A, rest.A)
    np.testing.assert_array_equal(alone.B, system.B[:, 1:2])
    np.testing.assert_array_equal(alone.C, system.C[1:2])


def test_closed_takes_stacks_of_complex_slopes():
    system = random_system(5)
    slopes = np.array([[1.0, 2.0, 3.0], [1.0 + 2.0j, 0.0, 1.0j]])
    found = system.closed(slopes)
    assert found.shape == (2, 5, 5)
    np.testing.assert_allclose(
        found[1], system.A - system.B @ np.diag(slopes[1]) @ system.C, rtol=1e-14
    )


def test_control_and_back():
    system = random_system(6)
    back = System.from_control(system.to_control(), ("a", "b", "c"))
    np.testing.assert_array_equal(back.B, system.B)
    assert back.state_names == system.state_names
    assert back.names == ("a", "b", "c")
    with pytest.raises(InputError, match="as many inputs as outputs"):
        System.from_control(control.ss([[-1.0]], [[1.0, 2.0]], [[1.0]], [[0.0, 0.0]]))
    with pytest.raises(InputError, match="D must be zero"):
        System.from_control(control.ss([[-1.0]], [[1.0]], [[1.0]], [[0.5]]))
    with pytest.raises(InputError, match="continuous time"):
        System.from_control(control.ss([[-0.5]], [[1.0]], [[1.0]], [[0.0]], 0.1))


def test_what_does_not_fit_is_refused():
    A, B, C = np.eye(3), np.ones((3, 2)), np.ones((2, 3))
    for matrices in ((A, B[:2], C), (A, B, C[:1]), (A[:2], B, C), (A, B[:, 0], C[0])):
        with pytest.raises(InputError, match="need shapes"):
            System(*matrices)
    with pytest.raises(InputError, match="need shapes"):
        System(A, B, C, d=np.ones(2))
    with pytest.raises(InputError, match="finite"):
        System(A, B, C, d=np.array([0.0, np.nan, 0.0]))
    for key in ("names", "units", "state_names"):
        with pytest.raises(InputError, match=f"^{key}: need [23] names, got 1"):
            System(A, B, C, **{key: ("a",)})
    system = System(A, B, C)
    assert (system.names, system.units) == (("y1", "y2"), ("rad", "rad"))
    with pytest.raises(ValueError, match="read-only"):
        system.B[0, 0] = 5.0


@pytest.mark.parametrize("air", AIRS)
def test_pitch_alone_is_the_one_spring_family_to_the_last_bit(air):
    speeds = np.array([0.7, 2.0, 5.0])
    family, model = SectionFamily(SECTION, air), SectionModel(SECTION, air, ["pitch"])
    A, B, C, d = model.stack(speeds)
    np.testing.assert_array_equal(A, family.stack(speeds)[0])
    np.testing.assert_array_equal(B[..., 0], family.stack(speeds)[1])
    np.testing.assert_array_equal(C, np.broadcast_to(family.c, (3, 1, family.c.size)))
    assert not d.any()
    np.testing.assert_array_equal(model.at(2.0).A, family.at(2.0).A)
    assert model.state_names == family.state_names
    assert model.search_range == family.search_range


@pytest.mark.parametrize("air", AIRS)
def test_unit_springs_make_the_linear_section_whichever_stand_outside(air):
    speed = 1.7
    whole = SectionModel(SECTION, air, ()).at(speed)
    assert whole.outputs == 0
    for springs in (("pitch",), ("heave",), ("pitch", "heave"), ("heave", "pitch")):
        system = SectionModel(SECTION, air, springs).at(speed)
        assert system.names == springs
        assert system.units == tuple({"pitch": "rad", "heave": "semichord"}[s] for s in springs)
        closed = system.closed(np.ones(len(springs)))
        np.testing.assert_allclose(closed, whole.A, rtol=1e-14, atol=1e-15)
    pair = SectionModel(SECTION, air, ("pitch", "heave")).at(speed)
    alone = SectionModel(SECTION, air, ("pitch",)).at(speed)
    np.testing.assert_allclose(pair.absorb({1: 1.0}).A, alone.A, rtol=1e-14, atol=1e-15)


@given(slope=st.floats(0.05, 3.0), speed=st.floats(0.4, 8.0))
def test_heave_spring_is_the_section_of_another_heave_frequency(slope, speed):
    """omega_bar² carries the stiffness; 2 zeta_xi omega_bar, the damping, has to stay."""
    found = SectionModel(SECTION, Wagner(), ("heave",)).at(speed).closed([slope])
    root = math.sqrt(slope)
    other = replace(SECTION, omega_bar=SECTION.omega_bar * root, zeta_xi=SECTION.zeta_xi / root)
    expected = SectionFamily(other).at(speed).closed(1.0)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-14)


def test_transfer_matrix_is_what_the_laplace_equations_give():
    """Moments of springs push the equations by (omega_bar², 1)/U²; oracle without any spring."""
    air, speed = Wagner(), 1.3
    system = SectionModel(SECTION, air, ("pitch", "heave")).at(speed)
    for p in S:
        bare = impedance(SECTION, air.a, air.b, speed, 0.0, p)
        bare[0, 0] -= SECTION.omega_bar**2 / speed**2
        push = np.diag([SECTION.omega_bar**2, 1.0]) / speed**2
        heave_first = np.linalg.solve(bare, push)
        np.testing.assert_allclose(system.transfer(p), heave_first[::-1, ::-1], rtol=1e-9)


def test_two_springs_in_one_coordinate():
    one = SectionModel(SECTION, springs=("pitch",)).at(2.0)
    two = SectionModel(SECTION, springs=("pitch", "pitch")).at(2.0)
    np.testing.assert_array_equal(two.A, one.A)
    np.testing.assert_allclose(two.closed([0.3, 0.7]), one.closed([1.0]), rtol=1e-14)


def test_derivatives_of_the_section():
    model = SectionModel(SECTION, springs=("heave", "pitch"))
    speeds, h = np.array([1.0, 3.0]), 1e-6
    up, down = model.stack(speeds + h), model.stack(speeds - h)
    for plus, minus, slope in zip(up, down, model.derivative(speeds), strict=True):
        np.testing.assert_allclose((plus - minus) / (2 * h), slope, atol=1e-8)


def test_unknown_coordinates_and_speeds_are_refused():
    with pytest.raises(InputError, match="springs: 'flap' is no coordinate of it; use heave or"):
        SectionModel(SECTION, springs=("flap",))
    with pytest.raises(InputError, match="speed: must be a positive finite number"):
        SectionModel(SECTION).at(0.0)


class Own:
    """A family as a user may write it: no more than what LureFamily asks for."""

    c = np.array([1.0, 0.0])
    state_names = ("angle", "rate")
    search_range = (0.5, 2.0)

    def at(self, speed):
        return LureSystem(*self.stack(speed), self.c, self.state_names)

    def stack(self, speeds):
        U = np.asarray(speeds, dtype=float)
        A = np.zeros((*U.shape, 2, 2))
        A[..., 0, 1] = 1.0
        A[..., 1, 1] = U - 1.0
        return A, np.stack([np.zeros_like(U), U**2], axis=-1)

    def derivative(self, speeds):
        U = np.asarray(speeds, dtype=float)
        dA = np.zeros((*U.shape, 2, 2))
        dA[..., 1, 1] = 1.0
        return dA, np.stack([np.zeros_like(U), 2 * U], axis=-1)


def test_a_family_of_the_users_own_is_taken():
    family = as_family(Own())
    A, B, C, d = family.stack([1.0, 1.5])
    assert (A.shape, B.shape, C.shape, d.shape) == ((2, 2, 2), (2, 2, 1), (2, 1, 2), (2, 2))
    dA, dB, dC, _ = family.derivative([1.0, 1.5])
    assert dA[1, 1, 1] == 1.0
    assert dB[1, 1, 0] == 3.0
    assert not dC.any()
    assert family.names == ("y",)
    assert family.scale is None
    assert family.search_range == (0.5, 2.0)
    np.testing.assert_array_equal(family.at(1.5).B, B[1])


def test_either_way_of_writing_leads_to_one():
    scaled = replace(SECTION, scale=Scale(b=0.5, omega_alpha=40.0))
    section = SectionFamily(scaled)
    assert as_family(section) is section.model
    assert as_family(section).scale == scaled.scale
    assert as_family(section.model) is section.model
    assert as_family(section).at(2.0).names == ("pitch",)
    system = section.at(2.0)
    assert as_system(system) is system.system
    assert as_system(system.system) is system.system
    back = LureSystem.of(system.system)
    for name in ("A", "b", "c", "state_names", "name", "unit"):
        np.testing.assert_array_equal(getattr(back, name), getattr(system, name))


def test_one_spring_elsewhere_as_vectors():
    family = SpringFamily(SectionModel(SECTION, springs=("heave",)))
    system = family.at(2.0)
    assert (system.name, system.unit) == ("heave", "semichord")
    np.testing.assert_array_equal(family.c, system.c)
    np.testing.assert_array_equal(family.stack([2.0])[1][0], system.b)
    with pytest.raises(InputError, match="must have one output, got 2"):
        SpringFamily(SectionModel(SECTION, springs=("heave", "pitch")))
    loaded = FixedModel(replace(system.system, d=np.ones(6)))
    with pytest.raises(InputError, match="no constant load"):
        SpringFamily(loaded)


def test_models_from_elsewhere_with_several_springs():
    model = SectionModel(SECTION, springs=("pitch", "heave"))
    speeds = np.linspace(1.0, 4.0, 40)
    sampled = SampledModel(speeds, [replace(model.at(U), d=np.full(6, U)) for U in speeds])
    *matrices, load = sampled.stack(2.22)
    for found, expected in zip(matrices, model.stack(2.22), strict=False):
        np.testing.assert_allclose(found, expected, atol=2e-5)
    np.testing.assert_allclose(load, np.full(6, 2.22), rtol=1e-9)
    assert sampled.names == ("pitch", "heave")
    np.testing.assert_allclose(sampled.derivative(2.22)[3], np.ones(6), rtol=1e-9)
    fixed = FixedModel(sampled.at(2.0))
    assert fixed.stack([1.0, 5.0])[1].shape == (2, 6, 2)
    assert not any(value.any() for value in fixed.derivative([1.0, 5.0]))
    assert as_family(FixedFamily(SectionFamily(SECTION).at(2.0))).at(9.0).names == ("pitch",)


def test_springs_of_other_stiffness():
    one = SectionModel(SECTION, springs=("pitch",)).at(2.0)
    half = SectionModel(SECTION, springs=("pitch", "pitch"), stiffness=(0.5, 0.25)).at(2.0)
    np.testing.assert_allclose(half.closed([1.0, 2.0]), one.closed([1.0]), rtol=1e-14)
    pair = SectionModel(SECTION, springs=("pitch", "heave")).at(2.0)
    soft = SectionModel(SECTION, springs=("pitch",), linear={"heave": 0.3}).at(2.0)
    assert soft.outputs == 1
    np.testing.assert_allclose(soft.A, pair.absorb({1: 0.3}).A, rtol=1e-13, atol=1e-15)
    beside = SectionModel(SECTION, springs=("pitch",), linear={"pitch": 0.6}).at(2.0)
    np.testing.assert_allclose(beside.closed([0.4]), one.closed([1.0]), rtol=1e-14, atol=1e-15)
    with pytest.raises(InputError, match="linear: 'flap' is no coordinate of it"):
        SectionModel(SECTION, linear={"flap": 1.0})
    with pytest.raises(InputError, match="as many of each, got 1 and 2"):
        SectionModel(SECTION, stiffness=(1.0, 2.0))
    with pytest.raises(InputError, match="every number must be finite"):
        SectionModel(SECTION, stiffness=(math.nan,))
