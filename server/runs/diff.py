"""What a comparison of two runs looks like outside."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from slipgrasp.recordings.compare.comparison import Comparison

RunId = Annotated[str, Field(max_length=100, description="id of a saved run")]
Tolerance = Annotated[
    Annotated[float, Field(ge=0.0, allow_inf_nan=False)] | None,
    Field(
        description="absolute difference that counts as none [SI]; what the integration may be "
        "off, by the tolerances of the runs, if left out"
    ),
]


class DiffQuery(BaseModel):
    """Which runs are compared, and how strictly."""

    model_config = ConfigDict(extra="forbid")

    a: RunId
    b: RunId
    tolerance: Tolerance = None


class DiffFigureQuery(DiffQuery):
    """Which runs are compared, how strictly, and how they are drawn."""

    format: Annotated[Literal["svg", "png"], Field(description="format of the picture")] = "svg"


ParameterValue = bool | int | float | str | list[float] | None
MetricValue = bool | int | float | str | list[float | None] | None


class ParameterDifferencePublic(BaseModel):
    """A parameter of the scenario that differs; null where a run has none."""

    key: str
    a: ParameterValue
    b: ParameterValue


class PhaseDifferencePublic(BaseModel):
    """A phase change that moved, or that only one run has; times in s."""

    contact: int
    from_phase: Annotated[str, Field(alias="from")]
    to: str
    a: float | None
    b: float | None
    time_difference: float | None


class SignalDifferencePublic(BaseModel):
    """How far a column differs, in its SI unit."""

    max: float
    rms: float
    tolerance: float = Field(description="difference that counts as none")


class MetricPairPublic(BaseModel):
    """A metric of both runs, or how they ended where that differs."""

    a: MetricValue
    b: MetricValue


class IntegrationErrorPublic(BaseModel):
    """How far the runs differ before anything that was set does, where they differ most."""

    before: float
    column: str
    max: float
    unit: str


class ContradictionPublic(BaseModel):
    """What a run states of itself, and what its samples give."""

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
        description="when what was set first differs [s]; null if it never does"
    )
    integration_error: IntegrationErrorPublic | None
    contradictions: list[ContradictionPublic]

    @classmethod
    def from_comparison(cls, comparison: Comparison) -> DiffPublic:
        """The comparison as it is answered."""
        return cls.model_validate(comparison.to_mapping())
