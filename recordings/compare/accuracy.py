"""How exactly two runs can be compared: as exactly as both were integrated, from some time on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Change, Scenario
from slipgrasp.core.scenario.parameters import parameter_differences
from slipgrasp.core.scenario.scenario import is_acting, is_there
from slipgrasp.recordings.compare.alignment import SAME_TIME

AMPLIFICATION = 100.0
"""How many times the error allowed in one step a signal may be off.

Measured as the difference from runs at a thousandth of the tolerance: at most 8 times in every
preset; in random scenarios 1 time in the median and below 30 times in nine of ten. The rest
amplify without bound, near a singular estimate.
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
"""What decides how a run is stored, how exactly it is computed and when it ends."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Accuracy:
    """What counts as no difference between two runs.

    Attributes:
        chosen: Absolute difference that the user chose, in the SI unit of each column; None for
            the accuracy of the integration.
        relative: Relative error allowed in one step, of the run that allows more.
        absolute: Absolute error allowed in one step likewise.
        cause: When the scenarios first differ [s]: what differs before is integration error.
            None where they never do.
    """

    chosen: float | None
    relative: float
    absolute: float
    cause: float | None

    @classmethod
    def between(cls, a: RunResult, b: RunResult, chosen: float | None) -> Self:
        """The accuracy of two runs.

        Args:
            a: One run.
            b: The other.
            chosen: What the user chose.
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
        """Whether the user decides what counts as no difference, and not the integration."""
        return self.chosen is not None

    def tolerance_of(self, largest: float) -> float:
        """Difference of a column that counts as none, in its SI unit.

        Args:
            largest: Largest value of its signal in both runs.
        """
        if self.chosen is not None:
            return self.chosen
        return AMPLIFICATION * (self.absolute + self.relative * largest)

    def is_early(self, times: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which instants come before the first cause; none where no cause is known."""
        return times < (self.cause or 0.0) - SAME_TIME

    @property
    def of_times(self) -> float:
        """Difference in time of a phase change, and of the end, that counts as none [s]."""
        return self.tolerance_of(1.0)


def first_cause(a: Scenario, b: Scenario) -> float | None:
    """When the first difference of two scenarios begins to act [s]; None if none ever does.

    Before, runs can differ by rounding alone. Pushes, patches and timed changes have a time;
    every other difference acts from the start. How a run is stored and integrated is no cause:
    it changes how exactly the same motion is computed.
    """
    calm = (replace(each, pulses=(), patches=(), changes=()) for each in (a, b))
    if any(difference.key not in _NO_CAUSE for difference in parameter_differences(*calm)):
        return 0.0
    instants = sorted({0.0, *_instants(a), *_instants(b)})
    return next((t for t in instants if _acting(a, t) != _acting(b, t)), None)


def _instants(scenario: Scenario) -> Iterator[float]:
    """When something begins or ends in a scenario."""
    for pulse in scenario.pulses:
        yield from (pulse.time, pulse.time + pulse.duration)
    for patch in scenario.patches:
        yield from (time for time in (patch.start_time, patch.end_time) if time is not None)
    yield from (change.time for change in scenario.changes)


def _acting(scenario: Scenario, t: float) -> tuple[Any, ...]:
    """What acts on a run from some time on until the next one [s], in an order of its own."""
    changes = [change for change in scenario.changes if change.time <= t]
    values = {change.parameter: change.value for change in sorted(changes, key=_time)}
    pulses = [pulse for pulse in scenario.pulses if is_acting(pulse, t)]
    patches = [
        (patch.place, values.get(_factor_key(i), patch.friction_factor))
        for i, patch in enumerate(scenario.patches)
        if is_there(patch, t)
    ]
    factors = {_factor_key(i) for i in range(len(scenario.patches))}
    # An estimate that is set anew need not have had that value until then.
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
