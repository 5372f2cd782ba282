"""REST models of studies; numbers are SI and finite."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.law_choice import with_law
from slipgrasp.core.scenario.loading import scenario_from_mapping
from slipgrasp.core.study.cost import StudyCost
from slipgrasp.core.study.definition import KeptRecordings, Study
from slipgrasp.core.study.loading import check_members, study_from_mapping
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.study.result_columns import ResultColumn
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.server.addresses import study_path
from slipgrasp.server.jobs.job import StudyState
from slipgrasp.server.paging import Limit, Offset
from slipgrasp.server.runs.scenarios import find_preset
from slipgrasp.server.studies.progress import StudyStatus

CHECKED_RUNS = 100

Column = Annotated[str, Field(max_length=120)]


class ResultsQuery(BaseModel):
    """Filter and pagination of results."""

    model_config = ConfigDict(extra="forbid")

    limit: Limit = 100
    offset: Offset = 0
    sort: Annotated[
        Column,
        Field(
            description="any column; '-' before it for descending order; rows without it come last",
            examples=["index", "-slip_path_0"],
        ),
    ] = "index"
    outcome: Annotated[
        Outcome | None, Field(description="only runs with this outcome", examples=["completed"])
    ] = None
    held: Annotated[
        bool | None,
        Field(description="only runs that held the object (true), or that did not (false)"),
    ] = None


class MapQuery(BaseModel):
    """Axes of a map."""

    model_config = ConfigDict(extra="forbid")

    x: Annotated[
        Column | None,
        Field(
            description="varied key of the horizontal axis; automatic if omitted",
            examples=["object.mass"],
        ),
    ] = None
    y: Annotated[
        Column | None,
        Field(
            description="varied key of the vertical axis; automatic if omitted",
            examples=["object.mass"],
        ),
    ] = None


class StudyEstimatePublic(BaseModel):
    """Estimated cost of a study, from some of its runs."""

    model_config = ConfigDict(from_attributes=True)

    runs: int = Field(description="number of runs")
    seconds: float = Field(description="elapsed time with all workers [s]")
    bytes: int = Field(description="largest size on disk")
    warnings: list[str] = Field(default=[], description="possible obstacles")

    @classmethod
    def from_cost(cls, cost: StudyCost, warnings: tuple[str, ...] = ()) -> Self:
        """Converts the estimate to the response."""
        public = cls.model_validate(cost)
        return public.model_copy(update={"warnings": list(warnings)})


class StudyPublic(BaseModel):
    """A study and its progress; its results have separate addresses, see `links`."""

    id: str
    state: StudyState
    title: str
    base: str = Field(description="preset of the base; empty if there is none")
    keys: list[str] = Field(description="varied parameters by dotted key")
    num_runs: int = Field(description="number of runs")
    recordings: KeptRecordings = Field(description="runs whose recording is stored")
    created: str = Field(description="ISO 8601, UTC")
    finished: int = Field(description="number of finished runs")
    outcomes: dict[str, int] = Field(description="number of finished runs by outcome")
    rate: float | None = Field(description="recently finished runs per second; null while it waits")
    time_left: float | None = Field(description="remaining time, if known [s]")
    estimate: StudyEstimatePublic | None = Field(description="null once it has ended")
    message: str = Field(description="reason for a failure or cancellation; otherwise empty")
    warnings: list[str]
    links: dict[str, str]

    @classmethod
    def from_status(cls, status: StudyStatus) -> Self:
        """Converts the progress of a study to the response."""
        stored = status.stored
        cost = status.estimate
        return cls(
            id=stored.id,
            state=status.state,
            title=stored.title,
            base=stored.base_name,
            keys=list(stored.keys),
            num_runs=stored.num_runs,
            recordings=stored.recordings,
            created=stored.created,
            finished=status.finished,
            outcomes=status.outcomes,
            rate=status.rate,
            time_left=status.time_left,
            estimate=None if cost is None else StudyEstimatePublic.from_cost(cost),
            message=status.message,
            warnings=list(status.warnings),
            links=_links(stored.id, status.state),
        )


def _links(study_id: str, state: StudyState) -> dict[str, str]:
    own = study_path(study_id)
    parts = {
        "events": "events",
        "results": "results",
        "results_csv": "results.csv",
        "results_parquet": "results.parquet",
        "results_json": "results.json",
        "summary": "summary",
        "comparison": "comparison",
        "map_svg": "map.svg",
        "map_png": "map.png",
    }
    is_complete = state in (StudyState.COMPLETED, StudyState.CANCELLED)
    parts |= {"recording": "recording"} if is_complete else {"cancel": "cancel"}
    return {"self": own, **{name: f"{own}/{part}" for name, part in parts.items()}}


class StudiesPublic(BaseModel):
    """A page of studies, and their number on all pages."""

    data: list[StudyPublic]
    count: int
    links: dict[str, str] = Field(description="next and prev, if there are such pages")


class StudyResultsPublic(BaseModel):
    """A page of results, and the number of rows on all pages."""

    data: list[dict[str, Any]] = Field(description="one object per run: column to value")
    columns: list[ResultColumn]
    count: int = Field(description="number of matching rows on all pages")
    finished: int = Field(description="number of finished runs, matching or not")
    links: dict[str, str] = Field(description="next and prev, if there are such pages")

    @classmethod
    def from_page(
        cls, results: StudyResults, rows: list[dict[str, Any]], count: int, links: dict[str, str]
    ) -> Self:
        """Some rows of the results."""
        return cls(
            data=rows,
            columns=list(results.columns),
            count=count,
            finished=results.num_rows,
            links=links,
        )


def read_study(body: Any, max_runs: int) -> Study:
    """The requested study; its runs are counted, but not created.

    Args:
        body: The request's body as plain values.
        max_runs: Largest number of runs.

    Raises:
        ScenarioError: With one item per wrong field, or if there are too many runs.
    """
    kind = body.get("law") if isinstance(body, dict) else None
    if kind is not None:
        # As in a study file, but only with names: no code, and no paths.
        body = {key: value for key, value in body.items() if key != "law"}
    study = study_from_mapping(body, partial(_find_base, kind=kind))
    if study.num_runs > max_runs:
        message = (
            f"the study has {study.num_runs} runs, at most {max_runs} are allowed on this server; "
            "use fewer values, several studies, or 'slipgrasp study' on the command line"
        )
        limit = f"at most {max_runs} runs"
        error = FieldError(field="vary", value=study.num_runs, limit=limit, message=message)
        raise ScenarioError([error])
    return study


def check_some_runs(study: Study) -> None:
    """Creates and validates the first runs of a study, and some of the others.

    Raises:
        ScenarioError: With the index of the first run of each kind of error.
    """
    step = max(1, 2 * study.num_runs // CHECKED_RUNS)
    first = range(min(CHECKED_RUNS // 2, study.num_runs))
    check_members(study, runs=(*first, *range(0, study.num_runs, step)))


def _find_base(base: Any, kind: Any) -> Scenario:
    """A preset by name or a complete scenario; paths are not allowed here."""
    try:
        found = scenario_from_mapping(base) if isinstance(base, dict) else find_preset(base)
        return found if kind is None else with_law(found, str(kind))
    except ScenarioError as error:
        raise ScenarioError([_in_base(finding) for finding in error.errors]) from error


def _in_base(finding: FieldError) -> FieldError:
    field = "base" if finding.field in ("", "scenario") else f"base.{finding.field}"
    return replace(finding, field=field)
