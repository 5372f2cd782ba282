"""How long an answer waits for a result (RFC 7240, the header ``Prefer``)."""

from __future__ import annotations

import asyncio
import re
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any, Self

_WAIT = re.compile(r'wait *= *"?([0-9]{1,6})"?', re.IGNORECASE)
_ASYNC = "respond-async"

ENDING_SECONDS = 2.0
"""How long an answer waits for what ends with the server; the server waits a little longer."""


@dataclass(frozen=True, slots=True)
class WaitPreference:
    """How long to wait.

    Attributes:
        seconds: How long an answer may take [s].
        applied: What of the client's preferences this takes up, for ``Preference-Applied``.
    """

    seconds: float
    applied: tuple[str, ...] = ()

    @classmethod
    def from_header(cls, prefer: str, usual: float, longest: float) -> Self:
        """What a client prefers; what is not understood does not count, as the standard says.

        Args:
            prefer: Value of the header, empty if there is none.
            usual: How long to wait where it does not say [s].
            longest: How long to wait at most [s].
        """
        words = [word.partition(";")[0].strip() for word in prefer.split(",")]
        is_async = any(word.lower() == _ASYNC for word in words)
        waits = [found[1] for word in words if (found := _WAIT.fullmatch(word))]
        applied = (_ASYNC,) if is_async else ()
        if not waits:
            return cls(0.0 if is_async else usual, applied)
        seconds = min(float(waits[0]), longest)
        return cls(seconds, (*applied, f"wait={seconds:.0f}"))

    @property
    def headers(self) -> dict[str, str]:
        """What an answer says of it."""
        return {"Preference-Applied": ", ".join(self.applied)} if self.applied else {}


async def wait_until_done(future: Future[Any], seconds: float, stopping: asyncio.Event) -> None:
    """Waits until something has ended, for some time at most.

    Once the server is to stop, all ends soon that is waited for, as stopped or as given up: then
    that is waited for, however long was asked for, as nobody can ask again.

    Args:
        future: What is waited for; it goes on, whatever happens here.
        seconds: How long at most.
        stopping: Set once the server is to stop.
    """
    if seconds <= 0.0 and not stopping.is_set():
        return
    loop, ended = asyncio.get_running_loop(), asyncio.Event()
    future.add_done_callback(lambda _: loop.call_soon_threadsafe(ended.set))
    waits = [asyncio.ensure_future(event.wait()) for event in (ended, stopping)]
    try:
        await asyncio.wait(waits, timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
        if stopping.is_set():
            await asyncio.wait(waits[:1], timeout=ENDING_SECONDS)
    finally:
        for wait in waits:
            wait.cancel()
