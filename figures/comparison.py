"""Two overlaid runs, and their differences below."""

from __future__ import annotations

from collections.abc import Sequence
from string import ascii_lowercase

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.trace import rows_from_start
from slipgrasp.figures.panels import lighter
from slipgrasp.figures.phases import draw_lanes, phase_patches
from slipgrasp.figures.slip_times import View, Window, closer_look, views_of, whole_run
from slipgrasp.figures.style import (
    PAGE_WIDTH,
    add_axes,
    add_box,
    add_title,
    new_figure,
    paint,
    paper_style,
)
from slipgrasp.figures.trends import Pair, Trend, pair_of, trends_of
from slipgrasp.recordings.compare.comparison import Comparison
from slipgrasp.recordings.palette import MARK, MUTED

# Sizes on the page [mm].
_MARGIN = 2.0
_HEADER = 10.5
_COLUMN = PAGE_WIDTH / 2
_LABELS = 15.5
_LOOK = 30.0
_RIGHT = 3.0
_TITLE = 6.0
_LANE = 2.6
_PAIR_GAP = 1.4
_PLOT = 27.0
_DIFFERENCE = 13.0
_BETWEEN = 1.6
_TICKS = 10.5

_PALE = 0.55
_LONGEST_NAME = 48
# Outside this range, numbers on an axis are in exponential notation.
_PLAIN = (1e-2, 1e5)


def draw_comparison(
    comparison: Comparison, a: RunResult, b: RunResult, names: tuple[str, str] = ("a", "b")
) -> Figure:
    """Draws two overlaid runs: a pale and wide, b dark and narrow on top.

    Below each quantity is the difference b - a at the common instants, on a separate axis; a dotted
    line marks where a column of the panel first differs by more than the tolerance.

    Args:
        comparison: Result of `slipgrasp.recordings.compare.comparison.compare`.
        a: The first run.
        b: The second run.
        names: Names of the runs.

    Returns:
        The figure. Its axes are labelled ``phases slip``, ``b whole``, ``b difference whole``:
        panel, content, and time range.
    """
    pair = pair_of(comparison, a, b)
    trends = trends_of(a, b)
    num_rows = (len(trends) + 1) // 2
    lanes = _lanes_height(a)
    block = _TITLE + _PLOT + _BETWEEN + _DIFFERENCE + _TICKS
    height = 2 * _MARGIN + _HEADER + lanes + num_rows * block
    with paper_style():
        figure = new_figure(height)
        _draw_header(figure, pair, names)
        _draw_phases(figure, pair)
        for k, trend in enumerate(trends):
            top = _MARGIN + _HEADER + lanes + (k // 2) * block
            _draw_trend(figure, pair, trend, ascii_lowercase[k + 1], _COLUMN * (k % 2), top)
    return figure


def _lanes_height(run: RunResult) -> float:
    contacts = run.trace.shape.num_contacts
    return _TITLE + contacts * (2 * _LANE + _PAIR_GAP) + _TICKS


def _draw_header(figure: Figure, pair: Pair, names: tuple[str, str]) -> None:
    """Key of the runs, the marks, and the colours of the phases."""
    comparison = pair.comparison
    row = add_box(figure, 0.0, _MARGIN, PAGE_WIDTH, 0.5 * _HEADER)
    a, b = (f"{run}: {_shortened(name)}" for run, name in zip("ab", names, strict=True))
    chosen = comparison.tolerance
    limit = "the integration error" if chosen is None else f"{chosen:g} (SI)"
    mark = f"first difference beyond {limit}"
    handles = [
        Line2D([], [], color=paint(lighter(MARK, _PALE)), linewidth=2.6, label=a),
        Line2D([], [], color=paint(MARK), linewidth=0.9, label=b),
        Line2D([], [], color=paint(MARK), linewidth=0.8, linestyle=":", label=mark),
    ]
    row.legend(handles=handles, loc="center", ncols=3)
    below = add_box(figure, 0.0, _MARGIN + 0.5 * _HEADER, PAGE_WIDTH, 0.5 * _HEADER)
    patches = {patch.get_label(): patch for run in (pair.a, pair.b) for patch in phase_patches(run)}
    below.legend(
        handles=list(patches.values()), loc="center", ncols=3, handlelength=1.2, handleheight=0.8
    )


def _shortened(name: str) -> str:
    shown = name if len(name) <= _LONGEST_NAME else f"{name[: _LONGEST_NAME - 1]}…"
    return shown.replace("$", r"\$")


def _draw_phases(figure: Figure, pair: Pair) -> None:
    """Lanes of the phases: for each contact that of a, and that of b below."""
    top = _MARGIN + _HEADER
    add_title(figure, "(a) phases of the contacts", 0.0, top, PAGE_WIDTH, _TITLE)
    views = _views(pair, 0.0, PAGE_WIDTH, share=0.42)
    for contact, finger in enumerate(pair.a.scenario.finger_names):
        start = top + _TITLE + contact * (2 * _LANE + _PAIR_GAP)
        for view in views:
            for k, run in enumerate((pair.a, pair.b)):
                strip = add_axes(figure, view.left, start + k * _LANE, view.width, _LANE)
                strip.set_label(f"phases {contact} {'ab'[k]} {view.name}")
                draw_lanes(strip, run, (contact,), view.window)
                if view is views[0]:
                    _name_lane(strip, f"{finger}  {'ab'[k]}", view)
    bottom = top + _TITLE + pair.a.trace.shape.num_contacts * (2 * _LANE + _PAIR_GAP)
    for view in views:
        axis = add_axes(figure, view.left, bottom - 0.4, view.width, 0.4)
        axis.set_label(f"phases time {view.name}")
        axis.spines[["top", "left", "right"]].set_visible(False)
        axis.tick_params(left=False, labelleft=False)
        _set_times(axis, view)


def _name_lane(strip: Axes, text: str, view: View) -> None:
    strip.text(
        -0.8 / view.width,
        0.5,
        text,
        transform=strip.transAxes,
        ha="right",
        va="center_baseline",
        fontsize=6.5,
        color=paint(MARK),
    )


def _draw_trend(
    figure: Figure, pair: Pair, trend: Trend, letter: str, left: float, top: float
) -> None:
    add_title(figure, f"({letter}) {trend.title}", left, top, _COLUMN, _TITLE)
    _draw_legend(figure, trend, left, top)
    first = _first_divergence(pair.comparison, trend)
    views = _views(pair, left, _COLUMN, share=_LOOK / (_COLUMN - _LABELS - _RIGHT))
    for view in views:
        upper = add_axes(figure, view.left, top + _TITLE, view.width, _PLOT)
        lower_top = top + _TITLE + _PLOT + _BETWEEN
        lower = add_axes(figure, view.left, lower_top, view.width, _DIFFERENCE)
        upper.set_label(f"{letter} {view.name}")
        lower.set_label(f"{letter} difference {view.name}")
        _draw_runs(upper, pair, trend)
        _draw_difference(lower, pair, trend)
        for axes in (upper, lower):
            _finish(axes, view, first, is_first=view is views[0])
        upper.tick_params(labelbottom=False)
        upper.set_xlabel("")
        if view is views[0]:
            _label(upper, trend.label, view)
            _label(lower, "$b - a$", view)


def _views(pair: Pair, left: float, width: float, share: float) -> tuple[View, ...]:
    """Close-up of the slips of both runs on the left, if there are any, and the complete runs."""
    whole = _around([whole_run(pair.a), whole_run(pair.b)])
    looks = [look for look in (closer_look(pair.a), closer_look(pair.b)) if look is not None]
    look = _around(looks) if looks else None
    return views_of(whole, look, left + _LABELS, width - _LABELS - _RIGHT, share)


def _around(windows: Sequence[Window]) -> Window:
    return Window(min(w.start for w in windows), max(w.end for w in windows))


def _first_divergence(comparison: Comparison, trend: Trend) -> float | None:
    found = comparison.first_divergence
    return min((found[l.column] for l in trend.lines if l.column in found), default=None)


def _draw_runs(axes: Axes, pair: Pair, trend: Trend) -> None:
    shown: list[NDArray[np.float64]] = []
    for line in trend.lines:
        for run, columns, is_a in ((pair.a, pair.of_a, True), (pair.b, pair.of_b, False)):
            rows = rows_from_start(run.trace)
            values = trend.scale * columns[line.column][rows]
            shown.append(values)
            axes.plot(
                run.trace.times[rows],
                values,
                color=paint(lighter(line.colour, _PALE if is_a else 0.0)),
                linewidth=2.6 if is_a else 0.9,
                zorder=2.0 if is_a else 2.5,
            )
    _set_values(axes, np.concatenate(shown), trend.least_span, ticks=4)


def _draw_difference(axes: Axes, pair: Pair, trend: Trend) -> None:
    first, second, _ = pair.rows
    times = pair.a.trace.times[first]
    start = int(np.searchsorted(times, times[0], side="right")) - 1
    axes.axhline(0.0, color=paint(lighter(MUTED, 0.4)), linewidth=0.5, zorder=1.0)
    shown: list[NDArray[np.float64]] = []
    for line in trend.lines:
        apart = trend.scale * (pair.of_b[line.column][second] - pair.of_a[line.column][first])
        shown.append(apart[start:])
        axes.plot(times[start:], apart[start:], color=paint(line.colour), linewidth=0.9)
    found = pair.comparison.signals
    limits = [found[line.column].tolerance for line in trend.lines if line.column in found]
    least = 2.0 * trend.scale * max([*limits, np.finfo(float).tiny])
    _set_values(axes, np.concatenate([*shown, [0.0]]), least, ticks=2)


def _set_values(axes: Axes, values: NDArray[np.float64], least_span: float, ticks: int) -> None:
    low, high = float(values.min()), float(values.max())
    middle, span = 0.5 * (low + high), max(high - low, least_span)
    axes.set_ylim(middle - 0.58 * span, middle + 0.58 * span)
    axes.yaxis.set_major_locator(MaxNLocator(ticks, steps=[1, 2, 2.5, 5, 10]))
    if not _PLAIN[0] <= max(abs(low), abs(high), span) < _PLAIN[1]:
        axes.yaxis.set_major_formatter("{x:.3g}")


def _finish(axes: Axes, view: View, first: float | None, *, is_first: bool) -> None:
    _set_times(axes, view)
    axes.tick_params(labelleft=is_first, top=True, right=True)
    if first is not None:
        axes.axvline(first, color=paint(MARK), linewidth=0.8, linestyle=":", zorder=3.0)


def _set_times(axes: Axes, view: View) -> None:
    axes.set_xlim(*view.window)
    axes.xaxis.set_major_locator(MaxNLocator(min(7, round(view.width / 7.5)), steps=[1, 2, 5, 10]))
    axes.set_xlabel(view.time_label, labelpad=1.5)


def _label(axes: Axes, text: str, view: View) -> None:
    axes.set_ylabel(text)
    axes.yaxis.set_label_coords(-11.0 / view.width, 0.5)


def _draw_legend(figure: Figure, trend: Trend, left: float, top: float) -> None:
    named = [line for line in trend.lines if line.label]
    if not named:
        return
    row = add_box(figure, left, top, _COLUMN - _RIGHT, _TITLE)
    handles: list[Artist] = [
        Line2D([], [], color=paint(line.colour), linewidth=1.2, label=line.label) for line in named
    ]
    row.legend(handles=handles, loc="center right", ncols=len(handles), columnspacing=0.9)
