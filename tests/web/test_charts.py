"""What the charts show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.result import RunResult
from core.trace import Trace, TraceShape
from web.charts import (
    Line,
    chart_data,
    contact_charts,
    control_charts,
    event_rows,
    rows_to_draw,
    values_at,
)
from web.playback import TimeWindow, slip_window, whole_window


def long_trace(rows: int) -> Trace:
    """A trace of zeros over one second, with one event in its middle."""
    shape = TraceShape(2, ("object.mass",))
    table = np.zeros((rows, shape.num_columns))
    table[:, 0] = np.linspace(0.0, 1.0, rows)
    table[rows // 2, 0] = table[rows // 2 - 1, 0]
    return Trace.from_rows(shape, table)


def test_charts_are_in_the_units_of_their_titles(case_2: RunResult) -> None:
    slip, velocity, _ = contact_charts(case_2)
    assert (slip.unit, velocity.unit) == ("mm", "mm/s")
    assert max(line.values.max() for line in slip.lines) == pytest.approx(47.23, abs=0.01)


def test_every_finger_has_its_force_and_the_limit_that_it_is_held_against(
    case_1: RunResult,
) -> None:
    forces = contact_charts(case_1)[2]
    assert [line.dashed for line in forces.lines] == [False, False, True, True]
    used, limit = forces.lines[0], forces.lines[2]
    assert used.colour == limit.colour
    slipping = case_1.trace.phase[:, 0] != 0
    np.testing.assert_allclose(used.values[slipping], limit.values[slipping], atol=1e-9)


def test_estimates_are_charted_by_unit_beside_the_truth(case_2: RunResult) -> None:
    charts = control_charts(case_2)
    titles = [chart.title for chart in charts]
    assert titles[1:4] == [
        "Friction estimates against the truth",
        "Mass estimates against the truth",
        "Inertia estimates against the truth",
    ]
    mass = charts[2]
    assert [line.label for line in mass.lines] == ["object mass", "true"]
    assert set(mass.lines[1].values) == {1.0}


def test_a_short_run_is_drawn_row_by_row(case_2: RunResult) -> None:
    window = slip_window(case_2)
    rows = rows_to_draw(case_2.trace, window, contact_charts(case_2)[0].lines)
    inside = (case_2.trace.times >= window.start) & (case_2.trace.times <= window.end)
    assert set(np.flatnonzero(inside)) <= set(rows)


def test_a_long_run_keeps_every_event_and_every_extreme() -> None:
    trace = long_trace(50_001)
    spike = np.zeros(len(trace))
    spike[[12_345, 40_000]] = (7.0, -3.0)
    rows = rows_to_draw(trace, TimeWindow(0.0, 1.0), [Line("spike", (0, 0, 0), spike)])
    assert len(rows) < 1000
    assert {12_345, 40_000, 0, 50_000} <= set(rows)
    assert set(event_rows(trace)) == {24_999, 25_000}
    assert {24_999, 25_000} <= set(rows)


def test_a_run_that_chatters_is_drawn_by_its_extremes() -> None:
    trace = long_trace(50_001)
    trace.times[1::2] = trace.times[:-1:2]
    spike = np.zeros(len(trace))
    spike[[12_345, 40_000]] = (7.0, -3.0)
    rows = rows_to_draw(trace, TimeWindow(0.0, 1.0), [Line("spike", (0, 0, 0), spike)])
    assert len(rows) < 1000
    assert {12_345, 40_000} <= set(rows)


def test_a_chart_spans_its_window_exactly(case_2: RunResult) -> None:
    chart = contact_charts(case_2)[0]
    window = TimeWindow(0.0123, 0.0789)
    rows = rows_to_draw(case_2.trace, window, chart.lines)
    times = chart_data(case_2.trace, chart, window, rows)[0]
    assert (times[0], times[-1]) == (0.0123, 0.0789)
    assert (np.diff(times) >= 0.0).all()


def test_a_legend_reads_its_lines_at_the_play_head(case_2: RunResult) -> None:
    left, _ = values_at(case_2.trace, contact_charts(case_2)[0], 0.0501)
    assert left == pytest.approx(1e3 * np.interp(0.0501, *slip_curve(case_2)))


def test_a_chart_holds_the_very_bits_of_the_stored_rows(case_2: RunResult) -> None:
    chart, window = contact_charts(case_2)[2], whole_window(case_2)
    rows = rows_to_draw(case_2.trace, window, chart.lines)
    times, _, *lines = chart_data(case_2.trace, chart, window, rows)
    assert times[1:-1].tobytes() == case_2.trace.times[rows].tobytes()
    for i in range(2):
        stored = np.abs(case_2.trace.tangential_force[rows, i])
        assert lines[i][1:-1].tobytes() == stored.tobytes()


def slip_curve(result: RunResult) -> tuple[np.ndarray, np.ndarray]:
    return result.trace.times, result.trace.slip[:, 0]


def test_slipping_is_shaded_from_event_to_event(case_2: RunResult) -> None:
    chart, window = contact_charts(case_2)[0], slip_window(case_2)
    rows = rows_to_draw(case_2.trace, window, chart.lines)
    times, shade, *_ = chart_data(case_2.trace, chart, window, rows)
    last = case_2.metrics.last_slip_time
    assert last is not None
    assert times[shade > 0.5].max() == pytest.approx(last)


def test_a_run_that_ended_at_once_can_be_drawn(case_2: RunResult) -> None:
    table = case_2.trace.to_rows()[:2]
    short = replace(case_2, trace=Trace.from_rows(case_2.trace.shape, table))
    window = whole_window(short)
    for chart in (*contact_charts(short), *control_charts(short)):
        rows = rows_to_draw(short.trace, window, chart.lines)
        assert len(chart_data(short.trace, chart, window, rows)[0]) >= 2
