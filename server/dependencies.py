"""What routes ask for, as annotated aliases.

A dependency that only looks something up is a coroutine: FastAPI calls all others in one of
forty threads, and while these wait for memory, a request for the health would wait too.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Annotated, Any

from fastapi import Depends, Header, Query, Request
from starlette.concurrency import run_in_threadpool

from slipgrasp.core.trace.columns import Column, columns_of
from slipgrasp.core.trace.trace import Trace
from slipgrasp.recordings.exceptions import RecordingNotFoundError
from slipgrasp.recordings.file.segment import Segment, read_outline
from slipgrasp.recordings.file.size import read_size
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.server.budget import MemoryBudget, Need
from slipgrasp.server.fits.schemas import FitCreate
from slipgrasp.server.fits.service import FitService
from slipgrasp.server.http.downloads import DownloadRequest
from slipgrasp.server.http.events import EventSlots
from slipgrasp.server.http.file_cache import FileCache
from slipgrasp.server.http.json_body import JSON_TYPE, MERGE_TYPE, read_body, read_values
from slipgrasp.server.http.waiting import WaitPreference
from slipgrasp.server.reading import RecordingReads
from slipgrasp.server.runs.retention import RetentionService
from slipgrasp.server.runs.schemas import RunCreate, RunUpdate
from slipgrasp.server.runs.search import RunsQuery
from slipgrasp.server.runs.service import RunService
from slipgrasp.server.runs.signals import SignalsQuery, select_columns
from slipgrasp.server.settings import Settings
from slipgrasp.server.studies.service import StudyService

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

LastEventId = Annotated[
    str,
    Header(
        alias="Last-Event-ID",
        pattern=r"^[0-9]{0,12}$",
        description="id of the last event that was received; only what is new is sent",
        examples=["120"],
    ),
]
"""The header of that name; empty where there is none."""


async def get_settings(request: Request) -> Settings:
    """The settings of the application that answers."""
    settings: Settings = request.app.state.settings
    return settings


async def get_run_service(request: Request) -> RunService:
    """The service of the application that answers."""
    return _run_service_of(request)


def _run_service_of(request: Request) -> RunService:
    service: RunService = request.app.state.run_service
    return service


def check_ended(run_id: str, request: Request) -> str:
    """The id of a run that may be changed.

    Raises:
        RunUnfinishedError: If it has not ended.
    """
    _run_service_of(request).check_ended(run_id)
    return run_id


def get_stored_run(run_id: str, request: Request) -> StoredRun:
    """The saved run of that id.

    Raises:
        RunUnfinishedError: If it has not ended.
        RecordingNotFoundError: If there is none.
    """
    return _run_service_of(request).get(run_id)


async def get_recording_reads(request: Request) -> RecordingReads:
    """What reads whole recordings for the application that answers."""
    reads: RecordingReads = request.app.state.recording_reads
    return reads


async def open_columns(
    stored: Annotated[StoredRun, Depends(get_stored_run)],
    query: Annotated[SignalsQuery, Query()],
    request: Request,
) -> AsyncIterator[list[Column]]:
    """The columns that are asked for of the saved run of that id, until it is answered.

    Raises:
        InvalidRequestError: For a name there is none of.
        RecordingError: If its file is damaged.
        MemoryLimitError: If they need more memory than there is.
        ServiceBusyError: If there is none for them now.
    """
    try:
        outline = await run_in_threadpool(read_outline, stored.path)
        size = await run_in_threadpool(read_size, stored.path)
    except RecordingNotFoundError:
        raise RecordingNotFoundError(stored.id) from None
    chosen = select_columns(outline, query.wanted)
    segment = query.segment_of(chosen)
    share = query.share_of(stored.summary.get("end_time", 0.0))
    need = Need.to_read_signals(size, _width_of(segment, outline), share)
    reads = await get_recording_reads(request)
    gone = request.is_disconnected
    async with reads.shared(stored.path, stored.id, segment, need, gone) as trace:
        yield select_columns(trace, [column.name for column in chosen])


def _width_of(segment: Segment, outline: Trace) -> int:
    """Columns of all signals that are read, with their times."""
    return 1 + sum(column.signal in segment.signals for column in columns_of(outline))


async def get_memory(request: Request) -> MemoryBudget:
    """The account of memory of the application that answers."""
    return _run_service_of(request).memory


async def get_study_service(request: Request) -> StudyService:
    """The service for studies of the application that answers."""
    return _study_service_of(request)


def _study_service_of(request: Request) -> StudyService:
    service: StudyService = request.app.state.study_service
    return service


def open_study_results(study_id: str, request: Request) -> StudyResults:
    """The results of the study of that id.

    Raises:
        StudyNotFoundError: If there is none.
        RecordingError: If its file is damaged.
    """
    return _study_service_of(request).results(study_id)


async def read_study_body(request: Request) -> Any:
    """The body of a request for a study, as plain values."""
    return await read_values(request, (JSON_TYPE,), MAX_STUDY_VALUES)


async def get_fit_service(request: Request) -> FitService:
    """The service for fits of the application that answers."""
    service: FitService = request.app.state.fit_service
    return service


async def read_fit_create(request: Request) -> FitCreate:
    """The body of a request for a fit."""
    return await read_body(request, FitCreate, (JSON_TYPE,))


async def read_run_create(request: Request) -> RunCreate:
    """The body of a request for a run."""
    return await read_body(request, RunCreate, (JSON_TYPE,))


async def read_run_update(request: Request) -> RunUpdate:
    """The body of a request to change what is written of a run."""
    return await read_body(request, RunUpdate, (JSON_TYPE, MERGE_TYPE))


async def get_retention_service(request: Request) -> RetentionService:
    """What deletes runs by rules for the application that answers."""
    service: RetentionService = request.app.state.retention_service
    return service


async def get_stopping(request: Request) -> asyncio.Event:
    """What is set once the server is to stop."""
    stopping: asyncio.Event = request.app.state.stopping
    return stopping


async def get_file_cache(request: Request) -> FileCache:
    """The files that the application that answers has made and keeps."""
    cache: FileCache = request.app.state.file_cache
    return cache


async def get_event_slots(request: Request) -> EventSlots:
    """How many streams of events of the application that answers are open."""
    slots: EventSlots = request.app.state.event_slots
    return slots


async def get_upload_slots(request: Request) -> asyncio.Semaphore:
    """How many more recordings may be sent at the same time."""
    slots: asyncio.Semaphore = request.app.state.upload_slots
    return slots


async def read_wait_preference(
    request: Request,
    prefer: Annotated[
        str | None,
        Header(
            description="`respond-async` answers at once, `wait=10` after 10 s at most; the run "
            "goes on meanwhile",
            examples=["wait=10"],
        ),
    ] = None,
) -> WaitPreference:
    """How long the client is willing to wait."""
    settings = await get_settings(request)
    # There may be several lines, of which the parameter above is only one.
    text = ",".join(request.headers.getlist("prefer"))
    return WaitPreference.from_header(text, settings.answer_within, settings.max_wait)


async def read_download_request(
    request: Request,
    range_: Annotated[
        str | None,
        Header(
            alias="Range",
            description="which bytes; one range, otherwise the whole file is sent",
            examples=["bytes=0-1023"],
        ),
    ] = None,
    if_range: Annotated[
        str | None, Header(description="send the part only if the `ETag` is still this one")
    ] = None,
    if_match: Annotated[
        str | None, Header(description="answer 412 if the `ETag` is another one")
    ] = None,
    if_none_match: Annotated[
        str | None, Header(description="answer 304 if the `ETag` is still this one")
    ] = None,
) -> DownloadRequest:
    """What of a file the client asks for."""
    return DownloadRequest(
        is_head=request.method == "HEAD",
        range=range_,
        if_range=if_range,
        if_match=if_match,
        if_none_match=if_none_match,
    )


RetentionServiceDep = Annotated[RetentionService, Depends(get_retention_service)]
RunServiceDep = Annotated[RunService, Depends(get_run_service)]
EndedRunIdDep = Annotated[str, Depends(check_ended)]
ColumnsDep = Annotated[list[Column], Depends(open_columns)]
StoredRunDep = Annotated[StoredRun, Depends(get_stored_run)]
MemoryDep = Annotated[MemoryBudget, Depends(get_memory)]
RecordingReadsDep = Annotated[RecordingReads, Depends(get_recording_reads)]
RunCreateDep = Annotated[RunCreate, Depends(read_run_create)]
RunUpdateDep = Annotated[RunUpdate, Depends(read_run_update)]
RunsQueryDep = Annotated[RunsQuery, Query()]
SettingsDep = Annotated[Settings, Depends(get_settings)]
StudyServiceDep = Annotated[StudyService, Depends(get_study_service)]
StudyResultsDep = Annotated[StudyResults, Depends(open_study_results)]
FitServiceDep = Annotated[FitService, Depends(get_fit_service)]
FitCreateDep = Annotated[FitCreate, Depends(read_fit_create)]
StudyBodyDep = Annotated[Any, Depends(read_study_body)]
FileCacheDep = Annotated[FileCache, Depends(get_file_cache)]
WaitPreferenceDep = Annotated[WaitPreference, Depends(read_wait_preference)]
DownloadRequestDep = Annotated[DownloadRequest, Depends(read_download_request)]
EventSlotsDep = Annotated[EventSlots, Depends(get_event_slots)]
UploadSlotsDep = Annotated[asyncio.Semaphore, Depends(get_upload_slots)]
StoppingDep = Annotated[asyncio.Event, Depends(get_stopping)]
