"""Which rows of a run a chart draws, and how a ghost stands beside them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.trace.signals import TraceShape
from slipgrasp.core.trace.trace import Trace
from slipgrasp.web.charts.chart import Chart, Line
from slipgrasp.web.charts.charts import charts_of, contact_charts
from slipgrasp.web.charts.columns import Drawing, event_rows, read_rows, rows_to_draw
from slipgrasp.web.model.playback import TimeWindow, slip_window, whole_window


def long_trace(rows: int) -> Trace:
    """A trace of zeros over one second, with one event in its middle."""
    shape = TraceShape(2, ("object.mass",))
    table = np.zeros((rows, shape.num_columns))
    table[:, 0] = np.linspace(0.0, 1.0, rows)
    table[rows // 2, 0] = table[rows // 2 - 1, 0]
    return Trace.from_rows(shape, table)


def slip_drawing(result: RunResult, window: TimeWindow) -> Drawing:
    return Drawing.of(result.trace, contact_charts(result)[0], window)


def test_a_short_run_is_drawn_row_by_row(case_2: RunResult) -> None:
    window = slip_window(case_2)
    rows = rows_to_draw(case_2.trace, window, contact_charts(case_2)[0].lines)
    inside = (case_2.trace.times >= window.start) & (case_2.trace.times <= window.end)
    # The first row is what sticking would have taken at the start, when both slipped at once.
    assert np.flatnonzero(inside)[0] == 0 and case_2.trace.times[1] == 0.0
    assert set(np.flatnonzero(inside)[1:]) <= set(rows)
    assert 0 not in rows


def test_a_long_run_keeps_every_event_and_every_extreme() -> None:
    trace = long_trace(50_001)
    spike = np.zeros(len(trace))
    spike[[12_345, 40_000]] = (7.0, -3.0)
    rows = rows_to_draw(trace, TimeWindow(0.0, 1.0), [Line("spike", "spike", (0, 0, 0), spike)])
    assert len(rows) < 1000
    assert {12_345, 40_000, 0, 50_000} <= set(rows)
    assert set(event_rows(trace)) == {24_999, 25_000}
    assert {24_999, 25_000} <= set(rows)


def test_a_run_that_chatters_is_drawn_by_its_extremes() -> None:
    trace = long_trace(50_001)
    trace.times[1::2] = trace.times[:-1:2]
    spike = np.zeros(len(trace))
    spike[[12_345, 40_000]] = (7.0, -3.0)
    rows = rows_to_draw(trace, TimeWindow(0.0, 1.0), [Line("spike", "spike", (0, 0, 0), spike)])
    assert len(rows) < 1000
    assert {12_345, 40_000} <= set(rows)


def test_a_chart_spans_its_window_exactly(case_2: RunResult) -> None:
    times = slip_drawing(case_2, TimeWindow(0.0123, 0.0789)).columns()[0]
    assert (times[0], times[-1]) == (0.0123, 0.0789)
    assert (np.diff(times) >= 0.0).all()


def test_a_chart_holds_the_very_bits_of_the_stored_rows(case_2: RunResult) -> None:
    drawing = Drawing.of(case_2.trace, contact_charts(case_2)[2], whole_window(case_2))
    times, _, *lines = drawing.columns()
    assert times[1:-1].tobytes() == case_2.trace.times[drawing.rows].tobytes()
    for i in range(2):
        stored = np.abs(case_2.trace.tangential_force[drawing.rows, i])
        assert lines[i][1:-1].tobytes() == stored.tobytes()


def test_slipping_is_shaded_from_event_to_event(case_2: RunResult) -> None:
    times, shade, *_ = slip_drawing(case_2, slip_window(case_2)).columns()
    last = case_2.metrics.last_slip_time
    assert last is not None
    assert times[shade > 0.5].max() == pytest.approx(last)


def test_a_run_that_ended_at_once_can_be_drawn(case_2: RunResult) -> None:
    table = case_2.trace.to_rows()[:2]
    short = replace(case_2, trace=Trace.from_rows(case_2.trace.shape, table))
    window = whole_window(short)
    for tab, charts in charts_of(short).items():
        for chart, whole in zip(charts, charts_of(case_2)[tab], strict=True):
            drawing = Drawing.of(short.trace, chart, window)
            ghost = Drawing.of(case_2.trace, whole, window, is_ghost=True)
            assert len(drawing.columns()[0]) >= 2
            assert len({len(column) for column in drawing.columns(ghost)}) == 1


def test_a_ghost_of_the_same_run_lies_on_it(case_2: RunResult) -> None:
    drawing = slip_drawing(case_2, slip_window(case_2))
    times, _, left, right, ghost_left, ghost_right = drawing.columns(drawing)
    assert (np.diff(times) >= 0.0).all()
    np.testing.assert_allclose(ghost_left, left, atol=1e-12)
    np.testing.assert_allclose(ghost_right, right, atol=1e-12)


def test_a_ghost_is_drawn_as_far_as_its_own_run_goes(case_2: RunResult) -> None:
    short = simulate(with_values(case_2.scenario, {"simulation.duration": 1.0}))
    window = whole_window(case_2)
    times, _, left, _, ghost_left, _ = slip_drawing(case_2, window).columns(
        slip_drawing(short, window)
    )
    assert times[np.isfinite(ghost_left)].max() == 1.0
    assert np.isfinite(left).all()
    at = np.interp(0.5, times[times <= 1.0], ghost_left[times <= 1.0])
    assert at == pytest.approx(1e3 * np.interp(0.5, short.trace.times, short.trace.slip[:, 0]))


def test_a_ghost_may_have_more_contacts_than_the_run(case_2: RunResult) -> None:
    chart, window = contact_charts(case_2)[0], slip_window(case_2)
    wide = replace(chart, lines=(*chart.lines, *chart.lines))
    columns = slip_drawing(case_2, window).columns(Drawing.of(case_2.trace, wide, window))
    assert len(columns) == 2 + 2 + 4
    assert len({len(column) for column in columns}) == 1


def test_a_jump_of_either_run_stays_a_jump_beside_the_other() -> None:
    shape = TraceShape(2, ())
    jumping, sloping = np.zeros((4, shape.num_columns)), np.zeros((3, shape.num_columns))
    jumping[:, 0], sloping[:, 0] = (0.0, 0.5, 0.5, 1.0), (0.0, 0.5, 1.0)
    window = TimeWindow(0.0, 1.0)

    def drawing(table: np.ndarray, values: list[float]) -> Drawing:
        line = Line("line", "line", (0, 0, 0), np.array(values))
        trace = Trace.from_rows(shape, table)
        return Drawing.of(trace, Chart("chart", "", "", "", (line,)), window)

    first, second = drawing(jumping, [0.0, 0.0, 9.0, 9.0]), drawing(sloping, [0.0, 1.0, 2.0])
    for own, ghost, column in ((first, second, 2), (second, first, 3)):
        columns = own.columns(ghost)
        at_jump = columns[column][columns[0] == 0.5].tolist()
        assert at_jump == sorted(at_jump)
        assert set(at_jump) == {0.0, 9.0}


def test_a_signal_is_read_on_either_side_of_an_event() -> None:
    times, values = np.array([0.0, 1.0, 1.0, 2.0]), np.array([0.0, 1.0, 5.0, 7.0])
    at = np.array([-1.0, 0.0, 0.5, 1.0, 1.5, 2.0, 3.0])
    before, after = (
        read_rows(times, values[:, None], at, side)[:, 0] for side in ("left", "right")
    )
    assert before[1:-1].tolist() == [0.0, 0.5, 1.0, 6.0, 7.0]
    assert after[1:-1].tolist() == [0.0, 0.5, 5.0, 6.0, 7.0]
    assert np.isnan(before[[0, -1]]).all()
    assert np.isnan(after[[0, -1]]).all()
