"""A saved run as a table for other programs: Parquet and NPZ."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from typing import BinaryIO

from fastapi import APIRouter
from fastapi.responses import StreamingResponse

from core.result import RunResult
from recordings.export import write_npz, write_parquet
from server.dependencies import RunResultDep, StoredRunDep
from server.schemas import ProblemPublic

__all__ = ["router"]

PIECE_BYTES = 1 << 16
PARQUET = "application/vnd.apache.parquet"
NPZ = "application/octet-stream"

router = APIRouter(prefix="/runs", tags=["runs"])


@router.get(
    "/{run_id}/signals.parquet",
    response_class=StreamingResponse,
    responses={200: {"content": {PARQUET: {}}}, **ProblemPublic.responses((404, 422))},
)
def read_signals_as_parquet(stored: StoredRunDep, result: RunResultDep) -> StreamingResponse:
    """All columns with their units, and the scenario, as a Parquet table."""
    return _download(write_parquet, result, f"{stored.id}.parquet", PARQUET)


@router.get(
    "/{run_id}/signals.npz",
    response_class=StreamingResponse,
    responses={200: {"content": {NPZ: {}}}, **ProblemPublic.responses((404, 422))},
)
def read_signals_as_npz(stored: StoredRunDep, result: RunResultDep) -> StreamingResponse:
    """All columns as NumPy arrays, and the scenario as JSON."""
    return _download(write_npz, result, f"{stored.id}.npz", NPZ)


def _download(
    write: Callable[[RunResult, BinaryIO], None], result: RunResult, name: str, media_type: str
) -> StreamingResponse:
    headers = {"Content-Disposition": f'attachment; filename="{name}"'}
    pieces = _pieces(write, result)
    return StreamingResponse(pieces, media_type=media_type, headers=headers)


def _pieces(write: Callable[[RunResult, BinaryIO], None], result: RunResult) -> Iterator[bytes]:
    """The file by way of the disk, so that nothing of it stays in memory."""
    with tempfile.TemporaryFile() as file:
        write(result, file)
        file.seek(0)
        while piece := file.read(PIECE_BYTES):
            yield piece
