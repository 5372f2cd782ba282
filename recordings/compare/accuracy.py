"""How exactly two runs can be compared: as exactly as both were integrated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.compare.alignment import SAME_TIME
from slipgrasp.recordings.compare.causes import first_cause

AMPLIFICATION = 100.0
"""How many times the error allowed in one step a signal may be off.

Measured as the difference from runs at a thousandth of the tolerance: at most 8 times in every
preset; in random scenarios 1 time in the median and below 30 times in nine of ten. The rest
amplify without bound, near a singular estimate.
"""


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
