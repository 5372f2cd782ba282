"""The dashboard in a real Chromium, through the one port."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from playwright.sync_api import Locator, Page, expect

from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import PHASES
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.web.charts.charts import CHART_TABS
from tests.server.serving import RunningServer
from tests.waiting import wait_until
from tests.web.conftest import Visitors
from tests.web.driving import (
    choose_case_2,
    control,
    number_field,
    pause_at,
    picture,
    set_number,
    slip_at_end,
)

MOVE_TWENTY_TIMES = """async slider => {
    for (let i = 0; i < 20; i += 1) {
        slider.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight", bubbles: true }));
        await null;
    }
}"""

pytestmark = [
    pytest.mark.browser,
    # A viewer may leave in the middle of a frame.
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]

SEEN_CHARTS = """
    Object.values(window.__viserTestpoints.uplots).map(u => u.chart)
        .filter(chart => chart.root.offsetParent && chart.width > 0)
"""


def test_the_first_picture_and_its_charts_show_slip_at_a_glance(seen_page: Page) -> None:
    page = seen_page
    choose_case_2(page)
    pause_at(page, 0.08)
    seen = picture(page).reshape(-1, 3)
    for phase in (ContactPhase.SLIP_FORWARD, ContactPhase.SLIP_BACKWARD):
        near = np.abs(seen - PHASES[phase]).max(axis=1) < 30
        assert near.sum() > 500
    assert page.get_by_text("Both fingertips slipped").count() == 1

    for tab in CHART_TABS:
        page.get_by_role("tab", name=tab).click()
        page.wait_for_function(
            f"""() => {{
                const seen = {SEEN_CHARTS};
                return seen.length >= 2 && seen.every(
                    chart => chart.axes.every(axis => axis._values && axis._values.length > 1));
            }}"""
        )
        places = page.evaluate(
            f"""() => {SEEN_CHARTS}.map(chart => {{
                const head = chart.over.querySelector(".sg-chart-head").getBoundingClientRect();
                const over = chart.over.getBoundingClientRect();
                const wanted = over.left + chart.valToPos(0.08, "x");
                return [head.left + head.width / 2 - wanted, head.top - over.top,
                        head.bottom - over.bottom];
            }})"""
        )
        assert np.abs(places).max() < 1.5
    page.get_by_role("tab", name=next(iter(CHART_TABS))).click()


def test_a_slider_changes_the_picture_and_the_charts_and_only_where_it_rests_is_saved(
    seen_page: Page, dashboard: RunningServer
) -> None:
    page, store = seen_page, RecordingStore(dashboard.data_directory)
    pause_at(page, 0.1)
    before, slip_before, runs_before = picture(page), slip_at_end(page), store.count()
    pause_at(page, 0.05)
    # All moves in one task of the page: it sends the first and the last.
    control(page, "mass [kg]").evaluate(MOVE_TWENTY_TIMES)
    wait_until(lambda: slip_at_end(page) != slip_before, "the chart did not change")
    wait_until(lambda: store.count() > runs_before, "no recording was saved")
    page.get_by_text("Saved as").wait_for()
    assert store.count() - runs_before <= 2
    (change,) = store.open(store.list(limit=1)[0].id).scenario.changes
    assert (change.time, change.parameter) == (0.05, "object.mass")
    assert float(str(change.value)) > 1.0
    pause_at(page, 0.1)
    changed = np.abs(picture(page) - before).max(axis=2) > 40
    assert changed.sum() > 300


def num_preview_workers() -> int:
    return sum(thread.name == "preview" for thread in threading.enumerate())


def test_users_share_no_control_and_a_session_ends_with_its_page(
    seen_page: Page, visitors: Visitors, dashboard: RunningServer
) -> None:
    mine, theirs = seen_page, visitors.open()
    pause_at(mine, 0.05)
    slip_before = slip_at_end(mine)
    set_number(mine, "mass [kg]", "1.3")
    wait_until(lambda: slip_at_end(mine) != slip_before, "the chart did not change")

    # What comes back after this had every occasion to bring the other's mass with it.
    theirs.get_by_label("scenario").first.click()
    theirs.get_by_role("option", name="paper-case-2").click()
    theirs.get_by_text("slipped by 47.2 mm").wait_for()
    expect(number_field(theirs, "mass [kg]")).to_have_value("1")
    assert number_field(mine, "mass [kg]").input_value() == "1.3"

    sessions, workers = dashboard.app.state.dashboard.num_sessions, num_preview_workers()
    theirs.close()
    wait_until(
        lambda: dashboard.app.state.dashboard.num_sessions == sessions - 1,
        "the session is still there",
    )
    wait_until(
        lambda: num_preview_workers() == workers - 1,
        "the worker is still there",
    )


def pixels_of(seen: np.ndarray, phase: ContactPhase) -> int:
    return int((np.abs(seen - PHASES[phase]).max(axis=2) < 30).sum())


def differing(seen: np.ndarray, before: np.ndarray) -> float:
    """Which share of two pictures is not the same."""
    return float((np.abs(seen - before).max(axis=2) > 40).mean())


def checkbox(page: Page, label: str) -> Locator:
    row = page.locator(f"xpath=//label[normalize-space(.)='{label}']/../../..")
    return row.locator("input[type=checkbox]").last


def test_switches_of_the_picture_and_the_way_back_to_the_front(seen_page: Page) -> None:
    page = seen_page
    pause_at(page, 0.08)
    usual = picture(page)
    page.get_by_text("Picture", exact=True).click()
    set_number(page, "force scale", "2")
    wait_until(lambda: differing(picture(page), usual) > 5e-4, "no arrow became longer")
    front = picture(page)

    page.mouse.move(640, 300)
    page.mouse.down()
    page.mouse.move(740, 340, steps=5)
    page.mouse.up()
    wait_until(lambda: differing(picture(page), front) > 0.02, "the camera was not moved")
    page.keyboard.press("f")
    wait_until(lambda: differing(picture(page), front) < 2e-3, "it is not back at the front")

    checkbox(page, "dark").check()
    wait_until(lambda: picture(page)[4, 4].max() < 50, "the scene is not dark")
    dark = picture(page)
    for phase in (ContactPhase.SLIP_FORWARD, ContactPhase.SLIP_BACKWARD):
        assert pixels_of(dark, phase) > 0.9 * pixels_of(front, phase)
    checkbox(page, "dark").uncheck()
    set_number(page, "force scale", "1")
    page.get_by_text("Picture", exact=True).click()
