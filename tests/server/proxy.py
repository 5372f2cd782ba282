"""A small reverse proxy that shows a server at a path: one request for each connection."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress


class PathProxy:
    """Passes what is below a path on, and answers 404 to everything else.

    Args:
        path: Such as ``/slipgrasp``.
        strips: Whether it takes the path away.

    Attributes:
        port: Where it listens.
        upstream_port: To whom it passes requests on; to be set once that one listens.
    """

    def __init__(self, path: str, *, strips: bool) -> None:
        self.path = path
        self.port = 0
        self.upstream_port = 0
        self._strips = strips

    @property
    def origin(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def url(self) -> str:
        return f"{self.origin}{self.path}/"

    async def open(self) -> asyncio.Server:
        server = await asyncio.start_server(self._pass_on, "127.0.0.1", 0)
        self.port = server.sockets[0].getsockname()[1]
        return server

    async def _pass_on(self, client: asyncio.StreamReader, answer: asyncio.StreamWriter) -> None:
        with closing(answer), suppress(asyncio.IncompleteReadError, ConnectionError):
            head = (await client.readuntil(b"\r\n\r\n")).decode("latin-1")
            passed = self._rewritten(head)
            if passed is None:
                answer.write(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n")
            else:
                there = await asyncio.open_connection("127.0.0.1", self.upstream_port)
                there[1].write(passed.encode("latin-1"))
                await asyncio.gather(_pump(client, there[1]), _pump(there[0], answer))

    def _rewritten(self, head: str) -> str | None:
        first, *lines = head.removesuffix("\r\n\r\n").split("\r\n")
        method, target, version = first.split(" ")
        below = target.removeprefix(self.path)
        if not target.startswith(self.path) or below[:1] not in ("", "/", "?"):
            return None
        if self._strips:
            target = below if below.startswith("/") else f"/{below}"
        if not any(line.lower().startswith("upgrade:") for line in lines):
            lines = [line for line in lines if not line.lower().startswith("connection:")]
            lines.append("Connection: close")
        lines.append("X-Forwarded-For: 127.0.0.1")
        return "\r\n".join([f"{method} {target} {version}", *lines, "", ""])


async def _pump(source: asyncio.StreamReader, target: asyncio.StreamWriter) -> None:
    with closing(target), suppress(ConnectionError):
        while piece := await source.read(65536):
            target.write(piece)
            await target.drain()


@contextmanager
def proxy_at(path: str, *, strips: bool) -> Iterator[PathProxy]:
    """A proxy in a thread of its own."""
    proxy, loop = PathProxy(path, strips=strips), asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    server = asyncio.run_coroutine_threadsafe(proxy.open(), loop).result()
    try:
        yield proxy
    finally:
        asyncio.run_coroutine_threadsafe(_end(server), loop).result()
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.close()


async def _end(server: asyncio.Server) -> None:
    server.close()
    others = asyncio.all_tasks() - {asyncio.current_task()}
    for task in others:
        task.cancel()
    await asyncio.gather(*others, return_exceptions=True)
