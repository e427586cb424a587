"""Figures: one colour one meaning, legends that are complete, labels that lie over nothing."""

from itertools import combinations

import numpy as np
import pytest
from figures import collisions
from matplotlib.colors import to_rgba

import aeroflutter as af
from aeroflutter.cli import main
from aeroflutter.plots import layout, meaning
from aeroflutter.plots import style as look
from aeroflutter.plots.branches import Line
from aeroflutter.plots.maps import plot_sweep
from aeroflutter.studies.maps.grid import ratios_around

QUICK = af.CycleOptions(simulations=0, depth=0, points=20)
WIDTHS = (None, 85.0, 180.0)


@pytest.fixture(scope="module")
def results():
    """One result of most kinds; the whole costs two seconds."""
    run14, freeplay = af.load_case("run14"), af.load_case("freeplay-02")
    return {
        "root locus": af.root_locus(run14),
        "root locus in SI": af.root_locus(af.load_case("naca496")),
        "describing": af.describing_curve(run14),
        "harmonic": af.harmonic_families(freeplay, options=af.HarmonicOptions(harmonics=5)),
        "cycles": af.limit_cycles(run14, options=QUICK),
        "motion": af.simulate(run14, speed_ratio=0.95, options=af.SimulateOptions(duration=600.0)),
        "map": af.flutter_map(run14, speed_ratio=[0.9, 0.95, 1.01], alpha_deg=[2.0, 8.0]),
    }


NAMES = (
    *("root locus", "root locus in SI", "describing", "harmonic", "cycles", "motion", "map"),
)  # fmt: skip


def drawn(result, width=None, **options):
    from aeroflutter.plots.drawing import draw

    return draw(result, width=width, **options)


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("name", NAMES)
def test_no_label_lies_over_another(results, name, width):
    figure = drawn(results[name], width)
    assert collisions(figure) == []
    if width is not None:
        assert figure.get_figwidth() == pytest.approx(width / 25.4)
        assert figure.get_figheight() < 11.0  # inches: a page


def test_the_check_sees_a_collision():
    figure, axes = layout.figure(width=3.0, height=2.0)
    axes.text(0.2, 0.2, "one thing")
    axes.text(0.22, 0.2, "another")
    assert collisions(figure) == ["'one thing' over 'another'"]


@pytest.mark.parametrize("name", NAMES)
def test_every_colour_of_a_line_is_in_the_legend(results, name):
    """But for axes through the origin and what figures refer to."""
    figure = drawn(results[name])
    named = {
        to_rgba(handle.get_color())
        for legend in figure.legends
        for handle in legend.legend_handles
        if hasattr(handle, "get_color")
    }
    free = {to_rgba(meaning.FAINT), to_rgba(meaning.INK)}
    for axes in figure.axes:
        if len({to_rgba(line.get_color()) for line in axes.lines} - free) < 2:
            continue  # one colour in a panel, which its title and axes explain
        for line in axes.lines:
            if len(line.get_xdata()):
                assert to_rgba(line.get_color()) in named | free, (axes.get_title(), line)


def test_no_colour_means_two_things():
    own = [colour for name, colour in meaning.STATES.items() if name != "lco"]
    methods = [meaning.EXACT, meaning.DESCRIBING, meaning.HARMONIC, meaning.PROVED, meaning.WARNING]
    every = [*methods, *own, *meaning.SERIES, meaning.INK, meaning.FAINT]
    for one, other in combinations(every, 2):
        apart = np.abs(np.subtract(to_rgba(one), to_rgba(other))).sum()
        assert apart > 0.04, (one, other)
    assert meaning.STATES["lco"] == meaning.VERDICTS["periodic"] == meaning.EXACT


def test_methods_are_told_apart_in_grey():
    weights = np.array([0.2126, 0.7152, 0.0722])
    methods = (meaning.EXACT, meaning.DESCRIBING, meaning.HARMONIC)
    grey = sorted(float(weights @ to_rgba(one)[:3]) for one in methods)
    assert np.diff(grey).min() > 0.05


def test_cycles_have_their_flutter_line_and_every_bifurcation_named(results):
    figure = drawn(results["cycles"])
    words = {text.get_text() for text in figure.legends[0].get_texts()}
    kinds = {event.kind for event in results["cycles"].bifurcations}
    assert {"linear flutter", "stable", "unstable", "exact cycles"} | kinds <= words


def test_harmonic_balance_is_drawn_round_through_its_cycles():
    turn = np.linspace(0.3, 1.8 * np.pi, 10)
    line = Line(2.0 + np.cos(turn), 2.0 + np.sin(turn), turn < np.pi)
    smooth = line.rounded()
    assert smooth.x.size > 20 * line.x.size
    for x, y in zip(line.x, line.y, strict=True):
        assert np.hypot(smooth.x - x, smooth.y - y).min() < 1e-12
    radius = np.hypot(smooth.x - 2.0, smooth.y - 2.0)
    assert np.abs(radius - 1.0).max() < 0.06  # straight lines are 0.04 off, with corners
    turns = np.diff(np.unwrap(np.arctan2(np.diff(smooth.y), np.diff(smooth.x))))
    assert np.abs(turns).max() < 0.35  # radians at once, of 0.6 of the polygon


def test_all_multipliers_are_in_view(results):
    from aeroflutter.plots.multipliers import plot_multipliers

    cycles = results["cycles"]
    assert max(abs(one.multipliers).max() for one in cycles.cycles) > 1.5
    figure = plot_multipliers(cycles)
    panels = [axes for axes in figure.axes if axes.get_aspect() == 1.0]
    shown = 0
    for axes in panels:
        for points in axes.collections:
            (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
            x, y = np.asarray(points.get_offsets()).T
            assert left <= x.min()
            assert x.max() <= right
            assert low <= y.min()
            assert y.max() <= high
            shown += x.size
    assert shown == sum(cycle.multipliers.size - 1 - cycle.continuum for cycle in cycles.cycles)
    assert len(figure.axes) == len(panels) + 1  # one scale of colours


def test_amplitudes_are_logarithmic_where_branches_crowd(results):
    crowded = np.array([0.0, 1.0]), np.array([0.01, 0.012])
    tall = np.array([0.98, 1.0]), np.array([0.02, 1.0])
    assert layout.crowded([crowded, tall], 1.0, (0.0, 1.0))
    assert not layout.crowded([(np.array([0.0, 0.5, 1.0]), np.array([0.1, 0.5, 1.0]))], 1.0, (0, 1))


def test_counts_have_no_halves():
    values = {"flutter_speed": np.array([4.0, 4.1, 4.2])}

    class Few:
        onset_method = "none"

        def of(self, name):
            return values.get(name, np.empty(0))

    axes = plot_sweep(Few(), si=False).axes[0]
    assert all(tick == int(tick) for tick in axes.get_yticks())


def test_a_map_is_where_something_happens():
    for onset in (0.2, 0.92, 0.97, 1.0, 1.4):
        ratios = ratios_around(onset, 91)
        assert ratios[0] < onset < ratios[-1]
        assert ratios[-1] > 1.0
        assert 30 <= ratios.size <= 91


def test_a_map_of_cycles_just_below_flutter_is_narrow():
    ratios = ratios_around(0.985, 91)
    assert ratios[-1] - ratios[0] < 0.03


def test_maps_follow_the_onset_and_what_is_asked_stays(capsys):
    from aeroflutter.cli.map import around_onset, axes

    case = af.load_case("run14")
    usual = around_onset(case)
    assert 0.85 < usual[0] < 0.9213 < 1.0 < usual[-1] < 1.1
    assert around_onset(af.load_case("linear-08"))[[0, -1]] == pytest.approx([0.1, 1.0])
    asked, _ = axes("0.1:1:10", None, None, None, None, usual=lambda: usual)
    assert asked.x.values == pytest.approx(np.linspace(0.1, 1.0, 10))


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["--plot-width", "85"], "belongs to --plot"),
        (["--plot", "x.png", "--plot-width", "5"], "must be 60 to 400 mm"),
    ],
)
def test_widths_that_cannot_be_are_refused(capsys, words, why):
    assert main(["spring", "run14", *words]) == 2
    assert why in capsys.readouterr().err


def test_a_figure_of_a_column_is_as_wide(tmp_path, capsys):
    file = tmp_path / "s.svg"
    assert main(["spring", "run14", "--plot", str(file), "--plot-width", "85"]) == 0
    points = float(file.read_text().split('width="')[1].split("pt")[0])
    assert points == pytest.approx(85.0 / 25.4 * 72.0, rel=1e-6)
    assert look.WIDTH.get() is None
