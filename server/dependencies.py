"""Dependencies of routes, as annotated aliases.

Dependencies that only look something up are coroutines: FastAPI calls all others in one of forty
threads, and while these wait for memory, a health request would wait too.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Annotated, Any

from anyio import CapacityLimiter
from fastapi import Depends, Header, Query, Request
from pydantic import BaseModel
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
from slipgrasp.server.http.file_cache import FileCache
from slipgrasp.server.http.job_events import EventRequest
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


def _in_state(name: str) -> Any:
    """The object with this name in the state of the application."""

    async def get(request: Request) -> Any:
        return getattr(request.app.state, name)

    return Depends(get)


def _json_body(kind: type[BaseModel], *types: str) -> Any:
    """The JSON body of a request, of a given kind and content type."""

    async def read(request: Request) -> Any:
        return await read_body(request, kind, types)

    return Depends(read)


SettingsDep = Annotated[Settings, _in_state("settings")]
StoppingDep = Annotated[asyncio.Event, _in_state("stopping")]
RunServiceDep = Annotated[RunService, _in_state("run_service")]
StudyServiceDep = Annotated[StudyService, _in_state("study_service")]
FitServiceDep = Annotated[FitService, _in_state("fit_service")]
FileCacheDep = Annotated[FileCache, _in_state("file_cache")]
RecordingReadsDep = Annotated[RecordingReads, _in_state("recording_reads")]
EventSlotsDep = Annotated[asyncio.Semaphore, _in_state("event_slots")]
EventMakersDep = Annotated[CapacityLimiter, _in_state("event_makers")]
UploadSlotsDep = Annotated[asyncio.Semaphore, _in_state("upload_slots")]
RunCreateDep = Annotated[RunCreate, _json_body(RunCreate, JSON_TYPE)]
RunUpdateDep = Annotated[RunUpdate, _json_body(RunUpdate, JSON_TYPE, MERGE_TYPE)]
FitCreateDep = Annotated[FitCreate, _json_body(FitCreate, JSON_TYPE)]
RunsQueryDep = Annotated[RunsQuery, Query()]


def check_ended(run_id: str, service: RunServiceDep) -> str:
    """The id of a run that may be changed.

    Raises:
        RunUnfinishedError: If the run has not ended.
    """
    service.check_ended(run_id)
    return run_id


def get_stored_run(run_id: str, service: RunServiceDep) -> StoredRun:
    """The stored run with this id.

    Raises:
        RunUnfinishedError: If the run has not ended.
        RecordingNotFoundError: If it does not exist.
    """
    return service.get(run_id)


StoredRunDep = Annotated[StoredRun, Depends(get_stored_run)]


async def open_columns(
    stored: StoredRunDep,
    query: Annotated[SignalsQuery, Query()],
    reads: RecordingReadsDep,
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
    gone = request.is_disconnected
    async with reads.shared(stored.path, stored.id, segment, need, gone) as trace:
        yield select_columns(trace, [column.name for column in chosen])


def _width_of(segment: Segment, outline: Trace) -> int:
    """Number of columns of the signals to read, with that of the times."""
    return 1 + sum(column.signal in segment.signals for column in columns_of(outline))


async def get_memory(service: RunServiceDep) -> MemoryBudget:
    """The memory budget of the application."""
    return service.memory


def open_study_results(study_id: str, service: StudyServiceDep) -> StudyResults:
    """The results of the study with this id.

    Raises:
        StudyNotFoundError: If it does not exist.
        RecordingError: If its file is damaged.
    """
    return service.results(study_id)


async def read_study_body(request: Request) -> Any:
    """The body of a request for a study, as plain values."""
    return await read_values(request, (JSON_TYPE,), MAX_STUDY_VALUES)


async def read_event_request(
    settings: SettingsDep,
    stopping: StoppingDep,
    slots: EventSlotsDep,
    makers: EventMakersDep,
    last_event_id: Annotated[
        str,
        Header(
            alias="Last-Event-ID",
            pattern=r"^[0-9]{0,12}$",
            description="id of the last received event; only newer events are sent",
            examples=["120"],
        ),
    ] = "",
) -> EventRequest:
    """A request for the events of a job."""
    return EventRequest(last_event_id, settings, stopping, slots, makers)


async def read_wait_preference(
    request: Request,
    settings: SettingsDep,
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
    # The header may occur several times, but the parameter above has only one.
    text = ",".join(request.headers.getlist("prefer"))
    return WaitPreference.from_header(text, settings.answer_within, settings.max_wait)


async def read_download_request(
    request: Request, asked: Annotated[DownloadRequest, Header()]
) -> DownloadRequest:
    """The conditions and range of a file request; HEAD has no range."""
    return asked.model_copy(update={"range": None}) if request.method == "HEAD" else asked


EndedRunIdDep = Annotated[str, Depends(check_ended)]
ColumnsDep = Annotated[list[Column], Depends(open_columns)]
MemoryDep = Annotated[MemoryBudget, Depends(get_memory)]
StudyResultsDep = Annotated[StudyResults, Depends(open_study_results)]
StudyBodyDep = Annotated[Any, Depends(read_study_body)]
EventRequestDep = Annotated[EventRequest, Depends(read_event_request)]
WaitPreferenceDep = Annotated[WaitPreference, Depends(read_wait_preference)]
DownloadRequestDep = Annotated[DownloadRequest, Depends(read_download_request)]
