"""Runs: simulate, wait for, search, rename, stop and delete."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Header, Request, Response
from starlette.concurrency import run_in_threadpool

from slipgrasp.core.scenario.validation import check_scenario
from slipgrasp.recordings.store.description import Description
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.server.dependencies import (
    EndedRunIdDep,
    IdempotencyKey,
    RunCreateDep,
    RunServiceDep,
    RunsQueryDep,
    RunUpdateDep,
    StoppingDep,
    WaitPreferenceDep,
)
from slipgrasp.server.exceptions import ServiceEndingError
from slipgrasp.server.http.conditions import entity_tag, expected_revisions, is_known
from slipgrasp.server.http.errors import ProblemPublic
from slipgrasp.server.http.openapi import json_body
from slipgrasp.server.http.waiting import WaitPreference, wait_until_done
from slipgrasp.server.paging import page_links
from slipgrasp.server.request_keys import KeyedRequest
from slipgrasp.server.runs.pending import PendingRun, RunState
from slipgrasp.server.runs.schemas import (
    PendingRunPublic,
    RunCreate,
    RunPublic,
    RunsPublic,
    RunUpdate,
)
from slipgrasp.server.runs.service import RunService

RETRY_AFTER = 1

router = APIRouter(prefix="/runs", tags=["runs"])

_TEXT = {"type": "string"}
_LOCATION = {"Location": {"description": "Path of the run", "schema": _TEXT}}
_TAG = {"ETag": {"description": "Entity tag of the description of the run", "schema": _TEXT}}
_PENDING: dict[int | str, dict[str, Any]] = {
    202: {
        "model": PendingRunPublic,
        "description": "It has not ended yet; request `Location` again after `Retry-After` seconds",
        "headers": {
            **_LOCATION,
            "Retry-After": {"description": "in seconds", "schema": {"type": "integer"}},
        },
    }
}
_IfMatch = Annotated[
    str | None,
    Header(description="execute only if the run's `ETag` still matches, else respond with 412"),
]


@router.post(
    "",
    status_code=201,
    response_model=RunPublic,
    responses={
        201: {"description": "It has ended and is stored", "headers": {**_LOCATION, **_TAG}},
        **_PENDING,
        **ProblemPublic.responses((400, 413, 415, 422, 503, 507)),
    },
    openapi_extra=json_body(RunCreate),
)
async def create_run(
    request: RunCreateDep,
    service: RunServiceDep,
    preference: WaitPreferenceDep,
    stopping: StoppingDep,
    idempotency_key: IdempotencyKey = "",
) -> Response:
    """Simulate a scenario and store the run, even if physics, or a limit, ends it early.

    If a run takes longer than about two seconds, the response is 202 before its end; the run
    continues in any case. A server that stops meanwhile returns the run so far, or 503 if it was
    not started.
    """
    found = await run_in_threadpool(_begin, service, request, idempotency_key)
    if isinstance(found, PendingRun):
        await wait_until_done(found.future, preference.seconds, stopping)
        if stopping.is_set() and found.state is RunState.WAITING:
            raise ServiceEndingError
    return await run_in_threadpool(_answer, service, found, preference, 201)


@router.get("", responses=ProblemPublic.responses((422,)))
def list_runs(query: RunsQueryDep, service: RunServiceDep, request: Request) -> RunsPublic:
    """Search the stored runs, by default newest first."""
    found = service.store.find(query.to_query())
    links = page_links(str(request.url), query.offset, query.limit, found.count)
    return RunsPublic.from_found(found, links)


@router.get(
    "/{run_id}",
    response_model=RunPublic,
    responses={
        200: {"description": "It has ended", "headers": _TAG},
        **_PENDING,
        304: {"description": "The client has it, according to `If-None-Match`"},
        **ProblemPublic.responses((404, 503, 507)),
    },
)
async def read_run(
    run_id: str,
    service: RunServiceDep,
    preference: WaitPreferenceDep,
    stopping: StoppingDep,
    if_none_match: Annotated[
        str | None, Header(description="respond with 304 if the run's `ETag` still matches")
    ] = None,
) -> Response:
    """A run without its signals; use its `ETag` for conditional changes.

    For a run that has not ended, the response is 202; with `Prefer: wait=10`, the server first
    waits up to 10 s, and returns the run itself if it ends meanwhile.
    """
    found = await run_in_threadpool(service.look_up, run_id)
    if isinstance(found, PendingRun) and preference.applied:
        await wait_until_done(found.future, preference.seconds, stopping)
    return await run_in_threadpool(_answer, service, found, preference, 200, if_none_match)


@router.post(
    "/{run_id}/stop",
    response_model=RunPublic,
    responses={**_PENDING, **ProblemPublic.responses((404, 503, 507))},
)
async def stop_run(
    run_id: str, service: RunServiceDep, preference: WaitPreferenceDep, stopping: StoppingDep
) -> Response:
    """Stop a run and store its samples; an ended run is not changed."""
    found = await run_in_threadpool(service.stop, run_id)
    if isinstance(found, PendingRun):
        await wait_until_done(found.future, preference.seconds, stopping)
    return await run_in_threadpool(_answer, service, found, preference, 200)


@router.patch(
    "/{run_id}",
    responses=ProblemPublic.responses((400, 404, 409, 412, 413, 415, 422, 507)),
    openapi_extra=json_body(RunUpdate),
)
async def update_run(
    run_id: EndedRunIdDep,
    update: RunUpdateDep,
    service: RunServiceDep,
    response: Response,
    if_match: _IfMatch = None,
) -> RunPublic:
    """Change name, notes or tags of a run; the recording does not change."""
    annotate = partial(service.store.annotate, run_id, **update.changes())
    stored = await run_in_threadpool(annotate, expected=expected_revisions(if_match))
    response.headers["ETag"] = entity_tag(stored)
    return RunPublic.from_stored(stored)


@router.delete("/{run_id}", status_code=204, responses=ProblemPublic.responses((404, 409, 412)))
def delete_run(run_id: EndedRunIdDep, service: RunServiceDep, if_match: _IfMatch = None) -> None:
    """Delete a run permanently, with its recording, name, notes and tags."""
    service.store.delete(run_id, expected=expected_revisions(if_match))


def _begin(
    service: RunService, request: RunCreate, key: str
) -> PendingRun | StoredRun | Description:
    """Validates a scenario before it is queued."""
    scenario = request.to_scenario()
    check_scenario(scenario)
    if not key:
        return service.submit(lambda: scenario)
    keyed = KeyedRequest.of(key, request.model_dump(mode="json", by_alias=True))
    return service.submit_once(lambda: scenario, keyed)


def _answer(
    service: RunService,
    found: PendingRun | StoredRun | Description,
    preference: WaitPreference,
    status: int,
    if_none_match: str | None = None,
) -> Response:
    """The current state of a run, with the status code if it has ended."""
    if isinstance(found, PendingRun):
        if not found.done():
            return _answer_pending(service, found, preference)
        result, stored = found.result()
        found = stored or Description.from_result(result)
    headers = preference.headers
    if isinstance(found, Description):
        return _json(RunPublic.from_description(found), status, headers)
    headers["ETag"] = entity_tag(found)
    if is_known(headers["ETag"], if_none_match):
        return Response(status_code=304, headers=headers)
    run = RunPublic.from_stored(found)
    if status == 201:
        headers["Location"] = run.links["self"]
    return _json(run, status, headers)


def _answer_pending(
    service: RunService, pending: PendingRun, preference: WaitPreference
) -> Response:
    run = PendingRunPublic.from_pending(pending, service.preparation.words())
    told = {"Location": run.links["self"], "Retry-After": str(RETRY_AFTER)}
    return _json(run, 202, {**preference.headers, **told})


def _json(content: RunPublic | PendingRunPublic, status: int, headers: dict[str, str]) -> Response:
    text = content.model_dump_json(by_alias=True)
    return Response(text, status, headers, media_type="application/json")
