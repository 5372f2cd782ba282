"""A run as an animated GIF: the hand in real time, and how far its fingertips have slipped."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from slipgrasp.core.run.result import RunResult
from slipgrasp.figures.hand_motion import motion_at
from slipgrasp.figures.moving_hand import MovingHand
from slipgrasp.figures.style import paper_style

MAX_FRAMES = 400
"""Most frames of a file; a run that is too long for them has fewer per second."""

_COLOURS = 256
_LAST_FRAME = 1500
_TICK = 0.01
"""GIF counts in hundredths of a second."""


def frame_times(result: RunResult, fps: float = 20.0) -> NDArray[np.float64]:
    """When the frames are taken [s]: from the start of a run to its end, in steps of 0.01 s.

    Args:
        result: The run.
        fps: Frames per second, at most; rounded so that the film runs in real time.
    """
    start, end = float(result.trace.times[0]), result.end_time
    return np.append(np.arange(start, end, _step(result, fps)), end)


def write_gif(
    result: RunResult,
    stream: BinaryIO,
    progress: Callable[[float], None] | None = None,
    fps: float = 20.0,
) -> None:
    """Writes a run as an animated GIF that plays in real time, over and over.

    Args:
        result: The run.
        stream: Where the file goes; it must be seekable.
        progress: Told the share that is done, from 0 to 1.
        fps: Frames per second, at most; see `MAX_FRAMES`.
    """
    times = frame_times(result, fps)
    durations = [round(1000 * _step(result, fps))] * (len(times) - 1) + [_LAST_FRAME]
    with paper_style():
        hand = MovingHand(result, motion_at(result, times))
        frames = _frames(hand, len(times), progress)
        next(frames).save(
            stream,
            format="GIF",
            save_all=True,
            append_images=frames,
            duration=durations,
            loop=0,
        )


def _step(result: RunResult, fps: float) -> float:
    """Time from frame to frame, in whole hundredths of a second."""
    span = result.end_time - float(result.trace.times[0])
    least = math.ceil(span / (MAX_FRAMES - 1) / _TICK)
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
