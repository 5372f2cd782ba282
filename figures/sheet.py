"""Draws the panels of a figure in two columns, each with a close-up of the slip."""

from __future__ import annotations

from collections.abc import Sequence
from string import ascii_lowercase
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.trace import rows_from_start
from slipgrasp.core.trace.types import Outcome
from slipgrasp.figures.panels import Curve, Panel, Plot, lighter
from slipgrasp.figures.phases import draw_lanes, name_lanes, phase_patches, shade
from slipgrasp.figures.slip_times import View, closer_look, views_of, whole_run
from slipgrasp.figures.style import PAGE_WIDTH, add_axes, add_box, add_title, new_figure, paint
from slipgrasp.recordings.palette import MARK, MUTED

# Sizes on the page [mm].
_MARGIN = 1.5
_COLUMN = PAGE_WIDTH / 2
_LABELS = 15.5
_LOOK = 26.0
_RIGHT = 3.0
_TITLE = 5.0
_LEGEND = 4.8
_LANE = 2.4
_LANE_GAP = 1.2
_PLOT = 35.0
_STACKED_PLOT = 22.0
_BETWEEN_PLOTS = 2.0
_TICKS = 10.5
_KEY = 5.5
_NAMES = 0.8

# Outside this range, numbers on an axis are in exponential notation.
_PLAIN = (1e-3, 1e5)


class _Cell(NamedTuple):
    """Position of a panel on the page, and the common heights of its row [mm]."""

    left: float
    top: float
    width: float
    header: float
    plots: float


def draw_sheet(result: RunResult, panels: Sequence[Panel]) -> Figure:
    """Draws panels in two columns, with shaded phases and a key.

    Args:
        result: The run.
        panels: Panels from `slipgrasp.figures.panels`.

    Returns:
        The figure. Its axes are labelled ``a whole``, ``a slip``, ``d 2 whole``, ``a phases
        whole``: panel, plot if there are several, and time range.
    """
    ending = ending_words(result)
    rows = [panels[i : i + 2] for i in range(0, len(panels), 2)]
    heights = [_row_height(row) for row in rows]
    height = 2 * _MARGIN + sum(heights) + _KEY * (2 if ending else 1)
    figure = new_figure(height)
    letters = iter(ascii_lowercase)
    for k, row in enumerate(rows):
        for column, panel in enumerate(row):
            cell = _Cell(
                left=_COLUMN * column,
                top=_MARGIN + sum(heights[:k]),
                width=PAGE_WIDTH / len(row),
                header=_header(row),
                plots=_plot_height(row),
            )
            _draw_panel(figure, result, panel, next(letters), cell)
    _draw_key(figure, result, height, ending)
    return figure


def ending_words(result: RunResult) -> str:
    """Describes an early end; empty if the run was completed."""
    if result.outcome is Outcome.COMPLETED:
        return ""
    words = f"Ended early at {result.end_time:.4g} s: {result.outcome.value.replace('_', ' ')}"
    contact = None if result.reason is None else result.reason.contact
    return words if contact is None else f"{words} ({result.scenario.finger_names[contact]} finger)"


def _row_height(row: Sequence[Panel]) -> float:
    return _header(row) + _plot_height(row) + _TICKS


def _header(row: Sequence[Panel]) -> float:
    """Height of title, legend if any, and phase lanes."""
    lanes = max(len(panel.contacts) for panel in row)
    legend = _LEGEND if any(_named_curves(panel) for panel in row) else 0.0
    return _TITLE + legend + _LANE * lanes + _LANE_GAP


def _plot_height(row: Sequence[Panel]) -> float:
    stacked = max(len(panel.plots) for panel in row)
    return _PLOT if stacked == 1 else stacked * (_STACKED_PLOT + _BETWEEN_PLOTS) - _BETWEEN_PLOTS


def _draw_panel(figure: Figure, result: RunResult, panel: Panel, letter: str, cell: _Cell) -> None:
    add_title(figure, f"({letter}) {panel.title}", cell.left, cell.top, cell.width, _TITLE)
    _draw_legend(figure, panel, cell)
    lanes = _LANE * len(panel.contacts)
    available = cell.width - _LABELS - _RIGHT
    share = _LOOK / (_COLUMN - _LABELS - _RIGHT)
    left = cell.left + _LABELS
    views = views_of(whole_run(result), closer_look(result), left, available, share)
    for view in views:
        top = cell.top + cell.header - _LANE_GAP - lanes
        strip = add_axes(figure, view.left, top, view.width, lanes)
        strip.set_label(f"{letter} phases {view.name}")
        draw_lanes(strip, result, panel.contacts, view.window)
        if view is views[0]:
            name_lanes(strip, result, panel.contacts, offset=_NAMES / view.width)
    count = len(panel.plots)
    height = (cell.plots - _BETWEEN_PLOTS * (count - 1)) / count
    for k, plot in enumerate(panel.plots):
        top = cell.top + cell.header + k * (height + _BETWEEN_PLOTS)
        name = letter if count == 1 else f"{letter} {k + 1}"
        for view in views:
            axes = add_axes(figure, view.left, top, view.width, height)
            axes.set_label(f"{name} {view.name}")
            shade(axes, result, panel.contacts)
            _draw_plot(axes, result, plot, view, height)
            _label(axes, plot, view, first=view is views[0], last=k == count - 1)


def _draw_plot(axes: Axes, result: RunResult, plot: Plot, view: View, height: float) -> None:
    if plot.with_zero:
        axes.axhline(0.0, color=paint(lighter(MUTED, 0.4)), linewidth=0.5, zorder=1.0)
    rows = rows_from_start(result.trace)
    times = result.trace.times[rows]
    marker = "." if len(times) == 1 else ""
    for curve in plot.curves:
        axes.plot(times, curve.values[rows], marker=marker, **_line(curve))
    limits = _limits(plot, rows)
    axes.set_xlim(*view.window)
    axes.set_ylim(*limits)
    if result.outcome is not Outcome.COMPLETED:
        axes.axvline(result.end_time, color=paint(MARK), linewidth=1.6, zorder=3.0)
    axes.xaxis.set_major_locator(MaxNLocator(min(7, round(view.width / 6.5)), steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_locator(MaxNLocator(max(2, round(height / 7.0)), steps=[1, 2, 2.5, 5, 10]))
    if not _PLAIN[0] <= max(map(abs, limits)) < _PLAIN[1]:
        axes.yaxis.set_major_formatter("{x:.3g}")


def _limits(plot: Plot, rows: slice) -> tuple[float, float]:
    """Range of all finite values."""
    values: NDArray[np.float64] = np.concatenate([curve.values[rows] for curve in plot.curves])
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    middle, span = 0.5 * (low + high), max(high - low, plot.least_span)
    return middle - 0.56 * span, middle + 0.56 * span


def _line(curve: Curve) -> dict[str, Any]:
    colour = paint(curve.colour)
    if curve.role == "quantity":
        return {"color": colour, "zorder": 2.5}
    style = (0, (4.0, 2.0)) if curve.role == "truth" else (0, (1.2, 1.2))
    return {"color": colour, "linewidth": 0.7, "linestyle": style, "zorder": 2.0}


def _label(axes: Axes, plot: Plot, view: View, *, first: bool, last: bool) -> None:
    axes.set_ylabel(plot.label if first else "")
    axes.tick_params(labelleft=first, labelbottom=last, top=True, right=True)
    axes.set_xlabel(view.time_label if last else "")
    axes.xaxis.labelpad = 1.5
    if first:
        axes.yaxis.set_label_coords(-9.5 / view.width, 0.5)


def _draw_legend(figure: Figure, panel: Panel, cell: _Cell) -> None:
    named = _named_curves(panel)
    if not named:
        return
    row = add_box(figure, cell.left + _LABELS, cell.top + _TITLE, cell.width - _LABELS, _LEGEND)
    handles: list[Artist] = [Line2D([], [], label=curve.label, **_line(curve)) for curve in named]
    row.legend(handles=handles, loc="center left", ncols=len(handles))


def _named_curves(panel: Panel) -> list[Curve]:
    """The entries of the legend, quantities first."""
    named = [curve for plot in panel.plots for curve in plot.curves if curve.label]
    return sorted(named, key=lambda curve: curve.role != "quantity")


def _draw_key(figure: Figure, result: RunResult, height: float, ending: str) -> None:
    """Key of the phase colours, and below it the early end of the run, if any."""
    lines = 2 if ending else 1
    row = add_box(figure, 0.0, height - _MARGIN - _KEY * lines, PAGE_WIDTH, _KEY)
    row.set_label("key")
    handles = phase_patches(result)
    row.legend(handles=handles, loc="center", ncols=3, handlelength=1.2, handleheight=0.8)
    if ending:
        figure.text(0.5, (_MARGIN + 0.5 * _KEY) / height, ending, ha="center", va="center")
