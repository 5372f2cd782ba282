"""Marks of technical drawings: arrows, angles, lines and labels, sized in mm on the page."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from slipgrasp.figures.style import add_box, paint
from slipgrasp.recordings.palette import MARK, Rgb

Point = NDArray[np.float64]
Frame = tuple[float, float, float, float]
Borders = tuple[float, float, float, float]

_HEAD = 6.0
_LINE = 0.8
_THIN = 0.5


class Drawing(NamedTuple):
    """Axes in metres with equal scales, and the length of one millimetre on the page.

    Attributes:
        axes: Axes to draw on.
        mm: Length that corresponds to one millimetre on the page [m].
        halo: Whether labels have a white border, for legibility on lines.
    """

    axes: Axes
    mm: float
    halo: bool

    def arrow(
        self,
        start: Point,
        end: Point,
        colour: Rgb = MARK,
        *,
        both: bool = False,
        width: float = _LINE,
    ) -> None:
        """A straight arrow with a head at its end, or at both ends."""
        self._path(np.stack([start, end]), colour, width, "<|-|>" if both else "-|>")

    def angle(self, centre: Point, start: float, end: float, radius: float, label: str) -> None:
        """An arc with an arrow head between two directions [rad], with its radius in mm."""
        turns = np.linspace(start, end, 40)
        arc = centre + radius * self.mm * np.stack([np.cos(turns), np.sin(turns)], axis=1)
        self.line(*arc)
        # A head on an arc would bend: the last part is drawn as a straight arrow.
        back = math.copysign(min(1.8 / radius, abs(end - start)), end - start)
        self.arrow(centre + radius * self.mm * unit(end - back), arc[-1], width=_THIN)
        middle = 0.5 * (start + end)
        self.write(centre + (radius + 3.0) * self.mm * unit(middle), label)

    def line(
        self, *points: Point, colour: Rgb = MARK, width: float = _THIN, style: str = "-"
    ) -> None:
        """A polyline with round ends, with its width in points."""
        xs, ys = np.stack(points).T
        self.axes.plot(
            xs,
            ys,
            linestyle=style,
            color=paint(colour),
            linewidth=width,
            solid_capstyle="round",
        )

    def dot(self, point: Point, size: float, face: Rgb, edge: Rgb) -> None:
        """A circle, with its diameter in points."""
        self.axes.plot(
            *point,
            marker="o",
            markersize=size,
            markerfacecolor=paint(face),
            markeredgecolor=paint(edge),
            markeredgewidth=0.8,
        )

    def write(self, point: Point, text: str, *, turn: float = 0.0, colour: Rgb = MARK) -> None:
        """Text centred at a point, rotated by an angle [rad] but never upside down."""
        upright = (math.degrees(turn) + 90.0) % 180.0 - 90.0
        x, y = point.tolist()
        halo = [withStroke(linewidth=2.0, foreground="white")] if self.halo else None
        self.axes.text(
            x,
            y,
            text.replace("-", "−"),
            ha="center",
            va="center",
            rotation=upright,
            rotation_mode="anchor",
            color=paint(colour),
            path_effects=halo,
            zorder=4.0,
        )

    def _path(self, points: Point, colour: Rgb, width: float, style: str) -> None:
        arrow = FancyArrowPatch(
            path=Path(points),
            arrowstyle=style,
            mutation_scale=_HEAD,
            linewidth=width,
            color=paint(colour),
            shrinkA=0.0,
            shrinkB=0.0,
            joinstyle="miter",
            capstyle="butt",
            zorder=3.0,
        )
        self.axes.add_patch(arrow)


def new_drawing(
    figure: Figure, frame: Frame, points: Point, borders: Borders, *, halo: bool
) -> Drawing:
    """Axes without ticks that show the points as large as their frame allows.

    Args:
        figure: The page.
        frame: Left, top, width and height on the page [mm].
        points: Points to include, shape ``(points, 2)`` [m].
        borders: Space for labels left, below, right and above [mm].
        halo: Whether labels have a white border.
    """
    axes = add_box(figure, *frame)
    left, below, right, above = borders
    low, high = points.min(axis=0), points.max(axis=0)
    available = np.array([frame[2] - left - right, frame[3] - below - above])
    mm = float(np.max((high - low) / available))
    spare = 0.5 * (available - (high - low) / mm)
    start = low - mm * (spare + np.array([left, below]))
    axes.set_xlim(start[0], start[0] + mm * frame[2])
    axes.set_ylim(start[1], start[1] + mm * frame[3])
    return Drawing(axes, mm, halo)


def empty_line(axes: Axes, zorder: float, **style: Any) -> Line2D:
    """A line to be placed later."""
    (drawn,) = axes.plot([], [], zorder=zorder, **style)
    return drawn


def unit(angle: float) -> Point:
    """The unit vector in a direction [rad]."""
    return np.array([math.cos(angle), math.sin(angle)])


def arrow_outline(tail: Point, along: Point, shaft: float, head: float) -> Point:
    """Corners of an arrow, shape ``(7, 2)``; a point if it has no length.

    Args:
        tail: Its start.
        along: Vector to its tip.
        shaft: Width of the shaft.
        head: Length of the head; a shorter arrow is a head alone.
    """
    length = float(np.hypot(*along))
    forward = along / length if length > 0.0 else np.zeros(2)
    aside = np.array([-forward[1], forward[0]])
    neck = max(length - head, 0.0)
    half, wide = 0.5 * shaft, 0.4 * min(head, length)
    corners = ((0.0, half), (neck, half), (neck, wide), (length, 0.0))
    left = [tail + forward * x + aside * y for x, y in corners]
    right = [tail + forward * x - aside * y for x, y in corners[-2::-1]]
    return np.stack([*left, *right])
