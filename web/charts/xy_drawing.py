"""Drawing of an XY chart: an SVG with axes, and the position of the play head."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from html import escape

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.trace.trace import Trace
from slipgrasp.web.charts.chart import Line
from slipgrasp.web.charts.columns import Drawing
from slipgrasp.web.charts.xy import XyChart
from slipgrasp.web.model.charts_view import ChartsView
from slipgrasp.web.model.colours import css, legible
from slipgrasp.web.model.playback import TimeWindow
from slipgrasp.web.model.sampling import locate
from slipgrasp.web.model.ticks import ticks_of

Values = NDArray[np.float64]

# Sizes in the drawing, which scales with the width of its panel.
_WIDTH, _FLAT, _SQUARE = 340.0, 190.0, 300.0
_LEFT, _RIGHT, _TOP, _BELOW = 52.0, 10.0, 6.0, 34.0
_MARGIN = 0.05
_NO_LENGTH = 1e-12
_PALE = 0.4


@dataclass(frozen=True, slots=True)
class Scale:
    """Range of values in the frame of a drawing, and position of the frame.

    Attributes:
        low: Smallest horizontal and vertical value.
        high: Largest values.
        height: Height of the drawing.
    """

    low: tuple[float, float]
    high: tuple[float, float]
    height: float

    def place(self, across: Values, up: Values) -> tuple[Values, Values]:
        """Positions of values in the drawing, from the left and from the top."""
        shares = [
            (values - low) / (high - low)
            for values, low, high in zip((across, up), self.low, self.high, strict=True)
        ]
        width, height = _WIDTH - _LEFT - _RIGHT, self.height - _TOP - _BELOW
        return _LEFT + width * shares[0], _TOP + height * (1.0 - shares[1])


@dataclass(frozen=True, slots=True, eq=False)
class Curves:
    """Curves in a time range.

    Attributes:
        lines: Vertical values.
        drawn: Points of each curve, across and upwards, shape ``(2, points)``.
        across: Horizontal values of each line, for locating the play head.
        times: Times of the rows of all [s].
    """

    lines: tuple[Line, ...]
    drawn: tuple[Values, ...]
    across: tuple[Values, ...] = ()
    times: Values = field(default_factory=lambda: np.empty(0))

    @classmethod
    def of(cls, trace: Trace, xy: XyChart, hidden: frozenset[str], window: TimeWindow) -> Curves:
        """The visible curves in a window."""
        both = zip(xy.chart.lines, xy.across, strict=True)
        shown = [(line, across) for line, across in both if line.key not in hidden]
        lines = tuple(line for line, _ in shown)
        acrosses = tuple(across for _, across in shown)
        # The horizontal values take part in the selection of rows, as additional lines.
        sideways = [replace(line, values=across) for line, across in shown]
        chart = replace(xy.chart, lines=(*lines, *sideways), bands=())
        _, _, *columns = Drawing.of(trace, chart, window).columns()
        count = len(lines)
        drawn = tuple(np.array([columns[count + i], columns[i]]) for i in range(count))
        return cls(lines, drawn, acrosses, trace.times)

    def at(self, seconds: float) -> Values:
        """Point of each curve at a time [s], horizontal and vertical, shape ``(curves, 2)``."""
        spot = locate(self.times, seconds)
        both = zip(self.across, self.lines, strict=True)
        places = [[float(spot.read(x)), float(spot.read(line.values))] for x, line in both]
        return np.array(places).reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class DrawnXy:
    """A drawn XY chart.

    Attributes:
        xy: The chart with all its curves.
        hidden: Keys of the hidden curves.
        own: The drawn curves.
        ghost: Those of another run, if there is one.
    """

    xy: XyChart
    hidden: frozenset[str]
    own: Curves
    ghost: Curves | None = None

    @cached_property
    def scale(self) -> Scale:
        """A scale that includes every curve, and the origin of a cone or a whole disc."""
        curves = [*self.own.drawn, *(self.ghost.drawn if self.ghost else ())]
        points = [curve.T for curve in curves]
        points += [outline[:1] for outline in self.xy.outlines]
        if self.xy.is_true_to_scale:
            points += self.xy.outlines
        least = np.array([self.xy.least_across, self.xy.chart.least])
        stacked = np.concatenate([*points, [-least, least]] if least.any() else points or [[least]])
        low, high = np.nanmin(stacked, axis=0), np.nanmax(stacked, axis=0)
        margin = np.maximum(_MARGIN * (high - low), _NO_LENGTH + 1e-3 * np.abs(high))
        low, high = low - margin, high + margin
        if self.xy.span is not None:
            low[0], high[0] = self.xy.span
        return _scale(low, high, is_square=self.xy.is_true_to_scale)

    @property
    def largest(self) -> float:
        """The largest absolute vertical value of the run."""
        sizes = [float(np.nanmax(np.abs(up), initial=0.0)) for _, up in self.own.drawn]
        return max([self.xy.chart.least, *sizes])

    def spots(self, seconds: float) -> list[list[float | None]]:
        """Position of each curve at a time [s], from the left and the top; None if undefined."""
        left, top = self.scale.place(*self.own.at(seconds).T)
        places = np.round(np.column_stack([left, top]), 1).tolist()
        return [[each if math.isfinite(each) else None for each in place] for place in places]


def _scale(low: Values, high: Values, *, is_square: bool) -> Scale:
    """The scale between two corners; with equal scales the shorter side is extended."""
    height = _SQUARE if is_square else _FLAT
    if is_square:
        sides = np.array([_WIDTH - _LEFT - _RIGHT, height - _TOP - _BELOW])
        half = 0.5 * sides * float(np.max((high - low) / sides))
        middle = 0.5 * (low + high)
        low, high = middle - half, middle + half
    (x0, y0), (x1, y1) = low.tolist(), high.tolist()
    return Scale((x0, y0), (x1, y1), height)


def xy_svg(drawn: DrawnXy, *, dark: bool) -> str:
    """The drawing; the page's script moves the spots of the play head and of the cursor."""
    scale, chart = drawn.scale, drawn.xy.chart
    lines = [*_curves(scale, drawn.ghost, _PALE, dark)] if drawn.ghost else []
    lines += _curves(scale, drawn.own, 1.0, dark)
    lines += [
        f"<path class='sg-xy-outline' d='{_path(*scale.place(*points.T))}'/>"
        for points in drawn.xy.outlines
    ]
    spots = "".join(
        f"<circle {kind} r='0' fill='{css(legible(line.colour, dark=dark))}'/>"
        for kind in ("data-sg-marked", "data-sg-spot")
        for line in drawn.own.lines
    )
    box = f"x='{_LEFT}' y='{_TOP}' width='{_WIDTH - _LEFT - _RIGHT}' " + (
        f"height='{scale.height - _TOP - _BELOW}'"
    )
    clip = f"sg-clip-{chart.key}"
    unit = "" if chart.unit == "1" else chart.unit
    up = f"x='11' y='{0.5 * (_TOP + scale.height - _BELOW)}'"
    turned = f"transform='rotate(-90 11 {0.5 * (_TOP + scale.height - _BELOW)})'"
    across = f"x='{0.5 * (_LEFT + _WIDTH - _RIGHT)}' y='{scale.height - 4}'"
    return (
        f"<svg class='sg-xy' data-sg-xy='{escape(chart.key)}' "
        f"viewBox='0 0 {_WIDTH:g} {scale.height:g}' role='img' "
        f"aria-label='{escape(chart.title)}'><clipPath id='{escape(clip)}'><rect {box}/></clipPath>"
        f"{_grid(scale)}<g clip-path='url(\"#{escape(clip)}\")'>{''.join(lines)}</g>"
        f"<rect class='sg-xy-frame' {box}/>{spots}"
        f"<text {up} {turned}>{escape(unit)}</text>"
        f"<text {across}>{escape(drawn.xy.across_words)}</text></svg>"
    )


def frame_style(drawn: DrawnXy) -> str:
    """Position of the frame in the drawing, as CSS."""
    height = drawn.scale.height
    sides = {"left": _LEFT / _WIDTH, "right": _RIGHT / _WIDTH}
    sides |= {"top": _TOP / height, "bottom": _BELOW / height}
    return ";".join(f"{side}:{100.0 * share:.3f}%" for side, share in sides.items())


def _grid(scale: Scale) -> str:
    """Lines at round values, with their numbers."""
    marks: list[str] = []
    for value in ticks_of(scale.low[0], scale.high[0]):
        left = float(scale.place(np.array(value), np.array(0.0))[0])
        bottom = scale.height - _BELOW
        marks.append(f"<path class='sg-xy-grid' d='M{left:.1f} {_TOP}V{bottom}'/>")
        marks.append(f"<text x='{left:.1f}' y='{bottom + 13}'>{value:.6g}</text>")
    for value in ticks_of(scale.low[1], scale.high[1]):
        top = float(scale.place(np.array(0.0), np.array(value))[1])
        marks.append(f"<path class='sg-xy-grid' d='M{_LEFT} {top:.1f}H{_WIDTH - _RIGHT}'/>")
        place = f"x='{_LEFT - 4}' y='{top + 3.5:.1f}'"
        marks.append(f"<text class='sg-xy-up' {place}>{value:.6g}</text>")
    return "".join(marks)


def _curves(scale: Scale, curves: Curves, opacity: float, dark: bool) -> Iterator[str]:
    """Overlaid curves; lower ones are wider, so that coincident curves remain visible."""
    for i, (line, points) in enumerate(zip(curves.lines, curves.drawn, strict=True)):
        width = 1.5 + 2.0 * (1.0 - (i + 1) / len(curves.lines))
        dash = " stroke-dasharray='5 4'" if line.dashed else ""
        stroke = css(legible(line.colour, dark=dark), opacity)
        path = _path(*scale.place(*points))
        yield f"<path d='{path}' stroke='{stroke}' stroke-width='{width:.2f}'{dash}/>"


def _path(left: Values, top: Values) -> str:
    """Straight lines through points; NaN starts a new line."""
    parts: list[str] = []
    is_on = False
    for x, y in zip(np.round(left, 1).tolist(), np.round(top, 1).tolist(), strict=True):
        if x != x or y != y:
            is_on = False
            continue
        parts.append(f"{'L' if is_on else 'M'}{x:g} {y:g}")
        is_on = True
    return "".join(parts)


def drawn_xy(
    trace: Trace,
    charts: Sequence[XyChart],
    window: TimeWindow,
    charts_view: ChartsView,
    ghost: tuple[Trace, Sequence[XyChart]] | None = None,
) -> list[DrawnXy]:
    """The XY charts of a run.

    Args:
        trace: The run.
        charts: Its charts.
        window: The time range.
        charts_view: Hidden curves.
        ghost: Another run with its charts, of which the corresponding ones are drawn.
    """
    others = {xy.chart.key: xy for xy in ghost[1]} if ghost else {}
    found: list[DrawnXy] = []
    for xy in charts:
        hidden = charts_view.hidden_in(xy.chart.key)
        own = Curves.of(trace, xy, hidden, window)
        other = others.get(xy.chart.key)
        pale = Curves.of(ghost[0], other, hidden, window) if ghost and other else None
        found.append(DrawnXy(xy, hidden, own, pale))
    return found
