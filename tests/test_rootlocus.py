"""Linear flutter: published speeds, closed forms, and every crossing found."""

import numpy as np
import pytest
from oracles import crossings_by_kronecker
from test_lure import random_section

from aeroflutter.errors import InputError
from aeroflutter.generated import quasi_steady
from aeroflutter.linear.rootlocus import (
    RootLocusOptions,
    flutter_against_stiffness,
    flutter_point,
    flutter_speed,
    root_locus,
)
from aeroflutter.model.aerodynamics import QuasiSteady, Wagner
from aeroflutter.model.lure import LureSystem, SampledFamily, SectionFamily
from aeroflutter.model.section import TypicalSection


def truncated(value, digits):
    return np.floor(value * 10**digits) / 10**digits


# Lee, Price & Wong, Prog. Aerospace Sci. 35 (1999), Table 2, Jones' two-term Wagner function,
# printed truncated to three decimals.
@pytest.mark.parametrize(
    ("mu", "omega_bar", "printed"),
    [
        (50, 0.2, 4.525),
        (50, 0.8, 3.074),
        (100, 0.2, 6.285),
        (100, 0.8, 4.114),
        (250, 0.2, 9.710),
    ],
)
def test_lee_price_wong_table_2(mu, omega_bar, printed):
    speed = flutter_speed(SectionFamily(TypicalSection(mu=mu, omega_bar=omega_bar)))
    assert truncated(speed, 3) == pytest.approx(printed, abs=1e-12)


def test_the_sixth_entry_of_table_2_is_not_what_its_equations_give():
    """Printed 5.962; the same equations, and det B(jk) = 0 solved directly, give 5.96357."""
    family = SectionFamily(TypicalSection(mu=250, omega_bar=0.8))
    point = flutter_point(family)
    assert abs(family.at(point.speed).inverse_transfer(1j * point.k) + 1) < 1e-12
    assert point.speed - 5.962 == pytest.approx(0.00157, abs=5e-6)


def test_chung_he_lee_2009():
    """mu = 100, omega_bar = 0.2: U*_L = 6.2851, k = 0.084, half-period 37.38 (as printed)."""
    point = flutter_point(SectionFamily(TypicalSection(omega_bar=0.2)))
    assert round(point.speed, 4) == 6.2851
    assert round(point.k, 3) == 0.084
    assert round(np.pi / point.k, 2) == 37.38


def test_naca_tr_496_case_with_jones_function():
    """Perry, NASA/TP-2015-218765: 172.857 ft/s with Jones' function, divergence 353.55 ft/s."""
    foot = 0.3048
    rho = 1.225
    section = TypicalSection.from_si(
        m=10 * np.pi * rho * foot**2,
        b=foot,
        rho=rho,
        a_h=-0.4,
        x_cg=0.2 * foot,
        r=0.5 * foot,
        omega_h=50.0,
        omega_alpha=100.0,
    )
    locus = root_locus(SectionFamily(section))
    assert section.scale.velocity(locus.flutter.speed) / foot == pytest.approx(172.857, abs=0.01)
    assert section.scale.velocity(locus.divergence) / foot == pytest.approx(353.55, abs=0.01)


@pytest.mark.parametrize("omega_bar", [0.1, 0.2, 0.5, 0.8, 1.1, 1.5])
@pytest.mark.parametrize("x_alpha", [0.05, 0.25, 0.45])
def test_quasi_steady_closed_form(omega_bar, x_alpha):
    """The determinant's discriminant for a_h = -1/2, solved by hand."""
    section = TypicalSection(omega_bar=omega_bar, x_alpha=x_alpha)
    ratio = x_alpha / section.r_alpha
    square = (section.mu * section.r_alpha**2 / (2 * x_alpha)) * (
        1 + omega_bar**2 - 2 * omega_bar * np.sqrt(1 - ratio**2)
    )
    point = flutter_point(SectionFamily(section, QuasiSteady()))
    assert point.coalescence
    assert point.speed == pytest.approx(np.sqrt(square), rel=1e-12)


@pytest.mark.parametrize("zeta", [1e-10, 1e-6, 1e-2])
def test_the_smallest_damping_counts(zeta):
    """Damping in pitch alone destabilises the quasi-steady section far below coalescence.

    Ziegler's paradox: the limit of little damping is not the undamped flutter speed. The Routh-
    Hurwitz determinant p1 p2 p3 - p0 p3² - p4 p1² of the characteristic polynomial must vanish.
    """
    family = SectionFamily(TypicalSection(omega_bar=0.5, zeta_alpha=zeta), QuasiSteady())
    speed = flutter_speed(family)

    def routh(U):
        p4, p3, p2, p1, p0 = quasi_steady.characteristic_coefficients(
            mu=100.0,
            a_h=-0.5,
            x_alpha=0.25,
            r_alpha=0.5,
            omega_bar=0.5,
            zeta_alpha=zeta,
            zeta_xi=0.0,
            speed=U,
            stiffness=1.0,
        )
        return (p1 * p2 * p3 - p0 * p3**2 - p4 * p1**2) / zeta**2

    # round-off in Re p, relative to the damping, bounds the accuracy of the crossing
    width = max(1e-9, 1e-14 / zeta)
    assert routh(speed * (1 - width)) * routh(speed * (1 + width)) < 0
    assert speed < 0.5 * flutter_speed(SectionFamily(TypicalSection(omega_bar=0.5), QuasiSteady()))


def test_a_crossing_is_a_root_of_det_b_to_round_off():
    rng = np.random.default_rng(5)
    found = 0
    for _ in range(60):
        family = SectionFamily(random_section(rng))
        for crossing in root_locus(family).crossings:
            found += 1
            residual = family.at(crossing.speed).inverse_transfer(1j * crossing.k) + 1
            assert abs(residual) < 1e-10
    assert found > 20


@pytest.mark.parametrize("seed", range(3))
def test_every_crossing_is_found(seed):
    """Against a determinant that is singular exactly at the crossings, on random sections."""
    rng = np.random.default_rng(seed)
    for _ in range(40):
        family = SectionFamily(random_section(rng))
        stiffness = rng.choice([1.0, 0.4, 0.05])
        options = RootLocusOptions(stiffness=stiffness)
        found = root_locus(family, options).crossings
        expected = crossings_by_kronecker(family, stiffness, *options.range(family))
        assert len(found) == len(expected)
        for crossing, (speed, k) in zip(found, expected, strict=True):
            assert crossing.speed == pytest.approx(speed, rel=1e-6)
            assert crossing.k == pytest.approx(k, rel=1e-5)


def test_an_instability_narrower_than_the_grid_is_found():
    """A mode whose damping touches the axis from below between two speeds of the search grid."""

    def system(speed, lift):
        damping = 0.01 * (speed - 1.2345) ** 2 - lift
        return LureSystem(
            np.array([[0.0, 1.0], [-1.0, -damping]]), np.array([0.0, 1e-9]), np.array([1.0, 0.0])
        )

    speeds = np.linspace(0.5, 2.0, 16)
    for lift, count in ((1e-9, 2), (-1e-9, 0)):
        family = SampledFamily(speeds, [system(speed, lift) for speed in speeds])
        crossings = root_locus(family, RootLocusOptions(grid=40)).crossings
        assert len(crossings) == count
        if count:
            half_width = np.sqrt(lift / 0.01)
            assert crossings[0].speed == pytest.approx(1.2345 - half_width, abs=1e-7)
            assert crossings[0].growing
            assert not crossings[1].growing


def test_divergence_is_the_closed_form():
    """U_D² = mu r²/(1 + 2 a_h) from the zero-frequency balance; none for a_h <= -1/2."""
    for a_h in (-0.45, -0.2, 0.1):
        section = TypicalSection(omega_bar=0.5, a_h=a_h)
        expected = np.sqrt(section.mu * section.r_alpha**2 / (1 + 2 * a_h))
        for aero in (Wagner(), QuasiSteady()):
            found = root_locus(SectionFamily(section, aero)).divergence
            assert found == pytest.approx(expected, rel=1e-10)
    for a_h in (-0.5, -0.6):
        assert root_locus(SectionFamily(TypicalSection(omega_bar=0.5, a_h=a_h))).divergence is None


def test_modes_are_followed_and_not_sorted():
    """Every column is smooth: halving the step halves its largest jump."""
    family = SectionFamily(TypicalSection(omega_bar=0.2))
    jumps = []
    for count in (201, 401, 801):
        locus = root_locus(family, speeds=np.linspace(2.0, 7.5, count))
        jumps.append(np.abs(np.diff(locus.roots, axis=0)).max(axis=0))
    ratio = np.array(jumps[:-1]) / np.array(jumps[1:])
    assert np.all(ratio > 1.8)
    assert locus.roots.shape == (801, 6)


def test_roots_are_returned_in_the_order_of_the_speeds_asked_for():
    family = SectionFamily(TypicalSection(omega_bar=0.8))
    speeds = np.array([3.0, 1.0, 4.5, 3.0])
    locus = root_locus(family, speeds=speeds)
    np.testing.assert_array_equal(locus.speeds, speeds)
    for speed, roots in zip(speeds, locus.roots, strict=True):
        expected = np.linalg.eigvals(family.at(speed).closed(1.0))
        np.testing.assert_allclose(np.sort_complex(roots), np.sort_complex(expected), atol=1e-12)
    single = root_locus(family, speeds=[2.0])
    assert single.roots.shape == (1, 6)


def test_flutter_speed_against_stiffness():
    """Stiffnesses enter only as N/U² and omega_bar²/U², so scaling them together scales U²."""
    base = TypicalSection(omega_bar=0.8)
    speed, _ = flutter_against_stiffness(SectionFamily(base), [1.0, 0.25])
    scaled = TypicalSection(omega_bar=0.8 / np.sqrt(0.25))
    assert speed[1] == pytest.approx(0.5 * flutter_speed(SectionFamily(scaled)), rel=1e-10)
    none, _ = flutter_against_stiffness(
        SectionFamily(TypicalSection(omega_bar=0.8, x_alpha=-0.2)), [1]
    )
    assert np.isnan(none[0])


def test_a_section_without_flutter_says_so():
    locus = root_locus(SectionFamily(TypicalSection(omega_bar=0.8, x_alpha=-0.2)))
    assert locus.flutter is None
    assert locus.crossings == ()


def test_a_section_unstable_from_the_start_says_so():
    """Negative structural damping cannot be entered, but a system from elsewhere may have it."""

    def system(speed):
        return LureSystem(
            np.array([[0.0, 1.0], [-1.0, 0.1 - 0.05 * speed]]),
            np.array([0.0, 1e-9]),
            np.array([1.0, 0]),
        )

    family = SampledFamily([0.5, 4.0], [system(0.5), system(4.0)])
    locus = root_locus(family)
    assert locus.unstable_at_low
    assert locus.flutter is None
    assert [crossing.growing for crossing in locus.crossings] == [False]
    assert locus.crossings[0].speed == pytest.approx(2.0, abs=1e-9)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"low": 0.0}, "low: must be a positive"),
        ({"high": np.inf}, "high: must be a finite"),
        ({"grid": 1}, "grid: needs at least 2"),
        ({"stiffness": np.nan}, "stiffness: must be finite"),
    ],
)
def test_options_name_what_is_wrong(options, message):
    with pytest.raises(InputError, match=message):
        RootLocusOptions(**options)


def test_an_empty_range_is_refused():
    family = SectionFamily(TypicalSection(omega_bar=0.2))
    with pytest.raises(InputError, match="need low < high"):
        root_locus(family, RootLocusOptions(low=5.0, high=4.0))
    with pytest.raises(InputError, match="positive finite"):
        root_locus(family, speeds=[1.0, -2.0])


def with_stiffness(stiffness):
    """p² + p/2 + stiffness(U) = 0: a real root passes through zero where the stiffness does."""

    def system(speed):
        return LureSystem(
            np.array([[0.0, 1.0], [-stiffness(speed), -0.5]]),
            np.array([0.0, 1e-9]),
            np.array([1.0, 0.0]),
        )

    speeds = np.linspace(0.5, 4.0, 8)
    return SampledFamily(speeds, [system(speed) for speed in speeds])


def test_a_real_root_that_grows_is_divergence_and_not_flutter():
    locus = root_locus(with_stiffness(lambda speed: 0.03 * (2.0 - speed)))
    assert np.any(np.all(locus.roots.imag == 0, axis=1) & np.any(locus.roots.real > 0, axis=1))
    assert locus.flutter is None
    assert locus.crossings == ()


def test_a_real_root_that_grows_from_the_start_is_no_oscillation():
    locus = root_locus(with_stiffness(lambda speed: 0.03 * (speed - 2.0)))
    assert not locus.unstable_at_low
    assert locus.flutter is None
