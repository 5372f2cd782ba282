"""`python -m benchmarks.dashboard_server PRESET …`: a dashboard that reports ages of frames.

It is `slipgrasp serve`, with its arguments, but opens with the preset. The stamp is the last
message of a frame, so that its receiver has the whole frame and its age.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import slipgrasp.web.session
from slipgrasp.cli.main import main
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.screen import Screen

STAMP = "drawn at "
"""Start of a stamp; the monotonic clock follows [s]."""


class StampedScreen(Screen):
    """A screen that reports the start time of each frame."""

    def __init__(self, client: Any, *arguments: Any) -> None:
        super().__init__(client, *arguments)
        self._stamp = client.gui.add_html("")

    def update(self, view: ViewState) -> None:
        """Draws a frame, then its stamp."""
        began = time.monotonic()
        super().update(view)
        if view.playback is not None and view.playback.playing:
            self._stamp.content = f"{STAMP}{began:.6f}"


if __name__ == "__main__":
    slipgrasp.web.session.Screen = StampedScreen
    slipgrasp.web.session.FIRST_PRESET = sys.argv[1]
    raise SystemExit(main(["serve", *sys.argv[2:]]))
