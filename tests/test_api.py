"""One namespace: analyses take cases, sections and families; results show and encode themselves."""

import subprocess
import sys

import numpy as np
import pytest
from test_engineering import SAME, TAILPLANE, loaded

import aeroflutter as af
from aeroflutter.analysis import Result
from aeroflutter.results import layouts

QUICK = af.CycleOptions(simulations=0, depth=0, points=20)
FEW = af.DescribingOptions(points=10)


@pytest.fixture(scope="module")
def case():
    return loaded(TAILPLANE)


@pytest.fixture(scope="module")
def results(case):
    march = af.SimulateOptions(duration=300.0, decide=False)
    return {
        "root locus": af.root_locus(case),
        "describing": af.describing_curve(case, FEW),
        "harmonic": af.harmonic_families(case, af.HarmonicOptions(harmonics=1)),
        "cycles": af.limit_cycles(case, QUICK),
        "motion": af.simulate(case, velocity=157.3, options=march),
        "map": af.flutter_map(case, velocity=[100.0, 157.3], alpha_deg=[0.5, 1.0]),
        "sweep": af.sweep(case, {"section.si.m": "normal(35,1.75)"}, 2, seed=1),
        "family": af.vary(case, "spring.gap_deg", [0.1, 0.2], lambda one: af.root_locus(one)),
    }


NAMES = ("root locus", "describing", "harmonic", "cycles", "motion", "map", "sweep", "family")


@pytest.mark.parametrize("name", NAMES)
def test_results_show_and_encode_themselves(results, name):
    from matplotlib.figure import Figure

    found = results[name]
    assert len(repr(found)) < 1500
    assert found._repr_html_().startswith("<table>")
    assert len(found._repr_html_()) < 10_000
    dataset, frame = found.to_dataset(), found.to_dataframe()
    assert dataset.attrs["title"]
    assert any("_m_s" in str(one) for one in (*dataset, *dataset.attrs)) or name in (
        "motion",
        "map",
    )
    assert len(frame) > 0
    axes = Figure().subplots()
    assert found.plot(ax=axes) is axes
    assert axes.get_xlabel()
    assert isinstance(found.plot(), Figure)
    assert "m/s" in "".join(a.get_xlabel() for a in found.plot().axes) or name == "motion"


def test_the_trace_of_a_motion_is_in_seconds_and_its_spectrum_in_hertz(results):
    found = results["motion"]
    seconds = found.to_dataset()["time_s"].values
    assert seconds[-1] == pytest.approx(found.time[-1] * 0.45 / 157.3)
    named = {axes.get_xlabel() for axes in found.plot().axes}
    assert {"time (s)", "frequency (Hz)"} <= named
    assert "frequency (Hz)" not in {a.get_xlabel() for a in found.plot(units="nondimensional").axes}


def test_a_case_a_section_and_a_family_are_one_thing(case):
    other = loaded(SAME)
    family = af.SectionFamily(other.section, other.aerodynamics)
    speeds = [
        af.root_locus(subject).flutter.speed for subject in (case, case.section, family)
    ]  # fmt: skip
    assert speeds == pytest.approx([speeds[0]] * 3, rel=1e-6)
    for subject, spring in ((case, None), (case.section, case.spring), (family, case.spring)):
        words = () if spring is None else (spring,)
        curve = af.describing_curve(subject, *words, options=FEW)
        assert curve.onset.speed_ratio == pytest.approx(0.5621663, abs=1e-6)
    # options may follow the case at once, and another spring may take the place of its own
    assert af.describing_curve(case, FEW).amplitude.size < 100
    free = af.describing_curve(case, af.Freeplay(case.spring.delta_h), FEW)
    assert free.onset is None or free.onset.speed_ratio != curve.onset.speed_ratio


@pytest.mark.parametrize("analyse", [af.limit_cycles, af.describing_curve, af.harmonic_families])
def test_what_cannot_be_taken_is_said_in_one_line(case, analyse):
    with pytest.raises(af.InputError, match="must be a Case, a TypicalSection or a family"):
        analyse(3.0, case.spring)
    with pytest.raises(af.InputError, match="needs the spring"):
        analyse(case.section)


def test_speeds_of_a_motion_are_given_once_and_in_any_unit(case):
    ratio = af.simulate(case, velocity=157.3).amplitude
    speed = case.scale.speed(157.3)
    assert af.simulate(case, speed=speed).amplitude == pytest.approx(ratio, rel=1e-9)
    assert np.degrees(ratio) == pytest.approx(0.334, abs=5e-4)
    at = af.cycles_at(case, velocity=157.3, options=QUICK)
    assert at.cycles[-1].amplitude == pytest.approx(ratio, rel=1e-9)
    with pytest.raises(af.InputError, match="give one of"):
        af.simulate(case)
    with pytest.raises(af.InputError, match="SI units"):
        af.simulate(af.load_case("run14"), velocity=100.0)


def test_a_dataset_needs_no_import_before():
    """In an interpreter of its own, where nothing else has been imported."""
    code = (
        "import aeroflutter as af; c = af.load_case('run14');"
        "d = af.to_dataset(af.describing_curve(c, af.DescribingOptions(points=5)));"
        "assert d.sizes['point'] > 5; assert d.attrs['title'].startswith('run 14')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_every_analysis_is_in_the_namespace_and_nothing_is_imported_for_it():
    listed = dir(af)
    for name in (
        *("root_locus", "describing_curve", "harmonic_families", "limit_cycles", "cycles_at"),
        *("simulate", "chaos", "tolerance", "largest_gap", "least_friction", "onset", "loop_test"),
        *("flutter_map", "sweep", "vary", "to_dataset"),
    ):
        assert name in listed
        assert callable(getattr(af, name))
    code = "import sys, aeroflutter; print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_every_result_has_a_figure():
    from aeroflutter.plots.drawing import DRAWN

    wrapped = {"Proved", "Branches", "Run", "Pass", "SpringLaw"}
    assert set(DRAWN) == layouts.KNOWN - wrapped | {"Members"}


def test_charts_and_pk_are_results_like_the_others():
    """What they draw, encode and say, of a case given as it is."""
    import bah

    hinge = af.load_case("run14")
    model = af.load_case({"title": "a wing", "model": bah.MODEL})
    found = {
        "chart": af.friction_chart(hinge, speed_ratio=[0.5, 0.6]),
        "pk": af.pk_method(model, af.PKOptions(low=350.0, high=450.0, points=5)),
    }
    for one in found.values():
        assert isinstance(one, Result)
        assert len(repr(one)) < 1000
        assert one._repr_html_().startswith("<table>")
        assert one.to_dataset().attrs["title"] in ("a wing", hinge.title)
        assert len(one.to_dataframe()) > 0
        assert one.plot().axes[0].get_xlabel().startswith("airspeed")
    with pytest.raises(af.InputError, match="p-k needs air forces"):
        af.pk_method(hinge)


def test_results_without_a_case_are_drawn_without_one():
    section = af.TypicalSection(omega_bar=0.8)
    found = af.describing_curve(section, af.Hysteresis(1.0, 0.2), FEW)
    assert isinstance(found, Result)
    assert found.context == {}
    assert found.plot().axes[0].get_xlabel().startswith("airspeed ratio")
    with pytest.raises(af.InputError, match="SI data"):
        found.plot(units="si")
