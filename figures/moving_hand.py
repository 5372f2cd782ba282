"""Draws the hand at successive times, and the slips of its fingertips."""

from __future__ import annotations

from collections.abc import Callable
from textwrap import fill, shorten
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.trace import rows_from_start
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.figures.centre_mark import CentreMark
from slipgrasp.figures.hand_motion import HandMotion
from slipgrasp.figures.lenses import add_lenses
from slipgrasp.figures.marks import arrow_outline, empty_line
from slipgrasp.figures.moving_lens import MovingLens
from slipgrasp.figures.panels import finger_colour, lighter
from slipgrasp.figures.phases import draw_lanes, name_lanes, phase_patches
from slipgrasp.figures.sheet import ending_words
from slipgrasp.figures.slip_times import Window
from slipgrasp.figures.style import paint
from slipgrasp.recordings.palette import (
    CONE,
    GHOST,
    JOINT,
    LINK,
    MARK,
    MUTED,
    OBJECT,
    OBJECT_EDGE,
    PHASES,
)
from slipgrasp.scene.sizes import sizes_of
from slipgrasp.scene.states import drawable

Pixels = NDArray[np.uint8]

SIZE = (6.4, 5.6)
"""Default width and height of an image [inches]."""

# Margin around the object in its largest radii; for other parts, as a fraction of the image.
_MARGIN = 0.35
_FORCE_LENGTH = 0.22
_CONE_LENGTH = 0.16
_SHAFT, _HEAD = 0.012, 0.04
_TIP_RADIUS = 0.022
_LINK_WIDTH = 0.05
"""Width of a finger [m], at most `_WIDEST_LINK` times the span."""
_WIDEST_LINK = 0.09
_GLASS, _BEHIND = 0.75, 2.0  # of a spatial object, and of parts behind it
_TITLE_WIDTH = 75
_CHART_TOP, _LANE, _LEAST_LANES = 0.36, 0.0165, 0.035  # fractions of the image
_POINTS_PER_INCH = 72.0


class _Scale(NamedTuple):
    """Scales of the drawing.

    Attributes:
        span: Larger side of the range that is always shown [m].
        points_per_metre: Size of a metre [points].
        metres_per_newton: Length of an arrow per newton.
    """

    span: float
    points_per_metre: float
    metres_per_newton: float

    @property
    def link_width(self) -> float:
        """Width of a link [m]."""
        return min(_LINK_WIDTH, _WIDEST_LINK * self.span)


class MovingHand:
    """Draws a run at successive times; must be used inside `style.screen_style`.

    Args:
        result: The run.
        motion: Positions at the times to draw.
        window: Time range of the chart.
        clock: Formats a time.
        size: Width and height of the image [px]; the font scales with its height.
    """

    def __init__(
        self,
        result: RunResult,
        motion: HandMotion,
        window: Window,
        clock: Callable[[float], str],
        size: tuple[int, int],
    ) -> None:
        self._motion, self._tell = motion, clock
        dpi = size[1] / SIZE[1]
        self._figure = Figure(figsize=(size[0] / dpi, SIZE[1]), dpi=dpi)
        self._canvas = FigureCanvasAgg(self._figure)
        hand = self._figure.add_axes((0.0, 0.36, 1.0, 0.56))
        scale = _show_what_is_held(hand, motion)
        self._ghost = Polygon(
            motion.desired[0], gid="desired", fill=False, ec=paint(GHOST), ls="--", lw=1.0
        )
        body, edge = paint(OBJECT), paint(OBJECT_EDGE)
        self._body = Polygon(motion.corners[0], gid="object", fc=body, ec=edge, lw=1.0)
        self._edges = LineCollection([], colors=[edge], linewidths=0.8)
        hand.add_patch(self._ghost)
        hand.add_patch(self._body)
        hand.add_collection(self._edges)
        chart = _draw_chart(self._figure, result, window)
        self._cursor = chart.axvline(0.0, color=paint(MARK), linewidth=0.8)
        self._parts: list[_Finger | CentreMark | MovingLens] = [
            _Finger(hand, chart, motion, i, scale) for i in range(motion.slip.shape[1])
        ]
        if result.scenario.space.num_positions == 3:
            self._body.set_alpha(_GLASS)
        else:
            inner_radius = sizes_of(result.scenario).inner_radius
            self._parts.append(CentreMark(hand, inner_radius, motion.states.object_pose))
        self._parts += add_lenses(hand, result, motion)
        self._clock = self._figure.text(0.98, 0.955, "", ha="right", va="center", fontsize=11)
        self._ending = self._figure.text(0.5, 0.895, "", ha="center", va="center", fontsize=10)
        self._last_words = ending_words(result)
        title = shorten(result.name, 2 * _TITLE_WIDTH, placeholder=" …")
        words = fill(title, _TITLE_WIDTH).replace("$", r"\$")
        self._figure.text(0.02, 0.955, words, va="center", fontsize=8.5)
        self._moving = self._collect()
        for artist in self._moving:
            artist.set_animated(True)
        self._canvas.draw()
        self._still = self._canvas.copy_from_bbox(self._figure.bbox)

    def _collect(self) -> list[Artist]:
        """The moving artists, from back to front."""
        parts = [artist for part in self._parts for artist in part.artists]
        body = [self._ghost, self._body, self._edges, self._cursor]
        words = [self._clock, self._ending]
        return sorted([*body, *parts, *words], key=lambda artist: artist.get_zorder())

    def draw(self, frame: int) -> Pixels:
        """Draws the image of one time.

        Args:
            frame: Index of the time.

        Returns:
            Red, green and blue, shape ``(height, width, 3)``.
        """
        self._place_all(frame)
        self._canvas.restore_region(self._still)
        for artist in self._moving:
            artist.draw(self._canvas.get_renderer())
        return np.asarray(self._canvas.buffer_rgba())[..., :3].copy()

    def draw_figure(self, frame: int) -> Figure:
        """Returns the figure of one time for saving; the object cannot be used afterwards."""
        self._place_all(frame)
        for artist in self._moving:
            artist.set_animated(False)
        return self._figure

    def _place_all(self, frame: int) -> None:
        motion = self._motion
        times = motion.states.times
        time = float(times[frame])
        self._ghost.set_xy(motion.desired[frame])
        self._body.set_xy(motion.corners[frame])
        self._edges.set_segments(list(motion.edges[frame]))
        self._cursor.set_xdata([time, time])
        self._clock.set_text(self._tell(time).replace("t", "$t$", 1))
        is_last = frame == len(times) - 1
        self._ending.set_text(self._last_words if is_last else "")
        for part in self._parts:
            part.place(frame)


class _Finger:
    """A finger with its contact at successive times, and its slip in the chart.

    Args:
        hand: The picture of the hand.
        chart: The chart of the slips.
        motion: Positions at the times to draw.
        index: Index of the finger.
        scale: Scales of the drawing.
    """

    def __init__(
        self, hand: Axes, chart: Axes, motion: HandMotion, index: int, scale: _Scale
    ) -> None:
        self._motion, self._index, self._scale = motion, index, scale
        width = scale.points_per_metre * scale.link_width
        bar: dict[str, Any] = {"solid_capstyle": "round", "solid_joinstyle": "round"}
        dot: dict[str, Any] = {"marker": "o", "ls": "", "mec": paint(JOINT), "mew": 0.8}
        self._bars = (
            empty_line(hand, 2.4, color=paint(JOINT), lw=width + 1.6, **bar),
            empty_line(hand, 2.5, color=paint(lighter(LINK, 0.3)), lw=width, **bar),
        )
        self._joints = empty_line(hand, 2.6, ms=width, mfc=paint(lighter(LINK, 0.7)), **dot)
        grey: dict[str, Any] = {"fc": paint(lighter(CONE, 0.45)), "alpha": 0.45, "lw": 0.0}
        self._cone = Polygon(np.zeros((3, 2)), gid=f"cone-{index}", zorder=2.2, **grey)
        self._force = Polygon(np.zeros((3, 2)), gid=f"force-{index}", lw=0.0, zorder=3.3)
        hand.add_patch(self._cone)
        hand.add_patch(self._force)
        dot["ms"] = scale.points_per_metre * (2.0 * _TIP_RADIUS * scale.span)
        self._tip = empty_line(hand, 3.4, gid=f"fingertip-{index}", **dot)
        in_chart = dot | {"ms": 5.0, "mec": paint(finger_colour(index))}
        self._slip = empty_line(chart, 3.0, **in_chart)
        if motion.behind[index]:
            for part in (*self._bars, self._joints):
                part.set_zorder(part.get_zorder() - _BEHIND)

    @property
    def artists(self) -> tuple[Artist, ...]:
        """All artists."""
        on_contact = (self._cone, self._force, self._tip)
        return (*self._bars, self._joints, *on_contact, self._slip)

    def place(self, frame: int) -> None:
        """Shows a frame."""
        motion, index, scale = self._motion, self._index, self._scale
        tip, normal = motion.joints[frame, index, -1], motion.normals[frame, index]
        # The ball touches the face from outside; the round end of the link ends behind it.
        ball = tip - _TIP_RADIUS * scale.span * normal
        points = _shortened(motion.joints[frame, index], ball, 0.5 * scale.link_width)
        for part in self._bars:
            part.set_data(*points.T)
        self._joints.set_data(*points[:-1].T)
        self._tip.set_data(*ball[:, None])
        colour = paint(PHASES[ContactPhase(int(motion.states.phases[frame, index]))])
        self._tip.set_markerfacecolor(colour)
        self._cone.set_xy(tip + _CONE_LENGTH * scale.span * motion.cones[frame, index])
        force = scale.metres_per_newton * motion.forces[frame, index]
        arrow = arrow_outline(tip, force, _SHAFT * scale.span, _HEAD * scale.span)
        self._force.set_xy(arrow)
        self._force.set_color(colour)
        self._slip.set_data([motion.states.times[frame]], [1e3 * motion.slip[frame, index]])
        self._slip.set_markerfacecolor(colour)


def _show_what_is_held(axes: Axes, motion: HandMotion) -> _Scale:
    """Sets limits that always include the object and its fingertips."""
    points = np.concatenate([motion.corners, motion.desired]).reshape(-1, 2)
    radius = 0.5 * float(np.hypot(*np.ptp(motion.corners[0], axis=0)))
    low, high = points.min(axis=0) - _MARGIN * radius, points.max(axis=0) + _MARGIN * radius
    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    size = figure.get_size_inches() * axes.get_position().size
    # Both directions have the same scale, the larger of the required ones.
    scale = float(((high - low) / size).max())
    middle, half = 0.5 * (low + high), 0.5 * scale * size
    axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
    axes.set_ylim(middle[1] - half[1], middle[1] + half[1])
    axes.set_axis_off()
    span = float((high - low).max())
    strength = float(np.hypot(*np.moveaxis(motion.forces, -1, 0)).max())
    return _Scale(span, _POINTS_PER_INCH / scale, _FORCE_LENGTH * span / max(strength, 1e-9))


def _shortened(
    joints: NDArray[np.float64], ball: NDArray[np.float64], gap: float
) -> NDArray[np.float64]:
    """The joints of a finger, whose last link ends at a gap from the centre of its fingertip."""
    along = ball - joints[-2]
    length = max(float(np.hypot(*along)), 1e-9)
    return np.concatenate([joints[:-1], [joints[-2] + max(1.0 - gap / length, 0.0) * along]])


def _draw_chart(figure: Figure, result: RunResult, window: Window) -> Axes:
    """The slips in a time range of the run, with the phases above them and the legend."""
    contacts = range(result.trace.shape.num_contacts)
    top = _CHART_TOP - max(_LANE * len(contacts), _LEAST_LANES)
    strip = figure.add_axes((0.1, top, 0.87, _CHART_TOP - top))
    draw_lanes(strip, result, contacts, window)
    name_lanes(strip, result, contacts, offset=0.008)
    chart = figure.add_axes((0.1, 0.125, 0.87, top - 0.135))
    rows = rows_from_start(result.trace)
    slips = result.trace.slip_of_contacts
    for i in contacts:
        colour = paint(lighter(finger_colour(i), 0.2))
        values = 1e3 * drawable(slips[rows, i])
        name = result.scenario.finger_names[i]
        chart.plot(result.trace.times[rows], values, color=colour, label=name)
    chart.axhline(0.0, color=paint(lighter(MUTED, 0.4)), linewidth=0.5, zorder=1.0)
    chart.set_xlim(*window)
    chart.margins(y=0.15)
    chart.set_xlabel("$t$ [s]", labelpad=1.0)
    chart.set_ylabel(f"{result.scenario.space.slip_words} [mm]", fontsize=7.0)
    chart.legend(loc="best", ncols=3, borderaxespad=0.5)
    patches = phase_patches(result)
    figure.legend(handles=patches, loc="lower center", ncols=3, handlelength=1.2, fontsize=8.5)
    return chart
