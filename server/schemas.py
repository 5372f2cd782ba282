"""What the REST interface gives; numbers are SI and finite."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, replace
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, BeforeValidator, Field, ValidationError

from core.loading import load_scenario, parameter_definitions
from core.parameters import Parameter
from core.result import RunResult
from core.scenario import Change, Scenario
from core.types import Outcome, Reason
from recordings.store import StoredRun

__all__ = [
    "API_PATH",
    "HealthPublic",
    "ParameterPublic",
    "ParametersPublic",
    "PresetPublic",
    "PresetSummary",
    "PresetsPublic",
    "ProblemPublic",
    "RunPublic",
    "RunsPublic",
]

API_PATH = "/api/v1"


def _finite_or_none(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


FiniteFloat = Annotated[float, Field(allow_inf_nan=False)]
FiniteOrNone = Annotated[float | None, BeforeValidator(_finite_or_none)]
"""A quantity that a run which went wrong may not have."""

PhaseName = Literal["stick", "slip_forward", "slip_backward"]


class PhaseChangePublic(BaseModel):
    """A contact passing from one phase to another."""

    time: FiniteFloat
    contact: int
    from_phase: Annotated[PhaseName, Field(alias="from")]
    to_phase: Annotated[PhaseName, Field(alias="to")]


class ReasonPublic(BaseModel):
    """Why a run ended early."""

    code: str
    message: str
    contact: int | None
    time: FiniteOrNone
    value: FiniteOrNone
    limit: FiniteOrNone
    hint: str


class WarningPublic(BaseModel):
    """Something worth knowing that did not end the run."""

    code: str
    message: str
    count: int
    first_time: FiniteOrNone


class MetricsPublic(BaseModel):
    """Figures of merit; lists have one entry per contact, or x, y, theta."""

    held: bool
    slipping_at_end: bool
    last_slip_time: FiniteOrNone
    slip_path: list[FiniteOrNone]
    peak_normal_force: list[FiniteOrNone]
    minimum_friction_margin: list[FiniteOrNone]
    rms_tracking_error: list[FiniteOrNone]
    final_tracking_error: list[FiniteOrNone]
    torque_effort: FiniteOrNone
    phase_change_count: int


class RunPublic(BaseModel):
    """A run without its signals: what ``slipgrasp run --json`` prints, its id and its links."""

    id: str | None = Field(description="null only if writing the recording failed")
    title: str
    created: str | None
    outcome: Outcome
    reason: ReasonPublic | None
    end_time: FiniteOrNone
    phase_changes: list[PhaseChangePublic]
    estimates: dict[str, FiniteOrNone]
    metrics: MetricsPublic | None = Field(description="null only if the recording is damaged")
    warnings: list[WarningPublic]
    recording: str | None = Field(description="path of the file; null only if writing it failed")
    links: dict[str, str]

    @classmethod
    def from_stored(cls, stored: StoredRun) -> Self:
        """A run that was saved; one whose recording tells nothing any more is ``failed``."""
        own = f"{API_PATH}/runs/{stored.id}"
        kept = {
            "id": stored.id,
            "title": stored.title,
            "created": stored.created,
            "recording": str(stored.path),
            "links": {
                "self": own,
                "signals": f"{own}/signals",
                "signals_csv": f"{own}/signals.csv",
                "recording": f"{own}/recording",
            },
        }
        try:
            return cls.model_validate({**stored.summary, **kept})
        except ValidationError:
            return cls.model_validate({**_damaged_summary(stored.title), **kept})

    @classmethod
    def from_result(cls, result: RunResult) -> Self:
        """A run that could not be saved: nothing of it can be asked for again."""
        unkept = {"id": None, "created": None, "recording": None, "links": {}}
        return cls.model_validate({**result.summary(), "title": result.scenario.title, **unkept})


def _damaged_summary(finding: str) -> dict[str, Any]:
    reason = Reason(
        code="damaged_recording",
        message=finding,
        contact=None,
        time=0.0,
        value=None,
        limit=None,
        hint="simulate the scenario again",
    )
    return {
        "outcome": Outcome.FAILED,
        "reason": asdict(reason),
        "end_time": None,
        "phase_changes": [],
        "estimates": {},
        "metrics": None,
        "warnings": [],
    }


class RunsPublic(BaseModel):
    """A page of the saved runs, newest first, and how many there are in all."""

    data: list[RunPublic]
    count: int


class PresetSummary(BaseModel):
    """A scenario that comes with the program."""

    name: str
    title: str
    links: dict[str, str]

    @classmethod
    def from_name(cls, name: str) -> Self:
        """The preset of that name."""
        links = {"self": f"{API_PATH}/presets/{name}"}
        return cls(name=name, title=load_scenario(name).title, links=links)


class PresetsPublic(BaseModel):
    """All presets."""

    data: list[PresetSummary]
    count: int


class PresetPublic(PresetSummary):
    """A preset with its scenario, as ``POST /runs`` takes it."""

    scenario: dict[str, Any]


class ParameterPublic(BaseModel):
    """One parameter of a scenario: what it means and what it may be."""

    key: str
    value: float | int | str | list[float] | None
    kind: Literal["number", "integer", "choice", "text", "number-or-list"]
    unit: str
    text: str
    limit: str
    minimum: float | None
    maximum: float | None
    exclusive_minimum: bool
    typical: tuple[float, float] | None
    choices: list[str]
    optional: bool
    changeable: bool

    @classmethod
    def from_parameter(cls, parameter: Parameter) -> Self:
        """The same parameter for a client."""
        return cls.model_validate(parameter, from_attributes=True)


class ParametersPublic(BaseModel):
    """The parameters of a preset by dotted key, list items by index."""

    data: list[ParameterPublic]
    count: int

    @classmethod
    def from_scenario(cls, scenario: Scenario) -> Self:
        """All parameters, and those of a timed change without value where there is none."""
        definitions = dict(parameter_definitions(scenario))
        example = Change(time=1.0, parameter="object.mass", value=1.0)
        changed = parameter_definitions(replace(scenario, changes=(example,)))
        for key in changed.keys() - definitions.keys():
            definitions[key] = replace(changed[key], value=None)
        data = [ParameterPublic.from_parameter(p) for p in definitions.values()]
        return cls(data=data, count=len(data))


class HealthPublic(BaseModel):
    """Whether the service is up, and how busy."""

    status: Literal["ok"]
    version: str
    kernel: Literal["ready", "compiling"]
    kernel_progress: float
    running: int
    waiting: int


class FieldErrorPublic(BaseModel):
    """One wrong field of a request."""

    field: str
    value: float | int | bool | str | None
    limit: str | None
    message: str


class ProblemPublic(BaseModel):
    """An error (RFC 9457, application/problem+json)."""

    type: str
    title: str
    status: int
    detail: str
    errors: list[FieldErrorPublic] = []

    @classmethod
    def responses(cls, statuses: Iterable[int]) -> dict[int | str, dict[str, Any]]:
        """How a route declares that it may answer so."""
        content = {"application/problem+json": {"schema": cls.model_json_schema()}}
        return {status: {"description": "Problem", "content": content} for status in statuses}
