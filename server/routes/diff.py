"""Comparisons of two saved runs, as JSON and as a picture."""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import Annotated

from fastapi import APIRouter, Query, Response

from slipgrasp.recordings.compare.comparison import compare
from slipgrasp.recordings.file.reader import read_as_stated, read_recording
from slipgrasp.recordings.file.size import read_size
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.server.budget import Need
from slipgrasp.server.dependencies import MemoryDep, RunServiceDep
from slipgrasp.server.http.downloads import BINARY_SCHEMA, PNG, SVG
from slipgrasp.server.http.errors import ProblemPublic
from slipgrasp.server.runs.diff import DiffFigureQuery, DiffPublic, DiffQuery

MEDIA_TYPES = {"svg": SVG, "png": PNG}

router = APIRouter(prefix="/diff", tags=["diff"])


@router.get("", responses=ProblemPublic.responses((404, 409, 422, 503)))
def diff_runs(
    query: Annotated[DiffQuery, Query()], service: RunServiceDep, memory: MemoryDep
) -> DiffPublic:
    """What tells two runs apart: parameters, phase changes, columns and metrics."""
    stored = [service.get(run_id) for run_id in (query.a, query.b)]
    with memory.room(_need(stored)):
        a, b = (read_as_stated(run.path) for run in stored)
        return DiffPublic.from_comparison(compare(a, b, query.tolerance))


@router.get(
    "/figure",
    response_class=Response,
    responses={
        200: {
            "description": "The picture",
            "content": {
                media_type: {"schema": BINARY_SCHEMA} for media_type in MEDIA_TYPES.values()
            },
        },
        **ProblemPublic.responses((404, 409, 422, 503)),
    },
)
def draw_diff(
    query: Annotated[DiffFigureQuery, Query()], service: RunServiceDep, memory: MemoryDep
) -> Response:
    """Two runs over each other, their difference below."""
    # matplotlib takes a second to load, and most servers never draw.
    from slipgrasp.figures.comparison import draw_comparison
    from slipgrasp.figures.drawing_thread import in_drawing_thread
    from slipgrasp.figures.files import save_figure

    stored = [service.get(run_id) for run_id in (query.a, query.b)]
    picture = io.BytesIO()
    with memory.room(_need(stored)):
        a, b = (read_recording(run.path) for run in stored)
        found, names = compare(a, b, query.tolerance), (query.a, query.b)
        in_drawing_thread(
            lambda: save_figure(draw_comparison(found, a, b, names), picture, query.format)
        )
    return Response(picture.getvalue(), media_type=MEDIA_TYPES[query.format])


def _need(runs: Iterable[StoredRun]) -> Need:
    return Need.to_compare(*(read_size(run.path) for run in runs))
