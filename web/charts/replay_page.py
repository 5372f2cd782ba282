"""A run as one HTML file that plays its 3D scene in a browser, without a network."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import BinaryIO

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.verdict import headline_of
from slipgrasp.recordings.clip import WHOLE, Clip
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.model.page_layout import Picture
from slipgrasp.web.model.sampling import Sampler
from slipgrasp.web.page.inline import close_ups_html
from slipgrasp.web.scene.camera import FIELD_OF_VIEW, frame_box
from slipgrasp.web.scene.layout import SceneLayout
from slipgrasp.web.scene.scene import Scene

MAX_FRAMES = 1800
"""Largest number of frames, one minute at 30 per second; longer runs have fewer per second."""

_SMALLEST_PICTURE = Picture(1000, 800)
_SHARE_FOR_WORDS = 0.09
_SHARE_OF_HEADLINE = 0.12  # as a fraction of the height of the view
_HEAD, _TITLE = "<head>", "<title>"
_END_OF_TITLE = "</title>"


def write_html(
    result: RunResult,
    stream: BinaryIO,
    progress: Callable[[float], None] | None = None,
    fps: float = 30.0,
    clip: Clip = WHOLE,
) -> None:
    """Writes a time range of a run as a page that plays its scene in a loop.

    The file is self-contained and can be opened offline.

    Args:
        result: The run.
        stream: Output stream.
        progress: Called with the completed fraction, 0 to 1.
        fps: Frames per second, at most; see `MAX_FRAMES`.
        clip: Time range and speed.

    Raises:
        ClipError: If the clip contains no part of the run.
    """
    times = clip.times(result, fps, MAX_FRAMES)
    server = ViewerServer()
    try:
        page = _record(server, result, times, progress or _ignore, clip)
    finally:
        server.stop()
    stream.write(_with_head(page, _title(result)).encode())


def _ignore(_share: float) -> None:
    """Ignores the progress."""


def _record(
    server: ViewerServer,
    result: RunResult,
    times: NDArray[np.float64],
    progress: Callable[[float], None],
    clip: Clip,
) -> str:
    """The page of a scene that moves through all frames."""
    scene, sampler = Scene(server), Sampler(result.trace)
    layout = scene.show(result)
    _frame(server, layout)
    clock = _add_words(server, result, layout)
    scene.update(sampler.at(float(times[0])))
    serializer = server.get_scene_serializer()
    interval = float(times[1] - times[0]) / clip.speed
    for i, time in enumerate(times.tolist()):
        clock.text = clip.clock(time)
        scene.update(sampler.at(time))
        serializer.insert_sleep(interval)
        progress((i + 1) / len(times))
    return serializer.as_html()


def _frame(server: ViewerServer, layout: SceneLayout) -> None:
    margin = np.array([0.0, _margin_for_words(layout)])
    framing = frame_box(
        layout.low - margin, layout.high + 1.6 * margin, _SMALLEST_PICTURE, layout.plane
    )
    server.initial_camera.fov = FIELD_OF_VIEW
    server.initial_camera.up = (0.0, 0.0, 1.0)
    server.initial_camera.position = framing.position
    server.initial_camera.look_at = framing.look_at


def _margin_for_words(layout: SceneLayout) -> float:
    return _SHARE_FOR_WORDS * float(layout.high[1] - layout.low[1])


def _add_words(server: ViewerServer, result: RunResult, layout: SceneLayout) -> viser.LabelHandle:
    """Adds the outcome above the scene, and a clock below, which is returned."""
    middle, margin = 0.5 * (layout.low[0] + layout.high[0]), _margin_for_words(layout)
    words = (
        ("outcome", headline_of(result), layout.high[1] + 1.1 * margin, 1.5),
        ("title", result.name, layout.high[1] + 0.3 * margin, 0.9),
        ("clock", "", layout.low[1] - 0.4 * margin, 1.2),
    )
    *_, clock = (
        server.scene.add_label(
            f"/words/{name}",
            text,
            position=layout.plane.place((float(middle), float(height))),
            font_screen_scale=size,
            anchor="center-center",
        )
        for name, text, height, size in words
    )
    return clock


def _title(result: RunResult) -> str:
    return f"{result.name} – {headline_of(result)}"


def _with_head(page: str, title: str) -> str:
    """The page with another title and close-ups."""
    start = page.index(_TITLE) + len(_TITLE)
    end = page.index(_END_OF_TITLE, start)
    titled = page[:start] + escape(title) + page[end:]
    return titled.replace(_HEAD, _HEAD + close_ups_html(_SHARE_OF_HEADLINE), 1)
