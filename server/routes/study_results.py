"""Results of a study: rows in pages, statistics, files, and any row as a recording."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Annotated, BinaryIO, Literal, TextIO

from fastapi import APIRouter, Path, Query, Request, Response

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario.field_errors import nearest
from slipgrasp.recordings.exceptions import QueryError, RecordingError
from slipgrasp.recordings.study.map_axes import choose_axes, numeric_keys
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.recordings.study.results_comparison import CombinationComparison
from slipgrasp.recordings.study.results_export import MOST_ROWS_AT_ONCE
from slipgrasp.recordings.study.results_summary import StudySummary
from slipgrasp.server.addresses import study_path
from slipgrasp.server.budget import Need
from slipgrasp.server.dependencies import (
    DownloadRequestDep,
    FileCacheDep,
    MemoryDep,
    StudyResultsDep,
    StudyServiceDep,
)
from slipgrasp.server.exceptions import InvalidRequestError, JobUnfinishedError, printable
from slipgrasp.server.http.conditions import file_tag, tag_of
from slipgrasp.server.http.downloads import (
    BINARY,
    CSV,
    JSON,
    PARQUET,
    PNG,
    SVG,
    Download,
    as_text,
    download_responses,
)
from slipgrasp.server.http.errors import ProblemPublic
from slipgrasp.server.http.file_cache import FileCache
from slipgrasp.server.paging import page_links
from slipgrasp.server.runs.schemas import RunPublic
from slipgrasp.server.studies.schemas import (
    MapQuery,
    ResultsQuery,
    StudyResultsPublic,
)

_PROBLEMS = (404, 422, 503, 507)

Write = Callable[[StudyResults, BinaryIO], None]

router = APIRouter(prefix="/studies/{study_id}", tags=["studies"])


@router.get(
    "/results",
    response_model=StudyResultsPublic,
    responses=ProblemPublic.responses((404, 422)),
)
def read_study_results(
    results: StudyResultsDep, query: Annotated[ResultsQuery, Query()], request: Request
) -> Response:
    """Rows of finished runs, in pages, also while the study runs."""
    try:
        rows, count = results.rows(
            query.offset,
            query.limit,
            sort=query.sort,
            outcome=query.outcome,
            held=query.held,
        )
    except QueryError as error:
        raise _wrong_sort(query.sort, error) from error
    links = page_links(str(request.url), query.offset, query.limit, count)
    page = StudyResultsPublic.from_page(results, rows, count, links)
    # Encoded in a thread, because a thousand rows would block the event loop.
    return Response(page.model_dump_json(), media_type="application/json")


def _wrong_sort(sort: str, error: QueryError) -> InvalidRequestError:
    shown, near = printable(sort), nearest(sort.removeprefix("-"), error.known)
    finding = FieldError(
        field="sort",
        value=shown,
        limit=f"one of {', '.join(error.known)}"[:2000],
        message=f"sort: there is no column '{shown}'{near}",
    )
    return InvalidRequestError([finding])


@router.get("/summary", responses=ProblemPublic.responses((404, 422, 503)))
def read_study_summary(results: StudyResultsDep, memory: MemoryDep) -> StudySummary:
    """Numbers of runs by outcome, and statistics of the metrics."""
    with memory.reserve(Need.for_rows(results.num_rows)):
        return results.summary()


@router.get("/comparison", responses=ProblemPublic.responses((404, 422, 503)))
def read_study_comparison(results: StudyResultsDep, memory: MemoryDep) -> CombinationComparison:
    """A comparison of crossed values, such as settings of a controller, on the same samples.

    It is empty if none are crossed.
    """
    with memory.reserve(Need.for_rows(results.num_rows)):
        compared = results.compare_combinations()
    return compared or CombinationComparison(keys=(), combinations=(), pairs=())


@router.post(
    "/results/{index}/recording",
    status_code=201,
    responses={
        200: {"description": "It is already stored", "model": RunPublic},
        **ProblemPublic.responses((404, 409, 422, 503, 507)),
    },
)
def record_study_run(
    study_id: str,
    index: Annotated[int, Path(ge=0, le=10**9, description="index of the run")],
    service: StudyServiceDep,
    response: Response,
) -> RunPublic:
    """Rebuild the recording of a row: simulate it again, and check it against the study."""
    stored, is_new = service.record_run(study_id, index)
    run = RunPublic.from_stored(stored)
    response.headers["Location"] = run.links["self"]
    response.status_code = 201 if is_new else 200
    return run


@router.head("/recording", include_in_schema=False)
@router.get(
    "/recording",
    response_class=Response,
    responses=download_responses(BINARY, problems=(404, 409, 422)),
)
def read_study_file(study_id: str, service: StudyServiceDep, asked: DownloadRequestDep) -> Response:
    """The MCAP file of an ended study: its base, its variation, and all rows."""
    if finding := service.status(study_id).stored.finding:
        raise RecordingError(finding)
    path = service.store.path_of(study_id)
    try:
        download = Download(
            tag=file_tag(path), name=path.name, media_type=BINARY, open=partial(path.open, "rb")
        )
        return download.answer(asked)
    except FileNotFoundError:
        raise JobUnfinishedError("study", study_id, study_path(study_id)) from None


def _add_file(
    name: str, route: Callable[..., Response], operation: str, media_type: str, description: str
) -> None:
    """Adds the route of a file."""
    router.add_api_route(f"/{name}", route, methods=["HEAD"], include_in_schema=False)
    router.add_api_route(
        f"/{name}",
        route,
        name=operation,
        description=description,
        response_class=Response,
        responses=download_responses(media_type, problems=_PROBLEMS),
    )


def _add_table(ending: str, media_type: str, write: Write, description: str) -> None:
    """Adds the route of a table; rows are only appended, so that their number gives its tag."""

    def read_table(
        study_id: str,
        results: StudyResultsDep,
        asked: DownloadRequestDep,
        cache: FileCacheDep,
        memory: MemoryDep,
    ) -> Response:
        shown = results.first(results.num_rows)
        need = Need.for_rows(min(shown.num_rows, MOST_ROWS_AT_ONCE))
        tag = tag_of(study_id, shown.num_rows, ending)

        def make(stream: BinaryIO) -> None:
            with memory.reserve(need):
                write(shown, stream)

        return _download(cache, study_id, ending, media_type, tag, make).answer(asked)

    operation = f"read_study_results_as_{ending}"
    _add_file(f"results.{ending}", read_table, operation, media_type, description)


def _add_map(ending: Literal["svg", "png"], media_type: str, description: str) -> None:
    """Adds the route of a map."""

    def draw_map(
        study_id: str,
        results: StudyResultsDep,
        query: Annotated[MapQuery, Query()],
        asked: DownloadRequestDep,
        cache: FileCacheDep,
        memory: MemoryDep,
    ) -> Response:
        x, y = _axes_of_map(results, query)
        shown = results.first(results.num_rows)
        tag = tag_of(study_id, shown.num_rows, x, y, ending)

        def make(stream: BinaryIO) -> None:
            with memory.reserve(Need.for_rows(shown.num_rows)):
                _draw_map(shown, x, y, stream, ending)

        return _download(cache, study_id, ending, media_type, tag, make).answer(asked)

    _add_file(f"map.{ending}", draw_map, f"draw_study_map_as_{ending}", media_type, description)


def _draw_map(
    results: StudyResults, x: str, y: str, stream: BinaryIO, ending: Literal["svg", "png"]
) -> None:
    # Deferred, because matplotlib takes a second to load.
    from slipgrasp.figures.drawing_thread import in_drawing_thread
    from slipgrasp.figures.files import save_figure
    from slipgrasp.figures.success_map import draw_success_map

    in_drawing_thread(lambda: save_figure(draw_success_map(results, x, y), stream, ending))


def _download(
    cache: FileCache,
    study_id: str,
    ending: str,
    media_type: str,
    tag: str,
    make: Callable[[BinaryIO], None],
) -> Download:
    return Download(
        tag=tag,
        name=f"{study_id}.{ending}",
        media_type=media_type,
        open=lambda: cache.open(tag, make),
    )


def _utf8(write: Callable[[StudyResults, TextIO], None]) -> Write:
    def write_bytes(results: StudyResults, stream: BinaryIO) -> None:
        with as_text(stream) as text:
            write(results, text)

    return write_bytes


def _axes_of_map(results: StudyResults, query: MapQuery) -> tuple[str, str]:
    """The keys of both axes.

    Raises:
        InvalidRequestError: If one is not a varied numeric key, both are the same, or there are no
            two.
    """
    known = numeric_keys(results.study)
    chosen = choose_axes(results.study) or (*known, *known)[:2]
    for field, key in (("x", query.x), ("y", query.y)):
        if key is not None and key not in known:
            shown = printable(key)
            message = f"{field}: '{shown}' is not a varied numeric key{nearest(key, known)}"
            raise _wrong_axis(field, shown, known, message)
    if len(known) < 2:
        message = f"a map needs two varied numeric keys; this study has {len(known)}"
        raise _wrong_axis("x", None, known, message)
    x = query.x or next(key for key in (*chosen, *known) if key != query.y)
    y = query.y or next(key for key in (*reversed(chosen), *known) if key != x)
    if x == y:
        raise _wrong_axis("y", y, known, f"y is '{y}' like x; choose two different keys")
    return x, y


def _wrong_axis(
    field: str, value: str | None, known: tuple[str, ...], message: str
) -> InvalidRequestError:
    limit = f"one of {', '.join(known)}" if known else None
    return InvalidRequestError([FieldError(field=field, value=value, limit=limit, message=message)])


_add_table(
    "csv",
    CSV,
    _utf8(StudyResults.write_csv),
    "Rows of finished runs; numbers have full precision.",
)
_add_table(
    "json",
    JSON,
    _utf8(StudyResults.write_json),
    "Rows of all finished runs, with the units of their columns.",
)
_add_table(
    "parquet",
    PARQUET,
    StudyResults.write_parquet,
    "Rows of all finished runs as a table with units; its metadata contain the study.",
)
_add_map("svg", SVG, "A map of outcomes over two of the varied parameters.")
_add_map("png", PNG, "A map of outcomes over two of the varied parameters, in pixels.")
