"""The dashboard in a real Chromium, through the one port."""

from __future__ import annotations

import io
import re
import threading
import time
from collections.abc import Callable

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Locator, Page

from core.types import ContactPhase
from recordings.store import RecordingStore
from tests.server.serving import RunningServer
from web.colours import PHASES

pytestmark = [
    pytest.mark.browser,
    # A viewer may leave in the middle of a frame.
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]

OpenDashboard = Callable[[], Page]

CLOCK = re.compile(r"^[0-9.]+ ms$")
SLIP_CHART = "Object.values(window.__viserTestpoints.uplots)[0].chart"


def number_field(page: Page, label: str) -> Locator:
    """The number beside the slider with a label."""
    row = page.locator(f"xpath=//label[normalize-space(.)='{label}']/../../..")
    return row.locator("input:visible").last


def set_number(page: Page, label: str, value: str) -> None:
    field = number_field(page, label)
    field.fill(value)
    field.press("Enter")


def pause(page: Page) -> None:
    button = page.get_by_role("button", name="Pause")
    if button.count():
        button.click()
    page.get_by_role("button", name="Play").wait_for()


def pause_at(page: Page, seconds: float) -> None:
    """Puts the play head somewhere, at rest."""
    pause(page)
    set_number(page, "time [s]", f"{seconds:g}")
    page.get_by_text(f"{1e3 * seconds:.1f} ms").wait_for()


def picture(page: Page) -> np.ndarray:
    """The scene between the panels, once it no longer changes."""
    before = shoot(page)
    for _ in range(40):
        page.wait_for_timeout(250)
        after = shoot(page)
        if np.array_equal(before, after):
            return after
        before = after
    pytest.fail("the picture does not come to rest")


def shoot(page: Page) -> np.ndarray:
    clip = {"x": 380, "y": 20, "width": 560, "height": 520}
    return np.asarray(Image.open(io.BytesIO(page.screenshot(clip=clip))).convert("RGB"), int)


def slip_at_end(page: Page) -> float:
    """Last value of the left finger's line in the slip chart [mm]."""
    return float(page.evaluate(f"{SLIP_CHART}.data[2].at(-1)"))


def wait_until(condition: Callable[[], bool], what: str) -> None:
    deadline = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.1)


def test_the_first_picture_shows_slip_at_a_glance(open_dashboard: OpenDashboard) -> None:
    page = open_dashboard()
    pause_at(page, 0.08)
    seen = picture(page).reshape(-1, 3)
    for phase in (ContactPhase.SLIP_FORWARD, ContactPhase.SLIP_BACKWARD):
        colour = PHASES[phase]
        near = np.abs(seen - colour).max(axis=1) < 30
        assert near.sum() > 500
    assert page.get_by_text("Both fingertips slipped").count() == 1


def test_a_slider_changes_the_picture_and_the_charts_and_ends_in_a_recording(
    open_dashboard: OpenDashboard, dashboard: RunningServer
) -> None:
    page, store = open_dashboard(), RecordingStore(dashboard.data_directory)
    pause_at(page, 0.08)
    before, slip_before, runs_before = picture(page), slip_at_end(page), store.count()
    slider = page.get_by_role("slider").first
    slider.focus()
    for _ in range(20):
        slider.press("ArrowRight")
    wait_until(lambda: slip_at_end(page) != slip_before, "the chart did not change")
    page.get_by_text("Saved as").wait_for()
    pause_at(page, 0.08)
    changed = np.abs(picture(page) - before).max(axis=2) > 40
    assert changed.sum() > 300
    wait_until(lambda: store.count() > runs_before, "no recording was saved")
    assert store.open(store.list(limit=1)[0].id).scenario.object.mass > 1.0


def test_the_runs_of_a_moving_knob_are_not_saved(
    open_dashboard: OpenDashboard, dashboard: RunningServer
) -> None:
    page, store = open_dashboard(), RecordingStore(dashboard.data_directory)
    pause_at(page, 0.05)
    runs_before, moves = store.count(), 24
    slider = page.get_by_role("slider").first
    slider.focus()
    for _ in range(moves):
        slider.press("ArrowLeft")
    wait_until(lambda: store.count() > runs_before, "no recording was saved")
    page.get_by_text("Saved as").wait_for()
    # A slow browser may rest between two moves for longer than it takes to save.
    assert store.count() - runs_before < moves / 3


def test_a_value_that_is_not_allowed_is_explained_and_the_last_run_stays(
    open_dashboard: OpenDashboard, dashboard: RunningServer
) -> None:
    page, store = open_dashboard(), RecordingStore(dashboard.data_directory)
    runs_before, slip_before = store.count(), slip_at_end(page)
    set_number(page, "control period [s]", "0.00005")
    page.get_by_text("Not simulated").wait_for()
    assert page.get_by_text("at least 0.0001 s").count() == 1
    assert page.get_by_text("last run that worked").count() == 1
    page.wait_for_timeout(1000)
    assert (slip_at_end(page), store.count()) == (slip_before, runs_before)
    page.get_by_role("button", name="Back to the preset").click()
    page.get_by_text("Not simulated").wait_for(state="detached")


def test_another_preset_brings_its_own_knobs_and_charts(open_dashboard: OpenDashboard) -> None:
    page = open_dashboard()
    page.get_by_label("scenario").first.click()
    page.get_by_role("option", name="paper-case-1").click()
    page.get_by_text("2.59 mm left").wait_for()
    assert page.get_by_text("left link mass 1 [kg]").count() == 1
    page.get_by_role("tab", name="Control").click()
    page.get_by_text("Mass estimates against the truth").wait_for()
    assert page.get_by_text("Friction estimates").filter(visible=True).count() == 0


def test_the_whole_run_is_charted_on_demand(open_dashboard: OpenDashboard) -> None:
    page = open_dashboard()
    page.get_by_role("button", name="whole run").click()
    page.wait_for_function(f"Math.abs({SLIP_CHART}.scales.x.max - 7) < 1e-3")
    page.get_by_role("button", name="slip", exact=True).click()
    page.wait_for_function(f"{SLIP_CHART}.scales.x.max < 0.3")


def test_play_and_pause_by_key(open_dashboard: OpenDashboard) -> None:
    page = open_dashboard()
    pause_at(page, 0.05)
    page.get_by_role("button", name="Play").wait_for()
    page.mouse.click(640, 560)
    page.keyboard.press("p")
    page.get_by_role("button", name="Pause").wait_for()
    page.get_by_text("50.0 ms").wait_for(state="detached")
    page.keyboard.press("p")
    page.get_by_role("button", name="Play").wait_for()


def test_a_play_head_that_is_caught_while_it_moves_rests_where_its_slider_says(
    open_dashboard: OpenDashboard,
) -> None:
    page = open_dashboard()
    row = page.locator("xpath=//label[normalize-space(.)='time [s]']/../../..")
    for _ in range(4):
        row.get_by_role("slider").press("ArrowRight")
        page.get_by_role("button", name="Play").wait_for()
        page.wait_for_timeout(700)
        clock = page.get_by_text(" ms", exact=False).filter(has_text=CLOCK).last.inner_text()
        said = float(number_field(page, "time [s]").input_value())
        assert said == pytest.approx(1e-3 * float(clock.removesuffix(" ms")), abs=6e-4)
        page.get_by_role("button", name="Play").click()
        page.get_by_role("button", name="Pause").wait_for()


def test_one_users_slider_does_not_move_anothers(open_dashboard: OpenDashboard) -> None:
    mine, theirs = open_dashboard(), open_dashboard()
    slip_before = slip_at_end(mine)
    set_number(mine, "mass [kg]", "1.3")
    wait_until(lambda: slip_at_end(mine) != slip_before, "the chart did not change")
    theirs.wait_for_timeout(500)
    assert slip_at_end(theirs) == slip_before
    assert number_field(theirs, "mass [kg]").input_value() == "1"


def test_a_session_ends_with_its_page(
    open_dashboard: OpenDashboard, dashboard: RunningServer
) -> None:
    page = open_dashboard()
    sessions = dashboard.app.state.dashboard.num_sessions
    page.close()
    wait_until(
        lambda: dashboard.app.state.dashboard.num_sessions == sessions - 1,
        "the session is still there",
    )
    wait_until(
        lambda: sum(t.name == "preview" for t in threading.enumerate()) == sessions - 1,
        "the worker is still there",
    )
