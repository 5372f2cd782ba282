"""Studies: many runs from one request, their progress, and their end."""

from __future__ import annotations

import asyncio
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from starlette.concurrency import run_in_threadpool

from slipgrasp.core.study.definition import MAX_RUNS
from slipgrasp.core.study.document import StudyDocument
from slipgrasp.server.dependencies import SettingsDep, StudyBodyDep, StudyServiceDep
from slipgrasp.server.http.conditions import is_known
from slipgrasp.server.http.downloads import tag_of
from slipgrasp.server.http.events import EventStream, LastEventId
from slipgrasp.server.http.idempotency import IdempotencyKey, request_digest
from slipgrasp.server.http.openapi import json_body
from slipgrasp.server.http.paging import page_links
from slipgrasp.server.runs.schemas import API_PATH, ProblemPublic
from slipgrasp.server.stopping import StoppingDep
from slipgrasp.server.studies.study_events import StudyTeller
from slipgrasp.server.studies.study_request import StudiesQuery, check_some_runs, read_study
from slipgrasp.server.studies.study_schemas import StudiesPublic, StudyEstimatePublic, StudyPublic

BODY_PATHS = (f"{API_PATH}/studies", f"{API_PATH}/studies/estimate")

_LOCATION = {"Location": {"description": "Where it is found", "schema": {"type": "string"}}}
_EVENTS: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "Events `progress` and `end`, whose data is the study as "
        "`GET /studies/{study_id}` gives it, and `rows`, whose data has new `rows`",
        "content": {"text/event-stream": {"schema": {"type": "string"}}},
    },
    204: {"description": "`Last-Event-ID` is that of the end: there is nothing more to come"},
}

router = APIRouter(prefix="/studies", tags=["studies"])


@router.post(
    "",
    status_code=202,
    responses={
        202: {"description": "It is taken on, or was before", "headers": _LOCATION},
        **ProblemPublic.responses((400, 413, 415, 422, 503, 507)),
    },
    openapi_extra=json_body(StudyDocument),
)
async def create_study(
    body: StudyBodyDep,
    service: StudyServiceDep,
    settings: SettingsDep,
    response: Response,
    idempotency_key: IdempotencyKey = "",
) -> StudyPublic:
    """Take on a study: every run is checked before, and simulated when its turn comes."""

    def create() -> StudyPublic:
        make_study = partial(read_study, body, settings.max_study_runs)
        digest = request_digest(body) if idempotency_key else ""
        status = service.create(make_study, key=idempotency_key, digest=digest)
        return StudyPublic.from_status(status)

    study = await run_in_threadpool(create)
    response.headers["Location"] = study.links["self"]
    return study


@router.post(
    "/estimate",
    responses=ProblemPublic.responses((400, 413, 415, 422)),
    openapi_extra=json_body(StudyDocument),
)
async def estimate_study(body: StudyBodyDep, service: StudyServiceDep) -> StudyEstimatePublic:
    """Count the runs of a study and find out what it would take; nothing of it is kept."""

    def estimate() -> StudyEstimatePublic:
        study = read_study(body, MAX_RUNS)
        check_some_runs(study)
        return StudyEstimatePublic.from_cost(*service.estimate(study))

    return await run_in_threadpool(estimate)


@router.get("", responses=ProblemPublic.responses((422,)))
def list_studies(
    query: Annotated[StudiesQuery, Query()], service: StudyServiceDep, request: Request
) -> StudiesPublic:
    """The studies, the newest first."""
    found, count = service.list(query.offset, query.limit)
    data = [StudyPublic.from_status(status) for status in found]
    links = page_links(request, query.offset, query.limit, count)
    return StudiesPublic(data=data, count=count, links=links)


@router.get(
    "/{study_id}",
    response_model=StudyPublic,
    responses={
        304: {"description": "The client has it, as `If-None-Match` says"},
        **ProblemPublic.responses((404,)),
    },
)
def read_study_status(
    study_id: str, service: StudyServiceDep, request: Request, response: Response
) -> StudyPublic | Response:
    """A study: what it is, and how far."""
    study = StudyPublic.from_status(service.status(study_id))
    tag = tag_of(study.model_dump_json())
    if is_known(tag, request.headers.get("if-none-match")):
        return Response(status_code=304, headers={"ETag": tag})
    response.headers["ETag"] = tag
    return study


@router.post(
    "/{study_id}/cancel",
    status_code=202,
    responses=ProblemPublic.responses((404,)),
)
def cancel_study(study_id: str, service: StudyServiceDep) -> StudyPublic:
    """End a study within a second; what is done stays. One that has ended is left alone."""
    return StudyPublic.from_status(service.cancel(study_id))


@router.delete("/{study_id}", status_code=204, responses=ProblemPublic.responses((404, 409)))
def delete_study(study_id: str, service: StudyServiceDep) -> None:
    """Delete a study that has ended, for good; recordings of its runs are runs, and stay."""
    service.delete(study_id)


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
    request: Request,
    rows: Annotated[bool, Query(description="tell the new rows of the results too")] = False,
    last_event_id: LastEventId = "",
) -> Response:
    """Server-sent events: progress, new rows if they are asked for, and the end.

    The id of an event is how many runs it knows of. A client that comes back with
    `Last-Event-ID` is told what is new since.
    """
    live = await run_in_threadpool(service.find_live, study_id)
    look = live.status if live is not None else partial(service.status, study_id)
    status = await run_in_threadpool(look)
    seen = int(last_event_id) if last_event_id else None
    if status.state.has_ended and seen is not None and seen > status.finished:
        return Response(status_code=204)
    if seen is not None:
        # What nobody can have been told of is still to come.
        seen = min(seen, status.finished)
    slots = request.app.state.event_slots
    slots.check()
    results = None
    if rows:
        results = live.results if live else await run_in_threadpool(service.results, study_id)
    teller = StudyTeller(look, results, seen, settings.event_heartbeat, slots.makers)
    return EventStream(teller.pieces(partial(_pause, stopping)), slots)


async def _pause(stopping: asyncio.Event, seconds: float) -> bool:
    """Waits, but not beyond the life of the server, which then is True."""
    try:
        async with asyncio.timeout(seconds):
            return await stopping.wait()
    except TimeoutError:
        return False
