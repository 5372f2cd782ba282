"""Descriptions of runs for lists, stored with the recordings, because these take long to read."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    Field,
    TypeAdapter,
    ValidationError,
    WithJsonSchema,
)

from slipgrasp.core.run.metrics import Metrics
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.custom_laws import LawIdentity
from slipgrasp.core.scenario.supported import NO_CONTROLLER
from slipgrasp.core.trace.types import ContactPhase, Outcome, Reason, RunWarning
from slipgrasp.core.words.display_name import preset_titles
from slipgrasp.recordings.exceptions import DamagedRecordingError
from slipgrasp.recordings.measured.recording import MeasuredOutline

MEASURED = "measured"
"""The controller of measured data in lists; no control law has this name."""

_PHASES = tuple(phase.label for phase in ContactPhase)


def _known_phase(label: str) -> str:
    if label not in _PHASES:
        raise ValueError(f"there is no phase '{label[:40]}'")
    return label


PhaseName = Annotated[
    str, AfterValidator(_known_phase), WithJsonSchema({"type": "string", "enum": [*_PHASES]})
]
"""Name of a phase of `ContactPhase` in files and responses."""

FiniteFloat = Annotated[float, Field(allow_inf_nan=False)]


class PhaseChangeDocument(BaseModel):
    """A transition of a contact from one phase to another."""

    time: FiniteFloat
    contact: int
    from_phase: Annotated[PhaseName, Field(alias="from")]
    to_phase: Annotated[PhaseName, Field(alias="to")]


class _Summary(BaseModel):
    """`RunResult.summary` as read from JSON."""

    name: str
    outcome: Outcome
    reason: Reason | None
    end_time: FiniteFloat
    phase_changes: list[PhaseChangeDocument]
    estimates: dict[str, FiniteFloat]
    unknowns: list[str]
    told: bool
    metrics: Metrics
    warnings: list[RunWarning]
    law: LawIdentity | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Description:
    """A run without its trace.

    Attributes:
        title: Title of its scenario or of measured data, or why the recording cannot be read.
        controller: Kind of its controller; empty if the recording cannot be read, `MEASURED` for
            measured data.
        summary: `RunResult.summary` as read from JSON; empty if it cannot be read, and for measured
            data.
    """

    title: str
    controller: str
    summary: dict[str, Any]

    @classmethod
    def from_result(cls, result: RunResult) -> Self:
        """Creates the description of a run.

        Raises:
            DamagedRecordingError: If it cannot be stored, which only a forged recording can cause.
        """
        scenario = result.scenario
        document = {
            "title": scenario.title,
            "controller": scenario.controller.kind if scenario.space.has_control else NO_CONTROLLER,
            "summary": result.summary(),
        }
        try:
            text = json.dumps(document, ensure_ascii=False, allow_nan=False).encode()
            return cls.from_document(json.loads(text))
        except (ArithmeticError, ValueError) as error:
            finding = "its ending holds a number or text that no run has"
            raise DamagedRecordingError(scenario.title, finding) from error

    @classmethod
    def from_measured(cls, outline: MeasuredOutline) -> Self:
        """Creates the description of measured data."""
        return cls(title=outline.text, controller=MEASURED, summary={})

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> Self:
        """Reads an untrusted document.

        Raises:
            ArithmeticError, KeyError, TypeError, ValueError: If it is incomplete.
        """
        summary = dict(document["summary"])
        json.dumps(summary, allow_nan=False)
        try:
            _Summary.model_validate(summary)
        except ValidationError as error:
            raise ValueError("its summary is malformed") from error
        title, controller = document["title"], document["controller"]
        if not (isinstance(title, str) and isinstance(controller, str)):
            raise TypeError("title and controller must be text")
        return cls(title=title, controller=controller, summary=summary)

    @property
    def display_name(self) -> str:
        """Name of the run in lists; empty if it cannot be read."""
        return self.summary["name"] if self.summary else ""

    @property
    def preset(self) -> str:
        """The preset with the same title; empty if there is none."""
        return preset_titles().get(self.title, "") if self.summary else ""


def figures_of(summary: Mapping[str, Any]) -> dict[str, float | None]:
    """Searchable numbers of a run: end time and every scalar metric.

    Raises:
        ArithmeticError, KeyError, TypeError, ValueError: If the summary is incomplete.
    """
    metrics = _metrics_reader().validate_python(summary["metrics"])
    values = {"end_time": summary["end_time"], **metrics.flattened()}
    return {name: None if value is None else float(value) for name, value in values.items()}


@cache
def _metrics_reader() -> TypeAdapter[Metrics]:
    return TypeAdapter(Metrics)
