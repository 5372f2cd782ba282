"""Runs of the paper's cases, the dashboard on a real port, and a real Chromium."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from playwright.sync_api import Browser, ConsoleMessage, Page, ViewportSize

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.app import create_dashboard_app
from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.model.editing import Reach
from slipgrasp.web.model.intents.compare import EndComparison
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.picture import (
    FrameHand,
    LayOutCharts,
    RestoreLayout,
    SetAppearance,
)
from slipgrasp.web.model.intents.playback import ChooseWindow
from slipgrasp.web.model.intents.scenario import ChoosePreset, ChooseReach
from slipgrasp.web.model.intents.selection import Select
from slipgrasp.web.model.playback import WindowChoice
from slipgrasp.web.page.routes import STATIC_PATH
from tests import waiting
from tests.server.serving import RunningServer, patient_settings, serve
from tests.web.driving import pause, told

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
FIRST: tuple[Intent, ...] = (
    EndComparison(),
    ChoosePreset("paper-case-1"),
    ChooseReach(Reach.PLAY_HEAD),
    ChooseWindow(WindowChoice.SLIP),
    Select("object"),
    SetAppearance(Appearance()),
    LayOutCharts(""),
    RestoreLayout(),
    FrameHand(),
)
"""What brings a page back to how it opens."""
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
    settings = patient_settings(tmp_path_factory.mktemp("dashboard"), study_executor="inline")
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
    pages: list[Page] = field(default_factory=list)

    def open(self, query: str = "", size: ViewportSize = SMALL, script: str = "") -> Page:
        """A page at rest.

        Args:
            query: The rest of its address, such as that of a link.
            size: Of the page.
            script: Runs before its own ones.
        """
        page = self.browser.new_page(viewport=size)
        self.pages.append(page)
        page.set_default_timeout(PATIENCE)
        page.add_init_script(script)
        page.on("console", self._hear)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        # A fixed resolution: viser else lowers it while the machine is slow.
        page.goto(f"{self.server.url}/?fixedDpr={0.3 if size is SMALL else 0.5}&{query}")
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

    def close(self) -> None:
        for page in self.pages:
            page.close()

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


# Between the files that use it, the page that they share draws nothing.
CAN_REST = """(() => {
    const draw = window.requestAnimationFrame.bind(window), waiting = [];
    let rests = false;
    window.requestAnimationFrame = (f) => (rests ? waiting.push(f) : draw(f));
    window.rest = (wanted) => {
        rests = wanted;
        if (!rests) waiting.splice(0).forEach(draw);
    };
})()"""


@pytest.fixture(scope="session")
def shared(browser: Browser, dashboard: RunningServer) -> Iterator[Visitors]:
    """One page for most tests in a browser: to open another takes longer than most of them."""
    with visitors_of(browser, dashboard) as visitors:
        visitors.open(size=LARGE, script=CAN_REST).evaluate("rest(true)")
        yield visitors


def begin_anew(page: Page, server: RunningServer) -> None:
    """Shows what a page opens with, at rest."""
    page.keyboard.press("Escape")
    page.get_by_role("tab", name="Run", exact=True).click()
    page.get_by_role("tab", name="Contact", exact=True).click()
    page.evaluate("document.activeElement.blur()")
    send = server.app.state.dashboard.directory.find(told(page)["session"])
    for intent in FIRST:
        send(intent)
    page.locator(".sg-origin", has_text="paper-case-1").wait_for()
    page.get_by_text("left: 2.59 mm").wait_for()
    pause(page)  # A run that is shown for the first time plays: from here on, or a little later.
    page.get_by_text("Saved as").wait_for()
    pause(page)


@contextmanager
def begun_anew(visitors: Visitors, size: ViewportSize) -> Iterator[Page]:
    """The shared page as it opens; it may not have complained in the end."""
    (page,) = visitors.pages
    page.evaluate("rest(false)")
    page.set_viewport_size(size)
    hide_warning(page)  # again: it may have been loaded anew
    begin_anew(page, visitors.server)
    yield page
    page.evaluate("rest(true)")
    complaints, visitors.complaints = visitors.complaints, []
    assert complaints == []


@pytest.fixture(scope="module")
def page(shared: Visitors) -> Iterator[Page]:
    """A small page that the tests of a module share: each begins where the last one ended."""
    with begun_anew(shared, SMALL) as page:
        yield page


@pytest.fixture(scope="module")
def seen_page(shared: Visitors) -> Iterator[Page]:
    """A page to look at that the tests of a module share."""
    with begun_anew(shared, LARGE) as page:
        yield page
