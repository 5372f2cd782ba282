"""Dependencies of routes, as annotated aliases.

Dependencies that only look something up are coroutines: FastAPI calls all others in one of forty
threads, and while these wait for memory, a health request would wait too.
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
        description="Any unique text, such as a UUID: a repeated request with the same key and "
        "body returns the same result, and creates nothing twice.",
        examples=["5f0c8f6e-6c1b-4d0e-9f57-3f6f0f1c2a4b"],
    ),
]
"""Key of a repeatable request (draft "The Idempotency-Key HTTP Header Field"); empty if absent."""

LastEventId = Annotated[
    str,
    Header(
        alias="Last-Event-ID",
        pattern=r"^[0-9]{0,12}$",
        description="id of the last received event; only newer events are sent",
        examples=["120"],
    ),
]
"""The header of that name; empty if absent."""


async def get_settings(request: Request) -> Settings:
    """The settings of the application."""
    settings: Settings = request.app.state.settings
    return settings


async def get_run_service(request: Request) -> RunService:
    """The run service of the application."""
    return _run_service_of(request)


def _run_service_of(request: Request) -> RunService:
    service: RunService = request.app.state.run_service
    return service


def check_ended(run_id: str, request: Request) -> str:
    """The id of a run that may be changed.

    Raises:
        RunUnfinishedError: If the run has not ended.
    """
    _run_service_of(request).check_ended(run_id)
    return run_id


def get_stored_run(run_id: str, request: Request) -> StoredRun:
    """The stored run of an id.

    Raises:
        RunUnfinishedError: If the run has not ended.
        RecordingNotFoundError: If it does not exist.
    """
    return _run_service_of(request).get(run_id)


async def get_recording_reads(request: Request) -> RecordingReads:
    """The shared reader of recordings."""
    reads: RecordingReads = request.app.state.recording_reads
    return reads


async def open_columns(
    stored: Annotated[StoredRun, Depends(get_stored_run)],
    query: Annotated[SignalsQuery, Query()],
    request: Request,
) -> AsyncIterator[list[Column]]:
    """The requested columns of a stored run, in memory until the response is sent.

    Raises:
        InvalidRequestError: For an unknown name.
        RecordingError: If its file is damaged.
        MemoryLimitError: If they need more memory than the budget.
        ServiceBusyError: If the memory stays in use.
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
    """Columns of all signals that were read, with their times."""
    return 1 + sum(column.signal in segment.signals for column in columns_of(outline))


async def get_memory(request: Request) -> MemoryBudget:
    """The memory budget of the application."""
    return _run_service_of(request).memory


async def get_study_service(request: Request) -> StudyService:
    """The study service of the application."""
    return _study_service_of(request)


def _study_service_of(request: Request) -> StudyService:
    service: StudyService = request.app.state.study_service
    return service


def open_study_results(study_id: str, request: Request) -> StudyResults:
    """The results of the study of an id.

    Raises:
        StudyNotFoundError: If it does not exist.
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
    """The body of a request to change the annotations of a run."""
    return await read_body(request, RunUpdate, (JSON_TYPE, MERGE_TYPE))


async def get_stopping(request: Request) -> asyncio.Event:
    """The event that is set when the server stops."""
    stopping: asyncio.Event = request.app.state.stopping
    return stopping


async def get_file_cache(request: Request) -> FileCache:
    """The file cache of the application."""
    cache: FileCache = request.app.state.file_cache
    return cache


async def get_event_slots(request: Request) -> EventSlots:
    """The number of open event streams of the application."""
    slots: EventSlots = request.app.state.event_slots
    return slots


async def get_upload_slots(request: Request) -> asyncio.Semaphore:
    """The number of further concurrent uploads."""
    slots: asyncio.Semaphore = request.app.state.upload_slots
    return slots


async def read_wait_preference(
    request: Request,
    prefer: Annotated[
        str | None,
        Header(
            description="`respond-async` responds immediately, `wait=10` after at most 10 s; the "
            "run continues meanwhile",
            examples=["wait=10"],
        ),
    ] = None,
) -> WaitPreference:
    """Time that the client is willing to wait."""
    settings = await get_settings(request)
    # The header may occur several times, but the parameter above has only one.
    text = ",".join(request.headers.getlist("prefer"))
    return WaitPreference.from_header(text, settings.answer_within, settings.max_wait)


async def read_download_request(
    request: Request,
    range_: Annotated[
        str | None,
        Header(
            alias="Range",
            description="range of bytes; one range only, otherwise the whole file is sent",
            examples=["bytes=0-1023"],
        ),
    ] = None,
    if_range: Annotated[
        str | None, Header(description="send the range only if the `ETag` still matches")
    ] = None,
    if_match: Annotated[
        str | None, Header(description="respond with 412 if the `ETag` differs")
    ] = None,
    if_none_match: Annotated[
        str | None, Header(description="respond with 304 if the `ETag` still matches")
    ] = None,
) -> DownloadRequest:
    """The conditions and range of a file request."""
    return DownloadRequest(
        is_head=request.method == "HEAD",
        range=range_,
        if_range=if_range,
        if_match=if_match,
        if_none_match=if_none_match,
    )


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
