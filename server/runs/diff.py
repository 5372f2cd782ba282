"""REST models of a comparison of two runs."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from slipgrasp.recordings.compare.comparison import IntegrationError

RunId = Annotated[str, Field(max_length=100, description="id of a stored run")]
Tolerance = Annotated[
    Annotated[float, Field(ge=0.0, allow_inf_nan=False)] | None,
    Field(
        description="absolute tolerance [SI]; if omitted, the integration error that the "
        "tolerances of the runs allow"
    ),
]


class DiffQuery(BaseModel):
    """The compared runs, and the tolerance."""

    model_config = ConfigDict(extra="forbid")

    a: RunId
    b: RunId
    tolerance: Tolerance = None


class DiffFigureQuery(DiffQuery):
    """The compared runs, the tolerance, and the format of the figure."""

    format: Annotated[Literal["svg", "png"], Field(description="format of the image")] = "svg"


ParameterValue = bool | int | float | str | list[float] | None
MetricValue = bool | int | float | str | list[float | None] | None


class ParameterDifferencePublic(BaseModel):
    """A differing parameter of the scenario; null if a run does not have it."""

    key: str
    a: ParameterValue
    b: ParameterValue


class PhaseDifferencePublic(BaseModel):
    """A phase change that moved, or that is in one run only; times in s."""

    contact: int
    from_phase: Annotated[str, Field(alias="from")]
    to: str
    a: float | None
    b: float | None
    time_difference: float | None


class SignalDifferencePublic(BaseModel):
    """Difference of a column, in its SI unit."""

    max: float
    rms: float
    tolerance: float = Field(description="tolerance of the column")


class MetricPairPublic(BaseModel):
    """A metric of both runs, or outcome or end time if they differ."""

    a: MetricValue
    b: MetricValue


class ContradictionPublic(BaseModel):
    """A statement of a run that contradicts its samples."""

    run: Literal["a", "b"]
    what: str
    stated: bool | int | float | str | None
    computed: bool | int | float | str | None


class DiffPublic(BaseModel):
    """Differences between two runs; the object that ``slipgrasp diff --json`` prints."""

    equal: bool
    scenario: list[ParameterDifferencePublic]
    phase_changes: list[PhaseDifferencePublic]
    first_divergence: dict[str, float]
    signals: dict[str, SignalDifferencePublic]
    metrics: dict[str, MetricPairPublic]
    cause: float | None = Field(
        description="time of the first effect of different parameters [s]; null if there is none"
    )
    integration_error: IntegrationError | None
    contradictions: list[ContradictionPublic]
