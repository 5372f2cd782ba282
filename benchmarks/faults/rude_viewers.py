"""Viewers that flood, send garbage or huge frames, or do not read, and the server's response.

`python -m benchmarks.faults.rude_viewers URL COUNT SEED` connects that number of them repeatedly
until its standard input is closed. It prints a line as they connect, and then how they were
disconnected.
"""

from __future__ import annotations

import asyncio
import json
import random
import sys
from collections import Counter
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
HUGE_BYTES = 49 << 20
LONG_BYTES = 1 << 20
STALL_SECONDS = 8.0
PATIENCE = 30.0

Rudeness = Callable[[ClientConnection, random.Random], Awaitable[None]]


async def _send_garbage(socket: ClientConnection, source: random.Random) -> None:
    await socket.send(source.randbytes(source.randrange(1, 1000)))


async def _send_unknown(socket: ClientConnection, _source: random.Random) -> None:
    await socket.send(msgspec.msgpack.encode({"type": "RunPythonMessage", "code": "exit()"}))


async def _send_text(socket: ClientConnection, _source: random.Random) -> None:
    await socket.send("words")


async def _send_long(socket: ClientConnection, _source: random.Random) -> None:
    await socket.send(bytes(LONG_BYTES))


async def _send_huge(socket: ClientConnection, _source: random.Random) -> None:
    await socket.send(bytes(HUGE_BYTES))


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
    "garbage": (_send_garbage, (POLICY_VIOLATION,)),
    "unknown message": (_send_unknown, (POLICY_VIOLATION,)),
    "text": (_send_text, (UNSUPPORTED_DATA,)),
    "long message": (_send_long, (POLICY_VIOLATION,)),
    "huge message": (_send_huge, (POLICY_VIOLATION, TOO_BIG, RESET)),
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


async def _come_again(url: str, count: int, seed: str) -> Counter[str]:
    found = Counter[str]()
    others = [
        asyncio.create_task(_misbehave(url, TOGETHER[i % len(TOGETHER)], f"{seed} {i}", found))
        for i in range(count)
    ]
    print("come", flush=True)
    await asyncio.to_thread(sys.stdin.read)
    for other in others:
        other.cancel()
    ends = await asyncio.gather(*others, return_exceptions=True)
    faults = [end for end in ends if not isinstance(end, asyncio.CancelledError)]
    assert not faults, faults
    return found


async def _misbehave(url: str, kind: str, seed: str, found: Counter[str]) -> None:
    source = random.Random(seed)
    while True:
        code = await be_rude(url, kind, source)
        found[f"{kind}: {'left' if code is None else code}"] += 1
        expected = (*RUDENESS[kind][1], TRY_AGAIN_LATER)
        assert code is None or code in expected, f"{kind}: closed with {code}"
        await asyncio.sleep(AGAIN_AFTER)


if __name__ == "__main__":
    print(json.dumps(asyncio.run(_come_again(sys.argv[1], int(sys.argv[2]), sys.argv[3]))))
