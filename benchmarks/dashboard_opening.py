"""`python -m benchmarks.dashboard_opening`: first paint, first picture, and bytes of a reload.

Each page is opened in a real Chromium, and then reloaded.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from playwright.sync_api import Browser, Page

from benchmarks.browser import new_page, open_browser
from benchmarks.dashboard import PRESET, serve_dashboard
from benchmarks.dashboard_viewers import come_and_go
from benchmarks.headless_viewer import HeadlessViewer, content_of, session_state
from benchmarks.report import Table, format_text

ROUNDS = 5
_STARTED = "window.sgAt !== undefined"
# The next frame begins once the picture is on the screen.
_WATCH = """addEventListener('DOMContentLoaded', () => new MutationObserver(() => {
  if (document.documentElement.dataset.sgStarted === undefined) return;
  requestAnimationFrame(() => { window.sgAt ??= performance.now(); });
}).observe(document.documentElement, { attributes: true }));"""
_PAINT = "performance.getEntriesByName('first-contentful-paint')[0].startTime"


class Opened(NamedTuple):
    """One page that was opened, or reloaded.

    Attributes:
        skeleton: Time until the first paint [s].
        picture: Time until the first picture [s].
        num_bytes: Bytes of its files on the network.
    """

    skeleton: float
    picture: float
    num_bytes: float


def tabulate_opening(rounds: int = ROUNDS) -> Table:
    """Median times and bytes of pages that are opened and then reloaded.

    Args:
        rounds: Number of browsers without cache.
    """
    with serve_dashboard() as served:
        come_and_go(served.socket, 1)
        with open_browser() as browser:
            both = [_open(browser, served.url) for _ in range(rounds)]
        session = _bytes_of_session(served.socket)
    rows = []
    for name, opened in zip(("opened", "reloaded"), zip(*both, strict=True), strict=True):
        skeleton, picture, num_bytes = np.median(np.array(opened), axis=0)
        rows.append((name, f"{skeleton:.2f}", f"{picture:.2f}", f"{1e-3 * num_bytes:.0f}"))
    heads = (PRESET, "first paint [s]", "first picture [s]", "files [kB]")
    note = f"1440 x 900, medians of {rounds}. A session sends {1e-3 * session:.0f} kB at first."
    return Table("dashboard-opening", heads, tuple(rows), (note,))


def _open(browser: Browser, url: str) -> tuple[Opened, Opened]:
    page = new_page(browser)
    page.add_init_script(_WATCH)
    sizes = _listen(page)
    page.goto(url)
    opened = _measured(page, sizes)
    page.reload()
    reloaded = _measured(page, sizes)
    page.context.close()
    return opened, reloaded


def _listen(page: Page) -> list[float]:
    """The sizes of answers from the server, as they come."""
    sizes, asked = list[float](), set[str]()
    devtools = page.context.new_cdp_session(page)
    devtools.send("Network.enable")

    def ask(event: dict[str, Any]) -> None:
        if event["request"]["url"].startswith("http"):
            asked.add(event["requestId"])

    def take(event: dict[str, Any]) -> None:
        if event["requestId"] in asked:
            sizes.append(event["encodedDataLength"])

    devtools.on("Network.requestWillBeSent", ask)
    devtools.on("Network.loadingFinished", take)
    return sizes


def _measured(page: Page, sizes: list[float]) -> Opened:
    page.wait_for_function(_STARTED)
    page.get_by_text("Saved as").wait_for()
    opened = Opened(1e-3 * page.evaluate(_PAINT), 1e-3 * page.evaluate("window.sgAt"), sum(sizes))
    sizes.clear()
    return opened


def _bytes_of_session(socket: str) -> int:
    """Bytes of messages that a new viewer receives until its first run is shown."""

    def is_shown(message: dict[str, Any]) -> bool:
        state = session_state(content_of(message))
        return state is not None and state["ready"]

    with HeadlessViewer(socket) as viewer:
        viewer.wait_for(is_shown)
        return viewer.bytes_received


if __name__ == "__main__":
    print(format_text(tabulate_opening()))
