"""Plots of selected signals over time, for one run, or with a second run or measured data."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.field_errors import nearest
from slipgrasp.core.trace.columns import Column, columns_of
from slipgrasp.core.trace.signals import SIGNALS
from slipgrasp.figures.panels import finger_colour, lighter
from slipgrasp.figures.phases import shade
from slipgrasp.figures.slip_times import Window, whole_run
from slipgrasp.figures.style import new_figure, paint, paper_style
from slipgrasp.recordings.measured.overlay import laid_over, thinned
from slipgrasp.recordings.measured.recording import MeasuredRecording
from slipgrasp.recordings.palette import Rgb

# Heights on the page [mm].
_PLOT, _MARGINS = 38.0, 10.0
_DASHED = {"linestyle": (0, (4.0, 2.0)), "linewidth": 0.8}
_DOTS = {"linestyle": "none", "marker": ".", "markersize": 2.5, "alpha": 0.6}
LONGEST_TITLE = 100
"""Number of characters that fit on one line above a figure."""
_MARGIN = 0.06
"""Fraction of the range of values, above and below."""
_BY_NAME = {signal.name: signal for signal in SIGNALS}
_OF_FINGERS = ("contact", "path", "tangent", "joint")


def draw_signals(
    run: RunResult,
    names: Sequence[str],
    *,
    over: RunResult | MeasuredRecording | None = None,
    time: tuple[float, float] | None = None,
    title: str | None = None,
) -> Figure:
    """Plots signals of a run over time, one below the other, with slip shaded.

    Args:
        run: The run.
        names: Signals (``slip``), or single columns of them (``slip_0``).
        over: A second run, drawn dashed, or measured data, drawn as dots.
        time: Start and end of the time axis [s]; the whole run if None.
        title: Title above the figure, without formulas; None for none.

    Raises:
        ScenarioError: If a run has no such signal, the times are not a valid range, or the title
            is empty or longer than `LONGEST_TITLE`.
    """
    second = None if over is None else _second(run, over)
    runs = [run] if second is None else [run, second.run]
    chosen = [[_columns(each, name) for each in runs] for name in names]
    window, heading = _window(run, time), _heading(title, run, second)
    with paper_style():
        figure = new_figure(_PLOT * len(names) + _MARGINS)
        figure.set_layout_engine("constrained")
        plots: Iterable[Axes] = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
        for axes, name, (columns, *others) in zip(plots, names, chosen, strict=True):
            _draw(axes, run, columns)
            if second is not None:
                _draw(axes, second.run, others[0], **second.style)
            _label(axes, name, columns)
            shade(axes, run, range(run.trace.shape.num_contacts))
            axes.set_xlim(*window)
            _fit(axes, window)
            axes.set_xlabel("time [s]")
            axes.label_outer()
        if heading:
            figure.suptitle("\n".join(heading), fontsize=8.5, parse_math=False)
        return figure


def _heading(title: str | None, run: RunResult, second: _Second | None) -> list[str]:
    """The lines above a figure: its title, and the names of the runs."""
    size = LONGEST_TITLE if title is None else len(title.strip())
    if not 1 <= size <= LONGEST_TITLE:
        message = f"title has {size} characters; allowed: 1 to {LONGEST_TITLE}"
        raise _refusal("title", (title or "")[:LONGEST_TITLE], message)
    own = [] if title is None else [" ".join(title.split())]
    if second is None:
        return own
    whole = [f"solid: {run.name}", f"{second.marking}: {second.name}"]
    return own + [line for text in whole for line in wrap(text, LONGEST_TITLE)]


class _Second(NamedTuple):
    """A second run or measured data, drawn over a run."""

    run: RunResult
    name: str
    marking: str
    style: dict[str, Any]


def _second(run: RunResult, over: RunResult | MeasuredRecording) -> _Second:
    if isinstance(over, MeasuredRecording):
        return _Second(laid_over(run, thinned(over)), over.outline.title, "dots", _DOTS)
    return _Second(over, over.name, "dashed", _DASHED)


def _window(run: RunResult, time: tuple[float, float] | None) -> Window:
    start, end = window = whole_run(run) if time is None else Window(*time)
    if not (math.isfinite(start) and math.isfinite(end) and start < end):
        message = f"time: {start:g} to {end:g} s is not a range; the start must be before the end"
        raise _refusal("time", f"{start:g}, {end:g}", message)
    return window


def _columns(run: RunResult, name: str) -> dict[int, Column]:
    """Finds a signal, or a single column of it, with the indices of its columns.

    Raises:
        ScenarioError: If the run has no such signal.
    """
    signals: dict[str, list[Column]] = {}
    for column in columns_of(run.trace)[1:]:
        signals.setdefault(column.signal, []).append(column)
    for signal, columns in signals.items():
        found = {k: each for k, each in enumerate(columns) if name in (signal, each.name)}
        if found:
            return found
    near = nearest(name, [*signals, *(c.name for each in signals.values() for c in each)])
    message = f"the run has no signal '{name[:80]}'{near}; signals: {', '.join(signals)}"
    raise _refusal("signals", name[:80], message)


def _refusal(field: str, value: str, message: str) -> ScenarioError:
    return ScenarioError([FieldError(field=field, value=value, limit=None, message=message)])


def _draw(axes: Axes, run: RunResult, columns: dict[int, Column], **style: Any) -> None:
    for place, column in columns.items():
        axes.plot(
            run.trace.times,
            column.values,
            color=paint(_colour(run, column, place)),
            label=column.name,
            drawstyle="steps-post" if column.holds_phases else "default",
            **style,
        )


def _colour(run: RunResult, column: Column, place: int) -> Rgb:
    """The colour of the column's finger, lighter by component; otherwise one per column."""
    signal, shape = _BY_NAME[column.signal], run.trace.shape
    if signal.per not in _OF_FINGERS:
        return finger_colour(place)
    finger, part = divmod(place, shape.width(signal) // shape.num_contacts)
    return lighter(finger_colour(finger), 0.3 * part)


def _label(axes: Axes, name: str, columns: dict[int, Column]) -> None:
    units = dict.fromkeys(column.unit for column in columns.values() if column.unit)
    axes.set_ylabel(f"{name} [{', '.join(units)}]" if units else name)
    sentence = _BY_NAME[next(iter(columns.values())).signal].text.rstrip(".")
    axes.set_title(sentence, loc="left", fontsize=8.5)
    labels = [column.name for column in columns.values()]
    axes.legend(
        axes.get_lines()[: len(labels)],
        labels,
        loc="center left",
        bbox_to_anchor=(1.0, 0.5),
        borderaxespad=0.6,
        fontsize=7.0,
    )


def _fit(axes: Axes, window: Window) -> None:
    """Fits the vertical axis to the values in the shown time range."""
    shown = []
    for line in axes.get_lines():
        times, values = (np.asarray(data, float) for data in line.get_data())
        inside = (times >= window[0]) & (times <= window[1]) & np.isfinite(values)
        shown.append(values[inside])
    values = np.concatenate(shown)
    if len(values):
        low, high = float(values.min()), float(values.max())
        margin = _MARGIN * (high - low) or 1e-9 * max(abs(high), 1.0)
        axes.set_ylim(low - margin, high + margin)
