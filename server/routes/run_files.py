"""What was recorded of a run: its file, and its signals as JSON, CSV, Parquet and NPZ."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Annotated, BinaryIO

from fastapi import APIRouter, Query, Response
from fastapi.responses import StreamingResponse

from slipgrasp.core.run.provenance import program_version
from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.exceptions import RecordingNotFoundError
from slipgrasp.recordings.export import write_csv, write_npz, write_parquet
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.server.dependencies import (
    DownloadRequestDep,
    FileCacheDep,
    RunResultDep,
    StoredRunDep,
)
from slipgrasp.server.http.conditions import file_tag, tag_of
from slipgrasp.server.http.downloads import (
    BINARY,
    CSV,
    PARQUET,
    Download,
    DownloadRequest,
    as_text,
    download_responses,
)
from slipgrasp.server.http.errors import ProblemPublic
from slipgrasp.server.http.file_cache import FileCache
from slipgrasp.server.runs.signals import SignalsPublic, encode_columns, select_columns

router = APIRouter(prefix="/runs", tags=["runs"])

_TABLE_PROBLEMS = (404, 409, 422, 507)


@router.get(
    "/{run_id}/signals",
    response_class=StreamingResponse,
    responses={
        200: {
            "description": "Columns by name, their units, and how many values each has.",
            "model": SignalsPublic,
        },
        **ProblemPublic.responses((404, 409, 422)),
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


@router.head("/{run_id}/recording", include_in_schema=False)
@router.get(
    "/{run_id}/recording",
    response_class=Response,
    responses=download_responses(BINARY, problems=(404, 409)),
)
def read_recording_file(stored: StoredRunDep, asked: DownloadRequestDep) -> Response:
    """The MCAP file, whole or a part of it."""
    try:
        tag, file = file_tag(stored.path), stored.path.open
        name = stored.file_name("mcap")
        download = Download(tag=tag, name=name, media_type=BINARY, open=partial(file, "rb"))
        return download.answer(asked)
    except FileNotFoundError:
        raise RecordingNotFoundError(stored.id) from None


@router.head("/{run_id}/signals.csv", include_in_schema=False)
@router.get(
    "/{run_id}/signals.csv",
    response_class=Response,
    responses=download_responses(CSV, problems=_TABLE_PROBLEMS),
)
def read_signals_as_csv(
    stored: StoredRunDep, asked: DownloadRequestDep, cache: FileCacheDep
) -> Response:
    """The table that ``slipgrasp export`` writes."""
    return _table(stored, asked, cache, "csv", CSV, _write_csv)


@router.head("/{run_id}/signals.parquet", include_in_schema=False)
@router.get(
    "/{run_id}/signals.parquet",
    response_class=Response,
    responses=download_responses(PARQUET, problems=_TABLE_PROBLEMS),
)
def read_signals_as_parquet(
    stored: StoredRunDep, asked: DownloadRequestDep, cache: FileCacheDep
) -> Response:
    """All columns with their units, and the scenario, as a Parquet table."""
    return _table(stored, asked, cache, "parquet", PARQUET, write_parquet)


@router.head("/{run_id}/signals.npz", include_in_schema=False)
@router.get(
    "/{run_id}/signals.npz",
    response_class=Response,
    responses=download_responses(BINARY, problems=_TABLE_PROBLEMS),
)
def read_signals_as_npz(
    stored: StoredRunDep, asked: DownloadRequestDep, cache: FileCacheDep
) -> Response:
    """All columns as NumPy arrays, and the scenario as JSON."""
    return _table(stored, asked, cache, "npz", BINARY, write_npz)


def _table(
    stored: StoredRun,
    asked: DownloadRequest,
    cache: FileCache,
    suffix: str,
    media_type: str,
    write: Callable[[RunResult, BinaryIO], None],
) -> Response:
    """A table of a recording; its tag is known without making it."""
    try:
        tag = tag_of(file_tag(stored.path), suffix, program_version())
    except FileNotFoundError:
        raise RecordingNotFoundError(stored.id) from None

    def make(stream: BinaryIO) -> None:
        write(read_recording(stored.path), stream)

    download = Download(
        tag=tag,
        name=stored.file_name(suffix),
        media_type=media_type,
        open=lambda: cache.open(tag, make),
    )
    return download.answer(asked)


def _write_csv(result: RunResult, stream: BinaryIO) -> None:
    with as_text(stream) as text:
        write_csv(result, text)
