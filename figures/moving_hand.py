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
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.trace import rows_from_start
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.figures.centre_mark import CentreMark
from slipgrasp.figures.hand_motion import HandMotion
from slipgrasp.figures.lenses import add_lenses
from slipgrasp.figures.marks import arrow_outline
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


class _Finger(NamedTuple):
    """The moving parts of one finger."""

    outline: Line2D
    links: Line2D
    joints: Line2D
    cone: Polygon
    force: Polygon
    tip: Line2D
    slip: Line2D


class _Sizes(NamedTuple):
    """Width of a link, and of a fingertip [points]."""

    link: float
    tip: float


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
        self._span, points_per_metre = _show_what_is_held(hand, motion)
        strength = float(np.hypot(*np.moveaxis(motion.forces, -1, 0)).max())
        self._metres_per_newton = _FORCE_LENGTH * self._span / max(strength, 1e-9)
        self._arrow = _SHAFT * self._span, _HEAD * self._span
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
        count = motion.slip.shape[1]
        self._link_width = min(_LINK_WIDTH, _WIDEST_LINK * self._span)
        width, dot = self._link_width, 2.0 * _TIP_RADIUS * self._span
        sizes = _Sizes(points_per_metre * width, points_per_metre * dot)
        self._fingers = [_add_finger(hand, chart, i, sizes) for i in range(count)]
        self._centre: CentreMark | None = None
        if result.scenario.space.num_positions == 3:
            self._body.set_alpha(_GLASS)
            for part in (p for i in np.flatnonzero(motion.behind) for p in self._fingers[i][:3]):
                part.set_zorder(part.get_zorder() - _BEHIND)
        else:
            self._centre = CentreMark(hand, sizes_of(result.scenario).inner_radius)
        self._lenses = add_lenses(hand, result, motion)
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
        fingers = [part for finger in self._fingers for part in finger]
        lenses = [part for lens in self._lenses for part in lens.artists]
        centre = () if self._centre is None else self._centre.artists
        words = [self._clock, self._ending]
        body = [self._ghost, self._body, self._edges, *centre]
        return sorted(
            [*body, self._cursor, *fingers, *lenses, *words],
            key=lambda a: a.get_zorder(),
        )

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
        for i, finger in enumerate(self._fingers):
            self._place(finger, i, frame)
        if self._centre is not None:
            self._centre.place(motion.states.object_pose[frame])
        for lens in self._lenses:
            lens.place(frame)

    def _place(self, finger: _Finger, index: int, frame: int) -> None:
        motion = self._motion
        tip, normal = motion.joints[frame, index, -1], motion.normals[frame, index]
        # The ball touches the face from outside; the round end of the link ends behind it.
        ball = tip - _TIP_RADIUS * self._span * normal
        points = _shortened(motion.joints[frame, index], ball, 0.5 * self._link_width)
        for part in (finger.outline, finger.links):
            part.set_data(*points.T)
        finger.joints.set_data(*points[:-1].T)
        finger.tip.set_data(*ball[:, None])
        phase = ContactPhase(int(motion.states.phases[frame, index]))
        colour = paint(PHASES[phase])
        finger.tip.set_markerfacecolor(colour)
        finger.cone.set_xy(tip + _CONE_LENGTH * self._span * motion.cones[frame, index])
        force = self._metres_per_newton * motion.forces[frame, index]
        finger.force.set_xy(arrow_outline(tip, force, *self._arrow))
        finger.force.set_color(colour)
        finger.slip.set_data([motion.states.times[frame]], [1e3 * motion.slip[frame, index]])
        finger.slip.set_markerfacecolor(colour)


def _show_what_is_held(axes: Axes, motion: HandMotion) -> tuple[float, float]:
    """Sets limits that always include the object and its fingertips.

    Returns:
        The larger span of the guaranteed range [m], and the size of a metre [points].
    """
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
    return float((high - low).max()), _POINTS_PER_INCH / scale


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


def _add_finger(hand: Axes, chart: Axes, index: int, sizes: _Sizes) -> _Finger:
    def line(axes: Axes, zorder: float, **style: Any) -> Line2D:
        (drawn,) = axes.plot([], [], zorder=zorder, **style)
        return drawn

    edge = paint(JOINT)
    links: dict[str, Any] = {"solid_capstyle": "round", "solid_joinstyle": "round"}
    dot: dict[str, Any] = {
        "marker": "o",
        "linestyle": "",
        "markeredgecolor": edge,
        "markeredgewidth": 0.8,
    }
    grey: dict[str, Any] = {"fc": paint(lighter(CONE, 0.45)), "alpha": 0.45, "lw": 0.0}
    cone = Polygon(np.zeros((3, 2)), gid=f"cone-{index}", zorder=2.2, **grey)
    force = Polygon(np.zeros((3, 2)), gid=f"force-{index}", lw=0.0, zorder=3.3)
    hand.add_patch(cone)
    hand.add_patch(force)
    return _Finger(
        outline=line(hand, 2.4, color=edge, linewidth=sizes.link + 1.6, **links),
        links=line(hand, 2.5, color=paint(lighter(LINK, 0.3)), linewidth=sizes.link, **links),
        joints=line(
            hand, 2.6, markersize=sizes.link, markerfacecolor=paint(lighter(LINK, 0.7)), **dot
        ),
        cone=cone,
        force=force,
        tip=line(hand, 3.4, gid=f"fingertip-{index}", markersize=sizes.tip, **dot),
        slip=line(
            chart, 3.0, markersize=5.0, **{**dot, "markeredgecolor": paint(finger_colour(index))}
        ),
    )
