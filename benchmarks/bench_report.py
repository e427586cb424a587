"""The report of run 14: how long it takes to make, how large it is, how fast a browser opens it."""

from __future__ import annotations

import json
import shutil
import statistics
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from queue import Queue
from typing import Any

from aeroflutter.case import load_case
from aeroflutter.report import analyse, gather, plotly_source, render

OPENINGS = 7
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--no-first-run",
    "--window-size=1280,900",
)
READY = "return document.documentElement.dataset.ready"
MARKS = """(page) => ["first-contentful-paint", "seen", "yes"].map((name) =>
  page.performance.getEntriesByName(name)[0]?.startTime / 1e3)"""
# The report in a frame of its own origin, as it is; the frame around it tells when it was ready.
AROUND = f"""<!doctype html><iframe src="report.html" width="1260" height="780"></iframe><script>
const marks = {MARKS}, page = document.querySelector("iframe").contentWindow;
const timer = setInterval(() => {{
  const found = marks(page);
  if (!found.every(Number.isFinite)) return;
  clearInterval(timer);
  fetch("done", {{ method: "POST", body: JSON.stringify(found) }});
}}, 100);
</script>"""


def measure() -> Iterator[tuple[str, float, str, float | None]]:
    """What, value, unit and aim."""
    case = load_case("run14")
    begin = time.process_time()
    page = render(case, gather(analyse(case)), plotly_source())
    yield "made, kernels compiled on the first run", time.process_time() - begin, "CPU s", None
    yield "size", len(page.encode()) / 1e6, "MB", 4.0
    if not (shutil.which("chromium") and shutil.which("chromedriver")):
        return
    times = opened(page)
    yield "opened in a new chromium: painted, median", times[0], "s", 2.0
    yield "  the figures in view, median", times[1], "s", 2.0
    yield "  every figure, median", times[2], "s", 2.0
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "report.html"
        file.write_text(page, encoding="utf-8")
        times = driven(file)
    yield "opened by chromedriver: painted, median", times[0], "s", 2.0
    yield "  the figures in view, median", times[1], "s", 2.0
    yield "  every figure, median (its debugger reads plotly.js again)", times[2], "s", 2.0


def opened(page: str) -> list[float]:
    """Medians, in seconds from navigation, as a reader sees it: of the first paint, the figures in
    view, every figure. Each opening is in a browser with nothing in its caches and no debugger.
    """
    found: Queue[list[float]] = Queue()
    server = ThreadingHTTPServer(("127.0.0.1", 0), _handler(page, found))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        address = f"http://127.0.0.1:{server.server_port}/"
        return _medians([_visit(address, found) for _ in range(OPENINGS)])
    finally:
        server.shutdown()


def _handler(page: str, found: Queue[list[float]]) -> type[BaseHTTPRequestHandler]:
    pages = {"/": AROUND.encode(), "/report.html": page.encode()}

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            body = pages.get(self.path, b"")
            self.send_response(200 if body else 404)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def do_POST(self) -> None:
            found.put(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_: Any) -> None: ...

    return Handler


def _visit(address: str, found: Queue[list[float]]) -> list[float]:
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        words = ["chromium", *FLAGS, f"--user-data-dir={profile}", address]
        browser = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            return found.get(timeout=60)
        finally:
            browser.terminate()
            browser.wait(30)


def driven(file: Path) -> list[float]:
    """The same medians under chromedriver, whose debugger has V8 find the source position of every
    exception: plotly.js throws and catches a few when it starts, at the price of reading it again.
    """
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.support.ui import WebDriverWait

    options = webdriver.ChromeOptions()
    for word in FLAGS:
        options.add_argument(word)
    found = []
    for _ in range(OPENINGS):
        service = Service(shutil.which("chromedriver"))
        driver: Any = webdriver.Chrome(options=options, service=service)
        try:
            driver.get(file.as_uri())
            WebDriverWait(driver, 60, poll_frequency=0.1).until(
                lambda one: one.execute_script(READY) == "yes"
            )
            found.append(driver.execute_script(f"return ({MARKS})(window)"))
        finally:
            driver.quit()
    return _medians(found)


def _medians(rows: list[list[float]]) -> list[float]:
    return [statistics.median(column) for column in zip(*rows, strict=True)]
