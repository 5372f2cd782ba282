"""A server that says where it is once it answers."""

from __future__ import annotations

import socket
import sys
from contextlib import redirect_stderr, redirect_stdout

import uvicorn

from slipgrasp.cli.status import complain
from slipgrasp.server.app import StoppableServer
from slipgrasp.server.http.log_limit import log_prints


class AnnouncingServer(StoppableServer):
    """Prints its URL alone on a line of standard output as soon as it serves.

    Args:
        config: What to serve, and how.
        url: Where it is.
        remark: What else its user wants to know, for standard error; may be empty.
    """

    def __init__(self, config: uvicorn.Config, url: str, remark: str = "") -> None:
        super().__init__(config)
        self._url = url
        self._remark = remark
        self._streams = (sys.stdout, sys.stderr)

    def run(self, sockets: list[socket.socket] | None = None) -> None:
        """Serves until it is stopped; meanwhile its log alone writes."""
        with log_prints():
            super().run(sockets)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Starts the application and its listeners."""
        await super().startup(sockets)
        output, errors = self._streams
        with redirect_stdout(output), redirect_stderr(errors):
            print(self._url, flush=True)
            if self._remark:
                complain(self._remark)
