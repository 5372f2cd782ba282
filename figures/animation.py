"""Animated GIF of a run: the hand, and the slips of its fingertips."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from slipgrasp.core.run.result import RunResult
from slipgrasp.figures.hand_motion import motion_of
from slipgrasp.figures.moving_hand import SIZE, MovingHand
from slipgrasp.figures.slip_times import Window
from slipgrasp.figures.style import screen_style
from slipgrasp.recordings.clip import WHOLE, Clip

MAX_FRAMES = 400
"""Largest number of frames of a file; long runs have fewer per second."""

_COLOURS = 256
_DPI = 100
_LAST_FRAME = 1500
_TICK = 0.01
"""GIF times are in hundredths of a second."""


def frame_times(result: RunResult, fps: float = 20.0, clip: Clip = WHOLE) -> NDArray[np.float64]:
    """Times of the frames [s], at most one per hundredth of a second of the viewer's clock.

    Args:
        result: The run.
        fps: Frames per second, at most; rounded so that the animation has the correct speed.
        clip: Time range and speed.
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
    """Writes a time range of a run as an animated GIF that loops.

    Args:
        result: The run.
        stream: Output stream; it must be seekable.
        progress: Called with the completed fraction, 0 to 1.
        fps: Frames per second, at most; see `MAX_FRAMES`.
        clip: Time range, speed and height.

    Raises:
        ClipError: If the clip contains no part of the run.
    """
    times = frame_times(result, fps, clip)
    start, end = clip.span(result)
    durations = [round(1000 * _step(end - start, fps, clip))] * (len(times) - 1) + [_LAST_FRAME]
    height = clip.height or round(SIZE[1] * _DPI)
    with screen_style():
        size = round(height * SIZE[0] / SIZE[1]), height
        hand = MovingHand(result, motion_of(result, times), Window(start, end), clip.clock, size)
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
    """Interval between frames on the viewer's clock, in hundredths of a second."""
    least = math.ceil(span / clip.speed / (MAX_FRAMES - 1) / _TICK)
    return _TICK * max(round(1.0 / fps / _TICK), least)


def _frames(
    hand: MovingHand, count: int, progress: Callable[[float], None] | None
) -> Iterator[Image.Image]:
    """All frames with one palette, so that unchanged parts need no space in the file."""
    samples = np.concatenate([hand.draw(frame) for frame in (0, count // 2, count - 1)])
    palette = Image.fromarray(samples).quantize(_COLOURS, dither=Image.Dither.NONE)
    for frame in range(count):
        picture = Image.fromarray(hand.draw(frame))
        yield picture.quantize(palette=palette, dither=Image.Dither.NONE)
        if progress is not None:
            progress((frame + 1) / count)
