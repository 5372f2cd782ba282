"""The kernel of spatial hands; its import registers its compiled units."""

from __future__ import annotations

from typing import Any

from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.spatial import advance as kernel
from slipgrasp.core.kernel.spatial.model import pack_model
from slipgrasp.core.kernel.spatial.run import last_row, make_run
from slipgrasp.core.kernel.spatial.state import parts_of
from slipgrasp.core.run.schedule import Timetable
from slipgrasp.core.run.spatial_schedule import SpatialSchedule
from slipgrasp.core.scenario import Change
from slipgrasp.core.scenario.geometry import Point
from slipgrasp.core.scenario.scenario import is_acting
from slipgrasp.core.scenario.spatial import SpatialScenario


class SpatialEngine:
    """The kernel of spatial hands."""

    def __init__(self, scenario: SpatialScenario, *, keeps_rows: bool) -> None:
        self._schedule = SpatialSchedule(scenario)
        self.timetable: Timetable[SpatialScenario] = self._schedule
        self.run, self.outlet = make_run(scenario, keeps_rows=keeps_rows)

    def pack(self) -> Any:
        """The constants of the current segment."""
        present, load = self.timetable.present, [0.0] * 6
        for pulse in present.pulses:
            if is_acting(pulse, self.timetable.begin):
                wrench = (*pulse.force, *pulse.moment)
                load = [sum(pair) for pair in zip(load, wrench, strict=True)]
        return pack_model(present, load, self._schedule.surfaces())

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
        return self._schedule.pass_instant(*self._slips())

    def cross_edge(self, contact: int) -> bool:
        """Switches to the segment beyond an edge at a fingertip; False if the face ends."""
        return self._schedule.cross_edge(contact, *self._slips())

    @property
    def estimates(self) -> Floats:
        """Estimates of the controller, as a view."""
        return self.run.discrete.estimates[: len(self.timetable.present.estimates)]

    def last_row(self, model: Record) -> Floats:
        """The last row of a run without a trace, ``(1, num_columns)``."""
        return last_row(model, self.run)

    def _slips(self) -> tuple[list[Point], list[Point]]:
        """Slip [m] and slip velocity [m/s] of every fingertip."""
        state = parts_of(self.run.step.start, len(self.timetable.present.fingers))
        return _points(state.slip), _points(state.slip_velocity)


def _points(flat: Floats) -> list[Point]:
    return [(float(x), float(y)) for x, y in flat.reshape(-1, 2)]
