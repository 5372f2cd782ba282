"""Comparisons of two saved runs, as JSON and as a picture."""

from __future__ import annotations

import io
from typing import Annotated

from fastapi import APIRouter, Query, Response

from slipgrasp.recordings.compare.comparison import compare
from slipgrasp.recordings.file.reader import read_as_stated
from slipgrasp.server.dependencies import RunServiceDep
from slipgrasp.server.http.downloads import BINARY_SCHEMA, PNG, SVG
from slipgrasp.server.http.errors import ProblemPublic
from slipgrasp.server.runs.diff import DiffFigureQuery, DiffPublic, DiffQuery

MEDIA_TYPES = {"svg": SVG, "png": PNG}

router = APIRouter(prefix="/diff", tags=["diff"])


@router.get("", responses=ProblemPublic.responses((404, 409, 422)))
def diff_runs(query: Annotated[DiffQuery, Query()], service: RunServiceDep) -> DiffPublic:
    """What tells two runs apart: parameters, phase changes, columns and metrics."""
    a, b = (read_as_stated(service.get(run_id).path) for run_id in (query.a, query.b))
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
        **ProblemPublic.responses((404, 409, 422)),
    },
)
def draw_diff(query: Annotated[DiffFigureQuery, Query()], service: RunServiceDep) -> Response:
    """Two runs over each other, their difference below."""
    # matplotlib takes a second to load, and most servers never draw.
    from slipgrasp.figures.comparison import draw_comparison
    from slipgrasp.figures.files import save_figure

    a, b = (service.open(run_id) for run_id in (query.a, query.b))
    figure = draw_comparison(compare(a, b, query.tolerance), a, b, (query.a, query.b))
    picture = io.BytesIO()
    save_figure(figure, picture, query.format)
    return Response(picture.getvalue(), media_type=MEDIA_TYPES[query.format])
