"""The section and its conversion from and to SI units."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeroflutter.errors import InputError
from aeroflutter.model.aerodynamics import Wagner
from aeroflutter.model.section import Scale, TypicalSection

# A wing section of a light aircraft: 1.2 m chord, 25 kg/m, sea level
SI = {"m": 25.0, "b": 0.6, "rho": 1.225, "a_h": -0.2}


def test_every_invalid_field_is_reported_at_once():
    with pytest.raises(InputError) as caught:
        TypicalSection(omega_bar=-1.0, mu=0.0, x_alpha=0.6, zeta_xi=-0.1)
    fields = [problem.split(":")[0] for problem in caught.value.problems]
    assert fields == ["mu", "omega_bar", "zeta_xi", "r_alpha"]


@pytest.mark.parametrize("value", [math.nan, math.inf, "1", True, None])
def test_what_is_not_a_finite_number_is_refused(value):
    with pytest.raises(InputError, match="a_h: must be a finite number"):
        TypicalSection(omega_bar=0.2, a_h=value)


@given(
    offset=st.floats(-0.2, 0.2),
    radius=st.floats(0.25, 0.8),
    heave=st.floats(1.0, 100.0),
    pitch=st.floats(1.0, 100.0),
)
def test_either_way_of_stating_a_quantity_gives_the_same_section(offset, radius, heave, pitch):
    m = SI["m"]
    first = TypicalSection.from_si(**SI, x_cg=offset, r=radius, omega_h=heave, omega_alpha=pitch)
    second = TypicalSection.from_si(
        **SI,
        S=m * offset,
        I_alpha=m * radius**2,
        K_h=m * heave**2,
        K_alpha=m * radius**2 * pitch**2,
    )
    for name in ("mu", "a_h", "x_alpha", "r_alpha", "omega_bar"):
        assert math.isclose(
            getattr(first, name), getattr(second, name), rel_tol=1e-14, abs_tol=1e-15
        )
    assert math.isclose(first.scale.omega_alpha, second.scale.omega_alpha, rel_tol=1e-14)


def test_definitions_of_the_dimensionless_groups():
    section = TypicalSection.from_si(**SI, x_cg=0.12, r=0.3, omega_h=20.0, omega_alpha=50.0)
    assert section.mu == pytest.approx(25.0 / (math.pi * 1.225 * 0.36), rel=1e-15)
    assert section.x_alpha == pytest.approx(0.2, rel=1e-15)
    assert section.r_alpha == pytest.approx(0.5, rel=1e-15)
    assert section.omega_bar == pytest.approx(0.4, rel=1e-15)


@given(
    b=st.floats(0.01, 10.0),
    omega=st.floats(0.1, 1e4),
    speed=st.floats(0.01, 100.0),
    k=st.floats(0, 10),
)
def test_speed_and_frequency_go_both_ways(b, omega, speed, k):
    scale = Scale(b=b, omega_alpha=omega)
    velocity = scale.velocity(speed)
    assert math.isclose(scale.speed(velocity), speed, rel_tol=1e-14)
    assert math.isclose(2 * math.pi * scale.frequency_hz(k, speed) * b / velocity, k, rel_tol=1e-13)
    assert math.isclose(scale.seconds(1.0, speed), b / velocity, rel_tol=1e-14)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"r": None}, "I_alpha or r: give exactly one of the two, got neither"),
        ({"I_alpha": 1.0}, "I_alpha or r: give exactly one of the two, got both"),
        ({"omega_h": -1.0}, "omega_h: must be a positive finite number"),
        ({"m": math.nan}, "m: must be a positive finite number"),
    ],
)
def test_si_input_names_what_is_wrong(change, message):
    given_values = {**SI, "x_cg": 0.1, "r": 0.3, "omega_h": 20.0, "omega_alpha": 50.0, **change}
    with pytest.raises(InputError, match=message):
        TypicalSection.from_si(**given_values)


@pytest.mark.parametrize(
    ("a", "b", "message"),
    [
        ((0.1,), (0.1, 0.2), "as many coefficients as rates"),
        ((0.1,), (0.0,), "every decay rate must be positive"),
        ((0.7, 0.3), (0.1, 0.2), "the sum must be below 1"),
        ((math.nan,), (0.2,), "every number must be finite"),
    ],
)
def test_wagner_terms_are_validated(a, b, message):
    with pytest.raises(InputError, match=message):
        Wagner(a=a, b=b)
