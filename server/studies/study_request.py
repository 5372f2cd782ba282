"""What the REST interface takes about studies: requests for one, and for parts of its results."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import scenario_from_mapping
from slipgrasp.core.study.definition import Study
from slipgrasp.core.study.loading import study_from_mapping
from slipgrasp.core.trace.types import Outcome
from slipgrasp.server.runs.run_request import find_preset

MAX_PAGE = 1000
CHECKED_RUNS = 100

Column = Annotated[str, Field(max_length=120)]
Limit = Annotated[int, Field(ge=1, le=MAX_PAGE, description="how many at most")]
Offset = Annotated[int, Field(ge=0, le=10**9, description="how many to skip")]


class StudiesQuery(BaseModel):
    """Which studies are asked for."""

    model_config = ConfigDict(extra="forbid")

    limit: Limit = 100
    offset: Offset = 0


class ResultsQuery(BaseModel):
    """Which rows of a study's results are asked for."""

    model_config = ConfigDict(extra="forbid")

    limit: Limit = 100
    offset: Offset = 0
    sort: Annotated[
        Column,
        Field(
            description="any column; '-' before it for falling order; rows without it come last",
            examples=["index", "-slip_path_0"],
        ),
    ] = "index"
    outcome: Annotated[
        Outcome | None, Field(description="only runs that ended so", examples=["completed"])
    ] = None
    held: Annotated[
        bool | None, Field(description="only runs that held the object, or only the others")
    ] = None


class MapQuery(BaseModel):
    """Which success map is asked for."""

    model_config = ConfigDict(extra="forbid")

    x: Annotated[
        Column | None,
        Field(description="varied key across; chosen if left out", examples=["object.mass"]),
    ] = None
    y: Annotated[
        Column | None,
        Field(description="varied key upwards; chosen if left out", examples=["object.mass"]),
    ] = None


def read_study(body: Any, max_runs: int) -> Study:
    """The study that a request asks for; its runs are counted, not made.

    Args:
        body: The request's body as plain values.
        max_runs: How many runs it may have.

    Raises:
        ScenarioError: With one entry per wrong field, or if there are too many runs.
    """
    study = study_from_mapping(body, _find_base)
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
    """Makes and validates the first runs of a study, and some of the others.

    Raises:
        ScenarioError: Naming the first wrong one by its index.
    """
    step = max(1, 2 * study.num_runs // CHECKED_RUNS)
    for index in (*range(min(CHECKED_RUNS // 2, study.num_runs)), *range(0, study.num_runs, step)):
        try:
            study.scenario_of(index)
        except ScenarioError as error:
            raise ScenarioError([_of_run(index, finding) for finding in error.errors]) from error


def _of_run(index: int, finding: FieldError) -> FieldError:
    field, message = f"runs.{index}.{finding.field}", f"run {index}: {finding.message}"
    return replace(finding, field=field, message=message)


def _find_base(base: Any) -> Scenario:
    """A preset by name or a whole scenario; a path is no name here, unlike on the command line."""
    try:
        return scenario_from_mapping(base) if isinstance(base, dict) else find_preset(base)
    except ScenarioError as error:
        raise ScenarioError([_in_base(finding) for finding in error.errors]) from error


def _in_base(finding: FieldError) -> FieldError:
    field = "base" if finding.field in ("", "scenario") else f"base.{finding.field}"
    return replace(finding, field=field)
