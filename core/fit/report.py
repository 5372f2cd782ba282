"""Result of a fit, with evidence."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from slipgrasp.core.fit.profile import ParameterClass

EXPLAINED = 1.1
"""Chi-squared per degree of freedom up to which the noise explains the residuals."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedParameter:
    """Estimate of one parameter, with limits.

    Attributes:
        key: Dotted key.
        unit: SI unit.
        value: The estimate; None unless the data bound it on both sides.
        low: Lower end of the 95 % interval; None if the data do not determine it.
        high: Upper end; None if the data do not determine it.
        kind: Sides on which the data bound it; ``class`` in JSON.
        limits: Searched range.
        start: Value in the scenario.
        profile: Values and rise of chi-squared, with the other parameters adjusted.
        note: Further remark in a sentence; usually empty.
    """

    key: str
    unit: str
    value: float | None
    low: float | None
    high: float | None
    kind: ParameterClass
    limits: tuple[float, float]
    start: float
    profile: tuple[tuple[float, float], ...]
    note: str = ""

    def to_mapping(self) -> dict[str, Any]:
        """The parameter as plain values for JSON."""
        mapping = asdict(self)
        return {("class" if name == "kind" else name): value for name, value in mapping.items()}


@dataclass(frozen=True, slots=True, kw_only=True)
class StartReport:
    """Results of the searches from many starts.

    Attributes:
        count: Number of starts.
        same_minimum: Number of starts that reached the lowest minimum; 0 if only a scan over a
            friction found it.
        chi_squared: Final value of each start, lowest first.
    """

    count: int
    same_minimum: int
    chi_squared: tuple[float, ...]

    @property
    def sentence(self) -> str:
        """How the lowest minimum was reached."""
        if self.same_minimum == 0:
            return f"a scan over a friction reached the minimum, none of {self.count} starts did"
        return f"{self.same_minimum} of {self.count} starts reached the minimum"


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalResidual:
    """Residuals of one signal, model minus data.

    Attributes:
        name: Name of the column.
        unit: SI unit.
        sigma: Stated standard deviation of its noise.
        rms: Root mean square.
        max: Largest absolute residual.
        autocorrelation: Correlation of neighbouring residuals; near 0 for pure noise, near 1 for
            model errors.
    """

    name: str
    unit: str
    sigma: float
    rms: float
    max: float
    autocorrelation: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactInformation:
    """Information about a contact in the data.

    Attributes:
        contact: Index of the contact.
        slip_time: Time during which it slipped in the best run [s].
        most_used_friction: Largest ratio of tangential to normal force in the best run, a lower
            bound of the true friction of a contact that never slipped.
    """

    contact: int
    slip_time: float
    most_used_friction: float


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldOut:
    """Prediction of data that were not fitted.

    Attributes:
        name: Name of the data.
        chi_squared_per_value: Mean square of the residuals in standard deviations.
        signals: Residuals by signal.
        final: Model minus data at the last sample, by column name.
    """

    name: str
    chi_squared_per_value: float
    signals: tuple[SignalResidual, ...]
    final: dict[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelComparison:
    """Comparison of a model with additional free parameters.

    Attributes:
        added: Keys of the additional free parameters; empty for the fitted model.
        chi_squared: Its minimum.
        held_out: Mean square of its residuals on data that were not fitted, by name.
        values: Fitted values.
    """

    added: tuple[str, ...]
    chi_squared: float
    held_out: dict[str, float]
    values: dict[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Coverage:
    """Result of synthetic twins: the best run with new noise, fitted again.

    Attributes:
        twins: Number of twins.
        seed: Seed of their noise.
        covered: Number of 95 % intervals that contain the true value, by key.
    """

    twins: int
    seed: int
    covered: dict[str, int]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FitReport:
    """The result of a fit.

    Attributes:
        parameters: Parameters of the scenario and of the measurement, by key.
        starts: Results of the searches.
        evaluations: Number of simulated runs, except those of twins and predictions.
        held_out: Predictions of other data.
        chi_squared: The minimum.
        degrees_of_freedom: Number of values minus the number of free parameters.
        threshold: Rise of chi-squared at the ends of the intervals: 3.84, times chi-squared per
            degree of freedom if residuals exceed the noise.
        best: Values of the best run; for an unbounded parameter, one of many.
        on_limit: Parameters whose best value is at a limit of its range.
        residuals: Residuals by signal.
        events: Times of the phase changes in the best run [s].
        contacts: Information about each contact.
        models: Other models, the fitted one first; empty if none was compared.
        coverage: Result of twins; None without twins.
    """

    parameters: dict[str, FittedParameter]
    starts: StartReport
    evaluations: int
    held_out: tuple[HeldOut, ...]
    chi_squared: float
    degrees_of_freedom: float
    threshold: float
    best: dict[str, float]
    on_limit: tuple[str, ...]
    residuals: tuple[SignalResidual, ...]
    events: tuple[float, ...]
    contacts: tuple[ContactInformation, ...]
    models: tuple[ModelComparison, ...] = ()
    coverage: Coverage | None = None

    @property
    def explains(self) -> bool:
        """Whether the residuals are no larger than the noise, within a tenth."""
        return self.chi_squared <= EXPLAINED * self.degrees_of_freedom

    @property
    def noise_is_smaller(self) -> bool:
        """Whether the stated noise is at least twice as large as the residuals."""
        return self.chi_squared < 0.25 * self.degrees_of_freedom

    def to_mapping(self) -> dict[str, Any]:
        """The report as plain values for JSON (the ``fit --json`` object)."""
        mapping = asdict(self)
        mapping["parameters"] = {k: p.to_mapping() for k, p in self.parameters.items()}
        return {**mapping, "explains": self.explains}
