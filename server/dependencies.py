"""What routes ask for, as annotated aliases."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Query, Request
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect

from core.result import RunResult
from recordings.store import StoredRun
from server.errors import (
    InvalidRequestError,
    UnreadableBodyError,
    UnsupportedBodyError,
    invalid_fields,
)
from server.json_body import read_json
from server.run_request import RunCreate
from server.run_service import RunService

__all__ = ["PageDep", "RunCreateDep", "RunResultDep", "RunServiceDep", "StoredRunDep"]

MAX_PAGE = 1000


class Page(BaseModel):
    """Which part of a list is asked for."""

    model_config = ConfigDict(extra="forbid")

    limit: Annotated[int, Field(ge=1, le=MAX_PAGE, description="how many at most")] = 100
    offset: Annotated[int, Field(ge=0, le=10**9, description="how many to skip")] = 0


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
    """The body of a request for a run.

    Raises:
        UnsupportedBodyError: If it is declared as something else than JSON.
        UnreadableBodyError: If it is not JSON.
        InvalidRequestError: If it asks for something else than a run.
    """
    content_type = request.headers.get("content-type", "")
    if content_type.partition(";")[0].strip().lower() != "application/json":
        raise UnsupportedBodyError(content_type)
    try:
        body = await request.body()
    except ClientDisconnect as error:
        raise UnreadableBodyError("its sender has gone") from error
    value = await run_in_threadpool(read_json, body)
    try:
        return RunCreate.model_validate(value)
    except ValidationError as error:
        known = [field.alias or name for name, field in RunCreate.model_fields.items()]
        raise InvalidRequestError(invalid_fields(error.errors(), known)) from error


RunServiceDep = Annotated[RunService, Depends(get_run_service)]
RunResultDep = Annotated[RunResult, Depends(open_stored_run)]
StoredRunDep = Annotated[StoredRun, Depends(get_stored_run)]
RunCreateDep = Annotated[RunCreate, Depends(read_run_create)]
PageDep = Annotated[Page, Query()]
