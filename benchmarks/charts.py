"""The diagrams of the documentation, in the style of the figures of a run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator

from benchmarks.assumptions import SHORTEST, Choice, longest_path
from benchmarks.sampled import CHOSEN, FIFTH, SampledPoint
from benchmarks.scaling import Scaling
from benchmarks.timing import MILLISECONDS
from benchmarks.work_precision import DRAKE, MUJOCO, OURS, Point
from slipgrasp.core.scenario import SimulationParameters
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.figures.style import add_axes, new_figure, paint, paper_style
from slipgrasp.recordings.palette import MUTED, PHASES, Rgb

_COLOURS: dict[str, Rgb] = {
    OURS: PHASES[ContactPhase.STICK],
    MUJOCO: PHASES[ContactPhase.SLIP_FORWARD],
    DRAKE: MUTED,
    "continuous": PHASES[ContactPhase.STICK],
    "1 kHz": PHASES[ContactPhase.SLIP_FORWARD],
}
_NAME_OFFSETS = {OURS: (6.0, 10.0), MUJOCO: (8.0, 7.0), DRAKE: (8.0, 7.0)}  # [pt]
_DEFAULT_TOLERANCE = SimulationParameters().relative_tolerance


def save(figure: Figure, path: Path) -> None:
    """Saves a diagram; the same numbers give the same bytes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with paper_style():
        figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)


def draw_work_precision(points: Sequence[Point]) -> Figure:
    """Error of the end of slip and of the end state over CPU time."""
    with paper_style():
        figure = new_figure(98.0)
        errors = ("event", "state")
        words = ("(a) error of the end of slip [s]", "(b) error of the end state [m]")
        for column, (error, title) in enumerate(zip(errors, words, strict=True)):
            axes = add_axes(figure, 14.0 + 88.0 * column, 7.0, 74.0, 78.0)
            axes.set(xscale="log", yscale="log", xlim=(0.6, 8e3), ylim=(1e-15, 1e-1))
            axes.set_xlabel("CPU time of 0.3 s [ms]")
            axes.set_title(title, loc="left", fontsize=8.5)
            axes.xaxis.set_major_formatter(_plain)
            _draw_curves(axes, points, error)
            _draw_legend(axes)
        return figure


def draw_sampled(points: Sequence[SampledPoint]) -> Figure:
    """Error of the final pose over CPU time, one curve per case and method."""
    with paper_style():
        figure = new_figure(90.0)
        cases = sorted({point.case for point in points})
        for column, case in enumerate(cases):
            axes = add_axes(figure, 14.0 + 42.0 * column, 7.0, 33.0, 70.0)
            axes.set(yscale="log", ylim=(1e-16, 1e-8))
            axes.set_xlabel("CPU time [ms]")
            axes.set_title(case, loc="left", fontsize=8.5)
            for way, style in ((CHOSEN, "o-"), (FIFTH, "s--")):
                curve = [point for point in points if (point.case, point.way) == (case, way)]
                times = [MILLISECONDS * point.seconds for point in curve]
                axes.plot(times, [point.pose for point in curve], style, label=way, markersize=3)
            axes.legend()
        return figure


def draw_scaling(durations: Scaling, fingers: Scaling) -> Figure:
    """CPU time of a run over its duration and over the number of fingers."""
    with paper_style():
        figure = new_figure(78.0)
        left = add_axes(figure, 14.0, 7.0, 74.0, 59.0)
        left.set_xlabel("simulated time [s]")
        left.set_title("(a) CPU time of case I [ms]", loc="left", fontsize=8.5)
        _draw_cost(left, durations, {"continuous": (-2, -2.0, 10.0), "1 kHz": (-2, -2.0, 8.0)})
        left.set(xlim=(0.0, None), ylim=(0.0, None))
        _draw_fingers(add_axes(figure, 102.0, 7.0, 74.0, 59.0), fingers)
        return figure


def _draw_fingers(axes: Axes, fingers: Scaling) -> None:
    """Makes both axes logarithmic, so that powers are straight lines."""
    axes.set(xscale="log", yscale="log", xlim=(1.9, 6.6), xlabel="fingers $n$")
    axes.set_title("(b) CPU time of 7 s [ms]", loc="left", fontsize=8.5)
    _draw_cost(axes, fingers, {"continuous": (2, 2.0, -12.0), "1 kHz": (1, -2.0, 8.0)})
    _draw_guide(axes, fingers, 1, "$n$")
    _draw_guide(axes, fingers, 3, "$n^3$")
    axes.set_xticks(fingers.sizes, [f"{size:g}" for size in fingers.sizes])
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(_plain)
    axes.minorticks_off()


def _draw_curves(axes: Axes, points: Sequence[Point], error: str) -> None:
    first_case = points[0].case
    for (engine, case), group in groupby(points, lambda point: (point.engine, point.case)):
        curve = list(group)
        places = [(MILLISECONDS * point.seconds, getattr(point, error)) for point in curve]
        colour = paint(_COLOURS[engine])
        filled = case == first_case
        axes.plot(
            *zip(*places, strict=True),
            color=colour,
            marker="o" if filled else "s",
            markersize=3.5,
            markerfacecolor=colour if filled else "white",
            linestyle="-" if filled else "--",
        )
        if filled:
            _name_settings(axes, curve, places)
            _write(axes, engine, places[0], _NAME_OFFSETS[engine], colour, size=9.0)


def _draw_legend(axes: Axes) -> None:
    """The legend of both cases; the engines are named next to their curves."""
    marks = {"case I": ("o", "black", "-"), "case II": ("s", "white", "--")}
    handles = [
        Line2D([], [], color="black", marker=marker, markersize=3.5, markerfacecolor=face, ls=line)
        for marker, face, line in marks.values()
    ]
    axes.legend(handles, list(marks), loc="lower right", borderaxespad=1.0)


def _name_settings(axes: Axes, curve: list[Point], places: list[tuple[float, float]]) -> None:
    """The setting of the first and the last point, and of our default."""
    for point, place in zip(curve, places, strict=True):
        colour = paint(_COLOURS[point.engine])
        if point.engine == OURS:
            default = ", the default" if point.setting == _DEFAULT_TOLERANCE else ""
            exponent = round(math.log10(point.setting))
            if default or point in (curve[0], curve[-1]):
                words = f"tolerance $10^{{{exponent}}}${default}"
                _write(axes, words, place, (6, -2.5), colour)
        elif point in (curve[0], curve[-1]):
            side = -6 if point is curve[0] else 6
            _write(axes, f"{1e3 * point.setting:g} ms", place, (side, -2.5), colour)


def _write(
    axes: Axes,
    words: str,
    place: tuple[float, float],
    offset: tuple[float, float],
    colour: tuple[float, float, float],
    size: float = 7.0,
) -> None:
    """Text next to a point: on its left if the offset [pt] is negative."""
    axes.annotate(
        words,
        place,
        offset,
        textcoords="offset points",
        ha="right" if offset[0] < 0 else "left",
        fontsize=size,
        color=colour,
    )


def _draw_cost(axes: Axes, scaling: Scaling, labels: dict[str, tuple[int, float, float]]) -> None:
    """Both curves; a label gives the index of its point and its offset from it [pt]."""
    for control, (index, *offset) in labels.items():
        places = _places(scaling, control)
        colour = paint(_COLOURS[control])
        axes.plot(*zip(*places, strict=True), color=colour, marker="o", markersize=3.5)
        _write(axes, f"{control} control", places[index], (offset[0], offset[1]), colour, size=8.5)


def _draw_guide(axes: Axes, scaling: Scaling, power: int, name: str) -> None:
    """The cost of the first continuous run, extrapolated with a power."""
    size, cost = _places(scaling, "continuous")[0]
    ends = [(size, cost), (scaling.sizes[-1], cost * (scaling.sizes[-1] / size) ** power)]
    grey = paint(MUTED)
    axes.plot(*zip(*ends, strict=True), color=grey, linewidth=0.7, linestyle=":", zorder=0)
    _write(axes, name, ends[-1], (3, -2.5), grey, size=8.5)


def _places(scaling: Scaling, control: str) -> list[tuple[float, float]]:
    costs = [MILLISECONDS * seconds for seconds in scaling.seconds[control]]
    return list(zip(scaling.sizes, costs, strict=True))


def _plain(value: float, _position: float) -> str:
    return f"{value:g}"


def draw_assumptions(choices: Sequence[Choice]) -> Figure:
    """Slip path of both cases, one row per choice, the largest effect on top."""
    with paper_style():
        row, top = 4.2, 12.0
        figure = new_figure(top + row * len(choices) + 12.0)
        for column, words in enumerate(("(a) case I", "(b) case II")):
            height = row * len(choices)
            axes = add_axes(figure, 74.0 + 54.0 * column, top, 48.0, height)
            _draw_choices(axes, choices, column)
            axes.set_title(words, loc="left", fontsize=8.5)
            axes.set_yticks(range(len(choices)), [choice.name for choice in choices])
            axes.tick_params(labelleft=column == 0, axis="y", length=0)
        return figure


def _draw_choices(axes: Axes, choices: Sequence[Choice], column: int) -> None:
    pairs = [(k, pair) for k, c in enumerate(choices) if (pair := c.runs[column]) is not None]
    default = 1e3 * longest_path(pairs[0][1][0])
    axes.axvline(default, color=paint(MUTED), linewidth=0.7)
    for place, (_, other) in pairs:
        path = 1e3 * max(longest_path(other), SHORTEST)
        held = other.metrics.held
        colour = paint(PHASES[ContactPhase.STICK if held else ContactPhase.SLIP_FORWARD])
        axes.plot([default, path], [place, place], color=colour, linewidth=0.9)
        axes.plot(path, place, "o" if held else "X", color=colour, markersize=3.5)
    axes.set(xscale="log", xlim=(7e-3, 300.0), ylim=(len(choices) - 0.4, -0.6))
    axes.set_xlabel("longest slip path [mm]")
