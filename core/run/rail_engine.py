"""The kernel of a finger on a rail; its import registers its compiled units."""

from __future__ import annotations

from typing import Any

from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.rail import advance as kernel
from slipgrasp.core.kernel.rail.model import pack_model
from slipgrasp.core.kernel.rail.run import last_row, make_run
from slipgrasp.core.kernel.rail.state import MASS
from slipgrasp.core.run.schedule import Timetable
from slipgrasp.core.scenario import Change
from slipgrasp.core.scenario.rail import RailScenario


class RailEngine:
    """The kernel of a finger on a rail."""

    def __init__(self, scenario: RailScenario, *, keeps_rows: bool) -> None:
        self.timetable: Timetable[RailScenario] = Timetable(scenario)
        self.run, self.outlet = make_run(scenario, keeps_rows=keeps_rows)

    def pack(self) -> Any:
        """The constants of the current segment."""
        return pack_model(self.timetable.present)

    def advance(self, model: Record, *, first: bool, same_ticks: bool, max_steps: int) -> int:
        """Advances the run by one chunk; returns the status of the kernel."""
        return kernel.advance_run(
            model,
            self.run,
            self.outlet,
            self.timetable.stretch_end,
            first=first,
            same_ticks=same_ticks,
            max_steps=max_steps,
        )

    def pass_instant(self) -> list[Change]:
        """Switches to the next segment; returns the timed changes at its start."""
        return self.timetable.end_stretch()

    def cross_edge(self, contact: int) -> bool:
        """Returns False: without patches, the only edge of the face is its end."""
        return False

    @property
    def estimates(self) -> Floats:
        """The estimate of the mass, as a view."""
        count = len(self.timetable.present.estimates)
        return self.run.step.start.x[MASS : MASS + count]

    def last_row(self, model: Record) -> Floats:
        """The last row of a run without a trace, ``(1, num_columns)``."""
        return last_row(model, self.run)
