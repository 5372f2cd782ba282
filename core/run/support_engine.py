"""The kernel of a body on a support; its import registers its compiled units."""

from __future__ import annotations

from typing import Any

import numpy as np

from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.support import advance as kernel
from slipgrasp.core.kernel.support.model import pack_model
from slipgrasp.core.kernel.support.run import last_row, make_run
from slipgrasp.core.run.schedule import Timetable
from slipgrasp.core.scenario import Change
from slipgrasp.core.scenario.scenario import is_acting
from slipgrasp.core.scenario.supported import SupportScenario


class SupportEngine:
    """The kernel of a body on a support."""

    def __init__(self, scenario: SupportScenario, *, keeps_rows: bool) -> None:
        self.timetable: Timetable[SupportScenario] = Timetable(scenario)
        self.run, self.outlet = make_run(scenario, keeps_rows=keeps_rows)

    def pack(self) -> Any:
        """The constants of the current segment."""
        present, load = self.timetable.present, [0.0] * 3
        for pulse in present.pulses:
            if is_acting(pulse, self.timetable.begin):
                wrench = (*pulse.force, pulse.moment)
                load = [sum(pair) for pair in zip(load, wrench, strict=True)]
        return pack_model(present, load)

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
        """Returns False; never called, because the support has no edges."""
        return False

    @property
    def estimates(self) -> Floats:
        """An empty array: nothing is estimated."""
        return np.empty(0)

    def last_row(self, model: Record) -> Floats:
        """The last row of a run without a trace, ``(1, num_columns)``."""
        return last_row(model, self.run)
