"""Describing functions: onsets, completeness, symmetry, agreement with independent computations."""

import control
import numpy as np
import oracles
import pytest
import scipy.optimize
from hypothesis import given, settings
from hypothesis import strategies as st
from test_lure import random_section

from aeroflutter.case import load_case
from aeroflutter.errors import InputError
from aeroflutter.linear.rootlocus import root_locus
from aeroflutter.model.aerodynamics import QuasiSteady
from aeroflutter.model.lure import FixedFamily, LureSystem, SectionFamily
from aeroflutter.model.section import TypicalSection
from aeroflutter.orbits.describing import (
    DescribingOptions,
    describing_at,
    describing_curve,
    describing_intersections,
)
from aeroflutter.orbits.describing.balance import BIAS, Balance
from aeroflutter.orbits.describing.families import Domain, _follow
from aeroflutter.orbits.describing.scan import scan
from aeroflutter.orbits.describing.stability import stability
from aeroflutter.results.dataset import to_dataset
from aeroflutter.springs import Cubic, Freeplay, Hysteresis, Table
from aeroflutter.springs.control_adapter import SpringNonlinearity

WAGNER = (0.165, 0.335), (0.0455, 0.3)  # R. T. Jones' coefficients
HEAVY = SectionFamily(TypicalSection(omega_bar=0.8))


# Exact onsets (event-exact simulation); the complex describing function agrees to 0.1 %.
@pytest.mark.parametrize(
    ("run", "exact"),
    [("run6", 0.8151), ("run10", 0.8489), ("run14", 0.9215), ("run15", 0.9530), ("run16", 0.8082)],
)
def test_onset_is_within_a_tenth_of_a_per_cent_of_the_exact_one(run, exact):
    case = load_case(run)
    onset = describing_curve(case.family(), case.spring).onset
    assert onset.speed_ratio == pytest.approx(exact, rel=1e-3)
    assert onset.kind == "fold"


def test_onset_is_a_stationary_point_of_the_balance():
    """At the fold d(U)/dA = 0: two amplitudes apart by 2h have speeds above it by O(h²)."""
    case = load_case("run14")
    onset = describing_curve(case.family(), case.spring).onset
    for h in (1e-3, 1e-4):
        near = describing_at(
            case.family(), case.spring, onset.amplitude * np.array([1 - h, 1.0, 1 + h])
        )
        rise = near.speed / onset.speed - 1
        assert abs(rise[1]) < 1e-9
        assert np.all(rise[[0, 2]] > 0)
        assert np.all(rise[[0, 2]] < 20 * h**2)


def test_every_point_closes_the_loop():
    rng = np.random.default_rng(3)
    for _ in range(6):
        family = SectionFamily(random_section(rng))
        spring = Hysteresis(rng.uniform(0.1, 1.0), rng.uniform(0.1, 1.0))
        curve = describing_curve(family, spring, DescribingOptions(points=25))
        for i in range(curve.amplitude.size):
            N = complex(spring.describing(curve.amplitude[i], curve.bias[i]).N)
            inverse = family.at(curve.speed[i]).inverse_transfer(1j * curve.k[i])
            assert abs(inverse + N) < 1e-9


def brute_force(family, spring, amplitude, speeds, ks):
    """Solutions of det B(jk) = 0 counted on a grid of speed and frequency: winding of 1/G + N.

    Around a simple zero of two real equations in two unknowns the argument turns once.
    """
    A, b = family.stack(speeds)
    from aeroflutter.model.lure import inverse_transfer

    value = inverse_transfer(A[:, None], b[:, None], family.c, 1j * ks[None, :]) + complex(
        spring.describing(amplitude, 0.0).N
    )
    corners = np.stack([value[:-1, :-1], value[1:, :-1], value[1:, 1:], value[:-1, 1:]])
    turns = np.angle(np.roll(corners, -1, axis=0) / corners).sum(axis=0) / (2 * np.pi)
    rows, columns = np.nonzero(np.abs(np.round(turns)) == 1)
    return np.sqrt(speeds[rows] * speeds[rows + 1]), np.sqrt(ks[columns] * ks[columns + 1])


@pytest.mark.parametrize(
    ("spring", "section"),
    [
        (Hysteresis(0.2, 1.0), {"omega_bar": 0.8}),
        (Hysteresis(0.2, 1.0), {"omega_bar": 0.2}),
        (Freeplay(1.0), {"omega_bar": 0.8}),
        (Hysteresis(1.0, 1.0), {"omega_bar": 1.2, "a_h": -0.4, "mu": 40.0}),
        (Hysteresis(0.5, 1.0), {"omega_bar": 0.5, "x_alpha": 0.35, "mu": 20.0}),
    ],
)
def test_every_family_is_found(spring, section):
    """Against a scan of 1/G + N over speed and frequency that knows nothing of continuation."""
    family = SectionFamily(TypicalSection(**section))
    amplitudes = spring.scale * np.array([0.35, 0.62, 0.9, 1.4, 4.0])
    found = describing_at(family, spring, amplitudes)
    speeds = np.geomspace(found.speed_range[0] * 1.01, found.speed_range[1] * 0.99, 500)
    ks = np.geomspace(0.004, 6.0, 700)
    for amplitude in amplitudes:
        scanned = np.column_stack(brute_force(family, spring, amplitude, speeds, ks))
        mine = np.isclose(found.amplitude, amplitude, rtol=1e-9) & (found.bias == 0)
        mine &= (found.speed > speeds[0]) & (found.speed < speeds[-1]) & (found.k > ks[0])
        cycles = np.column_stack([found.speed[mine], found.k[mine]])
        for speed, k in scanned:
            near = np.abs(np.log(cycles / np.array([speed, k]))).max(axis=1)
            assert near.min() < 0.02, (amplitude, speed, k)
        assert len(cycles) >= len(scanned)


@pytest.mark.parametrize(
    ("run", "count"),
    [
        *(("run6", 2), ("run10", 1), ("run14", 1), ("run15", 1), ("run16", 2)),
        *(("run101", 1), ("run102", 1), ("run103", 1), ("run111", 1)),
    ],
)
def test_minima_of_the_speed_to_1e_8(run, count):
    """Against a minimiser over amplitude of the printed equations, which shares no code with ours.

    Where the loop is much wider than high there are two: one with the slider off its stops.
    """
    case = load_case(run)
    curve = describing_curve(case.family(), case.spring)
    start = (curve.flutter_speed, root_locus(case.family()).flutter.k)
    loop = case.spring.delta_v, case.spring.delta_h
    expected = oracles.lowest_speeds(case.section, *WAGNER, *loop, start, top=20 * sum(loop))
    minima = sorted(
        (fold.speed, fold.amplitude)
        for one in curve.families
        for fold in one.folds
        if fold.speed < curve.flutter_speed and not fold.beside[0]
    )
    assert len(minima) == len(expected) == count
    np.testing.assert_allclose(np.array(minima)[:, 0], sorted(expected[:, 0]), rtol=1e-8)
    assert curve.onset.speed == minima[0][0]


@given(factor=st.floats(1e-3, 1e3))
@settings(max_examples=10, deadline=None)
def test_piecewise_linear_springs_have_no_scale(factor):
    spring = Hysteresis(1.0, 0.6, 0.1, 0.05)
    amplitudes = np.array([0.9, 1.5, 3.0])
    options = DescribingOptions(speed_ratio_range=(0.5, 1.2))
    base = describing_at(HEAVY, spring, amplitudes, options)
    scaled = describing_at(HEAVY, spring.scaled(factor), factor * amplitudes, options)
    assert scaled.speed.size == base.speed.size > 0
    np.testing.assert_allclose(np.sort(scaled.speed), np.sort(base.speed), rtol=1e-9)
    assert scaled.onset.speed == pytest.approx(base.onset.speed, rel=1e-8)


def test_mirrored_spring_has_mirrored_cycles():
    section = SectionFamily(TypicalSection(omega_bar=0.5, a_h=-0.4))
    options = DescribingOptions(speed_ratio_range=(0.4, 1.1))
    plus = describing_at(section, Hysteresis(0.6, 1.0, 0.1, 0.2), [1.2, 2.0], options)
    minus = describing_at(section, Hysteresis(0.6, 1.0, -0.1, -0.2), [1.2, 2.0], options)
    assert plus.speed.size == minus.speed.size > 0
    order, other = np.lexsort((plus.bias, plus.speed)), np.lexsort((-minus.bias, minus.speed))
    np.testing.assert_allclose(plus.speed[order], minus.speed[other], rtol=1e-9)
    np.testing.assert_allclose(plus.bias[order], -minus.bias[other], atol=1e-8)


def test_small_loops_tend_to_freeplay_and_to_the_linear_section():
    amplitudes = np.array([1.0, 2.0])
    freeplay = describing_at(HEAVY, Freeplay(1.0), amplitudes).speed
    loop = describing_at(HEAVY, Hysteresis(1e-9, 1.0), amplitudes).speed
    np.testing.assert_allclose(np.sort(loop), np.sort(freeplay), rtol=1e-7)


def test_stability_is_the_sign_of_the_root_drift():
    """Independent of the package's rule: growth of the root at an amplitude above and below."""
    case = load_case("run14")
    family, spring = case.family(), case.spring
    curve = describing_curve(family, spring, DescribingOptions(points=40))
    for i in range(curve.amplitude.size):
        if not curve.in_thesis_range[i]:
            continue
        growth = []
        for factor in (1 - 1e-4, 1 + 1e-4):
            N = complex(spring.describing(curve.amplitude[i] * factor, 0.0).N)
            roots = np.linalg.eigvals(family.at(curve.speed[i]).closed(N))
            growth.append(roots[np.argmin(np.abs(roots - 1j * curve.k[i]))].real)
        assert curve.stable[i] == (growth[1] < growth[0])


def test_hardening_cubic_bifurcates_from_linear_flutter():
    """Amplitude tends to zero at U*_L and grows above it; N = 1 + 3/4 beta3 A²."""
    curve = describing_curve(
        SectionFamily(TypicalSection(omega_bar=0.2)),
        Cubic(1.0, 3.0),
        DescribingOptions(amplitude_range=(1e-3, 0.5)),
    )
    first = curve.family == curve.onset.family
    assert curve.onset.speed_ratio == pytest.approx(1.0, abs=1e-5)
    assert np.all(np.diff(curve.speed_ratio[first]) > 0)
    assert curve.stable[first].all()
    np.testing.assert_allclose(curve.n_p[first], 1 + 2.25 * curve.amplitude[first] ** 2, rtol=1e-12)


# Lee, Jiang & Wong 1999, beta3 = 3: read off figures, hence 3 % in amplitude, 1 % in frequency.
@pytest.mark.parametrize(
    ("ratio", "amplitude_deg", "k"),
    [(1.05, 11.4, 0.0830), (1.10, 16.4, 0.0820), (1.15, 20.4, 0.0810)],
)
def test_cubic_against_lee_jiang_wong(ratio, amplitude_deg, k):
    curve = describing_curve(
        SectionFamily(TypicalSection(omega_bar=0.2)),
        Cubic(1.0, 3.0),
        DescribingOptions(amplitude_range=(1e-2, 0.6)),
    )
    mine = curve.family == curve.onset.family
    found = np.interp(ratio, curve.speed_ratio[mine], np.degrees(curve.amplitude[mine]))
    assert found == pytest.approx(amplitude_deg, rel=0.03)
    assert np.interp(ratio, curve.speed_ratio[mine], curve.k[mine]) == pytest.approx(k, rel=0.01)


def test_a_control_system_that_is_no_airfoil():
    """Saturation around a triple lag, against python-control's search for intersections.

    It intersects polylines through 2000 samples of N(A), which costs it some 1e-6.
    """
    plant = control.ss(control.tf([16.0], [1.0, 3.0, 3.0, 1.0]))
    saturation = Table(pitch=(-2.0, -1.0, 1.0, 2.0), moments=(-1.0, -1.0, 1.0, 1.0))
    found = describing_intersections(LureSystem.from_control(plant), saturation)
    response = control.describing_function_response(
        plant,
        SpringNonlinearity(saturation),
        np.linspace(1.01, 20, 2000),
        np.geomspace(0.1, 10, 2000),
        refine=True,
    )
    assert len(found) == len(response.intersections) == 1
    assert found[0] == pytest.approx(response.intersections[0], rel=1e-4)
    assert found[0, 1] == pytest.approx(np.sqrt(3.0), rel=1e-12)  # phase -180° of 1/(s+1)³


@pytest.mark.parametrize("amplitude", [3e3, 1e6])
def test_cycles_of_a_fixed_system_far_beyond_the_gap_are_found(amplitude):
    """A triple lag turns the phase by -180° at the square root of three, where it is an eighth of
    its gain: the gain says what N, and so how large the cycle is."""
    spring = Freeplay(2.0)
    N = float(spring.describing(amplitude, 0.0).n_p)
    plant = control.ss(control.tf([8.0 / N], [1.0, 3.0, 3.0, 1.0]))
    found = describing_intersections(LureSystem.from_control(plant), spring)
    assert found == pytest.approx(np.array([[amplitude, np.sqrt(3.0)]]), rel=1e-7)


def test_a_fixed_system_and_the_curve_agree():
    case = load_case("run14")
    curve = describing_at(case.family(), case.spring, [0.02])
    system = case.family().at(float(curve.speed[0]))
    found = describing_intersections(system, case.spring)
    distance = np.abs(found - np.array([0.02, curve.k[0]])).max(axis=1)
    assert distance.min() < 1e-9


@pytest.mark.parametrize("spring", [Hysteresis(1.0, 0.4), Freeplay(1.0), Cubic(1.0, 2.0)])
def test_adapter_gives_control_the_closed_form(spring):
    """python-control's own quadrature of the sampled law agrees to its sampling error."""
    amplitudes = np.array([0.9, 2.0])
    adapter = SpringNonlinearity(spring)
    closed = control.describing_function(adapter, amplitudes)
    np.testing.assert_allclose(closed, spring.describing(amplitudes, 0.0).N, rtol=1e-14)
    for amplitude, expected in zip(amplitudes, closed, strict=True):
        fresh = SpringNonlinearity(spring)
        theta = np.linspace(-np.pi / 2, 3.5 * np.pi, 8001)
        answer = np.array([fresh(amplitude * np.sin(angle)) for angle in theta])[4000:-1]
        gain = 2 * np.mean(answer * np.exp(-1j * theta[4000:-1])) * 1j / amplitude
        assert gain == pytest.approx(expected, abs=2e-6)


def test_undamped_sections_follow_coalescence():
    """Quasi-steady: U(A) is the closed-form coalescence speed of the stiffness N(A)."""
    family = SectionFamily(TypicalSection(omega_bar=0.5), QuasiSteady())
    curve = describing_at(family, Freeplay(1.0), [2.0])
    N = float(Freeplay(1.0).describing(2.0, 0.0).n_p)
    ratio = 0.5 / np.sqrt(N)
    square = N * 100 * 0.25 / 0.5 * (1 + ratio**2 - 2 * ratio * np.sqrt(0.75))
    assert np.min(np.abs(curve.speed - np.sqrt(square))) < 1e-6


def test_what_makes_no_curve_is_refused():
    system = HEAVY.at(3.0)
    with pytest.raises(InputError, match="does not depend on speed"):
        describing_curve(FixedFamily(system), Freeplay(1.0))
    with pytest.raises(InputError, match="finite positive"):
        describing_at(HEAVY, Freeplay(1.0), [-1.0])
    with pytest.raises(InputError, match="must be odd"):
        describing_intersections(system, Freeplay(1.0, 0.3))
    with pytest.raises(InputError, match="points"):
        DescribingOptions(points=1)


def test_a_curve_without_cycles_says_so():
    """Mass centre ahead of the axis: no flutter at any stiffness, so no cycle either."""
    ahead = SectionFamily(TypicalSection(omega_bar=0.8, x_alpha=-0.1))
    curve = describing_curve(ahead, Hysteresis(1.0, 0.2))
    assert curve.onset is None
    assert curve.families == ()
    assert "no limit cycle of any amplitude between" in curve.notes[0]


def test_curve_as_a_dataset():
    case = load_case("run14")
    data = to_dataset(describing_curve(case.family(), case.spring), case=case)
    assert data["amplitude_deg"].attrs["units"] == "degree"
    assert data.attrs["onset_speed_ratio"] == pytest.approx(0.9215, rel=1e-3)  # the exact onset
    assert "delta_v_deg" in data.attrs["case"]


class Beside:
    """A section with an independent block beside it, which neither drives nor is driven."""

    def __init__(self, block):
        self.block = np.atleast_2d(block)
        self.c = np.concatenate((HEAVY.c, np.zeros(len(self.block))))
        self.state_names = (*HEAVY.state_names, *("aside",) * len(self.block))
        self.search_range = HEAVY.search_range

    def _joined(self, A, b, block):
        n, m = A.shape[-1], len(block)
        wide = np.zeros((*A.shape[:-2], n + m, n + m))
        wide[..., :n, :n], wide[..., n:, n:] = A, block
        return wide, np.concatenate((b, np.zeros((*b.shape[:-1], m))), axis=-1)

    def stack(self, speeds):
        return self._joined(*HEAVY.stack(speeds), self.block)

    def derivative(self, speeds):
        return self._joined(*HEAVY.derivative(speeds), 0 * self.block)

    def at(self, speed):
        A, b = self.stack(np.asarray(speed))
        return LureSystem(A, b, self.c)


@pytest.mark.parametrize(
    ("block", "others", "bias_stable"),
    [
        ([[-0.1]], 0, True),
        ([[0.02, 1.0], [-1.0, 0.02]], 1, True),  # another oscillation that grows
        ([[0.02, 0.0], [0.0, 0.03]], 1, True),  # one that has turned into two real roots
        ([[0.02]], 0, False),  # the mean runs away: left to the bias
    ],
    ids=["quiet", "pair", "split pair", "real"],
)
def test_whatever_else_grows_makes_a_cycle_unstable(block, others, bias_stable):
    """What stands aside changes neither the cycle nor how its root drifts."""
    spring = Hysteresis(1.0, 0.2)
    at = describing_at(HEAVY, spring, [1.0, 3.0])
    balance = Balance(Beside(block), spring, biased=False)
    y = balance.pack(at.amplitude, at.bias, at.speed, at.k)
    found = stability(balance, y, spring.describing(at.amplitude, at.bias))
    assert np.all(found.drift < 0)
    np.testing.assert_allclose(found.drift, at.drift, rtol=1e-9)
    np.testing.assert_array_equal(found.others, others)
    assert np.all(found.bias_stable == bias_stable)
    assert np.all(found.stable == (others == 0 and bias_stable))


def test_the_bias_follows_the_amplitude_of_a_root_that_drifts():
    """d Re p/d ln A with the mean balanced anew at either amplitude, one matrix at a time."""
    family = SectionFamily(TypicalSection(omega_bar=0.5, a_h=-0.4))
    spring = Hysteresis(0.6, 1.0, 0.1, 0.2)
    found = describing_at(
        family, spring, [1.2, 2.0], DescribingOptions(speed_ratio_range=(0.4, 1.1))
    )
    assert found.speed.size > 1

    def mean_load(bias, load, amplitude):
        return load * bias + float(spring.describing(amplitude, bias).F0)

    for A, B, U, k, drift in zip(
        found.amplitude, found.bias, found.speed, found.k, found.drift, strict=True
    ):
        system = family.at(U)
        load, growth = float(system.inverse_transfer(0.0).real), []
        for amplitude in (A * (1 - 1e-5), A * (1 + 1e-5)):
            bias = scipy.optimize.newton(mean_load, B, args=(load, amplitude), tol=1e-14)
            roots = np.linalg.eigvals(system.closed(complex(spring.describing(amplitude, bias).N)))
            growth.append(roots[np.argmin(np.abs(roots - 1j * k))].real)
        assert drift == pytest.approx((growth[1] - growth[0]) / 2e-5, rel=1e-5)


@pytest.mark.parametrize("a_h", [-0.4, -0.2, 0.0])
@pytest.mark.parametrize("omega_bar", [0.2, 0.8])
def test_cycles_with_a_bias_end_where_it_dies_out_and_are_no_symmetric_ones(a_h, omega_bar):
    """Beside the symmetric family there is one with a bias, once, and its mirror image.

    At the pitchfork where they meet, Newton's method may step over to the symmetric family, on
    which the bias is round-off: neither a seed nor a walk may go on there.
    """
    section = SectionFamily(TypicalSection(omega_bar=omega_bar, a_h=a_h))
    curve = describing_curve(section, Freeplay(0.02))
    assert sorted((f.symmetric, f.mirror_of is None) for f in curve.families) == [
        (False, False), (False, True), (True, True)
    ]  # fmt: skip
    for family in curve.families:
        own = curve.family == family.number
        bias = np.abs(curve.bias[own])
        if family.symmetric:
            assert np.all(bias == 0.0)
            continue
        assert min(bias[0], bias[-1]) == pytest.approx(1e-6 * 0.01, rel=1e-3)  # the pitchfork
        assert np.all(bias > 0.9e-6 * 0.01)
        assert sum("the bias dies out" in end for end in family.ends) == 1
        at = np.flatnonzero(own)[np.argmin(bias)]
        there = describing_at(section, Freeplay(0.02), np.array([curve.amplitude[at]]))
        assert np.min(np.abs(there.speed[abs(there.bias) < 1e-12] / curve.speed[at] - 1.0)) < 1e-5


SHIFTED = TypicalSection(
    omega_bar=0.4268851872512805, mu=242.4456399508668, a_h=-0.10661997847245824,
    x_alpha=0.16212710723078608, r_alpha=0.45157067334330436, zeta_alpha=0.0011543833913274797,
)  # fmt: skip
LIGHT = TypicalSection(
    omega_bar=0.9174473918848747, mu=32.640608835293385, a_h=-0.35488321465819067,
    x_alpha=0.17374172074171143, r_alpha=0.40045279090427777, zeta_alpha=0.0012770318882959308,
    zeta_xi=0.00040970936984653774,
)  # fmt: skip
OFFSET = Hysteresis(
    0.9649417527158997, 0.6489090688958854, 0.13210706344118628, -0.19056717305636195
)


@pytest.mark.parametrize(
    ("family", "spring", "count"),
    [
        (SectionFamily(SHIFTED), Freeplay(1.0, 0.14544250824639837), 2),  # near each other
        (SectionFamily(LIGHT, QuasiSteady()), OFFSET, 1),
    ],
)
def test_a_family_is_found_once(family, spring, count):
    """A step does not end on another curve, and a cycle beside a corner is known to be a member."""
    curve = describing_curve(family, spring)
    assert len(curve.families) == count
    balance, speeds = Balance(family, spring, biased=True), np.geomspace(*curve.speed_range, 60)
    seeds = scan(balance, np.geomspace(*curve.amplitude_range, 300), speeds)
    low = np.argmin(curve.amplitude)  # a cycle that does not switch yet
    still = balance.pack(*(one[low] for one in (curve.amplitude, curve.bias, curve.speed, curve.k)))
    for seed in [still, *seeds[::36]]:
        found = _follow(balance, Domain(curve.amplitude_range, speeds), seed)
        assert np.max(np.abs(np.diff(found.branch.x[:, BIAS]))) < 0.5
        x = found.nodes()[1]
        steps = np.abs(np.diff(x, axis=0))
        straight = (np.max(steps[:, 1:], axis=1) < 1e-9) & (steps[:, 0] > 1e-6)
        for t in np.linspace(0.05, 0.95, 19):  # beside a corner, too
            assert np.all(found.contains(((1.0 - t) * x[:-1] + t * x[1:])[straight]))
