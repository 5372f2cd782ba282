"""`python -m benchmarks.dashboard_server FOLDER PRESET`: a dashboard that reports ages of frames.

It is set up as by `slipgrasp serve`, opens with the preset, prints its port, and ends when its
standard input is closed. The stamp is the last message of a frame, so that its receiver has the
whole frame and its age.
"""

from __future__ import annotations

import gc
import sys
import threading
import time
from pathlib import Path
from typing import Any

import uvicorn

import slipgrasp.web.session
from slipgrasp.cli.serving import SWITCH_SECONDS
from slipgrasp.server.app import server_config
from slipgrasp.server.memory import give_back_freed_memory
from slipgrasp.server.settings import Settings
from slipgrasp.web.app import create_dashboard_app
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


def main() -> None:
    """Serves until the standard input is closed."""
    give_back_freed_memory()
    sys.setswitchinterval(SWITCH_SECONDS)
    slipgrasp.web.session.Screen = StampedScreen
    slipgrasp.web.session.FIRST_PRESET = sys.argv[2]
    settings = Settings(data_directory=Path(sys.argv[1]))
    server = uvicorn.Server(server_config(create_dashboard_app(settings), settings))
    gc.freeze()
    thread = threading.Thread(target=server.run)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    print(server.servers[0].sockets[0].getsockname()[1], flush=True)
    sys.stdin.read()
    server.should_exit = True
    thread.join()


if __name__ == "__main__":
    main()
