"""Charts of signals selected by the user."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.columns import Column, columns_of
from slipgrasp.core.trace.signals import SIGNALS
from slipgrasp.core.trace.trace import Trace
from slipgrasp.recordings.palette import FINGERS
from slipgrasp.web.charts.chart import Chart, Line
from slipgrasp.web.model.charts_view import ChartsView
from slipgrasp.web.model.intents.picture import DrawAgainst, ToggleSignal
from slipgrasp.web.page.markup import change_attribute, click_attribute

CHOSEN_TAB = "Signals"

_SENTENCES = {signal.name: signal.text for signal in SIGNALS}


def choosable(trace: Trace) -> dict[str, Column]:
    """Every column of a trace except the time, by its name in tables."""
    return {column.name: column for column in columns_of(trace)[1:]}


def chosen_charts(result: RunResult, names: Sequence[str]) -> tuple[Chart, ...]:
    """One chart per unit of the selected signals, in SI units.

    Args:
        result: The run.
        names: Names of columns; unknown ones are ignored.
    """
    known = choosable(result.trace)
    columns = [known[name] for name in names if name in known]
    units = dict.fromkeys(column.unit for column in columns)
    return tuple(
        Chart(
            f"signals-{unit or 'phases'}",
            "Chosen signals",
            unit or "1",
            "Signals of the recording with their names in tables, in SI units.",
            tuple(_lines([column for column in columns if column.unit == unit])),
        )
        for unit in units
    )


def _lines(columns: Sequence[Column]) -> Iterator[Line]:
    for i, column in enumerate(columns):
        colour, values = FINGERS[i % len(FINGERS)], column.values.astype(float)
        yield Line(column.name, column.name, colour, values, dashed=i >= len(FINGERS))


def against_html(trace: Trace, charts_view: ChartsView) -> str:
    """A field that selects the signal of the horizontal axis.

    Args:
        trace: Trace with the signals.
        charts_view: Selected signals.
    """
    if not charts_view.chosen:
        return (
            f"<div class='sg-cursors'>Signals selected under {CHOSEN_TAB} can be plotted here "
            "against any other signal.</div>"
        )
    options = "".join(
        f"<option value='{escape(name)}'{' selected' if name == charts_view.across else ''}>"
        f"{escape(name)}</option>"
        for name in choosable(trace)
    )
    return (
        "<div class='sg-search'><label>Chosen signals against "
        f"<select {change_attribute(DrawAgainst, 'name')}><option value=''>nothing</option>"
        f"{options}</select></label></div>"
    )


def search_html(trace: Trace, chosen: Sequence[str]) -> str:
    """A field that searches signals by name, and the selected ones with buttons to remove them.

    Args:
        trace: Trace with the signals.
        chosen: Names of the selected signals.
    """
    options = "".join(
        f"<option value='{escape(column.name)}'>"
        f"{escape(_SENTENCES[column.signal])} [{escape(column.unit or 'phase')}]</option>"
        for column in choosable(trace).values()
        if column.name not in chosen
    )
    chips = "".join(
        f"<button type='button' class='sg-chip' title='Removes this signal from the charts' "
        f"{click_attribute(ToggleSignal(name))}>{escape(name)} ✕</button>"
        for name in chosen
    )
    return (
        "<div class='sg-search'><label>Add a signal <input type='search' list='sg-signals' "
        f"placeholder='part of its name' {change_attribute(ToggleSignal, 'name')}></label>"
        f"<datalist id='sg-signals'>{options}</datalist>{chips}</div>"
    )
