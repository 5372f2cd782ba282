"""Viewers of the dashboard that connect, watch and disconnect, well-behaved or not."""

from __future__ import annotations

import asyncio
import random
import threading
import time

from websockets.exceptions import ConnectionClosed

from benchmarks.dashboard_viewers import connect_viewer, say_hello
from benchmarks.faults.rude_viewers import RUDENESS, be_rude
from benchmarks.soak.asking import Tally

TOGETHER = 3
FIRST_FRAME_SECONDS = 20.0
SHARE_RUDE = 0.4
PAUSE = 1.0


def visit_until(tally: Tally, seed: int, ended: threading.Event) -> None:
    """Connects viewers to the dashboard until the load ends; returns once all have left."""
    url = "ws://{}:{}/".format(*tally.address)

    async def visit_again(source: random.Random) -> None:
        while not ended.is_set():
            await _visit(url, tally, source)
            await asyncio.sleep(source.uniform(0.0, 2.0 * PAUSE))

    async def visit() -> None:
        await asyncio.gather(*(visit_again(random.Random(f"{seed} {i}")) for i in range(TOGETHER)))

    asyncio.run(visit())


async def _visit(url: str, tally: Tally, source: random.Random) -> None:
    if source.random() >= SHARE_RUDE:
        await _look_on(url, tally, source.uniform(0.0, 15.0))
        return
    kind = source.choice(list(RUDENESS))
    try:
        code = await be_rude(url, kind, source)
    except (OSError, TimeoutError) as error:
        tally.blame(f"viewer, {kind}", repr(error))
        return
    tally.note(f"viewer, {kind}", "left" if code is None else f"closed, {code}")
    expected = RUDENESS[kind][1]
    tally.expect(f"viewer, {kind}", not expected or code in expected, f"closed with {code}")


async def _look_on(url: str, tally: Tally, seconds: float) -> None:
    """Watches for some time, then closes the window, or loses the connection."""
    kind, began = "viewer", time.monotonic()
    try:
        async with connect_viewer(url) as socket:
            await say_hello(socket)
            await asyncio.wait_for(socket.recv(), FIRST_FRAME_SECONDS)
            tally.note(kind, "saw the page")
            while time.monotonic() < began + seconds:
                await asyncio.wait_for(socket.recv(), FIRST_FRAME_SECONDS)
            if seconds < 5.0:
                socket.transport.abort()
    except (OSError, TimeoutError, ConnectionClosed) as error:
        tally.blame(kind, repr(error))
