"""Runs: simulate, search, rename, delete, and everything that was recorded of one."""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Iterator
from functools import partial
from typing import Annotated, Any
from urllib.parse import urlencode

from fastapi import APIRouter, Header, Query, Request, Response
from fastapi.responses import StreamingResponse
from pydantic import BaseModel
from starlette.concurrency import run_in_threadpool

from core.result import RunResult
from recordings.export import write_csv
from server.conditions import entity_tag, expected_revisions, is_known
from server.dependencies import (
    RunCreateDep,
    RunResultDep,
    RunServiceDep,
    RunsQueryDep,
    RunUpdateDep,
    StoredRunDep,
)
from server.run_request import RunCreate
from server.run_update import RunUpdate
from server.schemas import API_PATH, ProblemPublic, RunPublic, RunsPublic
from server.signals import encode_columns, select_columns

__all__ = ["router"]

CSV_PIECE_BYTES = 1 << 16

router = APIRouter(prefix="/runs", tags=["runs"])


def _json_body(model: type[BaseModel]) -> dict[str, Any]:
    """How a route declares the body that its dependency reads."""
    content = {"application/json": {"schema": model.model_json_schema()}}
    return {"requestBody": {"required": True, "content": content}}


@router.post(
    "",
    status_code=201,
    responses=ProblemPublic.responses((400, 413, 415, 422, 503, 507)),
    openapi_extra=_json_body(RunCreate),
)
async def create_run(
    request: RunCreateDep, service: RunServiceDep, response: Response
) -> RunPublic:
    """Simulate a scenario and keep the run, also where physics, or a limit, ends it early."""
    result, stored = await asyncio.wrap_future(service.submit(request.to_scenario))
    if stored is None:
        return await run_in_threadpool(RunPublic.from_result, result)
    run = await run_in_threadpool(RunPublic.from_stored, stored)
    response.headers["Location"] = run.links["self"]
    return run


@router.get("", responses=ProblemPublic.responses((422,)))
def list_runs(query: RunsQueryDep, service: RunServiceDep, request: Request) -> RunsPublic:
    """The saved runs that are asked for, the newest first unless told otherwise."""
    found = service.store.find(query.to_query())
    links = {}
    if query.offset + query.limit < found.count:
        links["next"] = _page_link(request, query.offset + query.limit)
    if query.offset > 0:
        links["prev"] = _page_link(request, max(query.offset - query.limit, 0))
    return RunsPublic.from_found(found, links)


@router.get(
    "/{run_id}",
    response_model=RunPublic,
    responses={
        304: {"description": "The client has it, as `If-None-Match` says"},
        **ProblemPublic.responses((404,)),
    },
)
def read_run(stored: StoredRunDep, request: Request, response: Response) -> RunPublic | Response:
    """A saved run without its signals; its `ETag` is what a change may depend on."""
    tag = entity_tag(stored)
    if is_known(tag, request.headers.get("if-none-match")):
        return Response(status_code=304, headers={"ETag": tag})
    response.headers["ETag"] = tag
    return RunPublic.from_stored(stored)


@router.patch(
    "/{run_id}",
    responses=ProblemPublic.responses((400, 404, 412, 413, 415, 422, 507)),
    openapi_extra=_json_body(RunUpdate),
)
async def update_run(
    run_id: str,
    update: RunUpdateDep,
    service: RunServiceDep,
    response: Response,
    if_match: Annotated[
        str | None,
        Header(description="change it only if its `ETag` is still this one, else answer 412"),
    ] = None,
) -> RunPublic:
    """Change name, notes or tags of a run; the recording stays as it is."""
    annotate = partial(service.store.annotate, run_id, **update.changes())
    stored = await run_in_threadpool(annotate, expected=expected_revisions(if_match))
    response.headers["ETag"] = entity_tag(stored)
    return RunPublic.from_stored(stored)


@router.delete("/{run_id}", status_code=204, responses=ProblemPublic.responses((404,)))
def delete_run(run_id: str, service: RunServiceDep) -> None:
    """Delete a run for good: its recording and all that is written about it."""
    service.store.delete(run_id)


@router.get(
    "/{run_id}/signals",
    response_class=StreamingResponse,
    responses={
        200: {
            "description": "Columns by name, their units, and how many values each has.",
            "content": {"application/json": {}},
        },
        **ProblemPublic.responses((404, 422)),
    },
)
def read_signals(
    stored: StoredRunDep,
    result: RunResultDep,
    names: Annotated[
        str,
        Query(
            max_length=4000,
            description="columns as in the CSV file, or whole signals, separated by commas; "
            "all if left out",
            examples=["t,slip,normal_force_0"],
        ),
    ] = "",
) -> StreamingResponse:
    """What was recorded of a run, column by column; an event gives two values at one time."""
    wanted = [name.strip() for name in names.split(",")] if names else []
    columns = select_columns(result, wanted)
    return StreamingResponse(encode_columns(stored.id, columns), media_type="application/json")


@router.get(
    "/{run_id}/signals.csv",
    response_class=StreamingResponse,
    responses={200: {"content": {"text/csv": {}}}, **ProblemPublic.responses((404, 422))},
)
def read_signals_as_csv(stored: StoredRunDep, result: RunResultDep) -> StreamingResponse:
    """The table that ``slipgrasp export`` writes."""
    headers = {"Content-Disposition": f'attachment; filename="{stored.id}.csv"'}
    return StreamingResponse(_csv_pieces(result), media_type="text/csv", headers=headers)


def _page_link(request: Request, offset: int) -> str:
    asked = [pair for pair in request.query_params.multi_items() if pair[0] != "offset"]
    return f"{API_PATH}/runs?{urlencode([*asked, ('offset', offset)])}"


def _csv_pieces(result: RunResult) -> Iterator[str]:
    """The CSV text by way of a temporary file: of a long run it is too large for memory."""
    with tempfile.TemporaryFile("w+", encoding="utf-8", newline="") as file:
        write_csv(result, file)
        file.seek(0)
        while piece := file.read(CSV_PIECE_BYTES):
            yield piece
