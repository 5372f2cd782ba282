"""A server that says where it is once it answers."""

from __future__ import annotations

import socket

import uvicorn

from slipgrasp.server.app import StoppableServer


class AnnouncingServer(StoppableServer):
    """Prints its URL alone on a line of standard output as soon as it serves.

    Args:
        config: What to serve, and how.
        url: Where it is.
    """

    def __init__(self, config: uvicorn.Config, url: str) -> None:
        super().__init__(config)
        self._url = url

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Starts the application and its listeners."""
        await super().startup(sockets)
        print(self._url, flush=True)
