"""Charts as HTML: titles with legends, notes, and values at the play head.

The page's script moves the play head over the lines, and reads the lines for the legends until the
session has sent the exact values, so that playback sends no charts.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from html import escape
from typing import NamedTuple

from slipgrasp.core.trace.trace import Trace
from slipgrasp.web.charts.chart import Chart, Line
from slipgrasp.web.model.colours import css, legible
from slipgrasp.web.model.intents.picture import ToggleLine, ToggleMark
from slipgrasp.web.model.sampling import locate
from slipgrasp.web.model.ticks import digits_of
from slipgrasp.web.page.keys import keys_of
from slipgrasp.web.page.markup import click_attribute

_NOTE = "font-size:0.75em;opacity:0.75;padding:0 1em;line-height:1.3"


class Cursors(NamedTuple):
    """Times at which charts are read [s]: the play head, and the second cursor or None."""

    time: float
    mark: float | None


def head_html(chart: Chart, hidden: frozenset[str], *, dark: bool) -> str:
    """Title with unit, and a legend that hides lines and shows their values.

    Args:
        chart: The chart.
        hidden: Keys of its lines that are hidden.
        dark: Whether the page is dark.
    """
    unit = "" if chart.unit == "1" else f" [{chart.unit}]"
    entries = "".join(_entry_html(chart, line, line.key in hidden, dark) for line in chart.lines)
    return (
        f"<div data-sg-chart='{escape(chart.key)}' class='sg-chart'>"
        f"<span class='sg-chart-title' title='{escape(chart.about)}'>"
        f"{escape(chart.title + unit)}</span>{entries}</div>"
    )


def _entry_html(chart: Chart, line: Line, is_hidden: bool, dark: bool) -> str:
    sign = "┄" if line.dashed else "━"
    return (
        f"<button type='button' class='sg-line'"
        f" {click_attribute(ToggleLine(chart.key, line.key))}"
        f" aria-pressed='{'false' if is_hidden else 'true'}'"
        f" title='{'Shows' if is_hidden else 'Hides'} this line; its value is at the play "
        f"head.'><span style='color:{css(legible(line.colour, dark=dark))}'>{sign}</span> "
        f"<span>{escape(line.label)}</span> <b data-sg-value></b></button> "
    )


@dataclass(frozen=True, slots=True)
class Readings:
    """Values in the charts of a tab.

    Attributes:
        time: The play head [s].
        values: Text of each line's value there, by key of the chart.
        changes: Times of parameter changes [s].
        mark: Time of the second cursor [s]; None if there is none.
        spots: Positions on the curves at the play head, by key of an XY chart [px].
        marked: Positions on the curves at the second cursor [px].
    """

    time: float
    values: Mapping[str, Sequence[str]]
    changes: Sequence[float]
    mark: float | None = None
    spots: Mapping[str, Sequence[Sequence[float | None]]] = field(default_factory=dict)
    marked: Mapping[str, Sequence[Sequence[float | None]]] = field(default_factory=dict)


def read_lines(chart: Chart, trace: Trace, cursors: Cursors, scale: float) -> list[str]:
    """Value of each line at the play head, and the difference from the second cursor.

    Args:
        chart: The chart.
        trace: The run.
        cursors: The times of both.
        scale: The largest value of the chart, which determines the digits.
    """
    values = chart.values_at(locate(trace.times, cursors.time))
    if cursors.mark is None:
        return [digits_of(value, scale) for value in values]
    before = chart.values_at(locate(trace.times, cursors.mark))
    elapsed = cursors.time - cursors.mark
    both = zip(values, before, strict=True)
    return [
        f"{digits_of(v, scale)} ({_difference(v - b, elapsed, chart.unit, scale)})" for v, b in both
    ]


def _difference(difference: float, elapsed: float, unit: str, scale: float) -> str:
    told = f"Δ {digits_of(difference, scale, signed=True)}"
    if elapsed == 0.0:
        return told
    slope = difference / elapsed
    return f"{told}, {digits_of(slope, abs(slope), signed=True)} {_per_second(unit)}"


def _per_second(unit: str) -> str:
    """The unit of the slope of a line: ``mm/s²`` for ``mm/s``."""
    if unit == "1":
        return "1/s"
    return f"{unit}²" if unit.endswith("/s") else f"{unit}/s"


def cursor_html(cursors: Cursors) -> str:
    """Time from the second cursor to the play head, or how to set that cursor."""
    if cursors.mark is None:
        return (
            f"<div class='sg-cursors'>Shift+click, or {keys_of(ToggleMark())}, sets a second "
            "cursor.</div>"
        )
    elapsed = digits_of(1e3 * (cursors.time - cursors.mark), 100.0, signed=True)
    return (
        f"<div class='sg-cursors'>From {1e3 * cursors.mark:.6g} ms to the play head "
        f"<b>Δt {elapsed} ms</b> <button type='button' class='sg-chip' title='Removes the second "
        f"cursor' {click_attribute(ToggleMark())}>✕</button></div>"
    )


def readings_html(read: Readings) -> str:
    """A hidden element with the values for the page's script."""
    readings = asdict(read)
    return f"<div hidden data-sg-readings='{escape(json.dumps(readings))}'></div>"


def note_html(sentences: Sequence[str]) -> str:
    """A small note about the charts of a tab."""
    return f"<div style='{_NOTE}'>{escape(' '.join(sentences))}</div>"
