"""Viewers that flood, send garbage or huge frames, or do not read, and the server's response.

`python -m benchmarks.faults.rude_viewers URL COUNT SEED` connects that number of them repeatedly
until its standard input is closed. It prints a line as they connect.
"""

from __future__ import annotations

import asyncio
import random
import sys
from collections.abc import Awaitable, Callable
from contextlib import suppress

import msgspec
from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed

from benchmarks.dashboard_viewers import connect_viewer, say_hello

POLICY_VIOLATION, UNSUPPORTED_DATA, TOO_BIG = 1008, 1003, 1009
RESET = 1006
"""Errors of a viewer whose connection is closed while it sends."""

TRY_AGAIN_LATER = 1013
"""The server is full: the place of a rejected viewer becomes free after a moment."""

AGAIN_AFTER = 1.0
"""Time after which a page without a connection tries again [s]."""

TOGETHER = ("flood", "huge message", "stalled", "garbage")
FLOOD_SECONDS = 8.0
STALL_SECONDS = 8.0
PATIENCE = 30.0

Rudeness = Callable[[ClientConnection, random.Random], Awaitable[None]]


def _sends(make: Callable[[random.Random], bytes | str]) -> Rudeness:
    """Sends one message."""

    async def send(socket: ClientConnection, source: random.Random) -> None:
        await socket.send(make(source))

    return send


def _garbage(source: random.Random) -> bytes:
    return source.randbytes(source.randrange(1, 1000))


_FOREIGN = msgspec.msgpack.encode({"type": "RunPythonMessage", "code": "exit()"})


async def _flood(socket: ClientConnection, _source: random.Random) -> None:
    """Sends as fast as the server reads, for some seconds."""
    with suppress(TimeoutError):
        async with asyncio.timeout(FLOOD_SECONDS):
            while True:
                await say_hello(socket)
    socket.transport.abort()


async def _fill_memory(socket: ClientConnection, _source: random.Random) -> None:
    """Starts sending files that viser would retain until they are complete, which never happens."""
    for i in range(100):
        start = {
            "type": "FileTransferStartUpload",
            "source_component_uuid": "x",
            "transfer_uuid": str(i),
            "filename": "x",
            "mime_type": "x",
            "part_count": 100,
            "size_bytes": 8 << 20,
        }
        await socket.send(msgspec.msgpack.encode(start))


async def _stall(socket: ClientConnection, _source: random.Random) -> None:
    socket.transport.pause_reading()
    await asyncio.sleep(STALL_SECONDS)
    socket.transport.abort()


RUDENESS: dict[str, tuple[Rudeness, tuple[int, ...]]] = {
    "garbage": (_sends(_garbage), (POLICY_VIOLATION,)),
    "unknown message": (_sends(lambda _: _FOREIGN), (POLICY_VIOLATION,)),
    "text": (_sends(lambda _: "words"), (UNSUPPORTED_DATA,)),
    "long message": (_sends(lambda _: bytes(1 << 20)), (POLICY_VIOLATION,)),
    "huge message": (_sends(lambda _: bytes(49 << 20)), (POLICY_VIOLATION, TOO_BIG, RESET)),
    "flood": (_flood, ()),
    "endless files": (_fill_memory, (POLICY_VIOLATION,)),
    "stalled": (_stall, ()),
}
"""Each behaviour, with the allowed close codes; none if the viewer disconnects itself."""


async def be_rude(url: str, kind: str, source: random.Random) -> int | None:
    """Connects, misbehaves and waits to be disconnected.

    Args:
        url: Address of the dashboard's websocket.
        kind: One of `RUDENESS`.
        source: Source of random numbers.

    Returns:
        The code with which the server closed the connection; None if the viewer disconnected.

    Raises:
        TimeoutError: If the server tolerates it for half a minute.
    """
    act, codes = RUDENESS[kind]
    async with asyncio.timeout(PATIENCE), connect_viewer(url) as socket:
        try:
            await say_hello(socket)
            await act(socket, source)
            while codes:
                await socket.recv()
        except ConnectionClosed:
            pass
        return socket.close_code if codes else None


async def _come_again(url: str, count: int, seed: str) -> None:
    others = [
        asyncio.create_task(_misbehave(url, TOGETHER[i % len(TOGETHER)], f"{seed} {i}"))
        for i in range(count)
    ]
    print("come", flush=True)
    await asyncio.to_thread(sys.stdin.read)
    for other in others:
        other.cancel()
    ends = await asyncio.gather(*others, return_exceptions=True)
    faults = [end for end in ends if not isinstance(end, asyncio.CancelledError)]
    assert not faults, faults


async def _misbehave(url: str, kind: str, seed: str) -> None:
    source = random.Random(seed)
    while True:
        code = await be_rude(url, kind, source)
        expected = (*RUDENESS[kind][1], TRY_AGAIN_LATER)
        assert code is None or code in expected, f"{kind}: closed with {code}"
        await asyncio.sleep(AGAIN_AFTER)


if __name__ == "__main__":
    asyncio.run(_come_again(sys.argv[1], int(sys.argv[2]), sys.argv[3]))
