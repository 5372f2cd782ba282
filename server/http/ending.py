"""Handling of unfinished requests when the server stops."""

from __future__ import annotations

import asyncio

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from slipgrasp.server.exceptions import ServiceEndingError
from slipgrasp.server.http.errors import problem_response

ANSWER_SECONDS = 2.5
"""Time after the stop request in which routes may still respond.

Slightly shorter than the time that the server waits for responses.
"""


class EndingLimit:
    """ASGI middleware: responds with 503 if the server stops before a route has started to respond.

    Otherwise such a connection would be reset, which does not explain the reason.

    Args:
        app: The application.
        stopping: Set when the server stops.
    """

    def __init__(self, app: ASGIApp, stopping: asyncio.Event) -> None:
        self._app = app
        self._stopping = stopping
        self._end: asyncio.Task[None] | None = None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one connection; protocols other than HTTP pass unchanged."""
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

        # A separate task, because its waiting threads cannot be cancelled.
        answer = asyncio.ensure_future(self._app(scope, receive, send_in_time))
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

    async def _wait_for_end(self) -> None:
        await self._stopping.wait()
        await asyncio.sleep(ANSWER_SECONDS)


def _ignore(answer: asyncio.Future[None]) -> None:
    """Retrieves the error of a response that is no longer needed."""
    if not answer.cancelled():
        answer.exception()
