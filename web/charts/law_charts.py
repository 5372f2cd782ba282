"""Overlaid runs of one scenario with every law, and a button for each law."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.verdict import headline_of
from slipgrasp.core.scenario.laws import law_alias
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.words.phrases import length_words
from slipgrasp.recordings.palette import FINGERS, Rgb
from slipgrasp.web.charts.chart import LEAST_LENGTH, Chart, Line
from slipgrasp.web.charts.columns import Drawing
from slipgrasp.web.charts.xy import XyChart
from slipgrasp.web.charts.xy_drawing import Curves, DrawnXy, frame_style, xy_svg
from slipgrasp.web.model.colours import css, legible
from slipgrasp.web.model.intents.scenario import ChooseLaw
from slipgrasp.web.model.laws_view import LawRun
from slipgrasp.web.model.playback import TimeWindow
from slipgrasp.web.page.markup import click_attribute

Values = NDArray[np.float64]

LAWS_TAB = "Laws"


def _farthest_slip(trace: Trace) -> Values:
    return 1e3 * trace.slid_way.max(axis=1)


def _offset(trace: Trace) -> Values:
    return 1e3 * np.linalg.norm(trace.tracking_error[:, : trace.shape.space.num_positions], axis=1)


def _hardest_press(trace: Trace) -> Values:
    return trace.normal_force.max(axis=1)


_CHARTS: tuple[tuple[Chart, Callable[[Trace], Values]], ...] = (
    (
        Chart(
            "laws-slip",
            "Travelled distance of the fingertip that slid farthest",
            "mm",
            "Distance that a fingertip has slid on its face so far.",
            (),
            least=LEAST_LENGTH,
        ),
        _farthest_slip,
    ),
    (
        Chart(
            "laws-offset",
            "Distance of the object from its desired position",
            "mm",
            "Distance of the object's centre from its desired position.",
            (),
            least=LEAST_LENGTH,
        ),
        _offset,
    ),
    (
        Chart(
            "laws-force",
            "Normal force of the fingertip that presses hardest",
            "N",
            "Effort of the grip, and load on a fragile object.",
            (),
        ),
        _hardest_press,
    ),
)


def colour_of(index: int) -> Rgb:
    """The colour of a law by its index; laws after the sixth are dashed."""
    return FINGERS[index % len(FINGERS)]


def law_charts_html(runs: Sequence[LawRun], window: TimeWindow, *, dark: bool) -> str:
    """Charts over time with a line for each law."""
    return "".join(
        f"<div data-sg-chart='{chart.key}' class='sg-chart'><span class='sg-chart-title' "
        f"title='{escape(chart.about)}'>{escape(chart.title)} [{chart.unit}]</span></div>"
        f"<div class='sg-timed'>{xy_svg(drawn, dark=dark)}"
        f"<div class='u-over' style='{frame_style(drawn)}'></div></div>"
        for chart, drawn in ((chart, _drawn(chart, read, runs, window)) for chart, read in _CHARTS)
    )


def _drawn(
    chart: Chart, read: Callable[[Trace], Values], runs: Sequence[LawRun], window: TimeWindow
) -> DrawnXy:
    """The lines of all laws; each has separate rows."""
    lines: list[Line] = []
    points: list[Values] = []
    for i, run in enumerate(runs):
        if run.result is None or run.result.end_time <= window.start:
            continue
        trace = run.result.trace
        line = Line(
            run.kind, law_alias(run.kind), colour_of(i), read(trace), dashed=i >= len(FINGERS)
        )
        only = Chart(chart.key, chart.title, chart.unit, chart.about, (line,))
        times, _, values = Drawing.of(trace, only, window).columns()
        lines.append(line)
        points.append(np.array([times, values]))
    span = (window.start, window.end)
    xy = XyChart(chart, (), "time [s]", span=span)
    return DrawnXy(xy, frozenset(), Curves(tuple(lines), tuple(points)))


def laws_html(runs: Sequence[LawRun], present: str, *, dark: bool) -> str:
    """A button for each law, with the outcome of its run.

    Args:
        runs: The runs with every law.
        present: The law of the run on the screen.
        dark: Whether the page is dark.
    """
    buttons = "".join(_button(i, run, present, dark) for i, run in enumerate(runs))
    return f"<div class='sg-laws' role='group' aria-label='Control laws'>{buttons}</div>"


def _button(index: int, run: LawRun, present: str, dark: bool) -> str:
    stroke = "━" if index < len(FINGERS) else "╍"
    swatch = f"<span style='color:{css(legible(colour_of(index), dark=dark))}'>{stroke}</span>"
    words = f"{swatch} <b>{escape(law_alias(run.kind))}</b> {escape(law_run_words(run))}"
    if run.result is None:
        return f"<div class='sg-law sg-law-refused'>{words}</div>"
    return (
        f"<button type='button' class='sg-law' aria-pressed='{str(run.kind == present).lower()}' "
        f"title='Uses this law for the whole run; can be undone' "
        f"{click_attribute(ChooseLaw(run.kind))}>{words}</button>"
    )


def law_run_words(run: LawRun) -> str:
    """Describes the run with a law, or the reason why there is none."""
    result = run.result
    if result is None:
        return run.problem
    slipped = max(result.metrics.slip_path)
    slip = f"slipped {length_words(slipped)}" if slipped > 0.0 else "no slip"
    force = max(result.metrics.peak_normal_force)
    return f"{headline_of(result)}; {slip}; pressed with up to {force:.0f}\u00a0N"
