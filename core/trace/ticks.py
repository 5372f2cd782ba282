"""Commands of the control law at every tick of sampled control."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from slipgrasp.core.trace.signals import Floats, TraceShape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ticks:
    """Commands of the control law; with them a run can be simulated again without its law.

    Attributes:
        times: Times of the ticks, shape ``(ticks,)`` [s].
        commands: Commanded torque, before limits and latency, shape ``(ticks, 2 n)`` [N m].
        estimates: Estimates of the law, shape ``(ticks, p)`` [SI].
        diagnostics: Diagnostics of the law, shape ``(ticks, d)``.
    """

    times: Floats
    commands: Floats
    estimates: Floats
    diagnostics: Floats

    @staticmethod
    def num_columns(shape: TraceShape) -> int:
        """Number of values per tick."""
        return sum(Ticks.widths(shape))

    @staticmethod
    def widths(shape: TraceShape) -> tuple[int, int, int, int]:
        """Columns of each attribute."""
        return 1, shape.width_of_joints, len(shape.unknowns), len(shape.diagnostics)

    @classmethod
    def from_rows(cls, shape: TraceShape, rows: Floats) -> Ticks:
        """Creates ticks from the rows of `to_rows`; the arrays are views."""
        commands, estimates, diagnostics = accumulate(cls.widths(shape)[:-1])
        return cls(
            times=rows[:, 0],
            commands=rows[:, commands:estimates],
            estimates=rows[:, estimates:diagnostics],
            diagnostics=rows[:, diagnostics:],
        )

    def to_rows(self) -> Floats:
        """One row per tick: time, command, estimates, diagnostics."""
        parts = (self.times[:, None], self.commands, self.estimates, self.diagnostics)
        return np.concatenate(parts, axis=1)

    def __len__(self) -> int:
        return len(self.times)

    def __getitem__(self, ticks: slice) -> Ticks:
        """A range of ticks, as views."""
        return Ticks(
            times=self.times[ticks],
            commands=self.commands[ticks],
            estimates=self.estimates[ticks],
            diagnostics=self.diagnostics[ticks],
        )
