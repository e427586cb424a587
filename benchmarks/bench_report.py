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
            times = openings(file)
        yield "opened in chromium, every figure drawn, median", statistics.median(times), "s", 2.0
        yield "opened in chromium, best", min(times), "s", None


def openings(file: Path) -> list[float]:
    """Seconds from navigation to the last figure, each in a browser of its own."""
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
            driver.get(file.as_uri())
            wait = WebDriverWait(driver, 60, poll_frequency=0.01)
            found.append(wait.until(lambda one: one.execute_script(READY)) / 1e3)
        finally:
            driver.quit()
    return found
