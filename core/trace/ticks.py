"""What the control law answered at every tick of sampled control."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from slipgrasp.core.trace.signals import Floats, TraceShape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ticks:
    """The answers of the control law, tick by tick; with them a run can be made again without it.

    Attributes:
        times: When it was asked, shape ``(ticks,)`` [s].
        commands: Torque it asked for, before limits and latency, shape ``(ticks, 2 n)`` [N m].
        estimates: Its estimates, shape ``(ticks, p)`` [SI].
        diagnostics: The numbers that it reported, shape ``(ticks, d)``.
    """

    times: Floats
    commands: Floats
    estimates: Floats
    diagnostics: Floats

    @staticmethod
    def num_columns(shape: TraceShape) -> int:
        """Numbers of one tick."""
        return sum(Ticks.widths(shape))

    @staticmethod
    def widths(shape: TraceShape) -> tuple[int, int, int, int]:
        """Columns of each attribute."""
        return 1, shape.width_of_joints, len(shape.unknowns), len(shape.diagnostics)

    @classmethod
    def from_rows(cls, shape: TraceShape, rows: Floats) -> Ticks:
        """The inverse of `to_rows`; its arrays are views."""
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
        """Some of the ticks, as views."""
        return Ticks(
            times=self.times[ticks],
            commands=self.commands[ticks],
            estimates=self.estimates[ticks],
            diagnostics=self.diagnostics[ticks],
        )
