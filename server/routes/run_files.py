"""Files of a run: its recording, and its signals as JSON and in all data formats."""

from __future__ import annotations

from functools import partial
from typing import BinaryIO

from fastapi import APIRouter, Response
from fastapi.responses import StreamingResponse

from slipgrasp.core.run.provenance import program_version
from slipgrasp.recordings.exceptions import RecordingNotFoundError
from slipgrasp.recordings.export import DATA_FORMATS, ExportFormat
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.size import read_size
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.server.budget import MOST_EXPORTED_WHOLE, MemoryBudget, Need
from slipgrasp.server.dependencies import (
    ColumnsDep,
    DownloadRequestDep,
    FileCacheDep,
    MemoryDep,
    RecordingReadsDep,
    StoredRunDep,
)
from slipgrasp.server.http.conditions import file_tag, tag_of
from slipgrasp.server.http.downloads import (
    BINARY,
    Download,
    DownloadRequest,
    download_responses,
)
from slipgrasp.server.http.errors import ProblemPublic
from slipgrasp.server.http.file_cache import FileCache
from slipgrasp.server.runs.signals import SignalsPublic, encode_columns

router = APIRouter(prefix="/runs", tags=["runs"])

_TABLE_PROBLEMS = (404, 409, 422, 503, 507)


@router.get(
    "/{run_id}/signals",
    response_class=StreamingResponse,
    responses={
        200: {
            "description": "Columns by name, their units, and the number of values.",
            "model": SignalsPublic,
        },
        **ProblemPublic.responses((404, 409, 422, 503)),
    },
)
def read_signals(
    stored: StoredRunDep, columns: ColumnsDep, reads: RecordingReadsDep
) -> StreamingResponse:
    """The recorded columns of a run; an event has two values at one time."""
    pieces = reads.in_threads(encode_columns(stored.id, columns))
    return StreamingResponse(pieces, media_type="application/json")


@router.head("/{run_id}/recording", include_in_schema=False)
@router.get(
    "/{run_id}/recording",
    response_class=Response,
    responses=download_responses(BINARY, problems=(404, 409)),
)
def read_recording_file(stored: StoredRunDep, asked: DownloadRequestDep) -> Response:
    """The MCAP file, or a range of it."""
    try:
        tag, file = file_tag(stored.path), stored.path.open
        name = stored.file_name("mcap")
        download = Download(tag=tag, name=name, media_type=BINARY, open=partial(file, "rb"))
        return download.answer(asked)
    except FileNotFoundError:
        raise RecordingNotFoundError(stored.id) from None


def _table(
    export: ExportFormat,
    stored: StoredRun,
    asked: DownloadRequest,
    cache: FileCache,
    memory: MemoryBudget,
) -> Response:
    """The signals of a recording in a data format; their tag is known without writing them."""
    try:
        tag = tag_of(file_tag(stored.path), export.name, program_version())
    except FileNotFoundError:
        raise RecordingNotFoundError(stored.id) from None

    def open_table() -> BinaryIO:
        size = read_size(stored.path)
        is_long = size.samples > MOST_EXPORTED_WHOLE and size.has_all_metrics
        if not (is_long and export.long_writer):
            return cache.open(tag, partial(make, Need.to_export(size)))
        return cache.open(tag, partial(make_long, Need.to_export_long(size)), takes_long=True)

    def make(need: Need, stream: BinaryIO) -> None:
        with memory.reserve(need):
            export.write(read_recording(stored.path), stream)

    def make_long(need: Need, stream: BinaryIO) -> None:
        with memory.reserve(need):
            export.write_long(stored.path, stream)

    download = Download(
        tag=tag,
        name=stored.file_name(export.name),
        media_type=export.media_type,
        open=open_table,
    )
    return download.answer(asked)


def _add_table(export: ExportFormat) -> None:
    """Adds the route of a format."""

    def read_signals_as(
        stored: StoredRunDep,
        asked: DownloadRequestDep,
        cache: FileCacheDep,
        memory: MemoryDep,
    ) -> Response:
        return _table(export, stored, asked, cache, memory)

    path = f"/{{run_id}}/signals.{export.name}"
    router.add_api_route(path, read_signals_as, methods=["HEAD"], include_in_schema=False)
    router.add_api_route(
        path,
        read_signals_as,
        name=f"read_signals_as_{export.name}",
        description=export.description,
        response_class=Response,
        responses=download_responses(export.media_type, problems=_TABLE_PROBLEMS),
    )


for _export in DATA_FORMATS:
    _add_table(_export)
