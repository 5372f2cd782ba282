"""Runs: simulate, list, and everything that was recorded of one."""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Iterator
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response
from fastapi.responses import FileResponse, StreamingResponse
from starlette.concurrency import run_in_threadpool

from core.result import RunResult
from recordings.csv_export import write_csv
from server.dependencies import PageDep, RunCreateDep, RunResultDep, RunServiceDep, StoredRunDep
from server.run_request import RunCreate
from server.schemas import ProblemPublic, RunPublic, RunsPublic
from server.signals import encode_columns, select_columns

__all__ = ["router"]

CSV_PIECE_BYTES = 1 << 16

router = APIRouter(prefix="/runs", tags=["runs"])

_RUN_BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {"application/json": {"schema": RunCreate.model_json_schema()}},
    }
}


@router.post(
    "",
    status_code=201,
    responses=ProblemPublic.responses((400, 413, 415, 422, 503)),
    openapi_extra=_RUN_BODY,
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
def list_runs(page: PageDep, service: RunServiceDep) -> RunsPublic:
    """The saved runs, newest first."""
    stored = service.store.list(page.offset, page.limit)
    data = [RunPublic.from_stored(run) for run in stored]
    return RunsPublic(data=data, count=service.store.count())


@router.get("/{run_id}", responses=ProblemPublic.responses((404,)))
def read_run(stored: StoredRunDep) -> RunPublic:
    """A saved run without its signals."""
    return RunPublic.from_stored(stored)


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


@router.get(
    "/{run_id}/recording",
    response_class=FileResponse,
    responses={
        200: {"content": {"application/octet-stream": {}}},
        **ProblemPublic.responses((404,)),
    },
)
def read_recording_file(stored: StoredRunDep) -> FileResponse:
    """The MCAP file."""
    name = stored.path.name
    return FileResponse(stored.path, media_type="application/octet-stream", filename=name)


def _csv_pieces(result: RunResult) -> Iterator[str]:
    """The CSV text by way of a temporary file: of a long run it is too large for memory."""
    with tempfile.TemporaryFile("w+", encoding="utf-8", newline="") as file:
        write_csv(result, file)
        file.seek(0)
        while piece := file.read(CSV_PIECE_BYTES):
            yield piece
