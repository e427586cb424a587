"""The report of run 14: how long it takes to make, how large it is, how fast a browser opens it."""

from __future__ import annotations

import shutil
import statistics
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from aeroflutter.case import load_case
from aeroflutter.report import analyse, gather, plotly_source, render

OPENINGS = 5
READY = "return document.documentElement.dataset.ready === 'yes' ? performance.now() : null"
PAINTED = "return performance.getEntriesByName('first-contentful-paint')[0].startTime"


def measure() -> Iterator[tuple[str, float, str, float | None]]:
    """What, value, unit and aim."""
    case = load_case("run14")
    begin = time.process_time()
    page = render(case, gather(analyse(case)), plotly_source())
    yield "made, kernels compiled on the first run", time.process_time() - begin, "CPU s", None
    yield "size", len(page.encode()) / 1e6, "MB", 6.0
    if shutil.which("chromium") and shutil.which("chromedriver"):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "report.html"
            file.write_text(page, encoding="utf-8")
            seen, drawn, again = zip(*openings(file), strict=True)
        yield "opened in chromium: the page is there, median", statistics.median(seen), "s", 2.0
        yield "every figure drawn, in a new browser, median", statistics.median(drawn), "s", 2.0
        yield "every figure drawn, best", min(drawn), "s", None
        yield "every figure drawn, opened again, median", statistics.median(again), "s", 2.0


def openings(file: Path) -> list[list[float]]:
    """Seconds from navigation, each time in a browser of its own: to the first paint, to the last
    figure, and to the last figure when it is opened again.
    """
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.support.ui import WebDriverWait

    options = webdriver.ChromeOptions()
    for word in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"):
        options.add_argument(word)
    found = []
    for _ in range(OPENINGS):
        service = Service(shutil.which("chromedriver"))
        driver: Any = webdriver.Chrome(options=options, service=service)
        try:
            wait = WebDriverWait(driver, 60, poll_frequency=0.01)
            driver.get(file.as_uri())
            drawn = wait.until(lambda one: one.execute_script(READY))
            seen = driver.execute_script(PAINTED)
            driver.get(file.as_uri())
            again = wait.until(lambda one: one.execute_script(READY))
            found.append([seen / 1e3, drawn / 1e3, again / 1e3])
        finally:
            driver.quit()
    return found
