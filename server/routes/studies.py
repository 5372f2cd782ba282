"""Studies: many runs from one request, their progress, and their end."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from starlette.concurrency import run_in_threadpool

from slipgrasp.core.study.definition import MAX_RUNS
from slipgrasp.core.study.document import StudyDocument
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.server.dependencies import (
    EventRequestDep,
    IdempotencyKey,
    SettingsDep,
    StudyBodyDep,
    StudyServiceDep,
)
from slipgrasp.server.http.conditions import is_known, tag_of
from slipgrasp.server.http.errors import ProblemPublic
from slipgrasp.server.http.job_events import event_responses
from slipgrasp.server.http.openapi import json_body
from slipgrasp.server.paging import PageQuery, page_links
from slipgrasp.server.request_keys import KeyedRequest
from slipgrasp.server.studies.progress import StudyStatus
from slipgrasp.server.studies.schemas import (
    StudiesPublic,
    StudyEstimatePublic,
    StudyPublic,
    check_some_runs,
    read_study,
)

_LOCATION = {"Location": {"description": "Path of the study", "schema": {"type": "string"}}}
router = APIRouter(prefix="/studies", tags=["studies"])


@router.post(
    "",
    status_code=202,
    responses={
        202: {"description": "It is accepted, or was accepted before", "headers": _LOCATION},
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
    """Create a study: the server checks all of its runs, and queues it."""

    def create() -> StudyPublic:
        make_study = partial(read_study, body, settings.max_study_runs)
        keyed = KeyedRequest.of(idempotency_key, body)
        return StudyPublic.from_status(service.create(make_study, keyed))

    study = await run_in_threadpool(create)
    response.headers["Location"] = study.links["self"]
    return study


@router.post(
    "/estimate",
    responses=ProblemPublic.responses((400, 413, 415, 422)),
    openapi_extra=json_body(StudyDocument),
)
async def estimate_study(body: StudyBodyDep, service: StudyServiceDep) -> StudyEstimatePublic:
    """Estimate the number of runs and the cost of a study, without creating it."""

    def estimate() -> StudyEstimatePublic:
        study = read_study(body, MAX_RUNS)
        check_some_runs(study)
        return StudyEstimatePublic.from_cost(*service.estimate(study))

    return await run_in_threadpool(estimate)


@router.get("", responses=ProblemPublic.responses((422,)))
def list_studies(
    query: Annotated[PageQuery, Query()], service: StudyServiceDep, request: Request
) -> StudiesPublic:
    """The studies, newest first."""
    found, count = service.list(query.offset, query.limit)
    data = [StudyPublic.from_status(status) for status in found]
    links = page_links(str(request.url), query.offset, query.limit, count)
    return StudiesPublic(data=data, count=count, links=links)


@router.get(
    "/{study_id}",
    response_model=StudyPublic,
    responses={
        304: {"description": "The client has it, according to `If-None-Match`"},
        **ProblemPublic.responses((404,)),
    },
)
def read_study_status(
    study_id: str, service: StudyServiceDep, request: Request, response: Response
) -> StudyPublic | Response:
    """A study and its progress."""
    study = StudyPublic.from_status(service.status(study_id))
    tag = tag_of(study.model_dump_json())
    if is_known(tag, request.headers.get("if-none-match")):
        return Response(status_code=304, headers={"ETag": tag})
    response.headers["ETag"] = tag
    return study


@router.get(
    "/{study_id}/events",
    response_class=Response,
    responses=event_responses(
        "Events `progress` and `end`, with the study as in `GET /studies/{study_id}`, and `rows`, "
        "with new `rows`"
    ),
)
async def stream_study_events(
    study_id: str,
    service: StudyServiceDep,
    events: EventRequestDep,
    rows: Annotated[bool, Query(description="send the new rows of the results too")] = False,
) -> Response:
    """Server-sent events: progress, new rows on request, and the end.

    The id of an event is the number of runs that it includes. A client that reconnects with
    `Last-Event-ID` receives the events since then.
    """
    rows_from = None
    if rows:
        rows_from = partial(_rows_from, await run_in_threadpool(service.results, study_id))
    return await events.answer(partial(service.status, study_id), _public, rows_from)


def _rows_from(results: StudyResults, start: int, limit: int) -> list[dict[str, Any]]:
    return results.rows(start, limit)[0]


def _public(status: StudyStatus) -> dict[str, Any]:
    return StudyPublic.from_status(status).model_dump(mode="json")


@router.post(
    "/{study_id}/cancel",
    status_code=202,
    responses=ProblemPublic.responses((404,)),
)
def cancel_study(study_id: str, service: StudyServiceDep) -> StudyPublic:
    """Stop a study within a second; finished runs are stored. An ended study is not changed."""
    return StudyPublic.from_status(service.cancel(study_id))


@router.post(
    "/{study_id}/resume",
    status_code=202,
    responses=ProblemPublic.responses((404, 409, 422, 503)),
)
def resume_study(study_id: str, service: StudyServiceDep) -> StudyPublic:
    """Continue a failed study after its last row. A running study is not changed."""
    return StudyPublic.from_status(service.resume(study_id))


@router.delete("/{study_id}", status_code=204, responses=ProblemPublic.responses((404, 409)))
def delete_study(study_id: str, service: StudyServiceDep) -> None:
    """Delete an ended study permanently; recordings of its runs are retained."""
    service.delete(study_id)
