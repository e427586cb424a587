"""Every term of the describing function's bounds counts: loops made so that it is needed.

A loop is given by its harmonics alone, sampled up to some and known beyond by a tail. Its higher
harmonics η are iterated to the end, and whatever the bounds say must hold of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import scipy.optimize
from hypothesis import given, settings
from hypothesis import strategies as st

from aeroflutter.guarantees.bounds import Bounds, mean_square_bounds, supremum_bounds
from aeroflutter.guarantees.law import Law, Unfit, law_of
from aeroflutter.guarantees.loop import LoopSamples, sample_loop
from aeroflutter.guarantees.region import find_regions
from aeroflutter.model.lure import FixedFamily, LureSystem, SectionFamily
from aeroflutter.model.section import TypicalSection
from aeroflutter.springs import Bilinear, Cubic, Freeplay, Hysteresis, Spring, Table

SECTION = SectionFamily(TypicalSection(omega_bar=0.8))
SAMPLES = 1 << 13
ROOM = 1.0 + 1e-6  # of the samples
GAP = Freeplay(1.0)
BENT = Table((-2.0, -0.5, 0.5, 2.0), (-1.7, -0.2, 0.2, 1.7))


@dataclass(frozen=True)
class Loop:
    """G_k of odd k >= 3 (zero where none is given), known one by one up to `sampled`."""

    G: dict[int, complex]
    sampled: int
    decay: int = 2

    def samples(self) -> LoopSamples:
        ks = np.arange(1, self.sampled + 1, 2)
        Z = 1 / np.array([self.G.get(k, 1e-30) for k in ks], dtype=complex)
        first = self.sampled + 2
        beyond = [abs(G) * (k / first) ** self.decay for k, G in self.G.items() if k >= first]
        return LoopSamples(Z[None], np.array([max(beyond, default=0.0)]), self.decay)

    def filter(self, stiffness: float) -> np.ndarray:
        """1/(Z_k + s) for k = 0 … (SAMPLES/2), zero but for odd k >= 3."""
        out = np.zeros(SAMPLES // 2 + 1, dtype=complex)
        for k, G in self.G.items():
            out[k] = G / (1 + stiffness * G)
        return out


@dataclass(frozen=True)
class Truth:
    """Norm and supremum of η, and how far it moves the describing function."""

    norm: float
    supremum: float
    shift: float


def truth(law: Law, a: float, loop: Loop) -> Truth:
    """By iteration of η = H u[a sin θ + η], which the bounds say contracts."""
    theta = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    low, high = law.slopes(np.array([2.0 * a]))
    s = float(low[0] + high[0]) / 2
    H, eta = loop.filter(s), np.zeros(SAMPLES)

    def rest(y: np.ndarray) -> np.ndarray:
        return 2 / SAMPLES * np.fft.rfft(s * y - law.spring.moment(y))

    for _ in range(2000):
        before = eta
        eta = np.fft.irfft(SAMPLES / 2 * H * rest(a * np.sin(theta) + eta))
        if np.max(np.abs(eta - before)) < 1e-13 * a:
            break
    else:
        raise AssertionError("the iteration does not converge")
    spectrum = 2 / SAMPLES * np.fft.rfft(eta)
    shift = rest(a * np.sin(theta) + eta)[1] - rest(a * np.sin(theta))[1]
    return Truth(float(np.linalg.norm(spectrum)), float(np.max(np.abs(eta))), abs(shift) / a)


def bounds(law: Law, a: float, loop: Loop, method: str, limit: float) -> Bounds:
    amplitude, samples = np.array([a]), loop.samples()
    F = law.harmonics(amplitude, loop.sampled)
    if method == "supremum":
        return supremum_bounds(law, amplitude, F, samples)
    return mean_square_bounds(law, amplitude, F, samples, np.array([limit * a]))


def check(spring: Spring, a: float, loop: Loop, method: str, limit: float = 1.0) -> None:
    """The bounds against the truth; they must say something."""
    law = law_of(SECTION, spring)
    found, true = bounds(law, a, loop, method, limit), truth(law, a, loop)
    assert np.isfinite(found.sigma[0])
    assert true.shift <= found.sigma[0] * ROOM
    assert true.supremum <= found.reach[0] * ROOM
    assert (true.norm if method == "mean square" else true.supremum) <= found.rest[0] * ROOM


def contraction(law: Law, a: float, loop: Loop, method: str, found: Bounds) -> float:
    """Norm of the filter that turns a change of u into one of η."""
    if method == "mean square":
        p, q = (float(slope[0]) for slope in law.slopes(np.array([a])))
        return 0.5 * (q - p) * float(np.max(np.abs(loop.filter(0.5 * (p + q)))))
    kernel = np.abs(np.fft.irfft(SAMPLES * loop.filter(law.stiffness)))
    step, half = 2 * np.pi / SAMPLES, SAMPLES // 2
    width = float(law.active(np.array([a]), found.reach)[0])
    inside = min(int(width / step), half)
    mass = np.concatenate(([0.0], np.cumsum(np.concatenate((kernel[:half], kernel[:half])))))
    return law.lipschitz * float(np.max(mass[inside : inside + half] - mass[:half])) * step / np.pi


METHODS = pytest.mark.parametrize("method", ["mean square", "supremum"])
KNOWN = 17  # harmonics sampled, of which eight are put into the spring


@METHODS
@pytest.mark.parametrize("gain", [1e-5, 1e-2, 0.1])
def test_a_loop_that_answers_in_its_tail_only(method: str, gain: float) -> None:
    """Nothing is seen of it in the sampled harmonics: all that is said of it is the tail."""
    check(GAP, 1.0, Loop({KNOWN + 2: gain}, KNOWN), method)


@METHODS
@pytest.mark.parametrize("gain", [1e-5, 1e-2])
def test_a_loop_that_answers_beyond_the_harmonics_put_into_the_spring(
    method: str, gain: float
) -> None:
    check(BENT, 0.55, Loop({19: gain, 21: gain}, 41), method)


@METHODS
def test_a_wave_whose_top_lies_between_the_samples(method: str) -> None:
    """The first iterate is a pulse, and its top half-way between two of its samples."""
    law, ks, between = law_of(SECTION, GAP), np.arange(3, KNOWN + 1, 2), np.pi / 256
    F = law.harmonics(np.array([1.0]), KNOWN)[0, 1:]
    G = -1e-5 * np.exp(-1j * (np.angle(F) + ks * between)) / np.abs(F)
    check(GAP, 1.0, Loop(dict(zip(ks.tolist(), G.tolist(), strict=True)), KNOWN), method)


@METHODS
@pytest.mark.parametrize("gain", [0.3, 0.5, -0.3])
def test_a_loop_that_feeds_its_harmonics_back(method: str, gain: float) -> None:
    """Each harmonic comes back with its own sign: the first iterate falls short of the sum."""
    check(GAP, 0.52, Loop({3: gain / (1 - 0.5 * gain)}, KNOWN), method)


def test_the_reach_of_a_cubic_covers_what_its_contraction_leaves_open() -> None:
    """η is the first iterate and a filtered v with |v| <= r |η|: at worst all of v at one place."""
    law, loop = law_of(SECTION, Cubic(1.0, 0.5)), Loop({3: 1e-3, 19: 0.3}, KNOWN)
    found = bounds(law, 1.0, loop, "mean square", 1.2)
    p, q = (float(slope[0]) for slope in law.slopes(np.array([1.2])))
    width = np.linalg.norm(loop.filter(0.5 * (p + q)))
    assert np.isfinite(found.sigma[0])
    assert found.reach[0] >= width * 0.5 * (q - p) * found.rest[0]


def test_a_cubic_beyond_the_pitch_up_to_which_its_slope_is_known_is_not_bounded() -> None:
    law, loop = law_of(SECTION, Cubic(1.0, 0.5)), Loop({3: 0.1}, KNOWN)
    assert np.isinf(bounds(law, 1.0, loop, "mean square", 1.0).sigma[0])
    assert np.isfinite(bounds(law, 1.0, loop, "mean square", 1.2).sigma[0])


@METHODS
@pytest.mark.parametrize("spring", [GAP, BENT], ids=["gap", "bent"])
@given(seed=st.integers(0, 2**32 - 1), share=st.floats(0.0, 1.0))
@settings(max_examples=60)
def test_the_ratio_is_no_less_than_what_contracts(
    spring: Spring, method: str, seed: int, share: float
) -> None:
    """Random filters of the sampled harmonics, and of a tail at its bound."""
    rng, top = np.random.default_rng(seed), 400
    known = {k: complex(*rng.normal(size=2)) / 100 for k in range(3, KNOWN + 1, 2)}
    decay = 1 + seed % 2
    tail = {
        k: share * 0.1 * (19 / k) ** decay * np.exp(2j * np.pi * rng.uniform())
        for k in range(KNOWN + 2, top, 2)
    }
    for G in (known, tail, known | tail):
        ratio_holds(spring, 0.5001, Loop(G, KNOWN, decay), method)


@METHODS
def test_the_ratio_of_a_tail_against_its_own_stiffness(method: str) -> None:
    """1/(1/G + s) exceeds G where they oppose each other."""
    ratio_holds(GAP, 0.5001, Loop({KNOWN + 2: -0.8}, KNOWN), method)


def ratio_holds(spring: Spring, a: float, loop: Loop, method: str) -> None:
    law = law_of(SECTION, spring)
    found = bounds(law, a, loop, method, 1.0)
    assert found.ratio[0] >= contraction(law, a, loop, method, found) * (1 - 1e-7)


def test_the_answer_of_a_saw_stays_below_its_bound() -> None:
    """A spring of many teeth: what its corners add to the variation of dF/dθ is most of it."""
    teeth = 40
    pitch = np.linspace(-1.0, 1.0, teeth + 2)[1:-1]
    saw = Table(tuple(pitch), tuple(0.01 * (-1.0) ** np.arange(teeth)))
    law = law_of(SECTION, saw)
    amplitude = np.array([0.9])
    F = law.harmonics(amplitude, 199)
    ks = 2 * np.arange(F.shape[1]) + 1
    assert np.all(np.abs(F) <= law.variation(amplitude)[:, None] / (np.pi * ks**2) + 1e-12)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_the_tail_of_a_loop_of_every_degree_stays_below_its_bound(degree: int) -> None:
    """G = 1/((s + 1) … (s + degree)) falls with the power of its degree."""
    poles = np.arange(1.0, degree + 1)
    A = -np.diag(poles) + np.diag(np.ones(degree - 1), 1)
    system = LureSystem(A, np.eye(degree)[-1], np.eye(degree)[0], ("x",) * degree)
    speed, omega, highest = np.array([1.0]), np.array([1.0]), 1001
    loop = sample_loop(FixedFamily(system), speed, omega, highest)
    ks = (highest + 2) * np.array([1, 3, 9, 27, 81])
    G = np.abs(1 / np.prod(1j * ks[:, None] + poles, axis=1))
    assert loop.decay == min(degree, 2)
    assert np.all(loop.tail[0] * ((highest + 2) / ks) ** loop.decay >= G * (1 - 1e-12))


# --- regions --------------------------------------------------------------------------------------

POINT = {"speed": 3.85, "omega": 0.2277}


def distance(speed: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """z = 1/G(jω; U) less its value at the point, from one matrix at a time."""
    z = [SECTION.at(U).inverse_transfer(1j * w) for U, w in zip(speed, omega, strict=True)]
    return np.array(z) - SECTION.at(POINT["speed"]).inverse_transfer(1j * POINT["omega"])


def around(target: complex) -> np.ndarray:
    """Speed and frequency at which z has a value near zero."""

    def missing(x: np.ndarray) -> list[float]:
        z = distance(x[:1], x[1:])[0] - target
        return [z.real, z.imag]

    found = scipy.optimize.root(missing, list(POINT.values()), tol=1e-13).x
    assert np.hypot(*missing(found)) < 1e-9 * abs(target)
    return found


def region(bound):
    point = {name: np.array([value]) for name, value in POINT.items()}
    N = -SECTION.at(POINT["speed"]).inverse_transfer(1j * np.array([POINT["omega"]]))
    found = find_regions(SECTION, N, **point, bound=bound)
    assert found.found[0]
    return found


@pytest.mark.parametrize("size", [1e-4, 1e-3, 1e-2])
def test_a_region_holds_its_rim_between_the_rays(size: float) -> None:
    found = region(lambda at, U, w: np.full(U.shape, size))
    assert found.radius[0] > 1.01 * size  # no cycle on the rim: |z| exceeds what moves it
    rim = [around(found.radius[0] * np.exp(1j * angle)) for angle in np.linspace(0, 2 * np.pi, 97)]
    speed, omega = np.transpose(rim)
    assert found.speed[0, 0] <= speed.min() < speed.max() <= found.speed[0, 1]
    assert found.omega[0, 0] <= omega.min() < omega.max() <= found.omega[0, 1]


def test_a_bound_that_is_large_inside_the_rim_is_seen() -> None:
    def bound(at, U, w):
        size = np.abs(distance(U.ravel(), w.ravel())).reshape(U.shape)
        return np.where((size > 3e-4) & (size < 8e-4), 5e-3, 1e-3)

    assert region(bound).radius[0] > 5e-3


# --- laws -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "spring",
    [
        Table((-3.0, -2.0, -1.0, 1.005, 2.0, 3.0), (-2.0, -1.0, -0.5, 0.5, 1.0, 2.0)),
        Table((-1.0, 0.5, 1.5, 3.0), (-1.5, 0.0, 0.0, 1.503)),
        Bilinear(1e-3, 0.0, -0.25, 0.5),
        Hysteresis(1.0, 0.2, 1e-3),
    ],
    ids=["place", "slope", "moment", "loop"],
)
def test_a_law_that_is_all_but_odd_about_a_centre_is_not_bounded(spring: Spring) -> None:
    with pytest.raises(Unfit):
        law_of(SECTION, spring)


def test_a_centre_that_a_moment_has_to_hold_is_not_bounded() -> None:
    """1/G(0) is small ahead of the quarter chord, and not zero."""
    family = SectionFamily(TypicalSection(omega_bar=0.8, a_h=-0.4999))
    with pytest.raises(Unfit):
        law_of(family, Freeplay(1.0, 0.3))
    assert law_of(family, Freeplay(1.0)).centre == 0.0
