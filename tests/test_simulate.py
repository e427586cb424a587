"""What the engines share: the start, the options, the verdicts, sweeps, spectra, figures."""

from __future__ import annotations

import numpy as np
import pytest

from aeroflutter import (
    Cubic,
    Freeplay,
    Hysteresis,
    InputError,
    Linear,
    LureSystem,
    SectionFamily,
    TypicalSection,
)
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.motion._kernel_settle import repeats, survey
from aeroflutter.motion.response import STATES, Initial, Response, SimulateOptions, simulate
from aeroflutter.motion.settling import rest_pitch
from aeroflutter.motion.spectra import poincare_section, power_spectrum
from aeroflutter.motion.sweeps import sweep, there_and_back
from aeroflutter.plots.timemarch import FIGURES, plot_response, plot_sweeps
from aeroflutter.results.dataset import to_dataset

DEGREE = np.pi / 180
FAMILY = SectionFamily(TypicalSection(omega_bar=0.8))
FLUTTER = flutter_speed(FAMILY)
LOOP = Hysteresis(DEGREE, 0.2 * DEGREE)
HOUBOLT = SimulateOptions(engine="houbolt")


def at(ratio):
    return FAMILY.at(ratio * FLUTTER)


# --- the start


def test_motions_find_their_states_by_name():
    system = LureSystem(np.eye(4), np.ones(4), np.ones(4), ("alpha_rate", "xi", "z", "alpha"))
    state = Initial(alpha=1.0, alpha_rate=2.0, xi=3.0).vector(system)
    np.testing.assert_array_equal(state, [2.0, 3.0, 0.0, 1.0])


def test_the_starting_memory_is_the_springs_own_or_fits_the_pitch():
    system = at(0.9)
    for alpha in (6 * DEGREE, -6 * DEGREE, 0.0):
        assert Initial(alpha=alpha).start(system, LOOP)[1] == LOOP.initial_memory(alpha)
    # A memory that the slider could not have at this pitch is moved to where it would be.
    assert Initial(alpha=0.2, memory=-5.0).start(system, LOOP)[1] == LOOP.h_high


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"alpha": np.nan}, "initial.alpha"),
        ({"xi_rate": np.inf}, "initial.xi_rate"),
        ({"memory": np.nan}, "initial.memory"),
        ({"state": [0.0, np.nan]}, "initial.state"),
        ({"state": [0.0, 0.0], "alpha": 1.0}, "excludes"),
    ],
)
def test_bad_starts_are_named(fields, words):
    with pytest.raises(InputError, match=words):
        Initial(**fields)


def test_a_start_that_does_not_fit_the_system_is_refused():
    foreign = LureSystem(np.eye(2), np.ones(2), np.ones(2))
    with pytest.raises(InputError, match="no state of that name"):
        Initial(alpha=0.1).vector(foreign)
    with pytest.raises(InputError, match="has 2 states"):
        Initial(state=[1.0, 2.0, 3.0]).vector(foreign)


def test_all_bad_options_are_told_at_once():
    with pytest.raises(InputError) as caught:
        SimulateOptions(duration=-1.0, dt=np.nan, engine="rk4")
    assert len(caught.value.problems) == 3


# --- verdicts


def test_turning_points_of_a_sine_lie_between_the_samples():
    # The parabola through three samples: fourth order in the spacing.
    spacings, errors = np.array([0.2, 0.1, 0.05]), []
    for dt in spacings:
        y = np.sin(np.arange(0.0, 40.0, dt))
        times, values = np.empty(y.size), np.empty(y.size)
        samples, count, low, high = survey(y, 0.0, dt, 1e-14, 2.0, times, values)
        assert (samples, count, low, high) == (y.size - 2, 13, y[2:].min(), y[2:].max())
        np.testing.assert_allclose(times[:count], np.pi * (np.arange(13) + 0.5), atol=dt**2)
        errors.append(np.abs(np.abs(values[:count]) - 1.0).max())
    assert np.polyfit(np.log(spacings), np.log(errors), 1)[0] == pytest.approx(4.0, abs=0.3)


def turns_of(sizes):
    """Times and values of turning points of a motion with these amplitudes, loop by loop."""
    sizes = np.repeat(np.asarray(sizes, dtype=float), 2)
    sizes[1::2] *= -1.0
    return np.arange(sizes.size, dtype=float), sizes


def verdict(sizes, recurrence=1e-3, drift=1e-4):
    return repeats(*turns_of(sizes), 16, recurrence, drift)[0]


def test_repeats_counts_the_loops_of_a_period():
    assert verdict(np.full(40, 2.0)) == 1
    assert verdict(np.tile([2.0, 1.5], 40)) == 2
    assert verdict(np.tile([2.0, 1.5, 2.2, 1.4], 40)) == 4
    assert verdict(np.full(6, 2.0)) == 0  # too few to say


def test_repeats_waits_for_what_still_moves():
    n = np.arange(300)
    # A geometric approach is believed once what is left of it is below the drift allowed.
    slow = 1.0 + 0.05 * 0.97**n
    first = next(k for k in range(30, 300) if verdict(slow[:k]))
    assert 0.05 * 0.97**first < 2e-4
    # A negative multiplier alternates about its cycle; it is no cycle of twice the period.
    alternating = 1.0 + 0.05 * (-0.9) ** n
    assert {verdict(alternating[:k], 2e-3, 1e-2) for k in range(9, 60)} == {0, 1}
    assert {verdict(1.5 + np.tile([0.5, -0.5], 60)[:k], 2e-3) for k in range(60, 120)} == {2}
    # Passing the ghost of a fold, x' = e + x^2: slow for long, never settled.
    x, ghost = -0.05, []
    while x < 0.05:
        ghost.append(1.0 + x)
        x += 1e-6 + x * x
    assert len(ghost) > 1000
    assert not any(verdict(ghost[:k], 1e-2) for k in range(30, len(ghost), 7))
    # Chaos never repeats.
    z, chaos = 0.3, []
    for _ in range(500):
        chaos.append(1.0 + z)
        z = 3.9 * z * (1.0 - z)
    assert verdict(chaos) == 0


@pytest.mark.parametrize("scale", [1.0, 1e-9])
def test_rest_is_proved_only_inside_the_branch(scale):
    system, loop = at(0.8), Hysteresis(DEGREE * scale, 0.2 * DEGREE * scale)
    memory = 0.05 * DEGREE * scale
    near, far = np.zeros(6), np.zeros(6)
    near[1], far[1] = memory + 1e-3 * DEGREE * scale, memory + 0.499 * DEGREE * scale
    assert rest_pitch(system, loop, near, memory) == pytest.approx(memory, rel=1e-9)
    assert np.isnan(rest_pitch(system, loop, far, memory))
    # Above the flutter speed nothing decays; inside the gap of freeplay pitch stays where it is.
    assert np.isnan(rest_pitch(at(1.01), loop, near, memory))
    rest = rest_pitch(system, Freeplay(scale), near * 1e-3, 0.0)
    assert abs(rest) < scale / 2
    assert np.isnan(rest_pitch(system, Cubic(1.0, 3.0), near, 0.0))


def test_freeplay_has_the_regimes_of_price():
    # Price, Alighanbari & Lee 1995: omega_bar = 0.2, gap 0.5 deg, 7 deg of initial pitch: rest up
    # to 0.13, limit cycles at 0.14-0.22, chaos at 0.29-0.33.
    family = SectionFamily(TypicalSection(omega_bar=0.2))
    reference = flutter_speed(family)
    options = SimulateOptions(engine="houbolt", record=False)
    states = [
        simulate(
            family.at(r * reference), Freeplay(0.5 * DEGREE), Initial(alpha=7 * DEGREE), options
        ).state
        for r in (0.12, 0.15, 0.18, 0.21, 0.30, 0.31)
    ]
    assert states == ["damped", "lco", "lco", "lco", "aperiodic", "aperiodic"]


def test_houbolt_does_not_take_a_decaying_alternation_for_a_longer_period():
    # Freeplay off centre; the cycle of one loop attracts with the multiplier -0.69, of which an
    # earlier look at the march sees two loops that hardly change.
    section = TypicalSection(
        mu=50.0, a_h=-0.2, x_alpha=0.25, r_alpha=0.5, omega_bar=0.5, zeta_alpha=0.02
    )
    family = SectionFamily(section)
    system = family.at(0.7891 * flutter_speed(family))
    start = Initial(alpha=5.72068 * DEGREE, xi=0.05)
    spring = Freeplay(0.2708 * DEGREE, 0.38436 * DEGREE)
    exact = simulate(system, spring, start)
    options = SimulateOptions(engine="houbolt", dt=0.05, record=False)
    march = simulate(system, spring, start, options)
    assert exact.extras["loops"] == march.extras["loops"] == 1
    # The scheme is of second order in dt = 0.05 and finds a cycle of 470 steps.
    for name in ("amplitude", "bias", "period", "first_harmonic"):
        assert getattr(march, name) == pytest.approx(getattr(exact, name), rel=5e-4)


# --- sweeps


def test_a_sweep_carries_the_state_over_and_shows_the_jump():
    # Falling from 0.98 the cycle of run 14 is followed through the window where a start from
    # 6 deg dies out (just above 0.97), down to its fold near 0.9215 (Table 5.1: 0.922).
    ratios = np.linspace(0.98, 0.915, 14)
    down = sweep(FAMILY, LOOP, ratios * FLUTTER, Initial(alpha=10 * DEGREE), HOUBOLT)
    assert down.state == ("lco",) * 12 + ("damped",) * 2
    assert np.all(np.diff(down.amplitude) < 1e-12)
    assert not down.upward
    (jump,) = down.jumps
    assert jump.after / FLUTTER < 0.9215 < jump.before / FLUTTER
    assert jump.amplitude_before > 0.5 * DEGREE
    assert jump.amplitude_after == 0.0


def test_there_and_back_starts_afresh_where_nothing_moves():
    fractions = []
    options = SimulateOptions(engine="houbolt", progress=fractions.append)
    up, down = there_and_back(
        FAMILY, LOOP, np.linspace(0.9, 0.98, 5) * FLUTTER, Initial(alpha=10 * DEGREE), options
    )
    assert (up.upward, down.upward) == (True, False)
    assert set(up.state) == {"damped"}  # a section at rest stays at rest
    assert down.state[0] == "lco"
    assert down.state[-1] == "damped"
    assert fractions == sorted(fractions)
    assert 0.8 < fractions[-1] <= 1.0


def test_a_cycle_is_carried_up_and_down():
    up, down = there_and_back(
        FAMILY, LOOP, np.linspace(0.93, 0.96, 4) * FLUTTER, Initial(alpha=6 * DEGREE), HOUBOLT
    )
    assert set(up.state + down.state) == {"lco"}
    # One attracting branch: to the jitter of Houbolt's switches.
    np.testing.assert_allclose(up.amplitude, down.amplitude[::-1], rtol=3e-4)
    assert up.jumps == down.jumps == ()


def test_a_sweep_ends_where_the_motion_leaves():
    above = sweep(FAMILY, LOOP, np.array([0.99, 1.05, 1.1]) * FLUTTER, Initial(alpha=0.2), HOUBOLT)
    assert above.state[-1] == "divergent"
    assert above.speeds.size == 2


@pytest.mark.parametrize(
    "speeds", [[], [1.0, 1.0], [1.0, 3.0, 2.0], [-1.0, 1.0], [1.0, np.nan], [[1.0, 2.0]]]
)
def test_bad_speeds_are_refused(speeds):
    with pytest.raises(InputError, match="speeds"):
        sweep(FAMILY, LOOP, speeds, Initial(alpha=0.1), HOUBOLT)


# --- spectra and sections


def trace(pitch, dt=0.1):
    """A response that holds a made-up trace."""
    time = dt * np.arange(pitch.size)
    return Response(
        state="lco",
        reason="made up",
        engine="none",
        duration=time[-1],
        time=time,
        pitch=pitch,
        heave=0.1 * pitch,
        moment=pitch,
        memory=np.zeros(pitch.size),
        states=np.column_stack((0.1 * pitch, pitch)),
        state_names=("xi", "alpha"),
    )


def test_spectrum_of_two_tones():
    # Parseval: the density integrates to the mean square; peaks where the tones are, to the
    # resolution of the segments.
    time = 0.1 * np.arange(40_000)
    spectrum = power_spectrum(trace(2.0 * np.sin(0.25 * time) + 0.5 * np.sin(0.75 * time)))
    step = spectrum.k[1]
    assert spectrum.peaks[:2] == pytest.approx([0.25, 0.75], abs=step)
    power = np.trapezoid(spectrum.density, spectrum.k)
    assert power == pytest.approx(2.0 + 0.125, rel=0.02)  # Hann's ripple over whole segments


def test_poincare_section_of_a_sine_is_its_maximum():
    time = 0.1 * np.arange(8000)
    section = poincare_section(trace(2.0 * np.sin(0.25 * time)))
    # Cubic splines: (k dt)^4 / 384 of the amplitude.
    assert section.pitch == pytest.approx(2.0, abs=1e-8)
    assert np.diff(section.time) == pytest.approx(2 * np.pi / 0.25, abs=1e-5)
    assert section.states[:, 0] == pytest.approx(0.2, abs=1e-8)


def test_short_traces_and_unknown_signals_are_refused():
    with pytest.raises(InputError, match="march longer"):
        power_spectrum(trace(np.ones(50)))
    with pytest.raises(InputError, match="march longer"):
        poincare_section(trace(np.ones(50)))
    with pytest.raises(InputError, match="signal"):
        power_spectrum(trace(np.ones(5000)), signal="lift")
    with pytest.raises(InputError, match="fraction"):
        poincare_section(trace(np.ones(5000)), fraction=0.0)


# --- results


def test_dataset_of_a_response_speaks_degrees():
    run = simulate(at(0.93), LOOP, Initial(alpha=6 * DEGREE), HOUBOLT)
    dataset = to_dataset(run)
    np.testing.assert_allclose(dataset["pitch_deg"], run.pitch / DEGREE)
    assert dataset["pitch_deg"].attrs["units"] == "degree"
    assert dataset.attrs["end_state"] == "lco"
    assert dataset.attrs["amplitude_deg"] == pytest.approx(run.amplitude / DEGREE)
    assert list(dataset["state_name"].values) == list(run.state_names)


def test_dataset_of_a_sweep(tmp_path):
    up = sweep(FAMILY, LOOP, np.array([0.9, 0.95]) * FLUTTER, Initial(alpha=0.1), HOUBOLT)
    dataset = to_dataset(up)
    assert dataset["end_state"].attrs["flag_meanings"].split() == list(STATES)
    dataset.to_netcdf(tmp_path / "sweep.nc", engine="netcdf4")
    assert (tmp_path / "sweep.nc").stat().st_size > 0


def test_every_figure_is_drawn(tmp_path):
    options = SimulateOptions(engine="houbolt", duration=600.0, decide=False)
    run = simulate(at(0.93), LOOP, Initial(alpha=6 * DEGREE), options)
    for kind in ("overview", *FIGURES):
        figure = plot_response(run, kind, "run 14")
        figure.savefig(tmp_path / f"{kind}.png", dpi=40)
        assert all(axes.get_xlabel() or axes.get_ylabel() for axes in figure.axes)
    speeds = np.array([0.91, 0.95]) * FLUTTER
    passes = there_and_back(FAMILY, LOOP, speeds, Initial(alpha=0.3), HOUBOLT)
    plot_sweeps(passes, FLUTTER).savefig(tmp_path / "sweep.png", dpi=40)
    assert len(list(tmp_path.glob("*.png"))) == len(FIGURES) + 2


@pytest.mark.parametrize("duration", [3.0, 30_000.0])
def test_figures_of_short_and_of_long_traces(tmp_path, duration):
    options = SimulateOptions(engine="houbolt", duration=duration, decide=False)
    run = simulate(at(0.9), Linear(), Initial(alpha=0.1), options)
    plot_response(run).savefig(tmp_path / "trace.png", dpi=40)
    assert (tmp_path / "trace.png").stat().st_size > 0
