"""The parts of a run that differ between planar and spatial hands, a support and a rail."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from slipgrasp.core.kernel.compilation.cache import IN_WEBASSEMBLY
from slipgrasp.core.kernel.compilation.compiler import choose_backend, start_in
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.planar import advance as kernel
from slipgrasp.core.kernel.planar.run import last_row, make_run
from slipgrasp.core.kernel.planar.state import StateParts, parts_of
from slipgrasp.core.kernel.webassembly.shipped import enter_shipped, shipped_file
from slipgrasp.core.run.schedule import Schedule, Timetable
from slipgrasp.core.scenario import PLANAR, RAIL, SUPPORT, Change, PlanarScenario, Scenario, Space

if IN_WEBASSEMBLY:
    from slipgrasp.core.kernel.webassembly.build import in_wasmtime

    choose_backend(in_wasmtime)
elif shipped_file() is not None:
    start_in(enter_shipped)


class Engine(Protocol):
    """The kernel of a run, with its records.

    Every engine calls its loop by name, because the name of the numerics is computed from the code
    that the engine reaches (`slipgrasp.core.run.numerics`).

    Attributes:
        timetable: Segments of constant parameters.
        run: State of the run.
        outlet: Output buffers for rows, phase changes and ticks.
    """

    timetable: Timetable[Any]
    run: Any
    outlet: Any

    def pack(self) -> Any:
        """The constants of the current segment."""
        ...

    def advance(self, model: Record, *, first: bool, same_ticks: bool, max_steps: int) -> int:
        """Advances the run by one chunk; returns the status of the kernel."""
        ...

    def pass_instant(self) -> list[Change]:
        """Switches to the next segment; returns the timed changes at its start."""
        ...

    def cross_edge(self, contact: int) -> bool:
        """Switches to the segment beyond an edge at a fingertip; False if the face ends."""
        ...

    @property
    def estimates(self) -> Floats:
        """Estimates of the controller, as a view."""
        ...

    def last_row(self, model: Record) -> Floats:
        """The last row of a run without a trace, ``(1, num_columns)``."""
        ...


def make_engine(scenario: Scenario, *, keeps_rows: bool) -> Engine:
    """Returns the backend of a run that has not started."""
    return engine_of(scenario.space)(scenario, keeps_rows=keeps_rows)


def engine_of(space: Space) -> Callable[..., Engine]:
    """Returns the kernel of a kind of hand, and registers its units for compilation."""
    if space is PLANAR:
        return PlanarEngine
    # Compiled and loaded only when needed.
    if space is SUPPORT:
        from slipgrasp.core.run.support_engine import SupportEngine

        return SupportEngine
    if space is RAIL:
        from slipgrasp.core.run.rail_engine import RailEngine

        return RailEngine
    from slipgrasp.core.run.space_engine import SpatialEngine

    return SpatialEngine


class PlanarEngine:
    """The kernel of planar hands."""

    def __init__(self, scenario: PlanarScenario, *, keeps_rows: bool) -> None:
        self._schedule = Schedule(scenario)
        self.timetable: Timetable[PlanarScenario] = self._schedule
        self.run, self.outlet = make_run(self._schedule.table, keeps_rows=keeps_rows)
        self._start = self.run.step.start  # a view, which is costly to create

    def pack(self) -> Any:
        """The constants of the current segment."""
        return self._schedule.pack()

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
        return self._state().estimates

    def last_row(self, model: Record) -> Floats:
        """The last row of a run without a trace, ``(1, num_columns)``."""
        return last_row(model, self.run)

    def _slips(self) -> tuple[np.ndarray, np.ndarray]:
        """Slip [m] and slip velocity [m/s] of every fingertip."""
        state = self._state()
        return state.slip, state.slip_velocity

    def _state(self) -> StateParts:
        present = self.timetable.present
        return parts_of(self._start, len(present.fingers), len(present.estimates))
