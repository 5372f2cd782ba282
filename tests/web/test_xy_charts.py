"""Charts of one quantity against another: what they hold, and how they are drawn."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.charts.drawn import ChartedRun
from slipgrasp.web.charts.xy import XY_TAB, XyChart, chosen_xy_charts, xy_charts
from slipgrasp.web.charts.xy_drawing import DrawnXy, drawn_xy, xy_svg
from slipgrasp.web.model.charts_view import MAX_LAYOUT, PLAIN, ChartsView
from slipgrasp.web.model.intents.picture import (
    DrawAgainst,
    LayOutCharts,
    PlaceMark,
    SeeCharts,
    ToggleMark,
)
from slipgrasp.web.model.playback import TimeWindow, slip_window, whole_window
from slipgrasp.web.model.ticks import digits_of
from slipgrasp.web.reducers.charts import ChartsReducer
from tests.web.test_charts_panel import Page, view_of


@cache
def run_of(preset: str) -> RunResult:
    return simulate(load_scenario(preset))


def chart(result: RunResult, key: str) -> XyChart:
    return next(xy for xy in xy_charts(result) if xy.chart.key == key)


def points(xy: XyChart, curve: int) -> np.ndarray:
    return np.column_stack([xy.across[curve], xy.chart.lines[curve].values])


def test_a_force_slips_along_the_edge_of_its_cone_and_sticks_inside(case_2: RunResult) -> None:
    cone = chart(case_2, "xy-cone")
    slopes = sorted({float(up / across) for _, (across, up) in cone.outlines})
    assert slopes == pytest.approx([-0.25, 0.25])
    for contact in range(2):
        normal, tangential = points(cone, contact).T
        phase = case_2.trace.phase[:, contact]
        slips = phase != ContactPhase.STICK
        assert slips.any()
        assert np.abs(tangential[slips]) == pytest.approx(0.25 * normal[slips], rel=1e-9)
        # In the very first row the fingertip is about to slip.
        sticks = np.flatnonzero(~slips & (case_2.trace.times > 0.0))
        assert (np.abs(tangential[sticks]) < 0.25 * normal[sticks]).all()


def test_in_space_friction_slips_on_the_rim_of_its_disc_the_way_the_slip_goes() -> None:
    result = run_of("spatial-prism")
    disc, path = chart(result, "xy-disc"), chart(result, "xy-path")
    (rim,) = disc.outlines
    assert np.hypot(*rim.T) == pytest.approx(1.0)
    for contact in range(3):
        slips = result.trace.phase[:, contact] != ContactPhase.STICK
        force = points(disc, contact)[slips]
        assert np.hypot(*force.T) == pytest.approx(1.0, rel=1e-9)
        way = points(path, contact)
        step = np.flatnonzero(slips)[[5, 10]]
        going = way[step[1]] - way[step[0]]
        assert force[7] @ going == pytest.approx(np.hypot(*going), rel=1e-3)


def test_in_the_pyramid_friction_stays_in_its_square() -> None:
    result = run_of("spatial-pyramid")
    square = chart(result, "xy-disc")
    assert "pyramid" in square.chart.title
    assert np.abs(square.outlines[0]).max(axis=1) == pytest.approx(1.0)
    later = result.trace.times > 0.0
    for contact in range(3):
        assert np.abs(points(square, contact)[later]).max() <= 1.0 + 1e-9
    assert not [xy for xy in xy_charts(result) if xy.chart.key == "xy-cone"]


def test_chosen_signals_are_drawn_against_another_one(case_2: RunResult) -> None:
    (xy,) = chosen_xy_charts(case_2, ["slip_velocity_0", "no such signal"], "slip_0")
    assert xy.across_words == "slip_0 [m]"
    np.testing.assert_array_equal(xy.across[0], case_2.trace.slip[:, 0])
    np.testing.assert_array_equal(xy.chart.lines[0].values, case_2.trace.slip_velocity[:, 0])
    assert chosen_xy_charts(case_2, ["slip_0"], "no such signal") == ()


def drawn(result: RunResult, window: TimeWindow, view: ChartsView = PLAIN) -> list[DrawnXy]:
    return drawn_xy(result.trace, xy_charts(result), window, view)


def path_of(svg: str, curve: int) -> np.ndarray:
    """Points of a curve as they stand in the picture."""
    path = re.findall(r"<path d='([^']*)' stroke=", svg)[curve]
    return np.array(re.findall(r"[ML](-?[\d.e-]+) (-?[\d.e-]+)", path), float)


@pytest.mark.parametrize("preset", ["paper-case-2", "spatial-prism"])
def test_a_curve_is_cut_to_the_window_and_its_spot_lies_on_it(preset: str) -> None:
    for xy in drawn(run_of(preset), TimeWindow(0.02, 0.07)):
        svg = xy_svg(xy, dark=False)
        for curve in range(len(xy.own.lines)):
            path = path_of(svg, curve)
            for seconds, end in ((0.02, 0), (0.07, -1)):
                assert xy.spots(seconds)[curve] == pytest.approx(path[end].tolist(), abs=0.11)


def test_a_way_is_drawn_to_scale() -> None:
    prism = run_of("spatial-prism")
    path = next(xy for xy in drawn(prism, slip_window(prism)) if xy.xy.is_true_to_scale)
    left, top = path.scale.place(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    assert left[1] - left[0] == pytest.approx(top[0] - top[1])


def test_a_hidden_curve_is_not_drawn_and_without_any_the_chart_stands(case_2: RunResult) -> None:
    view = replace(PLAIN, hidden=frozenset({("xy-cone", "finger-0"), ("xy-cone", "finger-1")}))
    cone = next(
        xy for xy in drawn(case_2, whole_window(case_2), view) if xy.xy.chart.key == "xy-cone"
    )
    assert cone.spots(0.05) == []
    assert "<path d=" not in xy_svg(cone, dark=True)


def test_two_cursors_read_differences_and_slopes(
    viewer_server: ViewerServer, case_2: RunResult
) -> None:
    page, view = Page(viewer_server), view_of(case_2)
    marked = ChartsReducer().reduce(PlaceMark(0.02), view)
    assert marked.charts.mark == 0.02
    page.panel.update(ChartsReducer().reduce(SeeCharts(XY_TAB, is_visible=True), marked))
    slip = 1e3 * np.interp([0.02, 0.05], case_2.trace.times, case_2.trace.slip[:, 0])
    change = slip[1] - slip[0]
    told = f"{slip[1]:.2f} (Δ {change:+.2f}, {change / 0.03:+.1f} mm/s)"
    assert page.readings()["slip"][0] == told
    assert page.readings()["xy-slip"][0].startswith(page.readings()["slip-velocity"][0])
    again = ChartsReducer().reduce(ToggleMark(), marked)
    assert again.charts.mark is None
    assert ChartsReducer().reduce(ToggleMark(), again).charts.mark == 0.05


def test_a_tab_out_of_sight_draws_nothing(viewer_server: ViewerServer, case_2: RunResult) -> None:
    page = Page(viewer_server)
    page.panel.update(view_of(case_2))
    assert not [text for text in page.client.texts if "data-sg-xy" in text]


def test_lines_on_each_other_are_told_apart(viewer_server: ViewerServer, case_2: RunResult) -> None:
    page = Page(viewer_server)
    page.panel.update(view_of(case_2))
    slip, forces = page.client.plots[0], page.client.plots[2]
    assert slip.series[2].get("width") == slip.series[3].get("width")
    assert forces.series[2].get("width", 0) > forces.series[3].get("width", 0) + 2
    assert "right |Fₓ| on left |Fₓ|" in page.notes()


def test_a_layout_comes_back_from_its_text(case_2: RunResult) -> None:
    view = replace(view_of(case_2), charts=ChartsView(frozenset({("slip", "slip-0")}), ("slip_0",)))
    view = ChartsReducer().reduce(DrawAgainst("slip_1"), view)
    assert view.charts.across == "slip_1"
    assert ChartsReducer().reduce(DrawAgainst("no such signal"), view) is view
    layout = view.charts.layout()
    laid_out = ChartsReducer().reduce(LayOutCharts(layout), view_of(case_2))
    assert replace(laid_out.charts, seen=view.charts.seen) == view.charts
    assert PLAIN.layout() == ""
    known = ChartedRun.of(case_2, view=view.charts)
    assert {"xy-signals-m"} <= {xy.chart.key for xy in known.xy}


@pytest.mark.parametrize(
    "text",
    [
        "{",
        "[]",
        "7",
        '{"signals": 7, "hidden": [["a"], "ab", [1, 2]], "across": {}}',
        '{"signals": [7, null]}',
        "[" * MAX_LAYOUT,
    ],
)
def test_a_layout_that_cannot_be_read_leaves_the_charts_plain(text: str) -> None:
    assert PLAIN.laid_out(text) == PLAIN


@pytest.mark.parametrize(
    ("value", "scale", "told"),
    [
        (4.078e-9, 0.01, "0.00000"),
        (-1e-12, 50.0, "0.00"),
        (46.834, 47.2, "46.83"),
        (0.25, 1.2, "0.250"),
        (3.0e-10, 5.0e-10, "3.000e-10"),
        (1234567.0, 2e7, "1.235e+06"),
        (float("nan"), 1.0, "–"),
        (0.0, 0.0, "0.000"),
    ],
)
def test_a_value_has_the_digits_that_say_something(value: float, scale: float, told: str) -> None:
    assert digits_of(value, scale) == told
