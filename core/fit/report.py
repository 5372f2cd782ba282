"""The result of a fit, and the evidence for it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from slipgrasp.core.fit.profile import ParameterClass


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedParameter:
    """The estimate of one parameter, and its limits.

    Attributes:
        key: Dotted key.
        unit: SI unit.
        value: The estimate; None unless the data bound it on both sides.
        low: Lower end of the 95 % interval; None where the data give none.
        high: Upper end, likewise.
        kind: Which sides the data bound; ``class`` in JSON.
        limits: The range that was searched.
        start: Value in the scenario.
        profile: Values and rise of chi-squared there, the other parameters following.
        note: What else is to be said, in a sentence; mostly empty.
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
    """How the searches from many starts ended.

    Attributes:
        count: Number of starts.
        same_minimum: How many of them reached the minimum with the lowest chi-squared.
        chi_squared: Where each ended, lowest first.
    """

    count: int
    same_minimum: int
    chi_squared: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalResidual:
    """Residuals of one signal, model minus data.

    Attributes:
        name: Name of the column.
        unit: SI unit.
        sigma: Standard deviation of its noise, as stated.
        rms: Root mean square.
        max: Largest absolute residual.
        autocorrelation: Correlation of neighbouring residuals; near 0 where noise is all that is
            left, near 1 where the model misses something.
    """

    name: str
    unit: str
    sigma: float
    rms: float
    max: float
    autocorrelation: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactInformation:
    """Where the information on a contact is.

    Attributes:
        contact: Index of the contact.
        slip_time: Time during which it slipped in the best run [s].
        most_used_friction: Largest ratio of tangential to normal force in the best run; the true
            friction of a contact that never slipped is at least that.
    """

    contact: int
    slip_time: float
    most_used_friction: float


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldOut:
    """How well the best run predicts data that were not fitted.

    Attributes:
        name: Name of the data.
        chi_squared_per_value: Mean square of the residuals in standard deviations.
        signals: Residuals signal by signal.
        final: Model minus data at the last sample, by name of the column.
    """

    name: str
    chi_squared_per_value: float
    signals: tuple[SignalResidual, ...]
    final: dict[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelComparison:
    """Another model of the same data: the same parameters and more.

    Attributes:
        added: Keys of the parameters that are free besides, or none: the model that was fitted.
        chi_squared: Its minimum.
        held_out: Mean square of its residuals on the data that were not fitted, by name.
        values: What it found.
    """

    added: tuple[str, ...]
    chi_squared: float
    held_out: dict[str, float]
    values: dict[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Coverage:
    """Synthetic twins: the best run with new noise, fitted again.

    Attributes:
        twins: Number of twins.
        seed: Seed of their noise.
        covered: How many of their 95 % intervals held the truth, by key.
    """

    twins: int
    seed: int
    covered: dict[str, int]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FitReport:
    """The result of a fit.

    Attributes:
        parameters: Parameters of the scenario and of the measurement, by key.
        starts: How the searches ended.
        evaluations: Number of runs that were simulated, twins and predictions apart.
        held_out: Predictions of other data.
        chi_squared: The minimum.
        degrees_of_freedom: Number of values less the free parameters.
        threshold: Rise of chi-squared at the ends of the intervals: 3.84, times chi-squared per
            degree of freedom where the model misses more than the noise explains.
        best: Values of the best run; where a parameter is not bounded, one of many.
        on_limit: Parameters whose best value is at an end of its range.
        residuals: Signal by signal.
        events: Times of the phase changes in the best run [s].
        contacts: Where the information on each contact is.
        models: Other models, the fitted one first; empty if none was compared.
        coverage: What twins showed; None without any.
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
        """True if the residuals are no larger than the noise, within a tenth."""
        return self.chi_squared <= 1.1 * self.degrees_of_freedom

    @property
    def noise_is_smaller(self) -> bool:
        """True if the noise was stated at least twice as large as the residuals are."""
        return self.chi_squared < 0.25 * self.degrees_of_freedom

    def to_mapping(self) -> dict[str, Any]:
        """The report as plain values for JSON (the ``fit --json`` object)."""
        mapping = asdict(self)
        mapping["parameters"] = {k: p.to_mapping() for k, p in self.parameters.items()}
        return {**mapping, "explains": self.explains}
