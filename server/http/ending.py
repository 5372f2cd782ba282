"""How requests end that are still under way when the server is to stop."""

from __future__ import annotations

import asyncio

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from slipgrasp.server.exceptions import ServiceEndingError
from slipgrasp.server.http.errors import problem_response

ANSWER_SECONDS = 2.5
"""How long after the server is to stop a request may still be answered by its route.

A little less than the server waits for its answers.
"""


class EndingLimit:
    """ASGI middleware: answers 503 where the server stops before a route has begun to answer.

    Without it such a connection would be reset, and its sender could not know what became of it.

    Args:
        app: What answers otherwise.
        stopping: Set once the server is to stop.
    """

    def __init__(self, app: ASGIApp, stopping: asyncio.Event) -> None:
        self._app = app
        self._stopping = stopping
        self._end: asyncio.Task[None] | None = None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one connection; what is not HTTP passes."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        if self._end is None:
            self._end = asyncio.create_task(self._wait_for_end())
        has_begun = is_given_up = False

        async def send_in_time(message: Message) -> None:
            nonlocal has_begun
            if not is_given_up:
                has_begun = True
                await send(message)

        # A task of its own: what it waits for in a thread cannot be cancelled.
        answer = asyncio.create_task(self._answer(scope, receive, send_in_time))
        try:
            await asyncio.wait((answer, self._end), return_when=asyncio.FIRST_COMPLETED)
            is_given_up = not (has_begun or answer.done())
            if is_given_up:
                await problem_response(503, str(ServiceEndingError()))(scope, receive, send)
                answer.add_done_callback(_ignore)
            else:
                await answer
        finally:
            answer.cancel()

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        await self._app(scope, receive, send)

    async def _wait_for_end(self) -> None:
        await self._stopping.wait()
        await asyncio.sleep(ANSWER_SECONDS)


def _ignore(answer: asyncio.Task[None]) -> None:
    """Takes the error of an answer that nobody waits for any more."""
    if not answer.cancelled():
        answer.exception()
