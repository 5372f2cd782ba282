"""Many concurrent viewers without a browser: amount, rate and age of the received messages."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
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

    async def watch_all() -> tuple[list[Watched], float]:
        async with watching(url, viewers) as seen:
            await asyncio.sleep(settle)
            return seen, await observe(seen, duration, clock)

    return asyncio.run(watch_all())


@asynccontextmanager
async def watching(url: str, viewers: int) -> AsyncIterator[list[Watched]]:
    """A context with viewers, each with a separate session.

    Args:
        url: Address of the dashboard's websocket.
        viewers: Number of viewers.

    Raises:
        AssertionError: If a viewer is disconnected.
    """
    seen = [Watched() for _ in range(viewers)]
    tasks = [asyncio.create_task(_view(url, one)) for one in seen]
    yield seen
    gone = sum(task.done() for task in tasks)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    assert not gone, f"{gone} of {viewers} viewers were disconnected"


async def observe(seen: Sequence[Watched], duration: float, clock: Callable[[], float]) -> float:
    """Counts the messages of viewers for some time [s]; returns the difference of a clock."""
    for one in seen:
        one.forget()
    began = clock()
    await asyncio.sleep(duration)
    return clock() - began


async def _view(url: str, seen: Watched, *, once: bool = False) -> None:
    """Acts as a viewer until it is cancelled or disconnected, or until its first frame."""
    async with connect_viewer(url) as socket:
        await say_hello(socket)
        async for content in socket:
            assert isinstance(content, bytes)
            seen.take(content)
            if once and seen.arrivals:
                return


def come_and_go(url: str, times: int, together: int = 4) -> None:
    """Connects and disconnects repeatedly, each time after the first frame was received.

    Args:
        url: Address of the dashboard's websocket.
        times: Total number of connections.
        together: Number of concurrent viewers.
    """

    async def visit(number: int) -> None:
        for _ in range(number, times, together):
            async with asyncio.timeout(_PATIENCE):
                await _view(url, Watched(), once=True)

    async def visit_together() -> None:
        await asyncio.gather(*map(visit, range(together)))

    asyncio.run(visit_together())


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
