"""Pages of the documentation: mathematics without a network, figures that their commands draw."""

import re
import shutil
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
PAGES = sorted(page for page in DOCS.rglob("*.md") if "_build" not in page.parts)
FORMULA = re.compile(r"\$\$(.+?)\$\$|(?<![\\$])\$([^$\n]+(?:\n[^$\n]+)?)\$", re.DOTALL)
BROWSER, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")


@pytest.fixture
def mathml(monkeypatch):
    pytest.importorskip("latex2mathml")
    pytest.importorskip("docutils")
    monkeypatch.syspath_prepend(str(DOCS))
    yield sys.modules.get("mathml") or __import__("mathml")
    sys.modules.pop("mathml", None)


def formulas(page):
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    return [block or inline for block, inline in FORMULA.findall(re.sub(r"`[^`]*`", "", text))]


def test_every_formula_is_understood(mathml):
    found = [one for page in PAGES for one in formulas(page)]
    assert len(found) > 500
    for one in found:
        assert mathml.mathml(one, "inline").startswith("<math")


def test_what_is_not_understood_stops_the_build(mathml):
    with pytest.raises(ValueError, match="no MathML"):
        mathml.mathml(r"a + \nosuchthing b", "inline")


def test_every_module_of_figures_is_in_the_api_pages():
    text = (DOCS / "api.md").read_text(encoding="utf-8")
    inner = {"__init__", "amplitudes", "branches", "layout"}  # what others draw with
    for module in (DOCS.parent / "aeroflutter" / "plots").glob("*.py"):
        assert module.stem in inner or f"automodule:: aeroflutter.plots.{module.stem}\n" in text


def test_pictures_of_pages_are_drawn_by_their_commands():
    """What `docs/figures.py` will look for when the pages are made."""
    seen = 0
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for name in re.findall(rf"\]\(figures/{page.stem}/(\w+)\.svg\)", text):
            plotted = re.findall(r"^\$ aeroflutter .*--plot (\w+)\.\w+", text, re.M)
            assert name in plotted or page.stem == "index", (page, name)
            seen += 1
    assert seen >= 8


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::PendingDeprecationWarning")
def test_a_browser_without_network_shows_mathematics(tmp_path, mathml):
    pytest.importorskip("myst_parser")
    sphinx = pytest.importorskip("sphinx.cmd.build")
    if BROWSER is None or DRIVER is None:
        pytest.skip("needs chromium and chromedriver (Debian: chromium, chromium-driver)")
    source = tmp_path / "source"
    source.mkdir()
    (source / "conf.py").write_text(
        'extensions = ["myst_parser", "mathml"]\nhtml_math_renderer = "mathml"\n'
        'html_theme = "basic"\nmyst_enable_extensions = ["amsmath", "dollarmath", "deflist"]\n'
        "myst_update_mathjax = False\n"
    )
    text = (DOCS / "theory" / "model.md").read_text(encoding="utf-8")
    (source / "index.md").write_text(re.sub(r"\]\([^)]*\)", "](#)", text))
    assert sphinx.main(["-q", "-b", "html", str(source), str(tmp_path / "html")]) == 0
    written = len(formulas(DOCS / "theory" / "model.md"))
    sizes, left, asked = _opened(tmp_path / "html" / "index.html")
    assert len(sizes) >= 0.9 * written > 20
    assert all(width > 3 and height > 5 for width, height in sizes)
    assert not re.search(r"\\(frac|alpha|mathrm|left)", left)
    assert asked == []


def _opened(page):
    """Sizes of formulas in pixels, the text that is seen, and addresses outside that were asked."""
    import json

    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = BROWSER
    for word in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"):
        options.add_argument(word)
    options.set_capability("goog:loggingPrefs", {"performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    try:
        driver.execute_cdp_cmd("Network.enable", {})
        driver.execute_cdp_cmd(
            "Network.emulateNetworkConditions",
            {"offline": True, "latency": 0, "downloadThroughput": 0, "uploadThroughput": 0},
        )
        driver.get(page.as_uri())
        sizes = driver.execute_script(
            "return [...document.querySelectorAll('math')].map((one) => {"
            "const box = one.getBoundingClientRect(); return [box.width, box.height];});"
        )
        text = driver.execute_script("return document.body.innerText")
        log = driver.get_log("performance")
    finally:
        driver.quit()
    events = [json.loads(entry["message"])["message"] for entry in log]
    urls = [
        event["params"]["request"]["url"]
        for event in events
        if event["method"] == "Network.requestWillBeSent"
    ]
    return sizes, text, [url for url in urls if url.startswith("http")]
