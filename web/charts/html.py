"""The words of the charts as HTML: heads with a legend, notes, and what is read at the play head.

The page's own script moves the play head over the lines and writes the values into the
legends, so that a run that plays sends some numbers per tab and never the charts again.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from html import escape

from slipgrasp.web.charts.charts import Chart, Line
from slipgrasp.web.model.colours import css, legible
from slipgrasp.web.model.intents.picture import ToggleLine
from slipgrasp.web.page.markup import click_attribute

_NOTE = "font-size:0.75em;opacity:0.75;padding:0 1em;line-height:1.3"


def head_html(chart: Chart, hidden: frozenset[str], *, dark: bool) -> str:
    """Title with unit, and a legend that hides lines and has room for their values.

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
        f" title='{'Shows' if is_hidden else 'Hides'} this line; its value is that at the play "
        f"head.'><span style='color:{css(legible(line.colour, dark=dark))}'>{sign}</span> "
        f"<span>{escape(line.label)}</span> <b data-sg-value></b></button> "
    )


def readings_html(changes: Sequence[float], values: Mapping[str, Sequence[float]]) -> str:
    """What the page's script writes into the charts of a tab; nothing that is seen by itself.

    Args:
        changes: When parameters change [s].
        values: By key of the chart, what each of its lines shows at the play head.
    """
    shown = {key: [f"{value:.4g}" for value in read] for key, read in values.items()}
    readings = {"changes": changes, "values": shown}
    return f"<div hidden data-sg-readings='{escape(json.dumps(readings))}'></div>"


def note_html(sentences: Sequence[str]) -> str:
    """What must be known of the charts of a tab, in a small note."""
    return f"<div style='{_NOTE}'>{escape(' '.join(sentences))}</div>"
