"""A server that tells its application at once when it is to stop, so that nothing waits on."""

from __future__ import annotations

import asyncio
import socket
from concurrent.futures import Future
from typing import Annotated, Any

import uvicorn
from fastapi import Depends, FastAPI, Request


class StoppableServer(uvicorn.Server):
    """Sets ``app.state.stopping`` before it waits for the answers that are still going on."""

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Ends answers, then the application."""
        if isinstance(self.config.app, FastAPI):
            self.config.app.state.stopping.set()
        await super().shutdown(sockets)


def _stopping(request: Request) -> asyncio.Event:
    stopping: asyncio.Event = request.app.state.stopping
    return stopping


StoppingDep = Annotated[asyncio.Event, Depends(_stopping)]
"""Set once the server is to stop."""


async def wait_for(future: Future[Any], seconds: float, stopping: asyncio.Event) -> None:
    """Waits until something has ended, for some time at most, and not beyond the server's life.

    Args:
        future: What is waited for; it goes on, whatever happens here.
        seconds: How long at most.
        stopping: Set once the server is to stop.
    """
    if seconds <= 0.0:
        return
    loop, ended = asyncio.get_running_loop(), asyncio.Event()
    future.add_done_callback(lambda _: loop.call_soon_threadsafe(ended.set))
    waits = [asyncio.ensure_future(event.wait()) for event in (ended, stopping)]
    try:
        await asyncio.wait(waits, timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for wait in waits:
            wait.cancel()
