"""Comparisons of two stored runs, as JSON and as an image."""

from __future__ import annotations

import io
from typing import Annotated

from fastapi import APIRouter, Query, Response

from slipgrasp.recordings.compare.comparison import compare
from slipgrasp.recordings.compare.thinned import read_thinned
from slipgrasp.recordings.file.reader import read_as_stated, read_recording
from slipgrasp.recordings.file.size import read_size
from slipgrasp.server.budget import MOST_DRAWN_WHOLE, Need
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
    """Differences between two runs: parameters, phase changes, columns and metrics."""
    paths = [service.get(run_id).path for run_id in (query.a, query.b)]
    with memory.reserve(Need.to_compare(*map(read_size, paths))):
        a, b = map(read_as_stated, paths)
        return DiffPublic.model_validate(compare(a, b, query.tolerance).to_mapping())


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
    """A figure of two runs and their difference.

    Runs of more than 20 000 samples are reduced to the samples at events and at minima and maxima.
    """
    # Deferred, because matplotlib takes a second to load and most servers never draw.
    from slipgrasp.figures.comparison import draw_comparison
    from slipgrasp.figures.drawing_thread import in_drawing_thread
    from slipgrasp.figures.files import save_figure
    from slipgrasp.figures.trends import DRAWN_SIGNALS

    paths = service.get(query.a).path, service.get(query.b).path
    sizes = read_size(paths[0]), read_size(paths[1])
    is_long = max(size.samples for size in sizes) > MOST_DRAWN_WHOLE
    picture, names = io.BytesIO(), (query.a, query.b)
    with memory.reserve(Need.to_draw(*sizes)):
        if is_long:
            a, b = read_thinned(paths, sizes, DRAWN_SIGNALS)
        else:
            a, b = read_recording(paths[0]), read_recording(paths[1])
        found = compare(a, b, query.tolerance, check_claims=not is_long)
        in_drawing_thread(
            lambda: save_figure(draw_comparison(found, a, b, names), picture, query.format)
        )
    return Response(picture.getvalue(), media_type=MEDIA_TYPES[query.format])
