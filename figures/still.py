"""Still image of a run in any size: the hand as in videos, as PNG or SVG."""

from __future__ import annotations

import io
import re
from functools import partial
from typing import BinaryIO

import numpy as np
from PIL import Image

from slipgrasp.core.run.result import RunResult
from slipgrasp.figures.files import save_figure
from slipgrasp.figures.hand_motion import motion_of
from slipgrasp.figures.moving_hand import MovingHand
from slipgrasp.figures.slip_times import Window, closer_look
from slipgrasp.figures.style import screen_style
from slipgrasp.recordings.clip import WHOLE, Clip
from slipgrasp.recordings.still import AT_THE_END, Still


def write_still(
    result: RunResult,
    stream: BinaryIO,
    still: Still = AT_THE_END,
    clip: Clip = WHOLE,
    *,
    ending: str,
) -> None:
    """Writes a still image of a run.

    Args:
        result: The run.
        stream: Output stream.
        still: Instant and size.
        clip: Time range of the chart; by default the slip at the instant, if it is short.
        ending: ``png`` or ``svg``.

    Raises:
        StillError: If the run does not contain the instant.
        ClipError: If the clip contains no part of the run.
    """
    motion = motion_of(result, np.array([still.time_in(result)]))
    size = still.width, still.height
    with screen_style():
        window = _window(result, motion.states.times[0], clip)
        hand = MovingHand(result, motion, window, _clock, size)
        if ending == "png":
            Image.fromarray(hand.draw(0)).save(stream, format="PNG")
            return
        drawing = io.BytesIO()
        save_figure(hand.draw_figure(0), drawing, ending)
    stream.write(_in_pixels(drawing.getvalue().decode(), still).encode())


def _window(result: RunResult, time: float, clip: Clip) -> Window:
    """The time range of the chart: of a whole run with a short slip, the slip at the time."""
    whole = Window(*clip.span(result))
    slip = closer_look(result) if clip == WHOLE else None
    return slip if slip is not None and slip.start <= time <= slip.end else whole


def _clock(time: float) -> str:
    return f"t = {1e3 * time:.4g} ms" if time < 1.0 else f"t = {time:.5g} s"


def _in_pixels(svg: str, still: Still) -> str:
    """Sets the requested size of a drawing, independent of its font unit."""
    sized = re.sub(r' width="[^"]*pt"', f' width="{still.width}"', svg, count=1)
    return re.sub(r' height="[^"]*pt"', f' height="{still.height}"', sized, count=1)


write_png = partial(write_still, ending="png")
write_svg = partial(write_still, ending="svg")
