"""The report as it is read: hostile words, units, bifurcations, keyboard, extremes, ranges."""

import base64
import gzip
import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_engineering import TAILPLANE

from aeroflutter.case import load_case
from aeroflutter.cli import main
from aeroflutter.motion.response import Initial
from aeroflutter.report.motions import Motions, marched
from aeroflutter.report.page import _words

BROWSER, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
HOSTILE = "</script><img src=x onerror=\"document.title='owned'\"><script>document.title='owned'"
B = 0.45  # semichord of the tailplane, m


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small report of the tailplane, its title a script."""
    folder = tmp_path_factory.mktemp("page")
    case = folder / "case.toml"
    case.write_text(f"title = {json.dumps(HOSTILE)}\n" + TAILPLANE)
    patch = pytest.MonkeyPatch()
    _quick(patch)
    words = ("--velocity", "150,160", "--alpha-deg", "0.5,1", "--periods", "4")
    assert main(["report", str(case), *words, "--out", str(folder / "r.html")]) == 0
    patch.undo()
    return folder / "r.html"


def _quick(patch: pytest.MonkeyPatch) -> None:
    """Let the analyses of a page look for little: what they find is tested elsewhere."""
    from aeroflutter.orbits.cycles import CycleOptions, limit_cycles
    from aeroflutter.orbits.harmonic import HarmonicOptions, harmonic_families

    analyses = "aeroflutter.report.analyses"
    few = CycleOptions(simulations=0, depth=0, points=30)
    low = HarmonicOptions(harmonics=3, max_step=0.2)
    patch.setattr(
        "aeroflutter.report.analyses.limit_cycles", lambda *loop: limit_cycles(*loop, few)
    )
    patch.setattr(
        f"{analyses}.harmonic_families",
        lambda family, spring, *_: harmonic_families(family, spring, low),
    )
    patch.setattr(f"{analyses}.PROVING", 0.1)


@pytest.fixture(scope="module")
def data(page: Path) -> dict[str, Any]:
    return _carried(page.read_text(encoding="utf-8"))


def _carried(text: str) -> dict[str, Any]:
    """The data of a page."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)
    assert found
    carried: dict[str, Any] = json.loads(found[1])
    return carried


def test_nothing_of_a_title_is_markup(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert "<img src=x" not in text
    assert text.count("<script") == 3
    assert text.count("</script>") == 3


def test_another_file_is_not_replaced(tmp_path: Path, capsys: Any) -> None:
    words = ["report", "naca496", "--velocity", "40", "--alpha-deg", "1", "--periods", "1"]
    out = tmp_path / "r.html"
    out.write_text("notes of my own")
    assert main([*words, "--out", str(out)]) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert out.read_text() == "notes of my own"
    assert main([*words, "--out", str(out), "--overwrite"]) == 0
    assert main([*words, "--out", str(out)]) == 0  # an earlier report of the same case
    assert f"replaced: {out}" in capsys.readouterr().out
    assert main([*words, "--out", str(out), "--set", "section.zeta_xi=0.1"]) == 2


def test_tables_are_in_seconds_where_the_page_is_in_metres(
    page: Path, data: dict[str, Any]
) -> None:
    text = page.read_text(encoding="utf-8")
    assert data["axis"]["semichord"] == B
    assert '<th scope="col">period (s)</th>' in text
    curve = data["curves"][0]
    seconds = curve["period"][0] * B / curve["x"][0]
    row = f"<td>{curve['x'][0]:.6g}</td><td>{curve['amplitude'][0]:.6g}</td>"
    assert f"<td>{seconds:.6g}</td>" in text[text.index(row) : text.index(row) + 200]
    assert "282.04 m/s" in text  # divergence


def test_a_model_from_a_file_has_a_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    import test_model_case

    test_model_case.npz(tmp_path / "s.npz", test_model_case.variables())
    case = tmp_path / "s.toml"
    case.write_text(
        'title = "a model"\n[model]\nkind = "state-space"\nfile = "s.npz"\n'
        '[[spring]]\nat = "pitch"\nkind = "freeplay"\ngap_deg = 1.0\n'
        '[[spring]]\nat = "heave"\nkind = "linear"\n'
    )
    _quick(monkeypatch)
    out = tmp_path / "m.html"
    words = ["report", str(case), "--out", str(out)]
    assert main([*words, "--alpha-deg", "1,2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["cells"] > 0
    text = out.read_text(encoding="utf-8")
    assert "A model from a file: 6 states" in text
    assert not re.search(r'<section aria-labelledby="map" hidden>', text)
    assert "<dd>87.195 m/s at 4.769 Hz</dd>" in text
    data = _carried(text)
    assert data["map"]["y"]["values"] == [1.0, 2.0]
    assert data["axis"]["seconds"] == 1.0
    assert {curve["method"] for curve in data["curves"]} == {"df", "hb", "exact"}
    shown = _shown(out, "return [document.getElementById('chosen').textContent, UNIT, CLOCK]")
    assert re.search(r"limit cycle of amplitude .* Hz\)", shown[0])
    assert shown[1:] == [" s", "t"]


def test_a_section_with_its_spring_in_heave_starts_in_pitch(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The map is over pitch in degrees, and pitch is drawn below the heave."""
    from aeroflutter.report import ReportOptions, analyse, gather

    _quick(monkeypatch)
    gap = {"spring": [{"at": "heave", "kind": "freeplay", "gap": 0.02}]}
    case = load_case({"section": {"omega_bar": 0.5, "mu": 20.0}, **gap})
    options = ReportOptions(speed_ratios=np.array([1.1]), pitches_deg=np.array([3.0]), periods=2.0)
    data = gather(analyse(case, options))
    assert data["told"] == {"unit": "semichord", "mark": " semichord", "effort": "force"}
    assert (data["map"]["y"]["name"], data["map"]["y"]["mark"]) == ("pitch", "°")
    assert data["beside"]["label"] == "pitch (deg)"
    count, _, *units = data["motions"]["headers"][data["map"]["motion"]]
    blob = gzip.decompress(base64.b64decode(data["motions"]["samples"]))
    start = sum(8 * one[0] for one in data["motions"]["headers"][: data["map"]["motion"]])
    first = np.frombuffer(blob, "<i2", 3 * count, start + 2 * count).reshape(3, count)[:, 0]
    assert first * units == pytest.approx([0.0, 3.0, 0.0], abs=1e-3)


def test_the_map_is_told_in_words() -> None:
    grid = {
        "x": {"scale": 2.0, "values": [1.0, 2.0, 3.0]},
        "y": {"values": [1.0, 5.0]},
        "states": ["damped", "lco"],
        "state": [[0, 0], [0, 1], [1, -1]],
    }
    assert _words(grid) == (
        "<li>5°: damped at 2; limit cycle at 4; not computed at 6</li>"
        "<li>1°: damped at 2 to 4; limit cycle at 6</li>"
    )


@pytest.mark.parametrize(
    ("low", "high", "end"), [(0.985, 1.0, 1.004), (0.9, 1.0, 1.025), (1.0, 3.0, 1.5)]
)
def test_the_view_fits_where_cycles_are(
    low: float, high: float, end: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those that begin just below flutter, and those that go up from it."""
    found = _seen(monkeypatch, np.linspace(low, high, 50), np.linspace(0.5, 3.0, 50))
    assert found["x"][1] == pytest.approx(end, abs=1e-3)
    assert found["x"][0] < low
    assert not found["log"]


def test_small_amplitudes_are_seen_beside_large_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    speeds = np.tile(np.linspace(0.6, 0.99, 40), 2)
    sizes = np.append(0.1 + 0.01 * speeds[:40], 0.2 / (1.0 - speeds[40:]))
    found = _seen(monkeypatch, speeds, sizes)
    assert found["log"]
    assert found["y"][0] < 0.11 < found["y"][1]


def _seen(patch: pytest.MonkeyPatch, speeds: Any, sizes: Any) -> dict[str, Any]:
    """Limits of the amplitude figure around some cycles; the spring's own size is one degree."""
    from types import SimpleNamespace

    from aeroflutter.report import content

    points = [
        {"speed": u, "amplitude_deg": a}
        for u, a in zip(speeds.tolist(), sizes.tolist(), strict=True)
    ]
    patch.setattr(content, "_results", lambda _: {"exact": points})
    patch.setattr(content, "fields_of", lambda result: {"branch": result})
    spring = SimpleNamespace(scale=np.radians(1.0))
    analyses: Any = SimpleNamespace(unit=1.0, flutter=1.0, case=SimpleNamespace(spring=spring))
    return content._view(analyses)


@pytest.mark.parametrize("ratio", [0.05, 0.3, 0.95])
def test_thinned_traces_keep_their_extremes(ratio: float) -> None:
    """At low speed the motion turns many times in a period of flutter."""
    case = load_case("run14")
    period, speed = 28.0, ratio * 4.1145
    start = Initial(alpha=np.radians(6.0))
    response = marched(case.family().at(speed), case.spring, start, period, 6 * period)
    motions = Motions()
    motions.add_response(response)
    count = int(motions.headers[0][0])
    kept = np.frombuffer(motions.parts[0], "<i2", 3 * count, 2 * count).reshape(3, count)
    signals = (np.degrees(response.pitch), response.heave, np.degrees(response.moment))
    places = np.frombuffer(motions.parts[0], "<u2", count)
    for signal, values, unit in zip(signals, kept, motions.headers[0][2:], strict=True):
        turns = np.flatnonzero(np.diff(signal)[1:] * np.diff(signal)[:-1] < 0.0) + 1
        assert turns.size >= 8
        drawn = np.interp(turns, places, unit * values)
        assert drawn == pytest.approx(signal[turns], abs=1e-3 * np.abs(signal).max())


def _driver() -> Any:
    """A browser without a window."""
    if BROWSER is None or DRIVER is None:
        pytest.skip("needs chromium and chromedriver (Debian: chromium, chromium-driver)")
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = BROWSER
    for word in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"):
        options.add_argument(word)
    options.add_argument("--window-size=1400,1000")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(options=options, service=Service(DRIVER))


def _open(driver: Any, page: Path) -> None:
    from selenium.webdriver.support.ui import WebDriverWait

    driver.get(page.as_uri())
    ready = "return document.documentElement.dataset.ready"
    WebDriverWait(driver, 60).until(lambda one: one.execute_script(ready) == "yes")


def _shown(page: Path, script: str) -> Any:
    """What a script says of a page, in a browser of its own."""
    driver = _driver()
    try:
        _open(driver, page)
        assert driver.get_log("browser") == []
        return driver.execute_script(script)
    finally:
        driver.quit()


@pytest.fixture(scope="module")
def browser(page: Path) -> Any:
    driver = _driver()
    _open(driver, page)
    yield driver
    driver.quit()


def test_a_title_of_script_is_words(browser: Any) -> None:
    assert browser.title == HOSTILE
    assert browser.find_element("tag name", "h1").text == HOSTILE
    assert browser.execute_script("return document.images.length") == 0


def test_the_button_says_what_it_does(browser: Any) -> None:
    button = browser.find_element("id", "theme")
    words = []
    for _ in range(2):
        words.append(button.text)
        button.click()
    assert words == ["Dark theme", "Light theme"]


def test_the_centre_of_a_mark_is_the_bifurcation(browser: Any, data: dict[str, Any]) -> None:
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.actions.action_builder import ActionBuilder

    place = """
    const plot = document.getElementById("plot-curves");
    plot.scrollIntoView({block: "center"});
    const box = plot.getBoundingClientRect(), {xaxis, yaxis} = plot._fullLayout;
    return [box.left + xaxis._offset + xaxis.d2p(arguments[0]),
            box.top + yaxis._offset + yaxis.d2p(arguments[1])];
    """
    event = next(one for one in data["events"] if one["kind"] == "fold")
    left, top = browser.execute_script(place, event["x"], event["amplitude"])
    action = ActionBuilder(browser)
    for away in (-4, 0):
        action.pointer_action.move_to_location(int(left) + away, int(top))
    action.perform()
    ActionChains(browser).pause(0.2).click().perform()
    said = browser.execute_script("return document.getElementById('chosen').textContent")
    assert said.startswith("Fold at speed")
    assert re.search(r"period [\d.]+ s \([\d.]+ Hz\)", said)


def test_motions_are_in_seconds(browser: Any, data: dict[str, Any]) -> None:
    browser.execute_script("chooseCell(1, 1)")
    shown = browser.execute_script("return document.getElementById('plot-traces').data[0].x")
    header = data["motions"]["headers"][data["map"]["motion"] + 3]
    speed = data["map"]["x"]["values"][1] * data["map"]["x"]["scale"]
    assert speed == pytest.approx(160.0, rel=1e-5)
    # four periods of flutter in tau: 13.381 Hz at 196.67 m/s
    assert shown[-1] == pytest.approx(4.0 / 13.381 * 196.67 / 160.0, rel=0.01)
    step = header[1] * B / speed
    assert shown[1] == pytest.approx(round(shown[1] / step) * step)
    said = browser.execute_script("return document.getElementById('chosen').textContent")
    assert re.search(r"certain after t = [\d.]+ s", said)


def test_linear_figures_are_read_by_keyboard(browser: Any, data: dict[str, Any]) -> None:
    from selenium.webdriver.common.keys import Keys

    region = browser.find_element("id", "linear-figures")
    region.send_keys(Keys.HOME, Keys.ARROW_RIGHT)
    said = browser.find_element("id", "linear-said").text
    locus = data["locus"]
    assert said.startswith(f"airspeed V (m/s) {locus['speeds'][1]:.4g}: mode 1 frequency (Hz) ")
    assert f"{locus['modes'][1]['frequency'][1]:.4g}" in said
