"""REST models of runs; numbers are SI and finite."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Annotated, Any, Literal, Self, get_type_hints

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, create_model

from slipgrasp.core.run.metrics import METRICS, Metric, Metrics
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.custom_laws import LawIdentity
from slipgrasp.core.trace.types import Outcome
from slipgrasp.core.words.interruptions import describe_damage
from slipgrasp.recordings.export import DATA_FORMATS
from slipgrasp.recordings.store.annotations import MAX_TAGS, RunName, RunNotes, RunTag
from slipgrasp.recordings.store.description import Description, PhaseChangeDocument
from slipgrasp.recordings.store.run_index import FoundRuns
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.server.addresses import run_path
from slipgrasp.server.runs.pending import PendingRun, RunState
from slipgrasp.server.runs.scenarios import ChangedValues, ChosenScenario, changed_scenario


def _finite_or_none(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


FiniteOrNone = Annotated[float | None, BeforeValidator(_finite_or_none)]
"""A quantity that may be missing in a failed run."""


class RunCreate(BaseModel):
    """A request for a run: a preset by name or a complete scenario, and changed values."""

    model_config = ConfigDict(
        extra="forbid",
        strict=True,
        json_schema_extra={
            "example": {"scenario": "paper-case-1", "set": {"object.mass": 1.4}},
        },
    )

    scenario: ChosenScenario
    law: Annotated[
        str | None,
        Field(
            description="Name of a control law, with recommended settings; `set` takes precedence."
        ),
    ] = None
    values: ChangedValues = {}

    def to_scenario(self) -> Scenario:
        """The requested scenario.

        Raises:
            ScenarioError: With one item per wrong field.
        """
        return changed_scenario(self.scenario, self.values, self.law)


class RunUpdate(BaseModel):
    """Changed annotations; omitted fields are not changed."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "example": {"name": "heavier object", "notes": "For the report.", "tags": ["report"]}
        },
    )

    name: Annotated[RunName, Field(description="at most 200 printable characters")] = ""
    notes: Annotated[RunNotes, Field(description="at most 10 000 characters, in several lines")] = (
        ""
    )
    tags: Annotated[
        list[RunTag],
        Field(max_length=MAX_TAGS, description="at most 32 of at most 64 printable characters"),
    ] = []

    def changes(self) -> dict[str, Any]:
        """The given values, by name."""
        return {name: getattr(self, name) for name in self.model_fields_set}


class PhaseChangePublic(PhaseChangeDocument):
    """A transition of a contact from one phase to another."""


class ReasonPublic(BaseModel):
    """Reason for an early end."""

    code: str
    message: str
    contact: int | None
    time: FiniteOrNone
    value: FiniteOrNone
    limit: FiniteOrNone
    hint: str


class WarningPublic(BaseModel):
    """A warning about a run."""

    code: str
    message: str
    count: int
    first_time: FiniteOrNone


_HINTS = get_type_hints(Metrics)


def _metric_type(metric: Metric) -> Any:
    if metric.kind != "number":
        return _HINTS[metric.name]
    return list[FiniteOrNone] if metric.per else FiniteOrNone


def _metric_field(metric: Metric) -> Any:
    """A field that is missing in older summaries without soft fingertips."""
    return (_metric_type(metric), ()) if metric.per == "pad" else _metric_type(metric)


class MetricsPublic(create_model("_Metrics", **{m.name: _metric_field(m) for m in METRICS})):
    """Metrics; lists have one item per contact, or x, y, theta.

    Those of soft fingertips are empty if there are none.
    """


class RunPublic(BaseModel):
    """A run without its signals: the output of ``slipgrasp run --json``, with id and links."""

    id: str | None = Field(description="null only if writing the recording failed")
    title: str = Field(description="title of its scenario")
    name: str = Field(description="name from a user; may be empty")
    display_name: str = Field(
        description="display name: `name` if given, else its preset and the differences from it"
    )
    notes: str
    tags: list[str]
    preset: str = Field(description="preset with the title of its scenario; empty if there is none")
    controller: str = Field(description="kind of its controller; empty if it cannot be read")
    law: LawIdentity | None = Field(
        default=None, description="the custom law of the run; null for a built-in one"
    )
    created: str | None
    size: int | None = Field(description="size of its recording, in bytes")
    kind: Literal["run", "measured"] = Field(
        default="run", description="measured: imported data without simulation"
    )
    outcome: Outcome | None = Field(description="null for measured data only")
    reason: ReasonPublic | None
    end_time: FiniteOrNone
    phase_changes: list[PhaseChangePublic]
    estimates: dict[str, FiniteOrNone]
    unknowns: list[str] = Field(
        description="keys of the parameters of hand and object that its controller did not know; "
        "it knew the true value of each of the others at every instant"
    )
    told: bool | None = Field(
        description="whether all parameters were known to its controller; null if the recording is "
        "damaged, or contains measured data"
    )
    metrics: MetricsPublic | None = Field(
        description="null only if the recording is damaged, or contains measured data"
    )
    warnings: list[WarningPublic]
    recording: str | None = Field(description="path of the file; null only if writing it failed")
    links: dict[str, str]

    @classmethod
    def from_stored(cls, stored: StoredRun) -> Self:
        """A stored run; one whose recording cannot be read is ``failed``."""
        own = run_path(stored.id)
        kept = {
            **_facts(stored),
            "id": stored.id,
            "name": stored.name,
            "notes": stored.notes,
            "tags": list(stored.tags),
            "created": stored.created,
            "size": stored.size,
            "recording": str(stored.path),
            "links": {
                "self": own,
                "signals": f"{own}/signals",
                **{f"signals_{each.name}": f"{own}/signals.{each.name}" for each in DATA_FORMATS},
                "recording": f"{own}/recording",
            },
        }
        if stored.is_measured:
            links = {name: kept["links"][name] for name in ("self", "recording")}
            return cls.model_validate(
                {**_EMPTY_SUMMARY, **kept, "kind": "measured", "links": links}
            )
        return cls.model_validate({**(stored.summary or _damaged_summary(stored.title)), **kept})

    @classmethod
    def from_description(cls, description: Description) -> Self:
        """A run that could not be stored."""
        unkept = {"id": None, "created": None, "recording": None, "size": None, "links": {}}
        told = {**_facts(description), "name": "", "notes": "", "tags": []}
        return cls.model_validate({**description.summary, **told, **unkept})


def _facts(run: StoredRun | Description) -> dict[str, str]:
    names = ("title", "display_name", "preset", "controller")
    return {name: getattr(run, name) for name in names}


class PendingRunPublic(BaseModel):
    """A run that has not ended: queued or being simulated."""

    id: str
    state: RunState
    progress: Annotated[float, Field(ge=0.0, le=1.0, description="simulated fraction")]
    links: dict[str, str]
    compiling: str = Field(
        description="progress and remaining time of compiling the simulation, if runs wait for it; "
        "otherwise empty"
    )

    @classmethod
    def from_pending(cls, pending: PendingRun, compiling: str) -> Self:
        """The current state of the run.

        Args:
            pending: The run.
            compiling: State of compilation as text; empty if the simulation is compiled.
        """
        own = run_path(pending.id)
        links = {"self": own, "stop": f"{own}/stop"}
        return cls(
            id=pending.id,
            state=pending.state,
            progress=pending.progress,
            links=links,
            compiling=compiling,
        )


_EMPTY_SUMMARY: dict[str, Any] = {
    "outcome": None,
    "reason": None,
    "end_time": None,
    "phase_changes": [],
    "estimates": {},
    "unknowns": [],
    "told": None,
    "metrics": None,
    "warnings": [],
}
"""Summary of a recording without a run that can be read."""


def _damaged_summary(finding: str) -> dict[str, Any]:
    reason = asdict(describe_damage(finding))
    return {**_EMPTY_SUMMARY, "outcome": Outcome.FAILED, "reason": reason}


class RunsPublic(BaseModel):
    """A page of the matching stored runs, and their number on all pages."""

    data: list[RunPublic]
    count: int
    unread: int = Field(
        description="recordings that were copied into the folder and have not been read yet; a "
        "search may miss them"
    )
    links: dict[str, str] = Field(description="next and prev, if there are such pages")

    @classmethod
    def from_found(cls, found: FoundRuns, links: dict[str, str]) -> Self:
        """Converts the results of a search to the response."""
        data = [RunPublic.from_stored(run) for run in found.runs]
        return cls(data=data, count=found.count, unread=found.unread, links=links)
