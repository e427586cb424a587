"""Harmonic balance of laws that jump: relays and friction, in closed form."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.integrate import quad

from aeroflutter import Freeplay, SectionFamily, TypicalSection
from aeroflutter.errors import ConvergenceError
from aeroflutter.model.family import SectionModel
from aeroflutter.orbits.cycles import Cycle, CycleOptions, limit_cycles
from aeroflutter.orbits.harmonic import HarmonicOptions, harmonic_balance
from aeroflutter.orbits.harmonic.branch import solve_cycle
from aeroflutter.orbits.harmonic.moment import Switched, answer
from aeroflutter.orbits.harmonic.monodromy import multipliers
from aeroflutter.springs import Friction, Relay, Spring

SECTION = SectionFamily(TypicalSection(omega_bar=0.8))
LAWS = [Relay(1.3), Relay(1.3, 0.8), Friction(0.3, 0.7)]
Y = np.array([0.2, 1.0 - 2.0j, 0.3 + 0.1j, -0.2j, 0.05])


def forces(law: Spring, theta: float) -> float:
    """The moment along the motion Y by its definition: from where it came to this angle."""
    ks = np.arange(Y.size)
    past = np.linspace(theta - 2 * np.pi, theta, 4001)
    y = (np.exp(1j * np.outer(past, ks)) @ Y).real
    if isinstance(law, Friction):
        rate = float((1j * ks * np.exp(1j * theta * ks) @ Y).real)
        return float(law.beta1 * y[-1] + law.friction * np.sign(rate))
    assert isinstance(law, Relay)
    beyond = np.flatnonzero(np.abs(y) > 0.5 * law.width)
    return float(law.level * np.sign(y[beyond[-1]]))


@pytest.mark.parametrize("law", LAWS)
def test_the_harmonics_of_a_law_that_jumps_are_its_integrals(law: Spring) -> None:
    found = answer(law, Y)
    assert isinstance(found, Switched)
    F = found.moment(4)
    for k in range(4):
        unit = (1.0 if k else 0.5) / np.pi
        for part, wave in ((F[k].real, np.cos), (-F[k].imag, np.sin)):
            value = quad(
                lambda theta, k=k, wave=wave: forces(law, theta) * wave(k * theta),
                0.0, 2 * np.pi, points=np.sort(found.at % (2 * np.pi)), limit=400,
            )[0]  # fmt: skip
            assert abs(part - unit * value) < 1e-4


@pytest.mark.parametrize("law", LAWS)
def test_the_first_harmonic_of_a_sinusoid_is_the_describing_function(law: Spring) -> None:
    sine, bias = 1.7, 0.1
    found = answer(law, np.array([bias, -1j * sine])).moment(2)
    closed = law.describing(sine, bias)
    assert found[0] == pytest.approx(float(closed.F0), abs=1e-13)
    assert found[1] == pytest.approx(-1j * sine * complex(closed.N), abs=1e-13)


@pytest.mark.parametrize("law", LAWS)
def test_its_derivative_is_that_of_differences(law: Spring) -> None:
    ks, h = np.arange(Y.size), 1e-6
    found = answer(law, Y).derivative(ks)
    for i in range(2 * ks.size):
        if i == ks.size:  # a mean has no imaginary part
            continue
        step = np.zeros(ks.size, dtype=complex)
        step[i % ks.size] = h if i < ks.size else 1j * h
        change = answer(law, Y + step).moment(ks.size) - answer(law, Y - step).moment(ks.size)
        expected = np.concatenate((change.real, change.imag)) / (2 * h)
        assert np.max(np.abs(found[:, i] - expected)) < 1e-7


def test_a_relay_that_stays_between_its_edges_never_jumps() -> None:
    small = answer(Relay(1.0, 3.0), np.array([0.2, 0.5], dtype=complex))
    assert small.straight
    assert small.moment(3)[0] == 1.0
    assert np.all(small.derivative(np.arange(2)) == 0.0)


@pytest.mark.parametrize("law", [*LAWS, Freeplay(0.2)])
def test_a_motion_without_bounds_is_no_motion(law: Spring) -> None:
    with pytest.raises(ConvergenceError, match="bounds"):
        answer(law, np.array([0.0, np.inf], dtype=complex))


@cache
def exact_cycles(law: Spring) -> tuple[Cycle, ...]:
    """By shooting."""
    found = limit_cycles(SECTION, law, CycleOptions(simulations=0, depth=0, points=30))
    return found.families[0].cycles


@pytest.mark.parametrize(
    ("law", "ratio", "stable", "order"),
    [
        (Relay(0.01, 0.002), 0.9, True, 2.5),
        (Relay(0.01, 0.002), 0.8, False, 2.5),
        (Relay(0.01), 1.1, False, 2.5),
        (Relay(0.01), 0.95, True, 2.5),
        (Friction(0.01), 0.99, True, 0.9),
    ],
)
def test_cycles_and_multipliers_go_to_the_exact_ones(
    law: Spring, ratio: float, stable: bool, order: float
) -> None:
    """With a power of the harmonics: of a motion whose second derivative jumps, the third. Friction
    jumps where the rate is zero, in the very place where its series is the worst."""
    cycles = [cycle for cycle in exact_cycles(law) if cycle.stable == stable]
    exact = min(cycles, key=lambda cycle: abs(cycle.speed_ratio - ratio))
    off, largest = [], float(np.max(np.abs(exact.multipliers)))
    for harmonics in (15, 121):
        cycle = solve_cycle(SECTION, law, exact, options=HarmonicOptions(harmonics=harmonics))
        found = multipliers(SECTION, cycle, answer(law, cycle.Y), symmetric=True)
        assert (np.max(np.abs(found.basic[1:])) < 1.0) == stable
        off.append(abs(abs(cycle.Y[1]) / abs(exact.Y[1]) - 1.0))
    assert np.log(off[0] / off[1]) / np.log(121 / 15) > order
    away = max(float(np.min(np.abs(found.all - root))) for root in exact.multipliers[:3])
    assert away < 1e-4 * largest
    assert found.error < 1e-4 * largest


@pytest.mark.parametrize(
    ("laws", "ratios"),
    [
        ((Freeplay(0.05), Friction(0.0005)), (0.95, 1.0)),
        ((Relay(0.01, 0.002), Freeplay(0.05)), (0.6, 0.7)),
    ],
)
def test_two_springs_of_which_one_jumps_have_the_multipliers_of_shooting(
    laws: tuple[Spring, Spring], ratios: tuple[float, float]
) -> None:
    """In pitch and heave; harmonics up to 61, both parts of the error seen."""
    family = SectionModel(SECTION.section, springs=["pitch", "heave"])
    options = CycleOptions(
        simulations=0, depth=0, points=40, max_states=60, speed_ratio_range=ratios
    )
    families = limit_cycles(family, laws, options).families
    compared = 0
    for exact in [cycle for one in families for cycle in one.cycles[::4]]:
        if abs(exact.multipliers[1]) > 5.0:
            continue
        try:
            cycle = solve_cycle(family, laws, exact, options=HarmonicOptions(harmonics=61))
        except ConvergenceError:  # it sticks, which no few harmonics can
            continue
        answers = [answer(*pair) for pair in zip(laws, cycle.motions, strict=True)]
        found = multipliers(family, cycle, answers, symmetric=False)
        away = max(float(np.min(np.abs(found.all - root))) for root in exact.multipliers[:4])
        assert away < 5.0 * found.error + 4e-3 * np.max(np.abs(exact.multipliers))
        compared += 1
    assert compared >= 4


def test_a_family_that_turns_in_amplitude_where_it_is_started_is_followed() -> None:
    """An island: the describing function's least distorted cycle is its largest."""
    section = TypicalSection(
        omega_bar=0.2,
        mu=13.154072270984562,
        a_h=-0.5,
        x_alpha=0.3075894961739832,
        r_alpha=0.6009191204320663,
    )
    law = Relay(np.radians(0.19514892088522304), np.radians(0.3902978417704461))
    found = harmonic_balance(SectionFamily(section), law, HarmonicOptions(harmonics=15))
    folds = sorted(one.cycle.speed_ratio for one in found.bifurcations if one.kind == "fold")
    assert folds == pytest.approx([0.05273222, 0.27955682], rel=2e-3)  # exact, by shooting
