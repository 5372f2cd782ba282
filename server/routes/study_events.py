"""Events of a study while it runs: progress, its new rows, and its end."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from functools import partial
from typing import Annotated, Any

from anyio import CapacityLimiter, to_thread
from fastapi import APIRouter, Query, Response
from starlette.concurrency import run_in_threadpool

from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.server.dependencies import (
    EventSlotsDep,
    LastEventId,
    SettingsDep,
    StoppingDep,
    StudyServiceDep,
)
from slipgrasp.server.http.errors import ProblemPublic
from slipgrasp.server.http.events import HEARTBEAT, EventStream, encode_event
from slipgrasp.server.studies.progress import StudyState, StudyStatus
from slipgrasp.server.studies.schemas import StudyPublic

LOOK_EVERY = 0.25
ROWS_AT_ONCE = 100

_EVENTS: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "Events `progress` and `end`, with the study as in "
        "`GET /studies/{study_id}`, and `rows`, with new `rows`",
        "content": {"text/event-stream": {"schema": {"type": "string"}}},
    },
    204: {"description": "`Last-Event-ID` is that of the end: there are no more events"},
}

router = APIRouter(prefix="/studies", tags=["studies"])


@router.get(
    "/{study_id}/events",
    response_class=Response,
    responses={**_EVENTS, **ProblemPublic.responses((404, 422, 503))},
)
async def stream_study_events(
    study_id: str,
    service: StudyServiceDep,
    settings: SettingsDep,
    stopping: StoppingDep,
    slots: EventSlotsDep,
    rows: Annotated[bool, Query(description="send the new rows of the results too")] = False,
    last_event_id: LastEventId = "",
) -> Response:
    """Server-sent events: progress, new rows on request, and the end.

    The id of an event is the number of runs that it includes. A client that reconnects with
    `Last-Event-ID` receives the events since then.
    """
    live = await run_in_threadpool(service.find_live, study_id)
    look = live.status if live is not None else partial(service.status, study_id)
    status = await run_in_threadpool(look)
    seen = int(last_event_id) if last_event_id else None
    if status.state.has_ended and seen is not None and seen > status.finished:
        return Response(status_code=204)
    if seen is not None:
        # Unsent events follow.
        seen = min(seen, status.finished)
    slots.check()
    results = None
    if rows:
        results = live.results if live else await run_in_threadpool(service.results, study_id)
    events = StudyEvents(look, results, seen, settings.event_heartbeat, slots.makers)
    return EventStream(events.pieces(partial(_pause, stopping)), slots)


async def _pause(stopping: asyncio.Event, seconds: float) -> bool:
    """Waits; returns True if the server ends meanwhile."""
    try:
        async with asyncio.timeout(seconds):
            return await stopping.wait()
    except TimeoutError:
        return False


class StudyEvents:
    """Sends the events of a study to one client until it has ended.

    The id of an event is the number of finished runs, so that a client that lost its connection
    continues there.

    Args:
        look: Returns the progress of the study.
        results: Its rows, if requested.
        seen: Number of runs that the client knows; None if it is new.
        heartbeat: Time of silence after which a comment is sent [s].
        makers: Threads that encode rows.
    """

    def __init__(
        self,
        look: Callable[[], StudyStatus],
        results: StudyResults | None,
        seen: int | None,
        heartbeat: float,
        makers: CapacityLimiter,
    ) -> None:
        self._look = look
        self._results = results
        self._seen = seen or 0
        self._state = None if seen is None else StudyState.RUNNING
        self._heartbeat = heartbeat
        self._makers = makers

    async def pieces(self, pause: Callable[[float], Awaitable[bool]]) -> AsyncIterator[bytes]:
        """The encoded events.

        Args:
            pause: Waits for at most this number of seconds; returns True if the service ends.
        """
        spoken = time.monotonic()
        while True:
            status = await run_in_threadpool(self._look)
            async for event in self._news(status):
                spoken = time.monotonic()
                yield event
            if status.state.has_ended:
                return
            if time.monotonic() - spoken >= self._heartbeat:
                spoken = time.monotonic()
                yield HEARTBEAT
            if await pause(LOOK_EVERY):
                return

    async def _news(self, status: StudyStatus) -> AsyncIterator[bytes]:
        is_further = status.finished > self._seen
        while self._results is not None and status.finished > self._seen:
            # Encoded there too, because many rows for many clients would block the event loop.
            yield await to_thread.run_sync(
                self._next_rows, self._results, status.finished, limiter=self._makers
            )
        if status.state.has_ended:
            # One more than the number of runs: after this id there are no events.
            yield encode_event("end", _public(status), status.finished + 1)
        elif is_further or status.state is not self._state:
            # The event with its rows already has the id of this run.
            is_new = is_further and self._results is None
            told = status.finished if is_new else None
            yield encode_event("progress", _public(status), told)
        self._seen, self._state = max(status.finished, self._seen), status.state

    def _next_rows(self, results: StudyResults, end: int) -> bytes:
        rows, _ = results.rows(self._seen, min(ROWS_AT_ONCE, end - self._seen))
        self._seen += len(rows)
        return encode_event("rows", {"rows": rows}, self._seen)


def _public(status: StudyStatus) -> dict[str, Any]:
    return StudyPublic.from_status(status).model_dump(mode="json")
