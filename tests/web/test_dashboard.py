"""The dashboard in a real Chromium, through the one port."""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page

from core.types import ContactPhase
from recordings.store import RecordingStore
from tests.server.serving import RunningServer
from tests.web.driving import (
    SLIP_CHART,
    knob,
    number_field,
    pause_at,
    picture,
    set_number,
    slip_at_end,
    wait_until,
)
from web.colours import PHASES

pytestmark = [
    pytest.mark.browser,
    # A viewer may leave in the middle of a frame.
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]

OpenDashboard = Callable[[], Page]


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
    pause_at(page, 0.1)
    before, slip_before, runs_before = picture(page), slip_at_end(page), store.count()
    pause_at(page, 0.05)
    slider = knob(page, "mass [kg]")
    slider.focus()
    for _ in range(20):
        slider.press("ArrowRight")
    wait_until(lambda: slip_at_end(page) != slip_before, "the chart did not change")
    page.get_by_text("Saved as").wait_for()
    pause_at(page, 0.1)
    changed = np.abs(picture(page) - before).max(axis=2) > 40
    assert changed.sum() > 300
    wait_until(lambda: store.count() > runs_before, "no recording was saved")
    (change,) = store.open(store.list(limit=1)[0].id).scenario.changes
    assert (change.time, change.parameter) == (0.05, "object.mass")
    assert float(str(change.value)) > 1.0


def test_the_runs_of_a_moving_knob_are_not_saved(
    open_dashboard: OpenDashboard, dashboard: RunningServer
) -> None:
    page, store = open_dashboard(), RecordingStore(dashboard.data_directory)
    pause_at(page, 0.05)
    runs_before, moves = store.count(), 24
    slider = knob(page, "mass [kg]")
    slider.focus()
    for _ in range(moves):
        slider.press("ArrowLeft")
    wait_until(lambda: store.count() > runs_before, "no recording was saved")
    page.get_by_text("Saved as").wait_for()
    # A slow browser may rest between two moves for longer than it takes to save.
    assert store.count() - runs_before < moves / 3


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


def test_a_play_head_that_is_caught_while_it_moves_rests_where_the_page_says(
    open_dashboard: OpenDashboard,
) -> None:
    page = open_dashboard()
    track = page.locator("[data-sg-track]")
    for share in (0.3, 0.7):
        page.get_by_role("button", name="Pause", exact=True).wait_for()
        box = track.bounding_box()
        assert box is not None
        track.click(position={"x": share * box["width"], "y": 0.5 * box["height"]})
        page.get_by_role("button", name="Play", exact=True).wait_for()
        page.wait_for_timeout(700)
        clock = page.locator(".sg-clock").inner_text()
        said = float(page.get_by_label("time [s]", exact=True).input_value())
        assert said == pytest.approx(1e-3 * float(clock.removesuffix(" ms")), abs=6e-5)
        page.get_by_role("button", name="Play", exact=True).click()


def test_one_users_slider_does_not_move_anothers(open_dashboard: OpenDashboard) -> None:
    mine, theirs = open_dashboard(), open_dashboard()
    slip_before = slip_at_end(mine)
    pause_at(mine, 0.05)
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


def test_the_play_head_stands_in_every_chart_where_its_time_is(
    open_dashboard: OpenDashboard,
) -> None:
    page = open_dashboard()
    pause_at(page, 0.05)
    places = page.evaluate(
        """() => {
            const charts = Object.values(window.__viserTestpoints.uplots).map(u => u.chart);
            const strokes = [...document.querySelectorAll('div')].filter(
                d => d.style.zIndex === '1' && d.style.height === '0px' && d.offsetParent);
            return strokes.map((stroke, i) => {
                const mark = stroke.firstElementChild.getBoundingClientRect();
                const over = charts[i].over.getBoundingClientRect();
                const wanted = over.left + charts[i].valToPos(0.05, 'x');
                return [mark.left + mark.width / 2 - wanted, mark.top - over.top,
                        mark.bottom - over.bottom];
            });
        }"""
    )
    assert len(places) == 3
    assert np.abs(places).max() < 1.0


def test_every_chart_has_numbers_on_its_axes(open_dashboard: OpenDashboard) -> None:
    page = open_dashboard()
    for tab in ("Contact", "Control"):
        page.get_by_role("tab", name=tab).click()
        page.wait_for_function(
            """() => {
                const charts = Object.values(window.__viserTestpoints.uplots).map(u => u.chart);
                const seen = charts.filter(chart => chart.root.offsetParent && chart.width > 0);
                return seen.length >= 3 && seen.every(
                    chart => chart.axes.every(axis => axis._values && axis._values.length > 1));
            }"""
        )
