"""Problem of a fit: a scenario, its free parameters, measured signals with their noise."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.field_errors import nearest
from slipgrasp.core.scenario.loading import parameter_definitions, with_values
from slipgrasp.core.scenario.parameters import Parameter
from slipgrasp.core.study.definition import expand_key
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.signals import SIGNALS, Floats

DELAY = "delay"
FORCE_BIAS = "force_bias"
NUISANCES = (DELAY, FORCE_BIAS)
MOST_PERIODS_LATE = 5.0
LARGEST_BIAS_SHARE = 0.2
"""Largest bias of a force sensor, as a fraction of the largest force."""

MISSING_SIGMAS = 30.0
"""Smallest residual of a sample after the end of a run, in standard deviations."""

JUMPY_UNITS = ("N", "N m", "m/s", "rad/s", "m/s²", "rad/s²")
"""Units of signals that are discontinuous at events."""

_MOST_FREE = 12
_FRICTION = re.compile(r"fingers\.(\d+)\.(static_)?friction")


class FitError(SlipgraspError):
    """An invalid fit; the message names field, value, limit and remedy.

    Attributes:
        field: The wrong input, with which the message begins; empty if there are several.
    """

    def __init__(self, message: str, field: str = "") -> None:
        self.field = field
        super().__init__(message)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Observations:
    """Measured signals over time.

    Attributes:
        names: Names of the columns, as in runs.
        units: Their SI units.
        times: Times of the samples, increasing, shape ``(samples,)`` [s].
        values: SI values, shape ``(samples, signals)``.
        sigmas: Standard deviation of the noise of each signal, shape ``(signals,)``.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    times: Floats
    values: Floats
    sigmas: Floats

    @property
    def period(self) -> float:
        """Median time between samples [s]."""
        return float(np.median(np.diff(self.times)))

    @property
    def count(self) -> int:
        """Number of values."""
        return self.values.size

    @classmethod
    def choose(
        cls, times: Floats, columns: Mapping[str, tuple[str, Floats]], noise: Mapping[str, float]
    ) -> Observations:
        """Selects the signals to fit.

        Args:
            times: Times of the samples [s]; of repeated times, the last sample is used.
            columns: Unit and values by name.
            noise: Standard deviation of the noise, in the unit of the signal, by name of a signal
                (``slip``) or of a single column (``slip_0``).

        Raises:
            FitError: If a signal was not measured, or a standard deviation is invalid.
        """
        sigmas: dict[str, float] = {}
        for name, sigma in noise.items():
            if not (math.isfinite(sigma) and sigma > 0.0):
                message = f"signals {name[:60]}:{sigma:g}: the noise must be a number above 0"
                raise FitError(message, "signals")
            for column in _columns_named(name, columns):
                sigmas[column] = sigma
        if not sigmas:
            message = (
                "signals: no signal is chosen; give one with its noise, such as object_pose:3e-4"
            )
            raise FitError(message, "signals")
        last = np.append(np.diff(times) > 0.0, True)
        chosen = [columns[name] for name in sigmas]
        return cls(
            names=tuple(sigmas),
            units=tuple(unit for unit, _ in chosen),
            times=times[last],
            values=np.stack([np.asarray(values, np.float64)[last] for _, values in chosen], 1),
            sigmas=np.array([*sigmas.values()]),
        )


def _columns_named(name: str, columns: Mapping[str, tuple[str, Floats]]) -> list[str]:
    if name in columns:
        return [name]
    signal = next((each for each in SIGNALS if each.name == name), None)
    if signal is not None:
        prefix = signal.prefix
        found = [column for column in columns if _belongs(column, prefix, signal.per)]
        if found:
            return found
    measured = ", ".join(columns)
    message = f"signals: '{name[:60]}' was not measured; the data have {measured[:2000]}"
    raise FitError(message, "signals")


def _belongs(column: str, prefix: str, per: str) -> bool:
    if per == "pose":
        return column in ("x", "y", "z", "theta", "qw", "qx", "qy", "qz")
    rest = column.removeprefix(f"{prefix}_")
    return (
        rest != column
        and re.fullmatch(r"(?:[xyz]_)?\d+(?:_\d+)?|x|y|z|theta|w[xyz]", rest) is not None
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class FreeParameter:
    """A free parameter of a fit.

    Attributes:
        key: Dotted key of a parameter of the scenario, or ``delay`` or ``force_bias.COLUMN`` for
            the measurement.
        unit: SI unit, "1" for pure numbers.
        low: Smallest value considered.
        high: Largest value considered.
        start: Value in the scenario.
        nuisance: Whether it belongs to the measurement and not to the scenario.
    """

    key: str
    unit: str
    low: float
    high: float
    start: float
    nuisance: bool = False

    @property
    def contact(self) -> int | None:
        """The contact of a friction parameter, if any."""
        matched = _FRICTION.fullmatch(self.key)
        return None if matched is None else int(matched[1])

    def value_at(self, share: float) -> float:
        """The value at a scaled position in the range."""
        return self.low + (self.high - self.low) * share

    def share_of(self, value: float) -> float:
        """The inverse of `value_at`, between 0 and 1."""
        return min(max((value - self.low) / (self.high - self.low), 0.0), 1.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class FitProblem:
    """A scenario, its free parameters and the data.

    Attributes:
        scenario: Scenario with the duration of the data.
        parameters: The free parameters; those of the measurement are last.
        data: The measured signals.
    """

    scenario: Scenario
    parameters: tuple[FreeParameter, ...]
    data: Observations

    @classmethod
    def make(
        cls,
        scenario: Scenario,
        free: Sequence[str],
        data: Observations,
        nuisance: Sequence[str] = (),
    ) -> FitProblem:
        """Validates and completes a fit.

        Args:
            scenario: Base scenario.
            free: Dotted keys, such as ``object.mass``, or ``object.mass=0.5..2`` with the range to
                search; ``fingers.*.friction`` stands for one parameter per finger.
            data: The measured signals.
            nuisance: Parameters of the measurement to fit too: delay, bias of forces.

        Raises:
            FitError: If a parameter does not exist, a range is invalid, or the data are unsuitable.
            ScenarioError: If the scenario cannot have the duration of the data.
        """
        if len(data.times) < 2:
            raise FitError("the data have fewer than 2 samples; a fit needs a recording over time")
        wanted = [one for text in free for one in _free(scenario, text)]
        wanted += _nuisances(data, nuisance)
        twice = [p.key for i, p in enumerate(wanted) if p.key in {q.key for q in wanted[:i]}]
        if twice:
            raise FitError(f"free: {twice[0]} is free twice; leave one out", "free")
        if not 1 <= len(wanted) <= _MOST_FREE:
            message = f"free: {len(wanted)} parameters are free; allowed: 1 … {_MOST_FREE}"
            raise FitError(message, "free")
        return cls(scenario=_as_long(scenario, data), parameters=tuple(wanted), data=data)

    def with_data(self, data: Observations) -> FitProblem:
        """The same scenario and parameters for other data, with their duration.

        Raises:
            ScenarioError: If the scenario cannot have the duration of the data.
        """
        return replace(self, scenario=_as_long(self.scenario, data), data=data)

    @cached_property
    def start(self) -> Floats:
        """The scaled values of the scenario."""
        return np.array([p.share_of(p.start) for p in self.parameters])

    def values_at(self, shares: Floats) -> tuple[float, ...]:
        """Values of the parameters from scaled values."""
        pairs = zip(self.parameters, shares.tolist(), strict=True)
        return tuple(parameter.value_at(share) for parameter, share in pairs)

    def scenario_values(self, values: Sequence[float]) -> dict[str, float]:
        """The values to set in the scenario, by dotted key."""
        pairs = zip(self.parameters, values, strict=True)
        return {parameter.key: value for parameter, value in pairs if not parameter.nuisance}

    def sample(self, run: RunResult, values: Sequence[float]) -> Floats:
        """The signals of a run as measured by the sensors, without noise.

        Args:
            run: The run with these values.
            values: Values of the parameters, of which those of the measurement are used.

        Returns:
            Shape ``(samples, signals)``; NaN after an early end, except in time-independent
            columns.
        """
        extra = {p.key: v for p, v in zip(self.parameters, values, strict=True) if p.nuisance}
        at = self.data.times - extra.get(DELAY, 0.0)
        columns = {column.name: column.values for column in columns_of(run.trace)}
        sampled = np.empty(self.data.values.shape)
        for k, name in enumerate(self.data.names):
            if name not in columns:
                near = nearest(name, columns)
                message = f"signals: runs of this scenario have no {name}{near}; leave it out"
                raise FitError(message, "signals")
            values_of_run = np.asarray(columns[name], np.float64)
            sampled[:, k] = np.interp(at, run.trace.times, values_of_run)
            sampled[:, k] += extra.get(f"{FORCE_BIAS}.{name}", 0.0)
        sampled[at > run.end_time + self.data.period] = np.nan
        return sampled


def _free(scenario: Scenario, text: str) -> list[FreeParameter]:
    key, equals, limits = (part.strip() for part in text.partition("="))
    definitions = parameter_definitions(scenario)
    found: list[FreeParameter] = []
    for one in expand_key(scenario, key):
        parameter = definitions.get(one)
        if parameter is None or parameter.kind != "number":
            what = "no parameter" if parameter is None else f"a {parameter.kind}"
            message = f"free {key[:60]}: {one[:60]} is {what}{nearest(one, definitions)}"
            message += "; 'slipgrasp scenarios parameters' lists the numbers"
            raise FitError(message, "free")
        low, high = _limits(parameter, limits) if equals else _usual_limits(parameter)
        found.append(_parameter(scenario, parameter, low, high))
    return found


def _parameter(scenario: Scenario, parameter: Parameter, low: float, high: float) -> FreeParameter:
    start = parameter.value
    if not isinstance(start, (int, float)):
        base = parameter_definitions(scenario).get(parameter.key.replace("static_", ""))
        fallback = base.value if base is not None else None
        start = fallback if isinstance(fallback, (int, float)) else (low + high) / 2.0
    start = min(max(float(start), low), high)
    return FreeParameter(key=parameter.key, unit=parameter.unit, low=low, high=high, start=start)


def _usual_limits(parameter: Parameter) -> tuple[float, float]:
    """The range of its slider, extended to its value in the scenario; else the allowed range."""
    if parameter.typical is not None:
        low, high = parameter.typical
        if isinstance(parameter.value, (int, float)):
            low, high = min(low, parameter.value), max(high, parameter.value)
        return float(low), float(high)
    if parameter.minimum is None or parameter.maximum is None:
        raise FitError(
            f"free {parameter.key}: it has no range; give one as {parameter.key}=LOW..HIGH",
            "free",
        )
    return parameter.minimum, parameter.maximum


def _limits(parameter: Parameter, text: str) -> tuple[float, float]:
    try:
        low, high = map(float, text.split(".."))
    except ValueError:
        message = f"free {parameter.key}={text[:40]}: a range is written LOW..HIGH, such as 0.5..2"
        raise FitError(message, "free") from None
    least = -math.inf if parameter.minimum is None else parameter.minimum
    most = math.inf if parameter.maximum is None else parameter.maximum
    if not least <= low < high <= most:
        message = f"free {parameter.key}={text[:40]} is not a range within {parameter.limit}"
        raise FitError(message, "free")
    return low, high


def _nuisances(data: Observations, wanted: Sequence[str]) -> list[FreeParameter]:
    found: list[FreeParameter] = []
    unknown = [name for name in wanted if name not in NUISANCES]
    if unknown:
        allowed = ", ".join(NUISANCES)
        raise FitError(f"nuisance {unknown[0][:40]}: allowed are {allowed}", "nuisance")
    if DELAY in wanted:
        most = MOST_PERIODS_LATE * data.period
        found.append(_nuisance(DELAY, "s", most))
    if FORCE_BIAS in wanted:
        for k, (name, unit) in enumerate(zip(data.names, data.units, strict=True)):
            if unit == "N":
                most = LARGEST_BIAS_SHARE * float(np.abs(data.values[:, k]).max())
                found.append(_nuisance(f"{FORCE_BIAS}.{name}", unit, max(most, data.sigmas[k])))
        if not any(p.key.startswith(FORCE_BIAS) for p in found):
            raise FitError("nuisance: force_bias needs a force among the signals", "nuisance")
    return found


def _nuisance(key: str, unit: str, most: float) -> FreeParameter:
    return FreeParameter(key=key, unit=unit, low=-most, high=most, start=0.0, nuisance=True)


def _as_long(scenario: Scenario, data: Observations) -> Scenario:
    """The scenario with the duration of the data, and at least their sampling rate."""
    own = scenario.simulation
    rate = max(own.output_rate, min(1.0 / data.period, 10.0 * own.output_rate))
    late = MOST_PERIODS_LATE * data.period
    values = {"simulation.duration": float(data.times[-1]) + late, "simulation.output_rate": rate}
    return with_values(scenario, values)
