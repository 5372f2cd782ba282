"""The dashboard in a real Chromium, through the one port."""

from __future__ import annotations

import numpy as np
import pytest
from playwright.sync_api import Page

from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import PHASES
from slipgrasp.web.charts.charts import CHART_TABS
from tests.waiting import wait_until
from tests.web.driving import (
    choose_case_2,
    pause_at,
    picture,
)

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


def differing(seen: np.ndarray, before: np.ndarray) -> float:
    """Which share of two pictures is not the same."""
    return float((np.abs(seen - before).max(axis=2) > 40).mean())


def resolution(page: Page) -> float:
    """Pixels of the picture per pixel of the page."""
    return page.evaluate("(({ width, clientWidth }) => width / clientWidth)(__viserMutable.canvas)")


def test_the_camera_is_turned_in_fewer_pixels_and_goes_back_to_the_front(seen_page: Page) -> None:
    page = seen_page
    pause_at(page, 0.08)
    front, full = picture(page), resolution(page)

    page.mouse.move(640, 300)
    page.mouse.down()
    page.mouse.move(740, 340, steps=5)
    wait_until(lambda: abs(resolution(page) - 0.4) < 2e-3, "the picture has all pixels")
    page.mouse.up()
    wait_until(lambda: resolution(page) == full > 0.45, "pixels are missing at rest")
    wait_until(lambda: differing(picture(page), front) > 0.02, "the camera was not moved")
    page.keyboard.press("f")
    wait_until(lambda: differing(picture(page), front) < 2e-3, "it is not back at the front")
