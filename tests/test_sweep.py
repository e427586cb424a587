"""Monte-Carlo sweeps: distributions as documented, samples that repeat, numbers that are right."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from aeroflutter import Hysteresis, SectionFamily, TypicalSection
from aeroflutter.cli import main
from aeroflutter.errors import InputError
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.motion.endstates import end_state
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.response import STATES, Initial
from aeroflutter.orbits.describing import describing_curve
from aeroflutter.studies.maps import Processes, Threads
from aeroflutter.studies.maps.sampling import (
    DESIGNS,
    KINDS,
    Distribution,
    parse_distribution,
    sample,
)
from aeroflutter.studies.maps.sweep import Specimen, SweepOptions, sweep

# Each distribution by SciPy's name and parametrisation, independently of the module's.
WRITTEN = {
    "normal(100,5)": stats.norm(loc=100.0, scale=5.0),
    "normal(1,1,0,3)": stats.truncnorm(-1.0, 2.0, loc=1.0, scale=1.0),
    "lognormal(2,0.5)": stats.lognorm(s=0.5, scale=2.0),
    "uniform(-1,3)": stats.uniform(loc=-1.0, scale=4.0),
    "triangular(0,1,4)": stats.triang(c=0.25, loc=0.0, scale=4.0),
    "beta(1,2,2,5)": stats.beta(2.0, 5.0, loc=1.0, scale=1.0),
}


@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize("text", WRITTEN)
def test_samples_follow_their_distribution(text: str, design: str) -> None:
    drawn = sample({"q": parse_distribution(text)}, 2048, seed=3, design=design)["q"]
    distance = stats.kstest(drawn, WRITTEN[text].cdf).statistic
    # Kolmogorov's 1 % bound for independent draws; a design that fills space does far better
    assert distance < (1.63 / np.sqrt(2048) if design == "random" else 2.0 / 2048)


def test_a_choice_takes_its_values_equally_often() -> None:
    drawn = sample({"q": parse_distribution("choice(1,2,5)")}, 3000, seed=1)["q"]
    counts = np.unique(drawn, return_counts=True)
    assert counts[0].tolist() == [1.0, 2.0, 5.0]
    assert stats.chisquare(counts[1]).pvalue > 0.01


def test_a_cut_distribution_piles_nothing_up_on_its_bounds() -> None:
    drawn = sample({"q": parse_distribution("normal(0,1,-0.5,2)")}, 4000)["q"]
    assert -0.5 < drawn.min() < drawn.max() < 2.0
    assert np.unique(drawn).size == drawn.size


@given(st.integers(0, 2**32), st.integers(1, 200), st.sampled_from(DESIGNS))
def test_the_same_seed_gives_the_same_sample(seed: int, number: int, design: str) -> None:
    asked = {"a": Distribution("normal", (0.0, 1.0)), "b": Distribution("uniform", (0.0, 1.0))}
    first, again = (sample(asked, number, seed, design) for _ in range(2))
    other = sample(asked, number, seed + 1, design)
    for name in asked:
        assert first[name].tobytes() == again[name].tobytes()
        assert first[name].size == number
        assert not np.array_equal(first[name], other[name])


def test_a_quantity_is_drawn_the_same_whatever_else_varies() -> None:
    one = Distribution("normal", (0.0, 1.0))
    alone = sample({"a": one}, 50, seed=4)["a"]
    both = sample({"b": one, "a": one}, 80, seed=4)
    assert np.array_equal(both["a"][:50], alone)
    # independent: the correlation of 80 pairs is within three of its standard deviations
    assert abs(np.corrcoef(both["a"], both["b"])[0, 1]) < 3.0 / np.sqrt(80)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("gauss(0,1)", "unknown distribution"),
        ("normal(0)", "takes mean, deviation"),
        ("normal(0,-1)", "deviation must be positive"),
        ("normal(0,1,3,2)", "nothing lies between"),
        ("normal(0,1,50,60)", "puts nothing between"),
        ("uniform(2,1)", "low must lie below high"),
        ("triangular(0,5,4)", "low <= mode <= high"),
        ("beta(0,1,-1,2)", "positive"),
        ("choice()", "one or more values"),
        ("normal(a,b)", "not a number"),
        ("normal", "must be written"),
    ],
)
def test_bad_distributions_are_named(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        parse_distribution(text)


class Sections:
    """Sections of different mass ratio with the spring of run 14, marched at U* = 3.9."""

    spring = Hysteresis(np.radians(1.0), np.radians(0.2))
    initial = Initial(alpha=np.radians(8.0))

    def at(self, values) -> Specimen:
        family = SectionFamily(TypicalSection(omega_bar=0.8, mu=values["mu"]))
        return Specimen(family, self.spring, self.initial, 3.9)

    def identity(self):
        return {}


def test_every_section_of_a_sweep_is_what_it_is_alone() -> None:
    drawn = sample({"mu": parse_distribution("normal(100,5)")}, 6, seed=2)
    found = sweep(Sections(), drawn)
    for i, mu in enumerate(drawn["mu"]):
        one = Sections().at({"mu": mu})
        assert found.values["flutter_speed"][i] == flutter_speed(one.family)
        onset = describing_curve(one.family, one.spring).onset
        assert found.values["onset_speed"][i] == onset.speed
        assert found.values["onset_amplitude_deg"][i] == np.degrees(onset.amplitude)
        system = one.family.at(3.9)
        alone = end_state(Flow(system, [one.spring]), *one.initial.start(system, one.spring))
        assert STATES[found.values["state"][i]] == alone.state
        assert np.radians(found.values["amplitude_deg"][i]) == pytest.approx(
            alone.amplitude, rel=1e-9, abs=1e-15
        )


def test_statistics_are_those_of_the_sample() -> None:
    drawn = sample({"mu": parse_distribution("uniform(90,110)")}, 40, seed=5)
    found = sweep(Sections(), drawn, SweepOptions(onset=False))
    speeds = [flutter_speed(Sections().at({"mu": mu}).family) for mu in drawn["mu"]]
    told = found.distribution("flutter_speed")
    assert told["number"] == 40
    assert told["mean"] == pytest.approx(np.mean(speeds), rel=1e-14)
    assert told["deviation"] == pytest.approx(np.std(speeds, ddof=1), rel=1e-12)
    assert told["quantiles"]["0.5"] == pytest.approx(np.median(speeds), rel=1e-14)
    assert (told["min"], told["max"]) == (min(speeds), max(speeds))
    assert found.distribution("onset_speed") == {"number": 0}
    cycling = found.values["state"] == STATES.index("lco")
    assert 0 < cycling.sum() < 40  # amplitudes are those of the cycles, not of the rests
    assert found.distribution("amplitude_deg")["number"] == cycling.sum()
    assert found.of("amplitude_deg").min() > 0
    assert sum(found.count(state) for state in STATES) == 40


def test_flutter_speed_spreads_as_its_slope_says() -> None:
    """To first order a small deviation of μ is one of U*_L times the slope there."""
    wide = 0.5
    drawn = sample(
        {"mu": Distribution("normal", (100.0, wide))}, 64, seed=7, design="latin-hypercube"
    )
    found = sweep(Sections(), drawn, SweepOptions(onset=False)).distribution("flutter_speed")

    def at(mu: float) -> float:
        return flutter_speed(SectionFamily(TypicalSection(omega_bar=0.8, mu=mu)))

    slope = (at(100.01) - at(99.99)) / 0.02
    # the deviation of a stratified sample of 64, and the curvature over a deviation of 0.5 %
    assert found["deviation"] == pytest.approx(abs(slope) * wide, rel=0.05)
    assert found["mean"] == pytest.approx(at(100.0), rel=1e-4)


def test_who_computes_does_not_matter() -> None:
    drawn = sample({"mu": parse_distribution("normal(100,5)")}, 24, seed=9)
    options = SweepOptions(onset=False)
    first, *others = (
        sweep(Sections(), drawn, options, executor=one)
        for one in (Threads(1), Threads(2), Processes(2))
    )
    for other in others:
        for name, values in first.values.items():
            assert values.tobytes() == other.values[name].tobytes(), name


WORDS = ("sweep", "run14", "--vary", "section.mu=normal(100,5)", "--sample", "6")


def result(capsys, *words: str) -> dict:
    code = main([*words, "--json"])
    out, err = capsys.readouterr()
    assert code == 0, err
    return json.loads(out)


def test_the_command_repeats_itself_and_says_what_it_drew(capsys) -> None:
    first, again = (result(capsys, *WORDS, "--seed", "3") for _ in range(2))
    other = result(capsys, *WORDS, "--seed", "4")
    assert first["values"] == again["values"]
    assert first["values"]["section.mu"] != other["values"]["section.mu"]
    assert first["samples"] == first["flutter_speed"]["number"] == 6
    assert (first["invalid"], first["failed"]) == (0, 0)
    assert first["seed"] == 3
    assert first["vary"] == {"section.mu": "normal(100,5)"}
    assert first["onset_speed"]["number"] == 6
    assert sum(first["states"].values()) == 0  # no airspeed, no motion


def test_amplitudes_at_a_speed_and_sections_that_cannot_be(capsys) -> None:
    vary = ("--vary", "section.x_alpha=uniform(0.2,0.6)", "--speed-ratio", "0.95", "--no-onset")
    found = result(capsys, *WORDS, *vary, "--seed", "1")
    assert found["invalid"] > 0  # |x_alpha| above r_alpha = 0.5 is no section
    assert found["flutter_speed"]["number"] == 6 - found["invalid"]
    assert sum(found["states"].values()) == 6 - found["invalid"]
    assert found["onset_speed"] == {"number": 0}


def test_files_of_a_sweep(capsys, tmp_path: Path) -> None:
    out, plot = tmp_path / "s.nc", tmp_path / "s.png"
    words = (*WORDS, "--speed", "3.9", "--out", str(out), "--plot", str(plot))
    found = result(capsys, *words)
    assert plot.stat().st_size > 0
    with xr.open_dataset(out) as data:
        assert data["varied_section_mu"].values.tolist() == found["values"]["section.mu"]
        assert data.attrs["seed"] == 0
        assert data.attrs["vary"] == "section.mu=normal(100,5)"
        assert np.allclose(data["flutter_speed"], found["values"]["flutter_speed"], rtol=0, atol=0)
    assert main(words) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert result(capsys, *words, "--resume")["values"] == found["values"]
    assert main([*words, "--seed", "8", "--resume"]) == 2
    assert "seed is 0 in the store, 8 here" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--vary", "section.mu"), "KEY=DISTRIBUTION"),
        (("--vary", "section.foo=normal(1,1)"), "section.foo"),
        (("--vary", "section.mu=normal(1,1)", "--vary", "section.mu=normal(1,1)"), "varies twice"),
        (("--vary", "section.mu=normal(-100,1)"), "puts nothing between"),
        (("--vary", "section.mu=normal(100,5)", "--sample", "0"), "at least 1"),
        (("--vary", "section.mu=normal(100,5)", "--seed", "-1"), "seed"),
        (("--vary", "section.mu=normal(100,5)", "--velocity", "20"), "SI units"),
        (("--vary", "section.mu=normal(100,5)", "--speed", "-1"), "must be positive"),
    ],
)
def test_bad_sweeps_are_refused_in_a_line(capsys, words, message: str) -> None:
    assert main(["sweep", "run14", *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err


def test_the_help_names_every_distribution(capsys) -> None:
    assert main(["sweep", "--help"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert all(f"{kind}(" in told for kind in KINDS)
