"""Runs of the paper's cases, the dashboard on a real port, and a real Chromium."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from playwright.sync_api import (
    Browser,
    ConsoleMessage,
    Page,
    ViewportSize,
)

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.app import create_dashboard_app
from slipgrasp.web.page.routes import STATIC_PATH
from tests import waiting
from tests.server.serving import RunningServer, patient_settings, serve
from tests.web.driving import pause

PATIENCE = 1000 * waiting.PATIENCE  # [ms]
# What viser's page says of its own doing, and nothing comes of it.
OF_VISER = (
    "Unable to preventDefault inside passive event listener",  # of a node that is dragged
    # It updates the inputs of a frame last, also one that the same frame removed. An update after
    # the removal raises in Python.
    "Tried to update non-existent component",
)
SCRIPT_HAS_RUN = """import(document.querySelector("script[src$='/dashboard.js']").src)
    .then(() => true)"""
SMALL = ViewportSize(width=1000, height=700)
LARGE = ViewportSize(width=1280, height=800)


@pytest.fixture(scope="session")
def case_1() -> RunResult:
    return simulate(load_scenario("paper-case-1"))


@pytest.fixture(scope="session")
def sluggish() -> RunResult:
    """Case I with a light weight of the errors: it slips much farther."""
    return simulate(with_values(load_scenario("paper-case-1"), {"controller.lyapunov_weight": 1.0}))


@pytest.fixture(scope="session")
def case_2() -> RunResult:
    return simulate(load_scenario("paper-case-2"))


@pytest.fixture
def store(tmp_path: Path) -> Iterator[RecordingStore]:
    store = RecordingStore(tmp_path / "data")
    yield store
    store.close()


@pytest.fixture
def stored(
    store: RecordingStore, case_1: RunResult, sluggish: RunResult
) -> tuple[StoredRun, StoredRun]:
    """Two runs of case I, called by their weight of the errors."""
    a, b = store.save(case_1), store.save(sluggish)
    return store.annotate(a.id, name="Q = 20"), store.annotate(b.id, name="Q = 1")


@pytest.fixture
def viewer_server() -> Iterator[ViewerServer]:
    server = ViewerServer()
    yield server
    server.stop()


@pytest.fixture(scope="session")
def dashboard(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    settings = patient_settings(tmp_path_factory.mktemp("dashboard"))
    with serve(settings, create_dashboard_app(settings)) as running:
        yield running


@pytest.fixture(scope="module")
def blank(browser: Browser, dashboard: RunningServer) -> Iterator[Page]:
    """A page without any script, that may load the modules of the dashboard."""
    page = browser.new_page(bypass_csp=True)
    page.goto(f"{dashboard.url}{STATIC_PATH}/icon.svg")
    yield page
    page.close()


@dataclass
class Visitors:
    """Opens pages of a dashboard, and hears what their consoles complain about.

    Attributes:
        browser: Where the pages are.
        server: The dashboard.
    """

    browser: Browser
    server: RunningServer
    complaints: list[str] = field(default_factory=list)
    _pages: list[Page] = field(default_factory=list)

    def open(self, query: str = "") -> Page:
        """A small page for what does not depend on looks; it is at rest.

        Args:
            query: The rest of its address, such as that of a link.
        """
        return self._open(SMALL, f"fixedDpr=0.3&{query}")

    def open_to_look(self) -> Page:
        """A page whose picture is looked at, at rest."""
        return self._open(LARGE, "fixedDpr=0.5")

    def close(self) -> None:
        for page in self._pages:
            page.close()

    def _open(self, size: ViewportSize, query: str) -> Page:
        page = self.browser.new_page(viewport=size)
        self._pages.append(page)
        page.set_default_timeout(PATIENCE)
        page.on("console", self._hear)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        # A fixed resolution: viser else lowers it while the machine is slow.
        page.goto(f"{self.server.url}/?{query}")
        page.locator(".sg-transport").wait_for()
        # A button can be there before the script that listens to it.
        page.evaluate(SCRIPT_HAS_RUN)
        hide_warning(page)
        # A picture that plays keeps a machine busy that draws without a graphics card.
        if "t=" in query:
            page.get_by_role("button", name="Play", exact=True).wait_for()
        else:
            pause(page)
        return page

    def _hear(self, message: ConsoleMessage) -> None:
        if message.type == "error" and not message.text.startswith(OF_VISER):
            self.complaints.append(message.text)


@contextmanager
def visitors_of(browser: Browser, server: RunningServer) -> Iterator[Visitors]:
    """Visitors of a dashboard; none of their pages may have complained in the end."""
    visitors = Visitors(browser, server)
    yield visitors
    visitors.close()
    assert visitors.complaints == []


def hide_warning(page: Page) -> None:
    """Hides viser's warning of software rendering, which covers a part of the scene."""
    # It comes when the page finds the time, or never, and leaves in the midst of a test.
    page.add_style_tag(content="#webgl-software-rendering { display: none !important }")


@pytest.fixture
def visitors(browser: Browser, dashboard: RunningServer) -> Iterator[Visitors]:
    with visitors_of(browser, dashboard) as visitors:
        yield visitors


@pytest.fixture(scope="module")
def page(browser: Browser, dashboard: RunningServer) -> Iterator[Page]:
    """A small page that the tests of a module share: each begins where the last one ended."""
    with visitors_of(browser, dashboard) as visitors:
        page = visitors.open()
        page.get_by_text("Saved as").wait_for()
        yield page


@pytest.fixture(scope="module")
def seen_page(browser: Browser, dashboard: RunningServer) -> Iterator[Page]:
    """A page to look at that the tests of a module share."""
    with visitors_of(browser, dashboard) as visitors:
        page = visitors.open_to_look()
        page.get_by_text("Saved as").wait_for()
        yield page
