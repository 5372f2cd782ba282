"""What routes ask for, as annotated aliases."""

from __future__ import annotations

from typing import Annotated, Any, TypeVar

from fastapi import Depends, Header, Query, Request
from pydantic import BaseModel, ValidationError
from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.server.exceptions import (
    InvalidRequestError,
    UnreadableBodyError,
    UnsupportedBodyError,
)
from slipgrasp.server.http.errors import invalid_fields
from slipgrasp.server.http.json_body import MAX_VALUES, read_json
from slipgrasp.server.runs.schemas import RunCreate, RunUpdate
from slipgrasp.server.runs.search import RunsQuery
from slipgrasp.server.runs.service import RunService
from slipgrasp.server.settings import Settings
from slipgrasp.server.studies.service import StudyService

JSON_TYPE = "application/json"
MERGE_TYPE = "application/merge-patch+json"
MAX_STUDY_VALUES = 500_000

IdempotencyKey = Annotated[
    str,
    Header(
        max_length=200,
        pattern=r"^[ -~]*$",
        description="Any text of your own, such as a UUID: sent again with the same key and body, "
        "the request gives what it gave before, and nothing is made twice.",
        examples=["5f0c8f6e-6c1b-4d0e-9f57-3f6f0f1c2a4b"],
    ),
]
"""As in the draft "The Idempotency-Key HTTP Header Field"; empty where there is none."""

Body = TypeVar("Body", bound=BaseModel)


def get_settings(request: Request) -> Settings:
    """What the application that answers was told when it started."""
    settings: Settings = request.app.state.settings
    return settings


def get_run_service(request: Request) -> RunService:
    """The service of the application that answers."""
    service: RunService = request.app.state.run_service
    return service


def check_ended(run_id: str, request: Request) -> str:
    """The id of a run that may be changed.

    Raises:
        RunUnfinishedError: If it has not ended.
    """
    get_run_service(request).check_ended(run_id)
    return run_id


def get_stored_run(run_id: str, request: Request) -> StoredRun:
    """The saved run of that id.

    Raises:
        RunUnfinishedError: If it has not ended.
        RecordingNotFoundError: If there is none.
    """
    return get_run_service(request).get(run_id)


def open_stored_run(run_id: str, request: Request) -> RunResult:
    """The saved run of that id, read back.

    Raises:
        RunUnfinishedError: If it has not ended.
        RecordingNotFoundError: If there is none.
        RecordingError: If its file is damaged.
    """
    return get_run_service(request).open(run_id)


def get_study_service(request: Request) -> StudyService:
    """The service for studies of the application that answers."""
    service: StudyService = request.app.state.study_service
    return service


def open_study_results(study_id: str, request: Request) -> StudyResults:
    """The results of the study of that id.

    Raises:
        StudyNotFoundError: If there is none.
        RecordingError: If its file is damaged.
    """
    return get_study_service(request).results(study_id)


async def read_study_body(request: Request) -> Any:
    """The body of a request for a study, as plain values; raises as `read_body`."""
    return await read_values(request, (JSON_TYPE,), MAX_STUDY_VALUES)


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
    value = await read_values(request, types, MAX_VALUES)
    try:
        return kind.model_validate(value)
    except ValidationError as error:
        known = [field.alias or name for name, field in kind.model_fields.items()]
        raise InvalidRequestError(invalid_fields(error.errors(), known)) from error


async def read_values(request: Request, types: tuple[str, ...], max_values: int) -> Any:
    """The JSON body of a request as plain values.

    Args:
        request: The request.
        types: As what it may be declared; the first is suggested.
        max_values: How many values it may hold.

    Raises:
        UnsupportedBodyError: If it is declared as something else than JSON.
        UnreadableBodyError: If it is not JSON.
        InvalidRequestError: If it holds what no request may hold.
    """
    content_type = request.headers.get("content-type", "")
    if content_type.partition(";")[0].strip().lower() not in types:
        raise UnsupportedBodyError(content_type, types[0])
    try:
        body = await request.body()
    except ClientDisconnect as error:
        raise UnreadableBodyError("its sender has gone") from error
    return await run_in_threadpool(read_json, body, max_values)


RunServiceDep = Annotated[RunService, Depends(get_run_service)]
EndedRunIdDep = Annotated[str, Depends(check_ended)]
RunResultDep = Annotated[RunResult, Depends(open_stored_run)]
StoredRunDep = Annotated[StoredRun, Depends(get_stored_run)]
RunCreateDep = Annotated[RunCreate, Depends(read_run_create)]
RunUpdateDep = Annotated[RunUpdate, Depends(read_run_update)]
RunsQueryDep = Annotated[RunsQuery, Query()]
SettingsDep = Annotated[Settings, Depends(get_settings)]
StudyServiceDep = Annotated[StudyService, Depends(get_study_service)]
StudyResultsDep = Annotated[StudyResults, Depends(open_study_results)]
StudyBodyDep = Annotated[Any, Depends(read_study_body)]
