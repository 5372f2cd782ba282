"""A run as an animated GIF: the hand, and how far its fingertips have slipped."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from textwrap import fill, shorten
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from numpy.typing import NDArray
from PIL import Image

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.spatial import refuse_in_space
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.figures.hand_motion import HandMotion, drawable, motion_at
from slipgrasp.figures.panels import finger_colour, lighter
from slipgrasp.figures.phases import draw_lanes, name_lanes, phase_patches
from slipgrasp.figures.sheet import ending_words, rows_from_start
from slipgrasp.figures.slip_times import Window
from slipgrasp.figures.style import paint, paper_style
from slipgrasp.recordings.clip import WHOLE, Clip
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

MAX_FRAMES = 400
"""Most frames of a file; a run that is too long for them has fewer per second."""

_COLOURS = 256
_LAST_FRAME = 1500
_TICK = 0.01
"""GIF counts in hundredths of a second."""


def frame_times(result: RunResult, fps: float = 20.0, clip: Clip = WHOLE) -> NDArray[np.float64]:
    """When the frames are taken [s]: every hundredth of a second of the viewer's clock or less.

    Args:
        result: The run.
        fps: Frames per second, at most; rounded so that the film runs at its speed.
        clip: Which stretch of the run, and how slowly.
    """
    start, end = clip.span(result)
    step = clip.speed * _step(end - start, fps, clip)
    return np.append(np.arange(start, end - 1e-9 * step, step), end)


def write_gif(
    result: RunResult,
    stream: BinaryIO,
    progress: Callable[[float], None] | None = None,
    fps: float = 20.0,
    clip: Clip = WHOLE,
) -> None:
    """Writes a stretch of a run as an animated GIF that plays over and over.

    Args:
        result: The run.
        stream: Where the file goes; it must be seekable.
        progress: Told the share that is done, from 0 to 1.
        fps: Frames per second, at most; see `MAX_FRAMES`.
        clip: Which stretch, how slowly, and how high.

    Raises:
        ClipError: If nothing of the run lies in the clip.
    """
    refuse_in_space(result.scenario, "moving pictures")
    times = frame_times(result, fps, clip)
    start, end = clip.span(result)
    durations = [round(1000 * _step(end - start, fps, clip))] * (len(times) - 1) + [_LAST_FRAME]
    height = clip.height or round(_SIZE[1] * _DPI)
    with paper_style():
        size = round(height * _SIZE[0] / _SIZE[1]), height
        hand = MovingHand(result, motion_at(result, times), clip, size)
        frames = _frames(hand, len(times), progress)
        next(frames).save(
            stream,
            format="GIF",
            save_all=True,
            append_images=frames,
            duration=durations,
            loop=0,
        )


def _step(span: float, fps: float, clip: Clip) -> float:
    """Time from frame to frame on the viewer's clock, in whole hundredths of a second."""
    least = math.ceil(span / clip.speed / (MAX_FRAMES - 1) / _TICK)
    return _TICK * max(round(1.0 / fps / _TICK), least)


def _frames(
    hand: MovingHand, count: int, progress: Callable[[float], None] | None
) -> Iterator[Image.Image]:
    """All frames in one palette, so that what stands still needs no room in the file."""
    samples = np.concatenate([hand.draw(frame) for frame in (0, count // 2, count - 1)])
    palette = Image.fromarray(samples).quantize(_COLOURS, dither=Image.Dither.NONE)
    for frame in range(count):
        picture = Image.fromarray(hand.draw(frame))
        yield picture.quantize(palette=palette, dither=Image.Dither.NONE)
        if progress is not None:
            progress((frame + 1) / count)


Pixels = NDArray[np.uint8]

# Size of the picture [inches] and dots per inch, unless another one is asked for.
_SIZE = (6.4, 5.6)
_DPI = 100

_MARGIN = 0.08
_FORCE_LENGTH = 0.22
_CONE_LENGTH = 0.1
_TITLE_WIDTH = 75


class _Finger(NamedTuple):
    """The moving parts of one finger."""

    outline: Line2D
    links: Line2D
    joints: Line2D
    cone: Polygon
    force: Line2D
    head: Polygon
    tip: Line2D
    slip: Line2D


class MovingHand:
    """Draws a run at one time after the other; use it inside `style.paper_style`.

    Args:
        result: The run.
        motion: Where everything stands at the times to be drawn.
        clip: Which stretch of the run they are of.
        size: Width and height of the picture [px]; letters grow with its height.
    """

    def __init__(
        self, result: RunResult, motion: HandMotion, clip: Clip, size: tuple[int, int]
    ) -> None:
        self._motion, self._clip = motion, clip
        dpi = size[1] / _SIZE[1]
        self._figure = Figure(figsize=(size[0] / dpi, _SIZE[1]), dpi=dpi)
        self._canvas = FigureCanvasAgg(self._figure)
        hand = self._figure.add_axes((0.0, 0.36, 1.0, 0.56))
        self._span = _show_whole_motion(hand, motion)
        strength = float(np.hypot(*np.moveaxis(motion.forces, -1, 0)).max())
        self._metres_per_newton = _FORCE_LENGTH * self._span / max(strength, 1e-9)
        ghost: dict[str, Any] = {
            "fill": False,
            "edgecolor": paint(GHOST),
            "linestyle": "--",
            "linewidth": 1.0,
        }
        self._ghost = Polygon(motion.desired[0], **ghost)
        body: dict[str, Any] = {
            "facecolor": paint(OBJECT),
            "edgecolor": paint(OBJECT_EDGE),
            "linewidth": 1.0,
        }
        self._body = Polygon(motion.corners[0], **body)
        hand.add_patch(self._ghost)
        hand.add_patch(self._body)
        chart = _draw_chart(self._figure, result, Window(*clip.span(result)))
        self._cursor = chart.axvline(0.0, color=paint(MARK), linewidth=0.8)
        count = motion.slip.shape[1]
        self._fingers = [_add_finger(hand, chart, i) for i in range(count)]
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
        """What moves, from back to front."""
        fingers = [part for finger in self._fingers for part in finger]
        words = [self._clock, self._ending]
        return sorted(
            [self._ghost, self._body, self._cursor, *fingers, *words], key=lambda a: a.get_zorder()
        )

    def draw(self, frame: int) -> Pixels:
        """The picture at one of the times.

        Args:
            frame: Which time of the motion.

        Returns:
            Red, green and blue, shape ``(height, width, 3)``.
        """
        motion, time = self._motion, float(self._motion.times[frame])
        self._ghost.set_xy(motion.desired[frame])
        self._body.set_xy(motion.corners[frame])
        self._cursor.set_xdata([time, time])
        self._clock.set_text(self._clip.clock(time).replace("t", "$t$", 1))
        is_last = frame == len(motion.times) - 1
        self._ending.set_text(self._last_words if is_last else "")
        for i, finger in enumerate(self._fingers):
            self._place(finger, i, frame)
        self._canvas.restore_region(self._still)
        for artist in self._moving:
            artist.draw(self._canvas.get_renderer())
        return np.asarray(self._canvas.buffer_rgba())[..., :3].copy()

    def _place(self, finger: _Finger, index: int, frame: int) -> None:
        motion = self._motion
        points = motion.joints[frame, index]
        for part in (finger.outline, finger.links):
            part.set_data(*points.T)
        finger.joints.set_data(*points[:-1].T)
        finger.tip.set_data(*points[-1:].T)
        phase = ContactPhase(int(motion.phases[frame, index]))
        colour = paint(PHASES[phase])
        finger.tip.set_markerfacecolor(colour)
        tip, friction = points[-1], motion.friction[frame, index]
        normal, tangent = motion.normals[frame, index], motion.tangents[frame, index]
        edges = [normal + side * friction * tangent for side in (1.0, -1.0)]
        length = _CONE_LENGTH * self._span
        finger.cone.set_xy([tip, *(tip + length * edge for edge in edges)])
        force = self._metres_per_newton * motion.forces[frame, index]
        finger.force.set_data(*np.stack([tip, tip + 0.9 * force]).T)
        finger.force.set_color(colour)
        finger.head.set_xy(_arrow_head(tip + force, force, 0.018 * self._span))
        finger.head.set_color(colour)
        finger.slip.set_data([motion.times[frame]], [1e3 * motion.slip[frame, index]])
        finger.slip.set_markerfacecolor(colour)


def _show_whole_motion(axes: Axes, motion: HandMotion) -> float:
    """Sets the limits so that nothing ever leaves the picture; returns its larger span [m]."""
    points = np.concatenate([motion.joints.reshape(-1, 2), motion.corners.reshape(-1, 2)])
    low, high = points.min(axis=0), points.max(axis=0)
    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    size = figure.get_size_inches() * axes.get_position().size
    # One scale for both directions: the larger of what width and height need.
    scale = float(((1.0 + 2.0 * _MARGIN) * (high - low) / size).max())
    middle, half = 0.5 * (low + high), 0.5 * scale * size
    axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
    axes.set_ylim(middle[1] - half[1], middle[1] + half[1])
    span = float((high - low).max())
    axes.set_axis_off()
    return span


def _draw_chart(figure: Figure, result: RunResult, window: Window) -> Axes:
    """The slips in a stretch of the run, the phases above them, and what the colours mean."""
    contacts = range(result.trace.shape.num_contacts)
    strip = figure.add_axes((0.1, 0.325, 0.87, 0.035))
    draw_lanes(strip, result, contacts, window)
    name_lanes(strip, result, contacts, offset=0.008)
    chart = figure.add_axes((0.1, 0.125, 0.87, 0.19))
    rows = rows_from_start(result.trace)
    for i in contacts:
        colour = paint(lighter(finger_colour(i), 0.2))
        values = 1e3 * drawable(result.trace.slip[rows, i])
        name = result.scenario.finger_names[i]
        chart.plot(result.trace.times[rows], values, color=colour, label=name)
    chart.axhline(0.0, color=paint(lighter(MUTED, 0.4)), linewidth=0.5, zorder=1.0)
    chart.set_xlim(*window)
    chart.margins(y=0.15)
    chart.set_xlabel("$t$ [s]", labelpad=1.0)
    chart.set_ylabel("slip [mm]")
    chart.legend(loc="best", ncols=3)
    patches = phase_patches(result)
    figure.legend(handles=patches, loc="lower center", ncols=3, handlelength=1.2, fontsize=8.5)
    return chart


def _add_finger(hand: Axes, chart: Axes, index: int) -> _Finger:
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
    cone = Polygon(np.zeros((3, 2)), fc=paint(lighter(CONE, 0.45)), alpha=0.45, lw=0.0, zorder=2.2)
    head = Polygon(np.zeros((3, 2)), lw=0.0, zorder=3.3)
    hand.add_patch(cone)
    hand.add_patch(head)
    return _Finger(
        outline=line(hand, 2.4, color=edge, linewidth=8.4, **links),
        links=line(hand, 2.5, color=paint(lighter(LINK, 0.3)), linewidth=6.8, **links),
        joints=line(hand, 2.6, markersize=7.0, markerfacecolor=paint(lighter(LINK, 0.7)), **dot),
        cone=cone,
        force=line(hand, 3.2, linewidth=2.2),
        head=head,
        tip=line(hand, 3.4, markersize=9.0, **dot),
        slip=line(
            chart, 3.0, markersize=5.0, **{**dot, "markeredgecolor": paint(finger_colour(index))}
        ),
    )


def _arrow_head(
    point: NDArray[np.float64], along: NDArray[np.float64], size: float
) -> NDArray[np.float64]:
    """A triangle whose tip is at a point; nothing where there is no direction."""
    length = float(np.hypot(*along))
    if length == 0.0:
        return np.stack([point] * 3)
    forward = along / length * size
    aside = 0.55 * np.array([-forward[1], forward[0]])
    back = point - 1.6 * forward
    return np.stack([point, back + aside, back - aside])
