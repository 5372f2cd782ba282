"""Video of a run: like the GIF, with more colours and 1080 lines or more.

The encoder is FFmpeg, from the package ``av``.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from typing import Any, BinaryIO

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.frames import import_optional
from slipgrasp.figures.hand_motion import motion_of
from slipgrasp.figures.moving_hand import MovingHand
from slipgrasp.figures.slip_times import Window
from slipgrasp.figures.style import screen_style
from slipgrasp.recordings.clip import WHOLE, Clip

MAX_FRAMES = 3600
"""Largest number of frames, two minutes at 30 per second; longer videos have fewer per second."""

HEIGHT = 720
_WIDE = 16 / 9
_CODECS: dict[str, tuple[str, dict[str, str]]] = {
    "mp4": ("libx264", {"crf": "18", "preset": "medium"}),
    "webm": ("libvpx-vp9", {"crf": "24", "b:v": "0", "cpu-used": "4"}),
}


def write_film(
    result: RunResult,
    stream: BinaryIO,
    progress: Callable[[float], None] | None = None,
    fps: float = 30.0,
    clip: Clip = WHOLE,
    *,
    container: str,
) -> None:
    """Writes a time range of a run as a video.

    Args:
        result: The run.
        stream: Output stream; it must be seekable.
        progress: Called with the completed fraction, 0 to 1.
        fps: Frames per second of the viewer's clock, at most; see `MAX_FRAMES`.
        clip: Time range, speed and height; the video is 16:9, with height `HEIGHT` by default.
        container: ``mp4`` (H.264) or ``webm`` (VP9).

    Raises:
        MissingPackageError: If ``av`` is not installed.
        ClipError: If the clip contains no part of the run.
    """
    av = import_optional("av")
    times = clip.times(result, fps, MAX_FRAMES)
    # Chroma subsampling needs an even number of lines.
    height = (clip.height or HEIGHT) // 2 * 2
    size = round(height * _WIDE / 2) * 2, height
    codec, options = _CODECS[container]
    file: Any = av.open(stream, "w", format=container)
    with file, screen_style():
        window = Window(*clip.span(result))
        hand = MovingHand(result, motion_of(result, times), window, clip.clock, size)
        # The length of the clip is not a multiple of the frame interval: the rate sets the speed.
        rate = Fraction((len(times) - 1) * clip.speed / float(times[-1] - times[0]))
        rate = rate.limit_denominator(1000)
        film = file.add_stream(codec, rate=rate, options=options)
        film.width, film.height, film.pix_fmt = *size, "yuv420p"
        for frame in range(len(times)):
            picture = av.VideoFrame.from_ndarray(hand.draw(frame), format="rgb24")
            file.mux(film.encode(picture))
            if progress is not None:
                progress((frame + 1) / len(times))
        file.mux(film.encode())


write_mp4 = partial(write_film, container="mp4")
write_webm = partial(write_film, container="webm")
