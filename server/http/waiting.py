"""Waiting time of a response for a result (RFC 7240, the header ``Prefer``)."""

from __future__ import annotations

import asyncio
import re
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any, Self

_WAIT = re.compile(r'wait *= *"?([0-9]{1,6})"?', re.IGNORECASE)
_ASYNC = "respond-async"

ENDING_SECONDS = 2.0
"""Longest wait for a result during shutdown; the server waits slightly longer."""


@dataclass(frozen=True, slots=True)
class WaitPreference:
    """A waiting time.

    Attributes:
        seconds: Longest waiting time of a response [s].
        applied: Preferences that are applied, for ``Preference-Applied``.
    """

    seconds: float
    applied: tuple[str, ...] = ()

    @classmethod
    def from_header(cls, prefer: str, usual: float, longest: float) -> Self:
        """Parses a client's preference; unknown ones are ignored, as in the standard.

        Args:
            prefer: Value of the header, empty if absent.
            usual: Default waiting time [s].
            longest: Largest waiting time [s].
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
        """The response headers."""
        return {"Preference-Applied": ", ".join(self.applied)} if self.applied else {}


async def wait_until_done(future: Future[Any], seconds: float, stopping: asyncio.Event) -> None:
    """Waits until a future is done, for a limited time.

    When the server stops, all futures end soon, as stopped or cancelled: this waits for the end,
    regardless of the time limit, because the client cannot repeat the request.

    Args:
        future: The future; it is not cancelled.
        seconds: Time limit.
        stopping: Set when the server stops.
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
