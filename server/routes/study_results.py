"""What came out of a study: rows page by page, numbers, files, and any row as a recording."""

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
from slipgrasp.recordings.study.results_export import MOST_ROWS_AT_ONCE
from slipgrasp.server.addresses import study_path
from slipgrasp.server.budget import MemoryBudget, Need
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
    StudyComparisonPublic,
    StudyResultsPublic,
    StudySummaryPublic,
)

_PROBLEMS = (404, 422, 503, 507)

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
    # Made text here, in a thread: a thousand rows would hold up the event loop.
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
def read_study_summary(results: StudyResultsDep, memory: MemoryDep) -> StudySummaryPublic:
    """Numbers of runs by outcome, and statistics of the metrics."""
    with memory.reserve(Need.for_rows(results.num_rows)):
        return StudySummaryPublic.from_summary(results.summary())


@router.get("/comparison", responses=ProblemPublic.responses((404, 422, 503)))
def read_study_comparison(results: StudyResultsDep, memory: MemoryDep) -> StudyComparisonPublic:
    """A comparison of crossed values, such as settings of a controller, on the same samples."""
    with memory.reserve(Need.for_rows(results.num_rows)):
        return StudyComparisonPublic.from_comparison(results.compare_combinations())


@router.post(
    "/results/{index}/recording",
    status_code=201,
    responses={
        200: {"description": "It is kept already", "model": RunPublic},
        **ProblemPublic.responses((404, 409, 422, 503, 507)),
    },
)
def record_study_run(
    study_id: str,
    index: Annotated[int, Path(ge=0, le=10**9, description="number of the run")],
    service: StudyServiceDep,
    response: Response,
) -> RunPublic:
    """Rebuild the recording of a row: simulate it again, and check it against the study."""
    stored, is_new = service.record_run(study_id, index)
    run = RunPublic.from_stored(stored)
    response.headers["Location"] = run.links["self"]
    response.status_code = 201 if is_new else 200
    return run


@router.head("/results.csv", include_in_schema=False)
@router.get(
    "/results.csv",
    response_class=Response,
    responses=download_responses(CSV, problems=_PROBLEMS),
)
def read_study_results_as_csv(
    study_id: str,
    results: StudyResultsDep,
    asked: DownloadRequestDep,
    cache: FileCacheDep,
    memory: MemoryDep,
) -> Response:
    """Rows of finished runs; numbers have all their digits."""
    write = _utf8(results.write_csv)
    return _table(cache, memory, study_id, results, "csv", CSV, write).answer(asked)


@router.head("/results.json", include_in_schema=False)
@router.get(
    "/results.json",
    response_class=Response,
    responses=download_responses(JSON, problems=_PROBLEMS),
)
def read_study_results_as_json(
    study_id: str,
    results: StudyResultsDep,
    asked: DownloadRequestDep,
    cache: FileCacheDep,
    memory: MemoryDep,
) -> Response:
    """Rows of all finished runs, with the units of their columns."""
    write = _utf8(results.write_json)
    return _table(cache, memory, study_id, results, "json", JSON, write).answer(asked)


@router.head("/results.parquet", include_in_schema=False)
@router.get(
    "/results.parquet",
    response_class=Response,
    responses=download_responses(PARQUET, problems=_PROBLEMS),
)
def read_study_results_as_parquet(
    study_id: str,
    results: StudyResultsDep,
    asked: DownloadRequestDep,
    cache: FileCacheDep,
    memory: MemoryDep,
) -> Response:
    """Rows of all finished runs as a table with units; its metadata contain the study."""
    write = results.write_parquet
    return _table(cache, memory, study_id, results, "parquet", PARQUET, write).answer(asked)


@router.head("/map.svg", include_in_schema=False)
@router.get(
    "/map.svg", response_class=Response, responses=download_responses(SVG, problems=_PROBLEMS)
)
def draw_study_map_as_svg(
    study_id: str,
    results: StudyResultsDep,
    query: Annotated[MapQuery, Query()],
    asked: DownloadRequestDep,
    cache: FileCacheDep,
    memory: MemoryDep,
) -> Response:
    """A map of outcomes over two of the varied parameters."""
    return _map(study_id, results, query, cache, memory, "svg").answer(asked)


@router.head("/map.png", include_in_schema=False)
@router.get(
    "/map.png", response_class=Response, responses=download_responses(PNG, problems=_PROBLEMS)
)
def draw_study_map_as_png(
    study_id: str,
    results: StudyResultsDep,
    query: Annotated[MapQuery, Query()],
    asked: DownloadRequestDep,
    cache: FileCacheDep,
    memory: MemoryDep,
) -> Response:
    """A map of outcomes over two of the varied parameters, in pixels."""
    return _map(study_id, results, query, cache, memory, "png").answer(asked)


@router.head("/recording", include_in_schema=False)
@router.get(
    "/recording",
    response_class=Response,
    responses=download_responses(BINARY, problems=(404, 409, 422)),
)
def read_study_file(study_id: str, service: StudyServiceDep, asked: DownloadRequestDep) -> Response:
    """The MCAP file of a study that has ended: its base, its variation, and all rows."""
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


def _utf8(write: Callable[[TextIO, int], None]) -> Callable[[BinaryIO, int], None]:
    def write_bytes(stream: BinaryIO, num_rows: int) -> None:
        with as_text(stream) as text:
            write(text, num_rows)

    return write_bytes


def _table(
    cache: FileCache,
    memory: MemoryBudget,
    study_id: str,
    results: StudyResults,
    ending: str,
    media_type: str,
    write: Callable[[BinaryIO, int], None],
) -> Download:
    """A download of results; rows are only added, so their number determines the tag."""
    count = results.num_rows
    tag = tag_of(study_id, count, ending)

    def make(stream: BinaryIO) -> None:
        with memory.reserve(Need.for_rows(min(count, MOST_ROWS_AT_ONCE))):
            write(stream, count)

    return Download(
        tag=tag,
        name=f"{study_id}.{ending}",
        media_type=media_type,
        open=lambda: cache.open(tag, make),
    )


def _map(
    study_id: str,
    results: StudyResults,
    query: MapQuery,
    cache: FileCache,
    memory: MemoryBudget,
    ending: Literal["svg", "png"],
) -> Download:
    x, y = _axes_of_map(results, query)
    shown = results.first(results.num_rows)
    tag = tag_of(study_id, shown.num_rows, x, y, ending)

    def draw(stream: BinaryIO) -> None:
        # matplotlib takes a second to load.
        from slipgrasp.figures.drawing_thread import in_drawing_thread
        from slipgrasp.figures.files import save_figure
        from slipgrasp.figures.success_map import draw_success_map

        with memory.reserve(Need.for_rows(shown.num_rows)):
            in_drawing_thread(lambda: save_figure(draw_success_map(shown, x, y), stream, ending))

    return Download(
        tag=tag,
        name=f"{study_id}.{ending}",
        media_type=SVG if ending == "svg" else PNG,
        open=lambda: cache.open(tag, draw),
    )


def _axes_of_map(results: StudyResults, query: MapQuery) -> tuple[str, str]:
    """The keys along both axes.

    Raises:
        InvalidRequestError: If one does not vary in numbers, both are the same, or there are
            no two.
    """
    known = numeric_keys(results.study)
    chosen = choose_axes(results.study) or (*known, *known)[:2]
    for field, key in (("x", query.x), ("y", query.y)):
        if key is not None and key not in known:
            shown = printable(key)
            message = f"{field}: '{shown}' does not vary in numbers here{nearest(key, known)}"
            raise _wrong_axis(field, shown, known, message)
    if len(known) < 2:
        message = f"a map needs two keys that vary in numbers; this study has {len(known)}"
        raise _wrong_axis("x", None, known, message)
    x = query.x or next(key for key in (*chosen, *known) if key != query.y)
    y = query.y or next(key for key in (*reversed(chosen), *known) if key != x)
    if x == y:
        raise _wrong_axis("y", y, known, f"y: it is '{y}' like x; choose two keys")
    return x, y


def _wrong_axis(
    field: str, value: str | None, known: tuple[str, ...], message: str
) -> InvalidRequestError:
    limit = f"one of {', '.join(known)}" if known else None
    return InvalidRequestError([FieldError(field=field, value=value, limit=limit, message=message)])
