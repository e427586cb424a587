"""One table makes every encoding: the same numbers in JSON, Datasets, DataFrames and the result."""

import dataclasses
import functools
import json
import math
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bah
import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from aeroflutter.case import Case, load_case
from aeroflutter.errors import InputError
from aeroflutter.guarantees import guarantees
from aeroflutter.guarantees.chart import friction_chart
from aeroflutter.guarantees.looptest import LoopTestOptions, loop_test
from aeroflutter.guarantees.onset import onset
from aeroflutter.linear.pk import PKOptions, pk_method
from aeroflutter.linear.rootlocus import root_locus
from aeroflutter.motion.chaos import ChaosOptions, chaos, chaos_scan
from aeroflutter.motion.response import Initial, SimulateOptions, simulate
from aeroflutter.motion.sweeps import sweep as sweep_of_speed
from aeroflutter.orbits.cycles import CycleOptions, cycles_at, limit_cycles
from aeroflutter.orbits.describing import DescribingOptions, describing_curve
from aeroflutter.orbits.harmonic import HarmonicOptions, harmonic_families
from aeroflutter.results import dataset as datasets
from aeroflutter.results import layouts, to_dataframe, to_dataset, to_json
from aeroflutter.results.cycles import Branches, Proved
from aeroflutter.results.fields import ANGLE, FIELDS, Field
from aeroflutter.results.motions import Pass, Run, SpringLaw
from aeroflutter.results.schema import Layout, Many, Value
from aeroflutter.springs import Hysteresis, respond
from aeroflutter.studies.maps import Axis, Grid, SpeedPitch, flutter_map
from aeroflutter.studies.maps.sweep import Specimen, SweepOptions
from aeroflutter.studies.maps.sweep import sweep as sweep_of_sections
from aeroflutter.studies.tolerance import tolerance

U_L = 1.7285730989193295  # of the section in SI units, naca496
OPTIONS = CycleOptions(points=8, depth=0, simulations=0)


@functools.cache
def case() -> Case:
    """A section in SI units with a loop, so that every field has its companion."""
    spring = {"kind": "hysteresis", "delta_v_deg": 0.5, "delta_h_deg": 0.5}
    return load_case("naca496", {f"spring.{key}": value for key, value in spring.items()})


def response() -> Any:
    system = case().family().at(0.95 * U_L)
    return simulate(system, case().spring, Initial(alpha=0.05), SimulateOptions(duration=400.0))


def run() -> Run:
    return Run(speed=0.95 * U_L, flutter_speed=U_L, start=Initial(alpha=0.05), response=response())


def one_pass() -> Pass:
    ratios = np.array([0.97, 0.95, 0.7])  # down to where cycles end
    family, spring = case().family(), case().spring
    return Pass(sweep_of_speed(family, spring, U_L * ratios, Initial(alpha=0.05)), U_L)


def curve() -> Any:
    return describing_curve(case().family(), case().spring, DescribingOptions(points=20))


def proved() -> Proved:
    found = curve()
    return Proved(curve=found, guarantees=guarantees(case().family(), case().spring, found))


def branches() -> Any:
    options = HarmonicOptions(harmonics=5)
    return harmonic_families(case().family(), case().spring, options)


def one_chaos() -> Any:
    options = ChaosOptions(cycles=40, transient=10)
    return chaos(case().family().at(0.95 * U_L), case().spring, Initial(alpha=0.05), options)


def scan() -> Any:
    speeds = U_L * np.array([0.5, 0.95])
    options = ChaosOptions(cycles=40, transient=10)
    return chaos_scan(case().family().at, speeds, case().spring, Initial(alpha=0.05), options)


def law() -> SpringLaw:
    pitch, amplitude = np.linspace(-0.05, 0.05, 7), np.linspace(0.01, 0.05, 5)
    moment, memory = respond(case().spring, pitch)
    return SpringLaw(
        pitch=pitch,
        moment=moment,
        memory=memory,
        amplitude=amplitude,
        bias=0.001,
        gains=case().spring.describing(amplitude, 0.001),
    )


def one_map() -> Any:
    grid = Grid(
        Axis("speed_ratio", np.array([0.9, 0.95, 1.05])),
        Axis("initial.alpha_deg", np.array([1.0, 5.0])),
    )
    return flutter_map(SpeedPitch(case().family(), case().spring, grid, U_L, Initial()))


class Sections:
    """Sections of another mass ratio, marched at one speed."""

    def at(self, values: Any) -> Specimen:
        changed = load_case("run14", {"section.mu": values["section.mu"]})
        return Specimen(changed.family(), changed.spring, Initial(alpha=0.1), 3.9)

    def identity(self) -> dict[str, Any]:
        return {}


def sections() -> Any:
    return sweep_of_sections(
        Sections(), {"section.mu": np.array([90.0, 100.0, 110.0])}, SweepOptions()
    )


MAKERS: dict[str, Callable[[], Any]] = {
    "RootLocus": lambda: root_locus(case().family()),
    "PKResult": lambda: pk_method(bah.modes(), PKOptions(low=100.0, high=700.0, points=12)),
    "DescribingCurve": curve,
    "Proved": proved,
    "LoopTest": lambda: loop_test(
        case().family(), case().spring, 0.95 * U_L, LoopTestOptions(points=20)
    ),
    "Branches": lambda: Branches(branches()),
    "HarmonicBranch": lambda: branches()[0],
    "LimitCycles": lambda: limit_cycles(case().family(), case().spring, OPTIONS),
    "CyclesAt": lambda: cycles_at(case().family(), case().spring, 0.95 * U_L, OPTIONS),
    "Tolerance": lambda: tolerance(case().family(), case().spring, 0.95, 0.02, OPTIONS),
    "Chart": lambda: friction_chart(case().family(), case().spring, [0.9 * U_L, 0.95 * U_L]),
    "Onset": lambda: onset(load_case("run100").family(), load_case("run100").spring, any_load=True),
    "Response": response,
    "Run": run,
    "Sweep": lambda: one_pass().sweep,
    "Pass": one_pass,
    "ChaosResult": one_chaos,
    "ChaosScan": scan,
    "SpringLaw": law,
    "FlutterMap": one_map,
    "SweepResult": sections,
}
ALL = pytest.mark.parametrize("name", MAKERS)


@functools.cache
def made(name: str) -> Any:
    return MAKERS[name]()


def test_every_result_that_can_be_encoded_is_tested_here() -> None:
    assert set(MAKERS) == layouts.KNOWN


# The same numbers in all encodings

PREFIXES = {  # of the variables that hold a list of records; facts have none
    "branch": "",
    "chart": "",
    "bifurcations": "bifurcation_",
    "families": "family_",
    "crossings": "crossing_",
    "points": "",
    "jumps": "jump_",
    "folds": "family_fold_",
    "harmonics": "",
    "path": "",
    "describing": "",
    "pieces": "piece_",
    "coordinates": "coordinate_",
    "springs": "spring_",
}
NAMES = {  # that differ on purpose
    "mirrored": "odd",
    "speeds": "speed",
    "velocities_m_s": "velocity_m_s",
    "roots": "root",
    "guarantee_guaranteed": "guaranteed",
    "guarantee_exists_at_speed": "exists_at_speed",
    "guarantee_contraction_ratio": "contraction_ratio",
    "guarantee_expected_error": "expected_error",
    "guarantee_doubtful": "doubtful",
    "family_family": "number",
    "family_origin": "origin",
    "frequency": "k",
    "state": "end_state",
    "locus_amplitude_deg": "locus_amplitude",
}
OF_ONE = {  # and of single results
    "CyclesAt": {name: f"at_{name}" for name in ("speed", "speed_ratio", "velocity_m_s")},
    "Tolerance": {
        name: f"tolerance_{name}"
        for name in ("speed_ratio", "speed", "velocity_m_s", "amplitude_deg", "factor", "notes")
    },
}
ELSEWHERE = {  # what is in a Dataset another way: as two variables, on an axis, as a text
    "LimitCycles": {"family_ends"},
    "CyclesAt": {"family_ends", "cycles"},
    "Tolerance": {"family_ends", "spring"},
    "LoopTest": {"order"},
    "ChaosResult": {"peaks_deg"},
    "ChaosScan": {"peaks_deg"},
}


def leaves(
    found: dict[str, Any], prefix: str = "", place: tuple[int, ...] = ()
) -> Iterator[tuple[str, tuple[int, ...], Any]]:
    """Name in a Dataset, place along the lists of records, and value of all of a record."""
    for key, value in found.items():
        records = isinstance(value, list) and bool(value) and isinstance(value[0], dict)
        if records and key != "cycles":
            for i, one in enumerate(value):
                yield from leaves(one, PREFIXES[key], (*place, i))
        elif records and "harmonics" in value[0]:  # those of a loop
            for i, one in enumerate(value):
                renamed = {{"k": "cycle_k", "frequency_hz": "cycle_frequency_hz"}.get(k, k): one[k]
                           for k in one}  # fmt: skip
                yield from leaves(renamed, "", (*place, i))
        elif isinstance(value, dict) and key != "spring":
            yield from leaves(value, PREFIXES.get(key, f"{prefix}{key}_"), place)
        elif value != []:
            yield prefix + key, place, value


def stored(dataset: xr.Dataset, name: str, place: tuple[int, ...]) -> Any:
    """What a Dataset holds there, codes as the text that they mean."""
    if name in dataset.attrs and not place:
        return dataset.attrs[name]
    variable = dataset[name]
    values = variable.values[place]
    if "flag_meanings" not in variable.attrs:
        return values
    words = dict(
        zip(variable.attrs["flag_values"], variable.attrs["flag_meanings"].split(), strict=True)
    )
    return words[int(values)] if np.ndim(values) == 0 else [words[int(one)] for one in values]


def same(said: Any, value: Any) -> bool:
    """Whether JSON says what a Dataset holds; where it says null there is no number, or no text."""
    if said is None:
        return np.asarray(value).tolist() in ("", -1) or not np.all(np.isfinite(value))
    if isinstance(said, str) or (isinstance(said, list) and isinstance(said[0], str)):
        held = np.asarray(value).tolist()
        return held in (said, "; ".join(said))
    expected, found = np.array(said, dtype=float), np.asarray(value, dtype=float)
    return np.array_equal(expected, found, equal_nan=True)


@pytest.mark.parametrize("name", [name for name in MAKERS if name not in layouts.MADE])
def test_json_says_what_the_dataset_holds(name: str) -> None:
    found = to_json(made(name), case=case())
    json.dumps(found, allow_nan=False)
    dataset = to_dataset(made(name), case=case())
    compared = 0
    for label, place, said in leaves(found):
        if label not in ELSEWHERE.get(name, ()):
            names = NAMES | ({} if place else OF_ONE.get(name, {}))
            other = names.get(label, label)
            if other not in dataset and other not in dataset.attrs:
                other = label
            if said is None and other not in dataset:  # nothing, or a record without a value
                held = [one for one in dataset if str(one).startswith(f"{other}_")]
                assert other not in dataset.attrs or np.isnan(dataset.attrs[other])
                assert all(same(None, stored(dataset, one, place)) for one in held if place)
            else:
                assert same(said, stored(dataset, other, place)), (label, place, said)
            compared += 1
    assert compared > 5


@ALL
def test_frame_holds_what_the_dataset_holds(name: str) -> None:
    dataset = to_dataset(made(name), case=case())
    frame = to_dataframe(made(name), case=case())
    main = frame.index.names
    assert frame.shape[0] == math.prod(dataset.sizes[dim] for dim in main)
    assert set(frame.columns) <= frame.attrs["units"].keys()
    if name == "RootLocus":
        dataset["root_re"] = dataset["root"].sel(part="re")
    held = [label for label, one in dataset.data_vars.items() if set(one.dims) == set(main)]
    assert held
    for label in held:
        values = dataset[label].transpose(*main).values.ravel()
        assert np.array_equal(frame[label].to_numpy(), values, equal_nan=values.dtype.kind == "f")
        assert frame.attrs["units"][label] == dataset[label].attrs["units"]


@pytest.mark.parametrize("name", ["LimitCycles", "Branches"])
def test_frame_spreads_multipliers_over_columns(name: str) -> None:
    frame = to_dataframe(made(name))
    multipliers = made(name).cycles if name == "LimitCycles" else made(name).points
    expected = np.array([one.multipliers for one in multipliers])
    for j in range(expected.shape[1]):
        assert np.array_equal(frame[f"multipliers_{j + 1}_re"], expected[:, j].real)
        assert np.array_equal(frame[f"multipliers_{j + 1}_im"], expected[:, j].imag)


@ALL
def test_dataset_survives_netcdf(name: str, tmp_path: Path) -> None:
    dataset = to_dataset(made(name), case=case())
    for label, variable in dataset.data_vars.items():
        assert variable.attrs.get("units"), label
        assert variable.attrs.get("long_name"), label
    dataset.to_netcdf(tmp_path / "saved.nc", engine="netcdf4")
    with xr.open_dataset(tmp_path / "saved.nc") as saved:
        xr.testing.assert_identical(saved.drop_attrs(), dataset.drop_attrs())
        assert saved.attrs.keys() == dataset.attrs.keys()


# Units, against the results themselves


def test_angles_are_degrees_and_complex_numbers_pairs() -> None:
    found, cycles = to_json(made("LimitCycles")), made("LimitCycles").cycles
    for point, cycle in zip(found["branch"], cycles, strict=True):
        assert math.radians(point["amplitude_deg"]) == pytest.approx(cycle.amplitude, rel=1e-15)
        assert point["speed"] == cycle.speed
        assert [complex(*pair) for pair in point["multipliers"]] == list(cycle.multipliers)
    curve = made("DescribingCurve")
    dataset = to_dataset(curve)
    assert np.allclose(np.radians(dataset["bias_deg"]), curve.bias, rtol=1e-15, atol=0)
    assert np.array_equal(dataset["k"], curve.k)


def test_si_units_stand_beside_speed_frequency_and_period() -> None:
    b, omega_alpha = case().section.scale.b, case().section.scale.omega_alpha
    for point in to_json(made("LimitCycles"), case=case())["branch"]:
        assert point["velocity_m_s"] == pytest.approx(point["speed"] * b * omega_alpha)
        hertz = point["k"] * point["velocity_m_s"] / b / (2 * math.pi)
        assert point["frequency_hz"] == pytest.approx(hertz)
        assert point["period_s"] * hertz == pytest.approx(1.0)
    run, dataset = made("Run"), to_dataset(made("Run"), case=case())
    seconds = run.response.time * b / (run.speed * b * omega_alpha)
    assert np.allclose(dataset["time_s"], seconds)
    assert dataset["time_s"].attrs["units"] == "s"
    assert "velocity_m_s" not in to_json(made("Run"))


def test_cells_and_sections_are_what_the_study_found() -> None:
    found, dataset = made("FlutterMap"), to_dataset(made("FlutterMap"))
    assert dataset["state"].dims == ("speed_ratio", "alpha_deg")
    assert np.array_equal(dataset["state"], found.state)
    assert np.array_equal(dataset["amplitude_deg"], found.amplitude_deg, equal_nan=True)
    assert to_json(found)["lco"] == int((found.state == 1).sum()) > 0
    sample, frame = made("SweepResult"), to_dataframe(made("SweepResult"))
    assert np.array_equal(frame["flutter_speed"], sample.values["flutter_speed"])
    assert np.array_equal(frame["varied_section_mu"], sample.samples["section.mu"])
    assert to_json(sample)["flutter_speed"]["mean"] == pytest.approx(frame["flutter_speed"].mean())


# Where every field is read, written out a second time: angles in radians

READ: dict[str, Callable[[Any], dict[str, Any]]] = {
    "RootLocus": lambda r: {
        "root": r.roots,
        "crossing_omega_ratio": [one.omega_ratio for one in r.crossings],
        "crossing_growing": [one.growing for one in r.crossings],
    },
    "Proved": lambda r: {
        **{name: getattr(r.curve, name) for name in ("speed", "k", "n_p", "n_q", "distortion")},
        "rules_agree": r.curve.rules_agree,
        "guaranteed": r.guarantees.guaranteed,
        "guarantee_speed": r.guarantees.speed,
        "guarantee_k": r.guarantees.omega,
        "guarantee_amplitude_deg": r.guarantees.amplitude,
        "guarantee_reason": r.guarantees.reason,
        "guarantee_method": r.guarantees.method,
        "contraction_ratio": r.guarantees.ratio,
        "exists_at_speed": r.guarantees.exists_at_speed,
        "doubtful": r.guarantees.doubtful,
        "family_onset_stable_below": [one.onset.beside[0] for one in r.curve.families],
        "family_onset_stable_above": [one.onset.beside[1] for one in r.curve.families],
    },
    "LoopTest": lambda r: {
        "response": r.G,
        "locus": r.locus,
        "k": r.frequency,
        "cycle_k": [one.k for one in r.cycles],
        "describing_function": [one.N for one in r.cycles],
        "answer": [one.answers for one in r.cycles],
        "gain": [one.gains for one in r.cycles],
        "spoils": [one.spoiling for one in r.cycles],
    },
    "HarmonicBranch": lambda r: {
        "k": r.omega,
        "stable": r.stable,
        "stability_certain": r.certain,
        "margin": r.margin,
        "truncation": r.truncation,
        "multipliers": r.multipliers,
        "pitch_harmonic_deg": np.array([cycle.Y for cycle in r.cycles]),
        "bifurcation_kind": [event.kind for event in r.bifurcations],
        "bifurcation_speed": [event.cycle.speed for event in r.bifurcations],
    },
    "LimitCycles": lambda r: {
        **{
            name: [getattr(one, name) for one in r.cycles]
            for name in ("k", "period", "multipliers", "closure", "switches", "continuum")
        },
        "memory_deg": [one.memory for one in r.cycles],
        "start": [one.state for one in r.cycles],
        "bifurcation_period": [event.cycle.period for event in r.bifurcations],
        "bifurcation_stable_before": [event.stable_beside[0] for event in r.bifurcations],
        "bifurcation_stable_after": [event.stable_beside[1] for event in r.bifurcations],
        "begins": [one.stopped[0] for one in r.families],
        "ends": [one.stopped[1] for one in r.families],
        "family_cycles": [len(one.cycles) for one in r.families],
    },
    "Response": lambda r: {
        **{name: getattr(r, name) for name in ("time", "heave", "states", "events")},
        **{f"{name}_deg": getattr(r, name) for name in ("pitch", "moment", "memory")},
    },
    "Sweep": lambda r: {
        "speed": r.speeds,
        "end_state": r.state,
        "period": r.period,
        "rest_deg": r.rest,
        "jump_before": [jump.before for jump in r.jumps],
        "jump_amplitude_deg": [[j.amplitude_before, j.amplitude_after] for j in r.jumps],
    },
    "ChaosResult": lambda r: {
        "lyapunov": r.exponents.values,
        "lyapunov_error": r.exponents.error,
        "statistical_error": r.exponents.statistical,
        "running": r.exponents.running,
        "running_time": r.exponents.time,
        "peak_deg": r.section.pitch,
        "peak_memory_deg": r.memory,
        "trough_deg": r.troughs,
    },
    "ChaosScan": lambda r: {
        "verdict": r.verdicts,
        "lyapunov": r.exponents,
        "multiplier": [one.multiplier for one in r.results],
        "dimension": [one.exponents.dimension for one in r.results],
    },
}


@pytest.mark.parametrize("name", READ)
def test_fields_are_read_where_they_are(name: str) -> None:
    dataset = to_dataset(made(name))
    for label, values in READ[name](made(name)).items():
        found, expected = dataset[label], np.asarray(values)
        if "part" in found.dims:
            found = found.sel(part="re") + 1j * found.sel(part="im")
        if "flag_meanings" in found.attrs:
            words = np.array(found.attrs["flag_meanings"].split())
            found = found.copy(data=words[found.values])
        assert found.shape == expected.shape or found.size == 0 == expected.size, label
        if not found.size:
            continue
        if label.endswith("_deg"):
            assert np.allclose(found, expected * 180 / np.pi, rtol=1e-14, equal_nan=True), label
        else:
            assert np.array_equal(found, expected, equal_nan=expected.dtype.kind in "fc"), label


# A new field


@ALL
@settings(max_examples=5, deadline=None)
@given(value=st.floats(-3.0, 3.0))
def test_a_new_field_is_in_all_encodings(name: str, value: float) -> None:
    added = Value("twist", lambda one: value, meaning=Field("twist of the wing", ANGLE))
    result, own = layouts.layout_of(made(name))
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(FIELDS, "twist", Field("twist of the wing", ANGLE))
        patch.setattr(layouts, "layout_of", lambda one: (result, widened(own, added)))
        patch.setattr(datasets, "layout_of", layouts.layout_of)
        found, dataset = to_json(result), to_dataset(result)
        frame = to_dataframe(result)
    degrees = np.degrees(value)
    assert found["twist_deg"] == degrees == dataset.attrs["twist_deg"] == frame.attrs["twist_deg"]
    lists = [entry for entry in own.entries if isinstance(entry, Many) and entry.label is not None]
    for entry in lists:
        for record in found[entry.name]:
            assert record["twist_deg"] == degrees
        variable = dataset[f"{entry.prefix}twist_deg"]
        assert variable.dims == (entry.dim,)
        assert np.all(variable == degrees)
        assert variable.attrs == {"units": "degree", "long_name": "twist of the wing"}
        if entry.dim in own.frame:
            assert np.all(frame["twist_deg"] == degrees)


def widened(layout: Layout, added: Value) -> Layout:
    """A layout with a field more, in every list of records too."""
    entries = [
        dataclasses.replace(entry, layout=widened(entry.layout, added))
        if isinstance(entry, Many)
        else entry
        for entry in layout.entries
    ]
    return dataclasses.replace(layout, entries=(*entries, added))


# The door


def test_results_need_no_other_import(tmp_path: Path) -> None:
    script = """
import sys
import aeroflutter.results
assert not {"numpy", "xarray", "aeroflutter.orbits"} & set(sys.modules)
from aeroflutter.results.dataset import to_dataset
assert not {"aeroflutter.orbits", "aeroflutter.studies"} & set(sys.modules)
from aeroflutter import load_case
from aeroflutter.orbits.cycles import CycleOptions, limit_cycles
case = load_case("run14")
options = CycleOptions(points=4, depth=0, simulations=0)
assert "amplitude_deg" in to_dataset(limit_cycles(case.family(), case.spring, options))
"""
    subprocess.run([sys.executable, "-c", script], check=True, cwd=tmp_path)


@pytest.mark.parametrize("wrong", [None, 3.0, {}, (), (1, 2), Hysteresis(1.0, 1.0), Path()])
@pytest.mark.parametrize("encode", [to_json, to_dataset, to_dataframe])
def test_what_is_no_result_is_refused(encode: Callable[[Any], Any], wrong: Any) -> None:
    with pytest.raises(InputError) as refused:
        encode(wrong)
    (line,) = refused.value.problems
    assert type(wrong).__name__ in line
    assert "LimitCycles" in line


def test_a_stranger_of_the_same_name_is_no_result() -> None:
    stranger = type("Response", (), {"__module__": "requests"})()
    with pytest.raises(InputError, match="Response is not the result of an analysis"):
        to_json(stranger)


def test_a_linear_section_has_empty_tables() -> None:
    found = limit_cycles(load_case("linear-08").family(), load_case("linear-08").spring)
    dataset = to_dataset(found)
    assert dataset.sizes["point"] == 0
    assert to_dataframe(found).empty
    assert to_json(found)["branch"] == []
