"""Charts, exports and a spatial hand in a real Chromium."""

from __future__ import annotations

import io
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Page, Position, expect

from slipgrasp import load_scenario, simulate
from tests.waiting import wait_until
from tests.web.driving import (
    SLIP_CHART,
    choose_case_2,
    choose_scenario,
    pause_at,
    picture_at_rest,
    set_number,
    told,
    unfold_changes,
)

pytestmark = pytest.mark.browser

CHARTS = "Object.values(window.__viserTestpoints.uplots).map(plot => plot.chart)"
SHOWN = f"{CHARTS}.map(chart => chart.series.filter(line => line.show).length)"


def shown_times(page: Page) -> tuple[float, float]:
    """Where the first chart begins and ends [s]."""
    start, end = page.evaluate(f"[{SLIP_CHART}.data[0][0], {SLIP_CHART}.data[0].at(-1)]")
    return start, end


def window(page: Page) -> tuple[float, float]:
    """Which stretch of time the session says that it shows [s]."""
    state = told(page)
    return state["start"], state["end"]


def scales(page: Page) -> set[tuple[float, float]]:
    """The time ranges that the visible charts show [s]."""
    areas = f"{CHARTS}.filter(chart => chart.over.checkVisibility())"
    return {tuple(x) for x in page.evaluate(f"{areas}.map(({{scales: {{x}}}}) => [x.min, x.max])")}


def legend(page: Page, chart: str) -> list[str]:
    """What the legend of a chart reads at the play head."""
    return page.locator(f"[data-sg-chart={chart}] [data-sg-value]").all_inner_texts()


HOLD = """time => import(new URL("session_state.js",
    document.querySelector("script[src$='/dashboard.js']").src)).then(({ hold }) => hold(time))"""


def drag_over(page: Page, chart: int, start: float, end: float) -> None:
    """Drags over a chart, from one share of its width to another, once it stands still."""
    area = page.locator(".u-over").nth(chart)
    area.hover()
    box = area.bounding_box()
    assert box is not None
    places = [Position(x=share * box["width"], y=0.5 * box["height"]) for share in (start, end)]
    area.drag_to(area, source_position=places[0], target_position=places[1])


def test_legends_read_the_lines_until_the_session_has_read_the_run(page: Page) -> None:
    run = simulate(load_scenario("paper-case-2"))
    choose_case_2(page)
    pause_at(page, 0.05)
    at_rest = legend(page, "slip")
    page.evaluate(HOLD, 0.09)  # as a hand on the timeline does, before the session answers
    slip = 1e3 * np.array([np.interp(0.09, run.trace.times, each) for each in run.trace.slip.T])
    wait_until(lambda: legend(page, "slip") != at_rest, "the legend waits for the session")
    read = legend(page, "slip")
    assert [float(text) for text in read] == pytest.approx(slip, rel=1e-3)
    decimals = [[len(text.partition(".")[2]) for text in texts] for texts in (read, at_rest)]
    assert decimals[0] == decimals[1]
    wait_until(lambda: legend(page, "slip") == at_rest, "the exact values do not come back")


def test_charts_zoom_together_read_the_play_head_and_hide_lines(page: Page) -> None:
    choose_case_2(page)
    pause_at(page, 0.05)
    wait_until(
        lambda: 10.0 < float(legend(page, "slip")[0] or "0") < 20.0,
        "the legend does not follow the play head",
    )
    slip = float(legend(page, "slip")[0])
    wait_until(lambda: shown_times(page) == window(page), "the charts show another window")
    start, end = window(page)

    drag_over(page, 1, 0.25, 0.75)
    wait_until(lambda: shown_times(page) != (start, end), "a drag does not zoom")
    quarter = 0.25 * (end - start)
    assert shown_times(page) == pytest.approx((start + quarter, end - quarter), abs=2e-3)
    assert page.evaluate(f"new Set({CHARTS}.map(chart => chart.data[0][0])).size") == 1
    assert scales(page) == {window(page)}

    before = shown_times(page)
    drag_over(page, 0, 0.5, 0.5)
    middle = 0.5 * (before[0] + before[1])
    wait_until(lambda: legend(page, "slip")[0] != f"{slip:.4g}", "a click does not seek")
    time = float(page.locator("[data-sg-time]").input_value())
    assert time == pytest.approx(middle, abs=2e-3)

    page.locator("[data-sg-chart=slip] .sg-line").nth(1).click()
    wait_until(
        lambda: page.evaluate(f"Math.min(...{SHOWN})") == 3,
        "a line cannot be hidden",
    )
    page.get_by_text("Slip: right hidden.").wait_for()

    page.locator(".u-over").first.dblclick()
    wait_until(lambda: shown_times(page) == (0.0, 7.0), "a double click does not show the run")
    page.get_by_role("button", name="slip", exact=True).click()
    wait_until(lambda: shown_times(page) == (start, end), "the slip is not shown again")


def test_a_chart_is_zoomed_before_the_session_answers(page: Page) -> None:
    choose_case_2(page)
    pause_at(page, 0.05)
    wait_until(lambda: scales(page) == {window(page)}, "the charts show another window")
    before = window(page)
    page.route("**/intents", lambda route: route.fulfill(status=202))
    drag_over(page, 1, 0.25, 0.75)
    quarter = 0.25 * (before[1] - before[0])
    wait_until(lambda: scales(page) != {before}, "it waits for the session")
    ((start, end),) = scales(page)
    assert (start, end) == pytest.approx((before[0] + quarter, before[1] - quarter), abs=2e-3)
    assert window(page) == before
    # Without an answer, the page returns to what the session shows.
    wait_until(lambda: scales(page) == {before}, "it keeps what the session does not show")
    page.unroute("**/intents")


def test_picture_charts_and_clip_arrive_as_files(page: Page, tmp_path: Path) -> None:
    choose_case_2(page)
    pause_at(page, 0.05)
    page.get_by_text("Export", exact=True).click()
    contents: dict[str, bytes] = {}
    for label in ("View (PNG)", "Charts (SVG)", "Clip (HTML)"):
        with page.expect_download() as download:
            page.get_by_role("button", name=label).click()
        path = tmp_path / download.value.suggested_filename
        download.value.save_as(path)
        contents[path.name] = path.read_bytes()
    assert list(contents) == [
        "slipgrasp-paper-case-2-view-50ms.png",
        "slipgrasp-paper-case-2-charts.svg",
        "slipgrasp-paper-case-2-clip.html",
    ]
    picture, drawing, replay = contents.values()
    pixels = np.asarray(Image.open(io.BytesIO(picture)).convert("RGB"))
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 100
    assert ElementTree.fromstring(drawing).tag.endswith("svg")
    assert b"<title>paper-case-2 \xe2\x80\x93 Held" in replay
    page.get_by_text("is in your downloads").wait_for()


def coloured(page: Page) -> tuple[int, int]:
    """Orange and blue pixels in the middle of the page, above the strip."""
    shot = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB"), dtype=int)
    height, width = shot.shape[:2]
    red, green, blue = np.moveaxis(
        shot[: int(0.6 * height), int(0.3 * width) : int(0.7 * width)], 2, 0
    )
    orange = (red - green > 60) & (green - blue > 20)
    return int(orange.sum()), int(((blue - red > 60) & (green > red)).sum())


@pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")
def test_a_prism_in_space_slips_in_the_picture_and_follows_a_control(page: Page) -> None:
    choose_scenario(page, "spatial-prism")
    verdict = page.locator(".sg-outcome")
    expect(verdict).to_contain_text("All fingertips slipped")
    expect(page.locator(".sg-names")).to_contain_text("side 2")
    legend = page.locator(".sg-legend")
    expect(legend).to_contain_text(re.compile(r"slips(?! clockwise)"))
    expect(legend).not_to_contain_text("clockwise")
    pause_at(page, 0.06)
    picture_at_rest(page, lambda: np.array(coloured(page)))
    slipping = coloured(page)
    pause_at(page, 0.12)

    def sticks() -> bool:
        # Rims and fingertips change from orange to blue, whatever else is on the page.
        orange, blue = np.subtract(coloured(page), slipping)
        return bool(orange < -1000 and blue > 800)

    wait_until(sticks, "the colours do not change")
    before = verdict.inner_text()
    set_number(page, "mass [kg]", "1.2")
    expect(verdict).not_to_have_text(before)
    unfold_changes(page)
    page.get_by_role("button", name="push", exact=True).click()
    page.locator(".sg-editor-note", has_text="push (0, 0, -5) N").wait_for()
