"""What came out of a study: rows page by page, numbers, and any row as a recording."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario.field_errors import nearest
from slipgrasp.recordings.exceptions import QueryError
from slipgrasp.server.dependencies import StudyResultsDep, StudyServiceDep
from slipgrasp.server.exceptions import InvalidRequestError, printable
from slipgrasp.server.http.errors import ProblemPublic
from slipgrasp.server.paging import page_links
from slipgrasp.server.runs.schemas import RunPublic
from slipgrasp.server.studies.schemas import (
    ResultsQuery,
    StudyComparisonPublic,
    StudyResultsPublic,
    StudySummaryPublic,
)

router = APIRouter(prefix="/studies/{study_id}", tags=["studies"])


@router.get(
    "/results",
    response_model=StudyResultsPublic,
    responses=ProblemPublic.responses((404, 422)),
)
def read_study_results(
    results: StudyResultsDep, query: Annotated[ResultsQuery, Query()], request: Request
) -> Response:
    """One row per run that is done, page by page, also while the study runs."""
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


@router.get("/summary", responses=ProblemPublic.responses((404, 422)))
def read_study_summary(results: StudyResultsDep) -> StudySummaryPublic:
    """How many runs ended in which way, and how the metrics are spread."""
    return StudySummaryPublic.from_summary(results.summary())


@router.get("/comparison", responses=ProblemPublic.responses((404, 422)))
def read_study_comparison(results: StudyResultsDep) -> StudyComparisonPublic:
    """What crossed values, such as those of a controller, did on the same samples."""
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
    """Make a row a recording: simulated again, and checked bit for bit against the study."""
    stored, is_new = service.record_run(study_id, index)
    run = RunPublic.from_stored(stored)
    response.headers["Location"] = run.links["self"]
    response.status_code = 201 if is_new else 200
    return run
