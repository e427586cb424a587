"""The report: what it carries, and what a reader sees, does and hears in a browser."""

import base64
import gzip
import json
import re
import shutil
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from aeroflutter.case import Case, load_case
from aeroflutter.cli import main
from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.linear.rootlocus import flutter_point
from aeroflutter.motion.response import STATES, Initial, SimulateOptions, simulate
from aeroflutter.report import ReportOptions, analyse, gather, render
from aeroflutter.report.motions import LEVELS, Motions, harmonic_motion, marched
from aeroflutter.springs import Linear

SMALL = ("--speed-ratio", "0.9,0.95,1.05,1.1", "--alpha-deg", "2,6")


def written(folder: Path, case: str, *words: str) -> str:
    """The page that the command writes."""
    page = folder / "page.html"
    assert main(["report", case, "-o", str(page), *words]) == 0
    return page.read_text(encoding="utf-8")


def carried(page: str) -> dict[str, Any]:
    """The data of a page."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    assert found
    return json.loads(found[1])


def decoded(data: dict[str, Any], number: int) -> dict[str, np.ndarray]:
    """A motion, decoded as `Motions.coded` says."""
    blob = gzip.decompress(base64.b64decode(data["motions"]["samples"]))
    headers = data["motions"]["headers"]
    count, step, *units = headers[number]
    start = sum(8 * header[0] for header in headers[:number])
    places = np.frombuffer(blob, "<u2", count, start)
    values = np.frombuffer(blob, "<i2", 3 * count, start + 2 * count).reshape(3, count)
    columns = zip(("pitch", "heave", "moment"), units, values, strict=True)
    return {"time": step * places, **{name: unit * value for name, unit, value in columns}}


@pytest.fixture(autouse=True)
def brief(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages whose proofs are not looked at are not kept waiting for them."""
    monkeypatch.setattr("aeroflutter.report.analyses.PROVING", 0.5)


@pytest.fixture(scope="module")
def run14(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    written(folder, "run14")
    return folder / "page.html"


@pytest.fixture(scope="module")
def data(run14: Path) -> dict[str, Any]:
    return carried(run14.read_text(encoding="utf-8"))


def engine(case: Case, data: dict[str, Any], i: int, j: int) -> dict[str, np.ndarray]:
    """What the engine says of a cell, at all its samples."""
    grid = data["map"]
    flutter = flutter_point(case.family())
    assert flutter is not None
    period = 2 * np.pi / flutter.k
    found = simulate(
        case.family().at(grid["x"]["values"][i] * flutter.speed),
        case.spring,
        Initial(alpha=np.radians(grid["y"]["values"][j])),
        SimulateOptions(duration=12 * period, dt=period / 300, decide=False),
    )
    pitch, moment = np.degrees(found.pitch), np.degrees(found.moment)
    return {"time": found.time, "pitch": pitch, "heave": found.heave, "moment": moment}


# ------------------------------------------------------------------------ what a page carries


def test_it_is_one_small_file_that_asks_for_nothing(run14: Path) -> None:
    page = run14.read_text(encoding="utf-8")
    assert run14.stat().st_size < 6e6
    assert page.count('<script type="application/gzip" id="plotly">') == 1
    assert not re.search(r"<(link|img|iframe|script)[^>]*(src|href)=\"(?!data:)", page)
    packed = re.search(r'id="plotly">(.*?)<', page)
    assert packed
    assert b"plotly.js" in gzip.decompress(base64.b64decode(packed[1]))[:200]


def test_motions_are_the_engines_own_samples(data: dict[str, Any]) -> None:
    case, grid = load_case("run14"), data["map"]
    rows = len(grid["y"]["values"])
    for i, j in ((0, 3), (10, 7), (-1, 14)):
        i %= len(grid["x"]["values"])
        number = grid["motion"] + i * rows + j
        shown, whole = decoded(data, number), engine(case, data, i, j)
        places = np.rint(shown["time"] / (whole["time"][1])).astype(int)
        for name, unit in zip(
            ("pitch", "heave", "moment"), data["motions"]["headers"][number][2:], strict=True
        ):
            # Half a level of coding; speed and pitch were written with seven digits, which an
            # unstable motion magnifies.
            assert shown[name] == pytest.approx(whole[name][places], abs=unit, rel=1e-4)


def test_a_settled_cycle_is_the_one_of_its_cell(data: dict[str, Any]) -> None:
    grid = data["map"]
    cells = np.argwhere(np.array(grid["state"]) == STATES.index("lco"))
    assert len(cells) > 10
    for i, j in cells[:: len(cells) // 5]:
        cycle = decoded(data, grid["settled"][i][j])
        half = 0.5 * np.ptp(cycle["pitch"])
        assert half == pytest.approx(grid["amplitude"][i][j], rel=2e-4)  # sampled at 300 a period
        assert cycle["time"][-1] == pytest.approx(grid["period"][i][j], rel=1 / 300)
        assert cycle["pitch"][-1] == pytest.approx(cycle["pitch"][0], abs=0.05 * half)


def test_three_methods_agree_on_the_page(data: dict[str, Any]) -> None:
    """Exact curve, harmonic balance and describing function at one amplitude (2 degrees)."""
    speeds = {}
    for curve in data["curves"]:
        amplitude = np.array(curve["amplitude"])
        up = np.argsort(amplitude)
        speeds[curve["method"]] = np.interp(2.0, amplitude[up], np.array(curve["x"])[up])
    assert speeds["hb"] == pytest.approx(speeds["exact"], rel=1e-3)
    assert speeds["df"] == pytest.approx(speeds["exact"], rel=1e-3)
    fold = next(event for event in data["events"] if event["kind"] == "fold")
    assert fold["x"] == pytest.approx(0.92151, abs=1e-5)


def test_the_proved_band_holds_its_curve(data: dict[str, Any]) -> None:
    curve = next(one for one in data["curves"] if one["method"] == "df")
    proved = [(x, *band) for x, band in zip(curve["x"], curve["band"], strict=True) if band[0]]
    assert len(proved) > 20
    assert all(low <= x <= high for x, low, high in proved)


def test_heave_of_a_harmonic_is_the_flutter_mode() -> None:
    family = load_case("run14").family()
    flutter = flutter_point(family)
    assert flutter is not None
    system = family.at(flutter.speed)
    _, pitch, heave, moment = harmonic_motion(system, Linear(), np.array([0, -1j]), flutter.k)
    values, vectors = np.linalg.eig(system.closed(1.0))
    mode = vectors[:, np.argmin(abs(values - 1j * flutter.k))]
    ratio = mode[system.state_names.index("xi")] / (system.c @ mode)
    turn = 2 * np.pi * np.arange(pitch.size) / (pitch.size - 1)
    assert moment == pytest.approx(pitch)
    assert heave == pytest.approx((-1j * ratio * np.exp(1j * turn)).real, abs=1e-9)


def test_a_divergent_motion_ends_and_keeps_its_accuracy() -> None:
    case = load_case("run14")
    period = 28.0
    response = marched(
        case.family().at(6.0), case.spring, Initial(alpha=0.1), period, 40.0 * period
    )
    motions = Motions()
    motions.add_response(response, divergent=True)
    count, step, unit, *_ = motions.headers[0]
    first = np.abs(response.pitch[:300]).max()
    assert np.degrees(20 * first) < unit * LEVELS <= np.degrees(30 * first)
    assert count * step < response.time[-1]


def test_straight_lines_between_samples_are_the_springs_path() -> None:
    """Freeplay, whose corners a sample on their wrong side would cut."""
    case = load_case("freeplay-02")
    start, period = Initial(alpha=np.radians(7.5)), 75.0
    response = marched(case.family().at(3.77), case.spring, start, period, 12 * period)
    motions = Motions()
    motions.add_response(response)
    shown = decoded({"motions": motions.coded()}, 0)
    apart = np.diff(shown["time"]) > 1.5 * response.time[1]
    middle = 0.5 * (shown["pitch"][1:] + shown["pitch"][:-1])[apart]
    moment = 0.5 * (shown["moment"][1:] + shown["moment"][:-1])[apart]
    law = np.degrees(case.spring.moment(np.radians(middle)))
    assert apart.sum() > 100
    assert moment == pytest.approx(law, abs=2 * sum(motions.headers[0][2::2]))  # levels of coding


class Outline(HTMLParser):
    """What a screen reader finds: landmarks, names, identifiers."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))


def test_landmarks_and_names(run14: Path) -> None:
    outline = Outline()
    outline.feed(run14.read_text(encoding="utf-8"))
    tags = [tag for tag, _ in outline.tags]
    identifiers = [attrs["id"] for _, attrs in outline.tags if "id" in attrs]
    assert len(identifiers) == len(set(identifiers))
    assert [tags.count(tag) for tag in ("main", "h1", "header", "nav", "footer")] == [1] * 5
    for tag, attrs in outline.tags:
        for name in ("aria-labelledby", "aria-describedby"):
            assert attrs.get(name, identifiers[0]) in identifiers
        if attrs.get("role") in ("img", "application", "region") or tag == "nav":
            assert attrs.get("aria-label") or attrs.get("aria-labelledby")
        if tag == "th":
            assert attrs.get("scope") in ("col", "row")
    assert dict(outline.tags[0][1])["lang"] == "en"


def test_tables_say_what_the_figures_show(run14: Path, data: dict[str, Any]) -> None:
    page = run14.read_text(encoding="utf-8")
    body = page[page.index('id="table-curves"') : page.index('id="table-map"')]
    points = sum(len(curve["x"]) for curve in data["curves"]) + len(data["events"])
    assert body.count("<tr>") == points
    letters = page[page.index('id="table-map"') :].count("<td>L</td>")
    assert letters == data["map"]["counts"]["lco"]


def test_a_long_list_of_notes_is_folded() -> None:
    case, few, many = load_case("naca496"), ["a", "b"], [*"abcde<"]
    options = ReportOptions(speed_ratios=np.array([0.9, 1.1]), pitches_deg=np.array([3.0]))
    content = gather(analyse(case, options))
    assert "<details>" not in noted(render(case, content | {"notes": few}, ""))
    page = noted(render(case, content | {"notes": many}, ""))
    assert page.index("<li>c</li>") < page.index("<summary>3 more</summary>") < page.index("&lt;")


def test_all_cycles_are_in_view_and_a_method_that_fails_is_a_note(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Run 103 has cycles that only the exact search knows, at lower speeds than the others."""

    def fails(*_: object) -> None:
        raise ConvergenceError("too few")

    monkeypatch.setattr("aeroflutter.report.analyses.harmonic_families", fails)
    page = written(tmp_path, "run103", "--speed-ratio", "0.6", "--alpha-deg", "3")
    found = carried(page)
    assert "<li>Harmonic balance: too few.</li>" in page
    assert {curve["method"] for curve in found["curves"]} == {"df", "exact"}
    assert found["view"]["x"][0] < min(min(curve["x"]) for curve in found["curves"])


def test_cycles_far_above_flutter_and_a_title_of_markup(tmp_path: Path) -> None:
    """Soft inside, stiff outside: all cycles above twice the flutter speed of the stiff slope."""
    case = tmp_path / "stiff.toml"
    case.write_text(
        'title = "<!--<script>"\n[section]\nomega_bar = 0.2\n[spring]\nkind = "table"\n'
        "pitch_deg = [-2.0, -0.5, 0.5, 2.0]\nmoment_deg = [-14.0, -2.0, 2.0, 14.0]\n"
    )
    page = written(tmp_path, str(case), "--speed-ratio", "1,3", "--alpha-deg", "3")
    found = carried(page)
    low, high = found["view"]["x"]
    assert low < min(min(curve["x"]) for curve in found["curves"]) < high
    assert "<!--" not in page


@pytest.mark.slow
def test_a_softening_spring_beyond_hills_reach_has_a_report(tmp_path: Path) -> None:
    words = ("--set", "spring.beta3=-3", "--speed-ratio", "0.9", "--alpha-deg", "5")
    found = carried(written(tmp_path, "cubic-02", *words))
    assert "df" in {curve["method"] for curve in found["curves"]}


def noted(page: str) -> str:
    """The list of notes of a page."""
    return page[page.index('id="notes"') : page.index('<div class="three">')]


# ------------------------------------------------------------------------ other cases, bad input


def test_without_flutter_the_page_says_so(tmp_path: Path) -> None:
    words = ("--set", "section.x_alpha=-0.2", "--speed", "2:8:4", "--alpha-deg", "2,6")
    page = written(tmp_path, "run14", *words)
    assert "There is no linear flutter between" in page
    assert carried(page)["axis"] == {"key": "speed", "label": "airspeed U*", "unit": 1.0}


def test_a_linear_spring_has_no_cycles_and_says_so(tmp_path: Path) -> None:
    page = written(tmp_path, "naca496", *SMALL)
    assert "<li>The spring is linear: it has no limit cycles.</li>" in page
    assert "52.687 m/s" in page
    found = carried(page)
    assert found["curves"] == found["events"] == []
    assert found["map"]["counts"]["damped"] == found["map"]["counts"]["divergent"] == 4


def test_a_spring_without_pieces_has_every_curve(tmp_path: Path) -> None:
    words = ("--speed-ratio", "1.1,1.2", "--alpha-deg", "10", "--periods", "3")
    page = written(tmp_path, "cubic-02", *words)
    assert "<li>Exact cycles: " not in page
    found = carried(page)
    assert {curve["method"] for curve in found["curves"]} == {"df", "hb", "exact"}
    assert found["map"]["counts"]["lco"] == 2


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--out", "report.pdf"), "--out report.pdf: must end in .html"),
        (("--out", "nowhere/report.html"), "there is no folder nowhere"),
        (("--speed-ratio", "1,0.9"), "--speed-ratio: must be ascending"),
        (("--speed-ratio", "0.1:1:200"), "3000 cells are more than the 1200"),
        (("--speed-ratio", "0.9,1", "--speed", "3,4"), "give one of the two"),
        (("--periods", "0"), "periods: must lie between"),
        (("--set", "section.mu=-1"), "section.mu"),
    ],
)
def test_bad_input_is_one_line(
    words: tuple[str, ...],
    named: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["report", "run14", *words]) == 2
    err = capsys.readouterr().err
    assert named in err
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_without_plotly_one_line_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "plotly.offline", None)
    assert main(["report", "run14"]) == 2
    assert 'pip install "aeroflutter[report]"' in capsys.readouterr().err


# ------------------------------------------------------------------------ in a browser

BROWSER, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")


@pytest.fixture(scope="module")
def browser(run14: Path) -> Iterator[Any]:
    if BROWSER is None or DRIVER is None:
        pytest.skip("needs chromium and chromedriver (Debian: chromium, chromium-driver)")
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = BROWSER
    for word in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"):
        options.add_argument(word)
    options.add_argument("--window-size=1400,1000")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    yield driver
    driver.quit()


@pytest.fixture
def opened(browser: Any, run14: Path) -> Any:
    """The page, freshly opened, its figures drawn."""
    from selenium.webdriver.support.ui import WebDriverWait

    browser.get_log("performance")
    browser.get(run14.as_uri())
    WebDriverWait(browser, 60).until(lambda one: one.execute_script(READY) == "yes")
    yield browser
    assert browser.get_log("browser") == []


READY = "return document.documentElement.dataset.ready"
PIXEL = """
const plot = document.getElementById(arguments[0]);
plot.scrollIntoView({block: "center"});
const box = plot.getBoundingClientRect(), {xaxis, yaxis} = plot._fullLayout;
return [box.left + xaxis._offset + xaxis.d2p(arguments[1]),
        box.top + yaxis._offset + yaxis.d2p(arguments[2])];
"""
SHOWN = """
const [pitch, heave] = document.getElementById("plot-traces").data;
const path = document.getElementById("plot-path").data[0];
return {time: pitch.x, pitch: pitch.y, heave: heave.y, moment: path.y};
"""


def click(browser: Any, plot: str, x: float, y: float) -> None:
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.actions.action_builder import ActionBuilder

    left, top = browser.execute_script(PIXEL, plot, x, y)
    action = ActionBuilder(browser)
    action.pointer_action.move_to_location(int(left) - 3, int(top)).move_to_location(
        int(left), int(top)
    )
    action.perform()
    ActionChains(browser).pause(0.2).click().perform()


def said(browser: Any) -> str:
    return browser.execute_script("return document.getElementById('chosen').textContent")


def press(browser: Any, *keys: str) -> None:
    for key in keys:
        browser.switch_to.active_element.send_keys(key)


def test_opening_asks_the_network_for_nothing(opened: Any, run14: Path) -> None:
    sent = [json.loads(entry["message"])["message"] for entry in opened.get_log("performance")]
    urls = [
        one["params"]["request"]["url"]
        for one in sent
        if one["method"] == "Network.requestWillBeSent"
    ]
    assert urls[0] == run14.as_uri()
    assert [url for url in urls[1:] if not url.startswith(("data:", "blob:"))] == []


def test_a_click_on_a_cell_shows_the_engines_trace(opened: Any, data: dict[str, Any]) -> None:
    grid = data["map"]
    for i, j in ((13, 9), (3, 12)):
        click(opened, "plot-map", grid["x"]["values"][i], grid["y"]["values"][j])
        assert f"initial pitch {grid['y']['values'][j]:.5g}°" in said(opened)
        shown = {name: np.array(v) for name, v in opened.execute_script(SHOWN).items()}
        whole = engine(load_case("run14"), data, i, j)
        places = np.rint(shown["time"] / whole["time"][1]).astype(int)
        assert shown["time"][-1] == pytest.approx(whole["time"][-1])
        for name in ("pitch", "heave", "moment"):
            size = np.abs(whole[name]).max()
            assert shown[name] == pytest.approx(whole[name][places], abs=1e-4 * size)


def test_a_click_on_a_curve_shows_its_cycle(opened: Any, data: dict[str, Any]) -> None:
    curve = next(one for one in data["curves"] if one["method"] == "exact")
    inside = [n for n, a in enumerate(curve["amplitude"]) if 2 < a < data["view"]["y"][1] - 0.5]
    n = inside[len(inside) // 2]
    click(opened, "plot-curves", curve["x"][n], curve["amplitude"][n])
    shown = opened.execute_script(SHOWN)
    assert "stable cycle at speed" in said(opened)
    assert 0.5 * np.ptp(shown["pitch"]) == pytest.approx(curve["amplitude"][n], rel=1e-3)
    assert shown["time"][-1] == pytest.approx(curve["period"][n], rel=1 / 200)


RING = """
const plot = document.getElementById("plot-curves");
return plot._fullLayout.shapes.filter((one) => one.type === "circle")
  .map((one) => [one.xanchor, one.yanchor]);
"""
FRAME = """
const plot = document.getElementById("plot-map");
const frames = plot._fullLayout.shapes.filter((one) => one.yref === "y");
return frames.map((one) => [one.x0, one.x1, one.y0, one.y1]);
"""


def test_the_choice_is_marked_and_the_mark_outlives_a_theme(
    opened: Any, data: dict[str, Any]
) -> None:
    curve, grid = data["curves"][0], data["map"]
    opened.execute_script("choosePoint(0, 3)")
    opened.find_element("id", "theme").click()
    assert opened.execute_script(RING) == [[curve["x"][3], curve["amplitude"][3]]]
    assert opened.execute_script(FRAME) == []
    opened.execute_script("chooseCell(2, 5)")
    opened.find_element("id", "theme").click()
    frames = opened.execute_script(FRAME)
    assert opened.execute_script(RING) == []
    assert len(frames) == 2  # light on dark, for it lies on any colour
    for x0, x1, y0, y1 in frames:
        assert [x for x in grid["x"]["values"] if x0 < x < x1] == [grid["x"]["values"][2]]
        assert [y for y in grid["y"]["values"] if y0 < y < y1] == [grid["y"]["values"][5]]


WATCH = """
new MutationObserver(() => {
  if (document.documentElement.dataset.ready !== "seen") return;
  window.drawnFirst = figures().filter(isDrawn);
}).observe(document, { attributes: true, subtree: true, attributeFilter: ["data-ready"] });
"""


def test_what_is_in_view_is_drawn_first(opened: Any) -> None:
    from selenium.webdriver.support.ui import WebDriverWait

    watch = opened.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": WATCH})
    opened.execute_script("scrollTo(0, 0)")
    opened.refresh()
    opened.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", watch)
    WebDriverWait(opened, 60).until(lambda one: one.execute_script(READY) == "yes")
    drawn = opened.execute_script("return window.drawnFirst")
    assert drawn == opened.execute_script("return figures().filter(inView)")
    assert 0 < len(drawn) < 5
    assert opened.execute_script("return figures().every(isDrawn)")


def test_keys_reach_everything(opened: Any, data: dict[str, Any]) -> None:
    from selenium.webdriver.common.keys import Keys

    active = "return document.activeElement.id || document.activeElement.className"
    reached = []
    opened.find_element("tag name", "body").send_keys(Keys.TAB)
    while len(reached) < 40:
        reached.append(opened.execute_script(active))
        if reached[-1] == "plot-map":
            break
        press(opened, Keys.TAB)
    assert reached[0] == "skip"
    assert {"theme", "plot-curves", "plot-map"} <= set(reached)
    outline = "return getComputedStyle(document.activeElement).outlineStyle"
    assert opened.execute_script(outline) == "solid"
    press(opened, Keys.HOME, *[Keys.ARROW_DOWN] * 20, Keys.ARROW_RIGHT, Keys.ARROW_UP)
    x, y = data["map"]["x"]["values"][1], data["map"]["y"]["values"][1]
    assert said(opened).startswith(f"Speed {x:.5g}, initial pitch {y:.5g}°")
    press(opened, Keys.SHIFT + Keys.TAB)
    press(opened, Keys.HOME, Keys.ARROW_RIGHT)
    curve = data["curves"][0]
    assert f"at speed {curve['x'][1]:.6g}" in said(opened)
    press(opened, Keys.ARROW_DOWN)
    assert said(opened).startswith("Harmonic balance")
    press(opened, Keys.PAGE_DOWN)
    assert said(opened).startswith(f"{data['events'][0]['kind'].capitalize()} at speed")


def test_dark_on_request_and_by_preference(opened: Any) -> None:
    paper = "return getComputedStyle(document.body).backgroundColor"
    ink = "return document.getElementById('plot-map')._fullLayout.font.color"
    light = opened.execute_script(paper)
    opened.find_element("id", "theme").click()
    dark, text = opened.execute_script(paper), opened.execute_script(ink)
    assert (light, dark) == ("rgb(255, 255, 255)", "rgb(20, 24, 29)")
    assert text == "rgb(228, 232, 236)"
    opened.find_element("id", "theme").click()
    media = {"features": [{"name": "prefers-color-scheme", "value": "dark"}]}
    opened.execute_cdp_cmd("Emulation.setEmulatedMedia", media)
    opened.execute_script("document.documentElement.style.colorScheme = ''")
    assert opened.execute_script(paper) == dark
    opened.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


@pytest.mark.parametrize("width", [390, 1400])
def test_nothing_is_wider_than_the_window(opened: Any, width: int) -> None:
    size = {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": False}
    opened.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        opened.refresh()
        assert opened.execute_script("return document.documentElement.scrollWidth") <= width
    finally:
        opened.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_paper_is_light_whatever_the_theme(opened: Any) -> None:
    ink = "return document.getElementById('plot-map')._fullLayout.font.color"
    light = opened.execute_script(ink)
    opened.find_element("id", "theme").click()
    dark = opened.execute_script(ink)
    opened.execute_script("dispatchEvent(new Event('beforeprint'))")
    assert opened.execute_script(ink) == light != dark
    opened.execute_script("dispatchEvent(new Event('afterprint'))")
    assert opened.execute_script(ink) == dark


def test_it_prints(opened: Any) -> None:
    printed = base64.b64decode(opened.execute_cdp_cmd("Page.printToPDF", {})["data"])
    assert printed.startswith(b"%PDF")
    assert 2 <= len(re.findall(rb"/Type\s*/Page\b", printed)) <= 8


def test_the_policy_keeps_foreign_scripts_and_the_network_out(opened: Any) -> None:
    probe = """
    const done = arguments[0];
    window.foreign = false;
    const script = document.createElement("script");
    script.textContent = "window.foreign = true";
    document.head.append(script);
    fetch("http://127.0.0.1:9/").then(() => done("reached"), () => done(window.foreign));
    """
    assert opened.execute_async_script(probe) is False
    refused = [entry["message"] for entry in opened.get_log("browser")]
    assert len(refused) >= 2
    assert all("Content Security Policy" in line for line in refused)


def test_a_section_that_starts_from_a_state_is_refused_before_anything_is_computed() -> None:
    steps: list[str] = []
    case = load_case("run14", {"initial": {"state": [0.0, 0.1, 0.0, 0.0, 0.0, 0.0]}})
    with pytest.raises(InputError, match="leaves no room for a pitch"):
        analyse(case, progress=steps.append)
    assert steps == []
