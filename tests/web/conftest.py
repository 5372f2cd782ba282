"""Runs of the paper's cases, the dashboard on a real port, and a real Chromium."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from playwright.sync_api import Browser, ConsoleMessage, Page, expect, sync_playwright
from playwright.sync_api import TimeoutError as PlaywrightTimeoutError

from core.loading import load_scenario, with_values
from core.result import RunResult
from core.simulator import simulate
from recordings.store import RecordingStore
from recordings.stored_run import StoredRun
from server.settings import Settings
from server.viewer_server import ViewerServer
from tests.ensure_programs import HOW_TO_FIX, find_chromium
from tests.server.serving import RunningServer, serve
from web.app import create_dashboard_app

# Software rendering, as on a machine without a screen.
FLAGS = (
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
)
PATIENCE = 60_000


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
    settings = Settings(data_directory=tmp_path_factory.mktemp("dashboard"))
    with serve(settings, create_dashboard_app(settings)) as running:
        yield running


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    chromium = find_chromium()
    if chromium is None:
        pytest.fail(HOW_TO_FIX)
    expect.set_options(timeout=PATIENCE)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=list(FLAGS))
        yield browser
        browser.close()


@dataclass
class Viewing:
    """A page of the dashboard, and what its console complained about."""

    page: Page
    complaints: list[str] = field(default_factory=list)

    def hear(self, message: ConsoleMessage) -> None:
        if message.type == "error":
            self.complaints.append(message.text)


def dismiss_warning(page: Page) -> None:
    """Takes away viser's warning of software rendering, which covers a part of the scene."""
    try:
        page.locator(".mantine-Notification-closeButton").first.click(timeout=5000)
    except PlaywrightTimeoutError:
        return
    page.locator(".mantine-Notification-root").wait_for(state="detached")


@pytest.fixture
def open_dashboard(browser: Browser, dashboard: RunningServer) -> Iterator[object]:
    """Opens pages that show the dashboard; none of them may have complained in the end."""
    opened: list[Viewing] = []

    def open_page() -> Page:
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.set_default_timeout(PATIENCE)
        viewing = Viewing(page)
        page.on("console", viewing.hear)
        page.on("pageerror", lambda error: viewing.complaints.append(str(error)))
        opened.append(viewing)
        # A fixed resolution: viser else lowers it while the machine is slow.
        page.goto(f"{dashboard.url}/?fixedDpr=0.5")
        page.get_by_text("Held", exact=True).wait_for()
        page.get_by_text("Saved as").wait_for()
        dismiss_warning(page)
        return page

    yield open_page
    for viewing in opened:
        viewing.page.close()
    assert [complaint for viewing in opened for complaint in viewing.complaints] == []
