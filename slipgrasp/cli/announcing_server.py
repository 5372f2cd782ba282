"""A server that prints its URL once it accepts requests."""

from __future__ import annotations

import socket
import sys
from contextlib import redirect_stderr, redirect_stdout

import uvicorn

from slipgrasp.cli.status import complain
from slipgrasp.server.app import StoppableServer
from slipgrasp.server.http.log_limit import log_prints


class AnnouncingServer(StoppableServer):
    """Prints its URL on a line of standard output once it accepts requests.

    Args:
        config: Configuration of uvicorn.
        url: Its URL.
        remark: A remark for the user on standard error; may be empty.
    """

    def __init__(self, config: uvicorn.Config, url: str, remark: str = "") -> None:
        super().__init__(config)
        self._url = url
        self._remark = remark
        self._streams = (sys.stdout, sys.stderr)

    def run(self, sockets: list[socket.socket] | None = None) -> None:
        """Serves until it is stopped; only its log writes meanwhile."""
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
