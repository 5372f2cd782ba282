"""Objective of a fit: weighted residuals, and chi-squared with robust outliers."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.fit.problem import JUMPY_UNITS, MISSING_SIGMAS, FitProblem, Observations
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.study.definition import apply_values
from slipgrasp.core.trace.signals import Floats

OUTLIER_SIGMAS = 4.0
"""Residual beyond which residuals count linearly instead of squared (Huber)."""

IMPOSSIBLE = 1e3
"""Residual of every sample if the parameter values are not allowed, in standard deviations."""

EVENT_PERIODS = 2.0
EVENT_WEIGHT = 0.1
"""Weight of samples of discontinuous signals within two periods of an event."""

Evaluate = Callable[[FitProblem, tuple[float, ...]], Floats]
"""Returns the sampled signals of the run, shape ``(samples, signals)``."""


def evaluate_here(problem: FitProblem, values: tuple[float, ...]) -> Floats:
    """Simulates in this process; returns NaN if the run is not allowed."""
    try:
        run = run_at(problem, values)
    except ScenarioError:
        return np.full(problem.data.values.shape, np.nan)
    return problem.sample(run, values)


def run_at(problem: FitProblem, values: Sequence[float]) -> RunResult:
    """The run with given values of the parameters.

    Raises:
        ScenarioError: If the values are not allowed.
    """
    return simulate(apply_values(problem.scenario, problem.scenario_values(values)))


class Objective:
    """Residuals of a problem as a function of parameters scaled to [0, 1].

    Args:
        problem: The problem.
        evaluate: Returns the sampled signals; it may use a cache.
        data: Other data with the same times; those of the problem if None.
        weights: Weight of every value, shape ``(samples, signals)``; 1 if None.
    """

    def __init__(
        self,
        problem: FitProblem,
        evaluate: Evaluate = evaluate_here,
        *,
        data: Floats | None = None,
        weights: Floats | None = None,
    ) -> None:
        self.problem = problem
        self._evaluate = evaluate
        self._data = problem.data.values if data is None else data
        self.weights = np.ones(self._data.shape) if weights is None else weights
        self._last: tuple[tuple[float, ...], Floats] | None = None

    @property
    def degrees_of_freedom(self) -> float:
        """Number of values, each with its squared weight, minus the number of free parameters."""
        return float((self.weights**2).sum()) - len(self.problem.parameters)

    def with_data(self, data: Floats) -> Objective:
        """The same objective for other data at the same times."""
        return Objective(self.problem, self._evaluate, data=data, weights=self.weights)

    def with_weights(self, weights: Floats) -> Objective:
        """The same objective with other weights."""
        return Objective(self.problem, self._evaluate, data=self._data, weights=weights)

    def model(self, shares: Floats) -> Floats:
        """The sampled signals of the run, shape ``(samples, signals)``; NaN after its end."""
        values = self.problem.values_at(shares)
        if self._last is None or self._last[0] != values:
            self._last = values, self._evaluate(self.problem, values)
        return self._last[1]

    def residuals(self, shares: Floats) -> Floats:
        """Model minus data in standard deviations, weighted, shape ``(samples * signals,)``."""
        return self.residuals_of(self.model(shares))

    def residuals_of(self, model: Floats) -> Floats:
        """The residuals of sampled signals."""
        missing = np.isnan(model)
        if missing.all():
            return np.full(model.size, IMPOSSIBLE)
        filled = np.where(missing, _held(model), model)
        found = (filled - self._data) / self.problem.data.sigmas
        far = np.where(found < 0.0, -1.0, 1.0) * np.maximum(np.abs(found), MISSING_SIGMAS)
        return (self.weights * np.where(missing, far, found)).ravel()

    def chi_squared(self, shares: Floats) -> float:
        """Sum of the squared residuals, with Huber loss for outliers."""
        return float(huber(self.residuals(shares)).sum())


def huber(residuals: Floats) -> Floats:
    """Square of each residual; beyond `OUTLIER_SIGMAS`, its tangent."""
    size = np.abs(residuals)
    linear = OUTLIER_SIGMAS * (2.0 * size - OUTLIER_SIGMAS)
    return np.where(size <= OUTLIER_SIGMAS, size**2, linear)


def _held(model: Floats) -> Floats:
    """Repeats the last sample before a run's end."""
    last = int(np.flatnonzero(~np.isnan(model[:, 0]))[-1])
    return np.broadcast_to(model[last], model.shape)


def event_weights(data: Observations, events: Sequence[float]) -> Floats:
    """Weights that are small near events for discontinuous signals.

    Args:
        data: The data.
        events: Times of the events [s].
    """
    weights = np.ones(data.values.shape)
    near = np.zeros(len(data.times), bool)
    for time in events:
        near |= np.abs(data.times - time) <= EVENT_PERIODS * data.period
    jumps = np.array([unit in JUMPY_UNITS for unit in data.units])
    weights[np.ix_(near, jumps)] = EVENT_WEIGHT
    return weights
