"""The Lur'e form: one linear system with one scalar feedback, wherever it comes from."""

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import determinant_root, impedance

from aeroflutter.errors import InputError
from aeroflutter.generated import section as generated
from aeroflutter.model.aerodynamics import QuasiSteady, Wagner
from aeroflutter.model.lure import (
    FixedFamily,
    LureSystem,
    SampledFamily,
    SectionFamily,
    inverse_transfer_gradient,
)
from aeroflutter.model.section import TypicalSection


@st.composite
def sections(draw):
    r_alpha = draw(st.floats(0.2, 0.9))
    return TypicalSection(
        mu=draw(st.floats(4.0, 300.0)),
        a_h=draw(st.floats(-0.7, 0.3)),
        x_alpha=r_alpha * draw(st.floats(-0.5, 0.9)),
        r_alpha=r_alpha,
        omega_bar=draw(st.floats(0.05, 1.8)),
        zeta_alpha=draw(st.sampled_from([0.0, 0.02])),
        zeta_xi=draw(st.sampled_from([0.0, 0.05])),
    )


def random_section(rng):
    r_alpha = rng.uniform(0.25, 0.9)
    return TypicalSection(
        mu=np.exp(rng.uniform(np.log(5), np.log(300))),
        a_h=rng.uniform(-0.6, 0.2),
        x_alpha=rng.uniform(-0.4, 0.8) * r_alpha,
        r_alpha=r_alpha,
        omega_bar=rng.uniform(0.1, 1.6),
        zeta_alpha=rng.uniform(0, 0.05),
        zeta_xi=rng.uniform(0, 0.05),
    )


def test_three_ways_to_the_roots_agree_on_200_random_sections():
    """State space, polynomial and Laplace domain share no step of computation after the equations.

    The polynomial's coefficients span several orders of magnitude, so its roots carry their
    condition number times round-off: measured at most 1e-10 here, against the 1e-9 asserted.
    """
    rng = np.random.default_rng(1998)
    aero = Wagner()
    for _ in range(200):
        section = random_section(rng)
        speed = rng.uniform(0.3, 1.5) * section.r_alpha * np.sqrt(section.mu)
        stiffness = rng.uniform(0.2, 1.2)
        system = SectionFamily(section, aero).at(speed)
        poles = control.poles(control.ss(system.closed(stiffness), system.b[:, None], system.c, 0))
        values = {
            name: getattr(section, name)
            for name in ("mu", "a_h", "x_alpha", "r_alpha", "omega_bar", "zeta_alpha", "zeta_xi")
        }
        coefficients = generated.characteristic_coefficients(
            **values, a=np.array(aero.a), b=np.array(aero.b), speed=speed, stiffness=stiffness
        )
        polynomial = np.roots(coefficients)
        for pole in poles:
            assert np.abs(polynomial - pole).min() < 1e-9
            root = determinant_root(section, aero.a, aero.b, speed, stiffness, pole * (1 + 1e-4))
            assert abs(root - pole) < 1e-9


@given(
    section=sections(),
    speed=st.floats(0.5, 15.0),
    p=st.complex_numbers(min_magnitude=0.02, max_magnitude=1.5),
    a=st.lists(st.floats(0.01, 0.2), min_size=0, max_size=4),
)
def test_transfer_function_is_what_the_laplace_equations_give(section, speed, p, a):
    """Any number of lag terms; p away from the poles of the lags and of G itself."""
    b = [0.05 * (i + 1) ** 1.5 for i in range(len(a))]
    matrix = (
        impedance(section, a, b, speed, 0.0, p) if all(abs(p + bi) > 1e-3 for bi in b) else None
    )
    if matrix is None or abs(np.linalg.det(matrix)) < 1e-6:
        return
    response = np.linalg.solve(matrix, [0.0, 1.0 / speed**2])[1]
    system = SectionFamily(section, Wagner(a=tuple(a), b=tuple(b))).at(speed)
    assert system.transfer(p) == pytest.approx(response, rel=1e-8, abs=1e-12)


@given(section=sections(), speed=st.floats(0.5, 15.0), k=st.floats(0.01, 1.0))
def test_inverse_transfer_and_its_gradient(section, speed, k):
    family = SectionFamily(section)
    A, b = family.stack(speed)
    s = 0.01 + 1j * k
    value, d_ds, d_dU = inverse_transfer_gradient(A, b, family.c, *family.derivative(speed), s)
    assert value == pytest.approx(1.0 / family.at(speed).transfer(s), rel=1e-9)
    h = 1e-5
    central = (
        family.at(speed).inverse_transfer(s + h) - family.at(speed).inverse_transfer(s - h)
    ) / (2 * h)
    assert d_ds == pytest.approx(central, rel=1e-5, abs=1e-5)
    H = 1e-5 * speed
    central = (
        family.at(speed + H).inverse_transfer(s) - family.at(speed - H).inverse_transfer(s)
    ) / (2 * H)
    assert d_dU == pytest.approx(central, rel=1e-5, abs=1e-5)


@given(section=sections(), speed=st.floats(0.5, 15.0))
def test_static_gain_is_finite_at_the_pole_of_the_quarter_chord_axis(section, speed):
    """1/G(0) = -(1 + 2 a_h) U²/(mu r²): the aerodynamic stiffness of steady pitch."""
    expected = -(1 + 2 * section.a_h) * speed**2 / (section.mu * section.r_alpha**2)
    found = SectionFamily(section).at(speed).static_gain_inverse()
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_static_gain_of_the_thesis_section_is_zero():
    system = SectionFamily(TypicalSection(omega_bar=0.8)).at(3.0)
    assert abs(system.static_gain_inverse()) < 1e-14


@pytest.mark.parametrize("aerodynamics", [Wagner(), Wagner(a=(), b=()), QuasiSteady()])
def test_stack_is_the_systems_one_by_one(aerodynamics):
    family = SectionFamily(TypicalSection(omega_bar=0.2, zeta_alpha=0.01), aerodynamics)
    speeds = np.array([1.0, 3.0, 7.0])
    A, b = family.stack(speeds)
    for i, speed in enumerate(speeds):
        np.testing.assert_array_equal(A[i], family.at(speed).A)
        np.testing.assert_array_equal(b[i], family.at(speed).b)
    dA, db = family.derivative(speeds)
    h = 1e-6
    up, down = family.stack(speeds + h), family.stack(speeds - h)
    np.testing.assert_allclose((up[0] - down[0]) / (2 * h), dA, atol=1e-8)
    np.testing.assert_allclose((up[1] - down[1]) / (2 * h), db, atol=1e-8)


def test_control_and_back():
    rng = np.random.default_rng(7)
    system = LureSystem(rng.normal(size=(5, 5)), rng.normal(size=5), rng.normal(size=5))
    back = LureSystem.from_control(system.to_control())
    s = np.array([0.3j, 1.0 + 2.0j])
    np.testing.assert_allclose(back.transfer(s), system.transfer(s), rtol=1e-12)
    np.testing.assert_allclose(system.to_control()(s), system.transfer(s), rtol=1e-10)


@pytest.mark.parametrize(
    ("system", "message"),
    [
        (control.ss([[-1.0]], [[1.0]], [[1.0]], [[0.5]]), "D must be zero"),
        (control.ss([[-1.0]], [[1.0, 2.0]], [[1.0]], [[0.0, 0.0]]), "one input and one output"),
        (control.ss([[-0.5]], [[1.0]], [[1.0]], [[0.0]], 0.1), "continuous time"),
    ],
)
def test_systems_that_make_no_loop_are_refused(system, message):
    with pytest.raises(InputError, match=message):
        LureSystem.from_control(system)


def test_sampled_family_reproduces_the_section_between_samples():
    """A cubic spline: the error falls with the fourth power of the spacing."""
    family = SectionFamily(TypicalSection(omega_bar=0.2))
    errors = []
    for count in (9, 17, 33):
        speeds = np.linspace(3.0, 8.0, count)
        sampled = SampledFamily(speeds, [family.at(speed) for speed in speeds])
        middle = np.linspace(4.0, 7.0, 301)
        errors.append(np.abs(sampled.stack(middle)[0] - family.stack(middle)[0]).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 3.5)


def test_sampled_family_refuses_what_does_not_match():
    family = SectionFamily(TypicalSection(omega_bar=0.2))
    quasi = SectionFamily(TypicalSection(omega_bar=0.2), QuasiSteady())
    with pytest.raises(InputError, match="same states"):
        SampledFamily([1.0, 2.0], [family.at(1.0), quasi.at(2.0)])
    with pytest.raises(InputError, match="strictly increasing"):
        SampledFamily([2.0, 1.0], [family.at(2.0), family.at(1.0)])
    sampled = SampledFamily([1.0, 2.0], [family.at(1.0), family.at(2.0)])
    with pytest.raises(InputError, match="between 1 and 2"):
        sampled.at(2.5)


def test_fixed_family_is_one_system_everywhere():
    system = SectionFamily(TypicalSection(omega_bar=0.2)).at(4.0)
    family = FixedFamily(system)
    A, _ = family.stack([1.0, 2.0, 3.0])
    assert A.shape == (3, 6, 6)
    np.testing.assert_array_equal(A[2], system.A)
    assert not np.any(family.derivative([1.0, 2.0])[0])


@pytest.mark.parametrize("speed", [0.0, -1.0, np.nan, np.inf])
def test_speeds_must_be_positive(speed):
    with pytest.raises(InputError, match="speed: must be a positive finite number"):
        SectionFamily(TypicalSection(omega_bar=0.2)).at(speed)


def test_matrices_are_read_only_and_checked():
    with pytest.raises(InputError, match="shapes"):
        LureSystem(np.eye(3), np.ones(2), np.ones(2))
    with pytest.raises(InputError, match="finite"):
        LureSystem(np.array([[np.nan]]), np.ones(1), np.ones(1))
    system = LureSystem(np.eye(2), np.ones(2), np.ones(2))
    with pytest.raises(ValueError, match="read-only"):
        system.A[0, 0] = 5.0


@settings(max_examples=25)
@given(section=sections())
def test_a_system_is_not_changed_by_what_made_it(section):
    A = np.eye(2)
    system = LureSystem(A, np.ones(2), np.ones(2))
    A[0, 0] = section.mu
    assert system.A[0, 0] == 1.0


def test_the_last_speed_of_samples_may_come_back_with_its_round_off():
    family = SectionFamily(TypicalSection(omega_bar=0.8))
    sampled = SampledFamily([3.0, 4.0, 5.0], [family.at(speed) for speed in (3.0, 4.0, 5.0)])
    beyond = float(np.nextafter(5.0, 6.0))  # what exp(log(…)) makes of a number
    np.testing.assert_array_equal(sampled.at(beyond).A, sampled.at(5.0).A)
    for speed in (2.999, 5.001):
        with pytest.raises(InputError, match="between 3 and 5"):
            sampled.at(speed)
