"""Many concurrent viewers without a browser: amount, rate and age of the received messages."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import msgspec
from websockets.asyncio.client import ClientConnection, connect

from benchmarks.dashboard_server import STAMP
from benchmarks.headless_viewer import PROTOCOL, camera_fields, content_of, messages_of

_PATIENCE = 60.0


@dataclass
class Watched:
    """Messages received by one viewer.

    Attributes:
        arrivals: Arrival times of frames, by the monotonic clock [s].
        ages: Age of each frame on arrival, since the server began to draw it [s].
        num_bytes: Number of bytes received.
    """

    arrivals: list[float] = field(default_factory=list)
    ages: list[float] = field(default_factory=list)
    num_bytes: int = 0

    def forget(self) -> None:
        """Resets the counts."""
        self.arrivals.clear()
        self.ages.clear()
        self.num_bytes = 0

    def take(self, content: bytes) -> None:
        """Records a websocket message."""
        self.num_bytes += len(content)
        now = time.monotonic()
        for stamp in map(content_of, messages_of(content)):
            if stamp.startswith(STAMP):
                self.arrivals.append(now)
                self.ages.append(now - float(stamp.removeprefix(STAMP)))


def watch(
    url: str, viewers: int, settle: float, duration: float, clock: Callable[[], float]
) -> tuple[list[Watched], float]:
    """Connects viewers, each with a separate session, while the first run is played.

    Args:
        url: Address of the dashboard's websocket.
        viewers: Number of viewers.
        settle: Time that all are connected before the measurement [s].
        duration: Duration of the measurement [s].
        clock: Clock, read at the start and at the end of the measurement.

    Returns:
        The messages received by each viewer, and the difference of the clock.
    """
    seen = [Watched() for _ in range(viewers)]

    async def watch_all() -> float:
        async with asyncio.TaskGroup() as group:
            tasks = [group.create_task(view(url, one)) for one in seen]
            await asyncio.sleep(settle)
            for one in seen:
                one.forget()
            began = clock()
            await asyncio.sleep(duration)
            ended = clock()
            for task in tasks:
                task.cancel()
        return ended - began

    return seen, asyncio.run(watch_all())


async def view(url: str, seen: Watched) -> None:
    """Acts as a viewer until it is cancelled or disconnected.

    Args:
        url: Address of the dashboard's websocket.
        seen: Records the received messages.
    """
    async with connect_viewer(url) as socket:
        await say_hello(socket)
        async for content in socket:
            assert isinstance(content, bytes)
            seen.take(content)


def come_and_go(url: str, times: int, together: int = 4) -> None:
    """Connects and disconnects repeatedly, each time after the first frame was received.

    Args:
        url: Address of the dashboard's websocket.
        times: Total number of connections.
        together: Number of concurrent viewers.
    """

    async def visit(visits: int) -> None:
        for _ in range(visits):
            await _visit(url)

    async def visit_together() -> None:
        shares = (times // together + (i < times % together) for i in range(together))
        await asyncio.gather(*map(visit, shares))

    asyncio.run(visit_together())


async def _visit(url: str) -> None:
    seen = Watched()
    async with asyncio.timeout(_PATIENCE), connect_viewer(url) as socket:
        await say_hello(socket)
        async for content in socket:
            assert isinstance(content, bytes)
            seen.take(content)
            if seen.arrivals:
                return


def connect_viewer(url: str) -> connect:
    """A connection like that of a viewer's page.

    Args:
        url: Address of the dashboard's websocket.
    """
    return connect(
        url,
        subprotocols=[PROTOCOL],
        compression=None,
        max_size=None,
        ping_interval=None,
        proxy=None,
    )


async def say_hello(socket: ClientConnection) -> None:
    """Sends the camera of the viewer, which starts a session."""
    message = {"type": "ViewerCameraMessage", **camera_fields()}
    await socket.send(msgspec.msgpack.encode(message))
