"""Events of a study while it runs: progress, its new rows, and its end."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

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
from slipgrasp.server.http.job_events import has_nothing_new, stream_events
from slipgrasp.server.studies.progress import StudyStatus
from slipgrasp.server.studies.schemas import StudyPublic

_EVENTS: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "Events `progress` and `end`, whose data is the study as "
        "`GET /studies/{study_id}` gives it, and `rows`, whose data has new `rows`",
        "content": {"text/event-stream": {"schema": {"type": "string"}}},
    },
    204: {"description": "`Last-Event-ID` is that of the end: there is nothing more to come"},
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

    The id of an event is how many runs it knows of. A client that comes back with
    `Last-Event-ID` receives the events since then.
    """
    live = await run_in_threadpool(service.find_live, study_id)
    look = live.status if live is not None else partial(service.status, study_id)
    if await has_nothing_new(look, last_event_id):
        return Response(status_code=204)
    slots.check()
    results = None
    if rows:
        results = live.results if live else await run_in_threadpool(service.results, study_id)
    rows_from = None if results is None else partial(_rows_from, results)
    heartbeat = settings.event_heartbeat
    return await stream_events(look, _public, rows_from, last_event_id, heartbeat, stopping, slots)


def _rows_from(results: StudyResults, start: int, limit: int) -> list[dict[str, Any]]:
    return results.rows(start, limit)[0]


def _public(status: StudyStatus) -> dict[str, Any]:
    return StudyPublic.from_status(status).model_dump(mode="json")
