"""Accuracy of the comparison of two runs, from their integration errors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Change, Scenario
from slipgrasp.core.scenario.parameters import parameter_differences
from slipgrasp.core.scenario.scenario import is_acting, is_there, without_events
from slipgrasp.recordings.compare.alignment import SAME_TIME

AMPLIFICATION = 100.0
"""Ratio of the error of a signal to the error allowed in one step.

Measured as the difference from runs with a thousandth of the tolerance: at most 8 in every preset;
in random scenarios 1 in the median and below 30 in 90 %. The others amplify errors without bound,
near a singular estimate.
"""


_NO_CAUSE = frozenset(
    f"simulation.{name}"
    for name in (
        "output_rate",
        "relative_tolerance",
        "absolute_tolerance",
        "max_step",
        "duration",
        "max_steps",
        "chatter_changes",
        "chatter_window",
    )
) | {"title"}
"""Parameters that determine storage, accuracy and end of a run."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Accuracy:
    """Differences between two runs that count as zero.

    Attributes:
        chosen: Absolute tolerance from the user, in the SI unit of each column; None for the
            accuracy of the integration.
        relative: Relative error allowed in one step; the larger one of both runs.
        absolute: Absolute error allowed in one step; the larger one of both runs.
        cause: Time of the first difference of the scenarios [s]: earlier differences are
            integration errors. None if the scenarios are equal.
    """

    chosen: float | None
    relative: float
    absolute: float
    cause: float | None

    @classmethod
    def between(cls, a: RunResult, b: RunResult, chosen: float | None) -> Self:
        """The accuracy of two runs.

        Args:
            a: First run.
            b: Second run.
            chosen: Tolerance from the user.
        """
        simulations = a.scenario.simulation, b.scenario.simulation
        return cls(
            chosen=chosen,
            relative=max(each.relative_tolerance for each in simulations),
            absolute=max(each.absolute_tolerance for each in simulations),
            cause=first_cause(a.scenario, b.scenario),
        )

    @property
    def is_chosen(self) -> bool:
        """Whether the user has set the tolerance."""
        return self.chosen is not None

    def tolerance_of(self, largest: float) -> float:
        """Tolerance of a column, in its SI unit.

        Args:
            largest: Largest value of its signal in both runs.
        """
        if self.chosen is not None:
            return self.chosen
        return AMPLIFICATION * (self.absolute + self.relative * largest)

    def is_early(self, times: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether instants are before the first cause; none if there is no known cause."""
        return times < (self.cause or 0.0) - SAME_TIME

    @property
    def of_times(self) -> float:
        """Tolerance of the times of phase changes and of the end [s]."""
        return self.tolerance_of(1.0)


def first_cause(a: Scenario, b: Scenario) -> float | None:
    """Time from which the first difference of two scenarios has an effect [s]; None if never.

    Earlier differences are due to rounding alone. Pushes, patches and timed changes have a time;
    all other differences have an effect from the start. Parameters of storage and integration are
    not causes, because they only change the accuracy.
    """
    calm = map(without_events, (a, b))
    if any(difference.key not in _NO_CAUSE for difference in parameter_differences(*calm)):
        return 0.0
    instants = sorted({0.0, *_instants(a), *_instants(b)})
    return next((t for t in instants if _acting(a, t) != _acting(b, t)), None)


def _instants(scenario: Scenario) -> Iterator[float]:
    """Times at which something starts or ends in a scenario."""
    for pulse in scenario.pulses:
        yield from (pulse.time, pulse.time + pulse.duration)
    for patch in scenario.patches:
        yield from (time for time in (patch.start_time, patch.end_time) if time is not None)
    yield from (change.time for change in scenario.changes)


def _acting(scenario: Scenario, t: float) -> tuple[Any, ...]:
    """Active disturbances and changes from a time until the next one [s], sorted."""
    changes = [change for change in scenario.changes if change.time <= t]
    values = {change.parameter: change.value for change in sorted(changes, key=_time)}
    pulses = [pulse for pulse in scenario.pulses if is_acting(pulse, t)]
    patches = [
        (patch.place, values.get(_factor_key(i), patch.friction_factor))
        for i, patch in enumerate(scenario.patches)
        if is_there(patch, t)
    ]
    factors = {_factor_key(i) for i in range(len(scenario.patches))}
    # An estimate that is set again may have had another value before.
    resets = [c for c in changes if c.time == t and c.parameter.startswith("estimates.")]
    return (
        sorted((p.force, p.moment) for p in pulses),
        sorted(patches),
        {key: value for key, value in values.items() if key not in factors},
        sorted((c.parameter, repr(c.value)) for c in resets),
    )


def _time(change: Change) -> float:
    return change.time


def _factor_key(index: int) -> str:
    return f"patches.{index}.friction_factor"
