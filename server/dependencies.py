"""What routes ask for, as annotated aliases."""

from __future__ import annotations

from typing import Annotated, TypeVar

from fastapi import Depends, Query, Request
from pydantic import BaseModel, ValidationError
from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect

from core.result import RunResult
from recordings.stored_run import StoredRun
from server.errors import (
    InvalidRequestError,
    UnreadableBodyError,
    UnsupportedBodyError,
    invalid_fields,
)
from server.json_body import read_json
from server.run_request import RunCreate
from server.run_service import RunService
from server.run_update import RunUpdate
from server.runs_query import RunsQuery

__all__ = [
    "RunCreateDep",
    "RunResultDep",
    "RunServiceDep",
    "RunUpdateDep",
    "RunsQueryDep",
    "StoredRunDep",
]

JSON_TYPE = "application/json"
MERGE_TYPE = "application/merge-patch+json"

Body = TypeVar("Body", bound=BaseModel)


def get_run_service(request: Request) -> RunService:
    """The service of the application that answers."""
    service: RunService = request.app.state.run_service
    return service


def get_stored_run(run_id: str, request: Request) -> StoredRun:
    """The saved run of that id.

    Raises:
        RecordingNotFoundError: If there is none.
    """
    return get_run_service(request).store.get(run_id)


def open_stored_run(run_id: str, request: Request) -> RunResult:
    """The saved run of that id, read back.

    Raises:
        RecordingNotFoundError: If there is none.
        RecordingError: If its file is damaged.
    """
    return get_run_service(request).store.open(run_id)


async def read_run_create(request: Request) -> RunCreate:
    """The body of a request for a run; raises as `read_body`."""
    return await read_body(request, RunCreate, (JSON_TYPE,))


async def read_run_update(request: Request) -> RunUpdate:
    """The body of a request to change what is written of a run; raises as `read_body`."""
    return await read_body(request, RunUpdate, (JSON_TYPE, MERGE_TYPE))


async def read_body(request: Request, kind: type[Body], types: tuple[str, ...]) -> Body:
    """The JSON body of a request.

    Args:
        request: The request.
        kind: What it should be.
        types: As what it may be declared; the first is suggested.

    Raises:
        UnsupportedBodyError: If it is declared as something else than JSON.
        UnreadableBodyError: If it is not JSON.
        InvalidRequestError: If it is something else than it should be.
    """
    content_type = request.headers.get("content-type", "")
    if content_type.partition(";")[0].strip().lower() not in types:
        raise UnsupportedBodyError(content_type, types[0])
    try:
        body = await request.body()
    except ClientDisconnect as error:
        raise UnreadableBodyError("its sender has gone") from error
    value = await run_in_threadpool(read_json, body)
    try:
        return kind.model_validate(value)
    except ValidationError as error:
        known = [field.alias or name for name, field in kind.model_fields.items()]
        raise InvalidRequestError(invalid_fields(error.errors(), known)) from error


RunServiceDep = Annotated[RunService, Depends(get_run_service)]
RunResultDep = Annotated[RunResult, Depends(open_stored_run)]
StoredRunDep = Annotated[StoredRun, Depends(get_stored_run)]
RunCreateDep = Annotated[RunCreate, Depends(read_run_create)]
RunUpdateDep = Annotated[RunUpdate, Depends(read_run_update)]
RunsQueryDep = Annotated[RunsQuery, Query()]
