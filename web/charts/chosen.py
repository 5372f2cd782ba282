"""Charts of signals that the user chose, out of all that a run records."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.columns import Column, columns_of
from slipgrasp.core.trace.signals import SIGNALS
from slipgrasp.core.trace.trace import Trace
from slipgrasp.recordings.palette import FINGERS
from slipgrasp.web.charts.charts import Chart, Line
from slipgrasp.web.model.charts_view import ChartsView
from slipgrasp.web.model.intents.picture import DrawAgainst, ToggleSignal
from slipgrasp.web.page.markup import change_attribute, click_attribute

CHOSEN_TAB = "Signals"

_SENTENCES = {signal.name: signal.text for signal in SIGNALS}


def choosable(trace: Trace) -> dict[str, Column]:
    """Every column of a trace but the time, by its name as in tables."""
    return {column.name: column for column in columns_of(trace)[1:]}


def chosen_charts(result: RunResult, names: Sequence[str]) -> tuple[Chart, ...]:
    """One chart per unit of the signals that were chosen, in SI units.

    Args:
        result: The run.
        names: Names of columns; those that the run does not have are left out.
    """
    known = choosable(result.trace)
    columns = [known[name] for name in names if name in known]
    units = dict.fromkeys(column.unit for column in columns)
    return tuple(
        Chart(
            f"signals-{unit or 'phases'}",
            "Chosen signals",
            unit or "1",
            "Signals of the recording by their names in tables, in SI units.",
            tuple(_lines([column for column in columns if column.unit == unit])),
        )
        for unit in units
    )


def _lines(columns: Sequence[Column]) -> Iterator[Line]:
    for i, column in enumerate(columns):
        colour, values = FINGERS[i % len(FINGERS)], column.values.astype(float)
        yield Line(column.name, column.name, colour, values, dashed=i >= len(FINGERS))


def against_html(trace: Trace, charts_view: ChartsView) -> str:
    """A field for what the chosen signals are drawn against.

    Args:
        trace: Whose signals can be chosen.
        charts_view: Which of them are.
    """
    if not charts_view.chosen:
        return (
            f"<div class='sg-cursors'>Signals that you choose under {CHOSEN_TAB} can be drawn here "
            "against any other.</div>"
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
    """A field that finds a signal by its name, and what was chosen with a way to drop it.

    Args:
        trace: Whose signals can be chosen.
        chosen: Names of the chosen ones.
    """
    options = "".join(
        f"<option value='{escape(column.name)}'>"
        f"{escape(_SENTENCES[column.signal])} [{escape(column.unit or 'phase')}]</option>"
        for column in choosable(trace).values()
        if column.name not in chosen
    )
    chips = "".join(
        f"<button type='button' class='sg-chip' title='Takes this signal out of the charts' "
        f"{click_attribute(ToggleSignal(name))}>{escape(name)} ✕</button>"
        for name in chosen
    )
    return (
        "<div class='sg-search'><label>Add a signal <input type='search' list='sg-signals' "
        f"placeholder='part of its name' {change_attribute(ToggleSignal, 'name')}></label>"
        f"<datalist id='sg-signals'>{options}</datalist>{chips}</div>"
    )
