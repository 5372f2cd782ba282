"""Computation of a run: segments of constant parameters, advanced in short chunks."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.output import rows_in, take_rows, ticks_in
from slipgrasp.core.kernel.loop.progress import ROWS_BEFORE_PAUSE, TICKS_BEFORE_PAUSE
from slipgrasp.core.kernel.loop.status import LAW_FAILED, LEFT_FACE, REACHED, RUNNING
from slipgrasp.core.run.engine import make_engine
from slipgrasp.core.run.law_code import LawCode, Replay, set_parameters
from slipgrasp.core.scenario import Change, Scenario
from slipgrasp.core.scenario.chosen_laws import custom_law_in, diagnostics_of
from slipgrasp.core.scenario.custom_laws import Diagnostic, LawIdentity
from slipgrasp.core.scenario.validation import check_scenario
from slipgrasp.core.trace.signals import TraceShape
from slipgrasp.core.trace.ticks import Ticks
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import ContactPhase, Outcome, PhaseChange, Reason
from slipgrasp.core.words.endings import describe_end
from slipgrasp.core.words.interruptions import describe_law_failure

_STEPS_PER_PIECE = 1000


class Computation:
    """A run in progress, advanced in chunks; `Simulation` adds access to its results.

    Attributes:
        scenario: Simulated scenario.
        shape: Shape of its trace.
        outcome: Outcome of the run, None while it is in progress.
    """

    _law: LawCode | Replay | None
    _identity: LawIdentity | None
    _replays_all = False

    def __init__(self, scenario: Scenario, *, keep_trace: bool = True) -> None:
        """Prepares the run.

        Args:
            scenario: Scenario to simulate.
            keep_trace: Whether to store the trace, without which a run only has a summary.

        Raises:
            ScenarioError: If the scenario cannot be simulated.
        """
        check_scenario(scenario)
        self._keeps_trace = keep_trace
        self._prepare(scenario, diagnostics_of(scenario))
        law = custom_law_in(scenario)
        if law is not None:
            self._law = LawCode(law, self._run.own, self._size)
            self._identity = law.identity

    def _prepare(self, scenario: Scenario, diagnostics: tuple[Diagnostic, ...]) -> None:
        """Initializes the state of a run before its start."""
        self.scenario = scenario
        self.outcome: Outcome | None = None
        self._reason: Reason | None = None
        self._law, self._identity = None, None
        unknowns = tuple(e.parameter for e in scenario.estimates)
        count = len(scenario.fingers)
        self.shape = TraceShape(
            count,
            unknowns,
            diagnostics,
            scenario.space,
            scenario.sliding_joints,
            scenario.has_soft_fingers,
        )
        self._size = count, len(unknowns)
        self._engine = make_engine(scenario, keeps_rows=self._keeps_trace)
        # The kernel also sets them at the start, but a run may end before.
        self._engine.estimates[:] = [estimate.initial for estimate in scenario.estimates]
        self._run, self._outlet = self._engine.run, self._engine.outlet
        self._timetable = self._engine.timetable
        self._model = self._pack()
        self._first = True
        self._same_ticks = False
        self._rows: list[np.ndarray] = []
        self._ticks: list[np.ndarray] = []
        self._changes: list[PhaseChange] = []

    @property
    def finished(self) -> bool:
        """True if the run has ended."""
        return self.outcome is not None

    @property
    def time(self) -> float:
        """Simulation time reached [s]."""
        return float(self._run.now)

    @property
    def progress(self) -> float:
        """Simulated fraction of the duration, 0 to 1."""
        return min(1.0, self.time / self.scenario.simulation.duration)

    def advance(self) -> None:
        """Advances by one chunk, which takes at most about 50 ms."""
        if self.finished:
            return
        status = self._engine.advance(
            self._model,
            first=self._first,
            same_ticks=self._same_ticks,
            max_steps=_STEPS_PER_PIECE,
        )
        self._collect()
        if self._law is not None and self._law.interrupt is not None:
            raise self._law.interrupt
        if status != RUNNING:
            self._pass_end(status)

    def _pass_end(self, status: int) -> None:
        """Starts the next segment, or ends the run."""
        if status == REACHED and not self._timetable.is_last:
            self._begin_stretch(self._engine.pass_instant())
        elif status == LEFT_FACE and self._engine.cross_edge(int(self._run.concerned)):
            self._begin_stretch([])
        else:
            self._finish(status)

    def end(self, outcome: Outcome, reason: Reason) -> None:
        """Ends the run early for a reason outside the model; the simulated part is retained."""
        if not self.finished:
            self.outcome, self._reason = outcome, reason

    def _collect(self) -> None:
        """Moves rows and phase changes out of the kernel's buffers."""
        run, outlet = self._run, self._outlet
        if outlet.num_rows > ROWS_BEFORE_PAUSE:
            self._rows.append(take_rows(run, outlet, self.shape.num_columns))
        if outlet.num_ticks >= TICKS_BEFORE_PAUSE:
            self._ticks.append(ticks_in(outlet, Ticks.num_columns(self.shape)).copy())
            outlet.num_ticks = 0
        if self._keeps_trace and run.num_changes:
            for t, contact, before, after in outlet.changes[: run.num_changes].tolist():
                self._changes.append(
                    PhaseChange(
                        time=t,
                        contact=int(contact),
                        from_phase=ContactPhase(int(before)),
                        to_phase=ContactPhase(int(after)),
                    )
                )
        run.num_changes = 0

    def _begin_stretch(self, changes: list[Change]) -> None:
        """Switches to the constants of the new segment."""
        before, self._model = self._model, self._pack()
        for change in changes:
            self._reset_estimate(change)
        self._same_ticks = before.law.period == self._model.law.period
        self._first = False
        self._run.begun = 0

    def _pack(self) -> Record:
        """Constants of the current segment."""
        model, present = self._engine.pack(), self._timetable.present
        model.num_diagnostics = len(self.shape.diagnostics)
        if self._replays_all:
            model.law.facts.is_own = True
        set_parameters(custom_law_in(present), present.controller.parameters, self._run.own)
        return model

    def _reset_estimate(self, change: Change) -> None:
        """Applies a timed change of an initial estimate to the estimate."""
        head, _, tail = change.parameter.partition(".")
        index, _, field = tail.partition(".")
        if head == "estimates" and field == "initial":
            initial = self._timetable.present.estimates[int(index)].initial
            self._engine.estimates[int(index)] = initial
            self._run.pending_rates[int(index)] = 0.0

    def _finish(self, status: int) -> None:
        if status == REACHED:
            assert self._run.tally.time == self.scenario.simulation.duration
            self.outcome = Outcome.COMPLETED
            return
        if status == LAW_FAILED:
            found = "its answer is not finite" if self._law is None else self._law.explain()
            kind = self._timetable.present.controller.kind
            self.outcome = Outcome.FAILED
            self._reason = describe_law_failure(kind, found, self.time)
            return
        contact = int(self._run.concerned)
        last = Trace.from_rows(self.shape, self._last_row())
        # From the last row, because the current state may not be finite.
        self.outcome, self._reason = describe_end(
            status, contact, self.scenario, self._timetable.present, last, float(last.times[0])
        )

    def _last_row(self) -> np.ndarray:
        if self._run.tally.rows == 0:
            return start_row(self.shape, self.scenario)
        if self._keeps_trace:
            rows = rows_in(self._outlet, self.shape.num_columns)
            return rows[-1:] if len(rows) else self._rows[-1][-1:]
        return self._engine.last_row(self._model)


def start_row(shape: TraceShape, scenario: Scenario) -> np.ndarray:
    """Row with the initial state, the result of a run whose first row is not finite."""
    row = np.zeros((1, shape.num_columns))
    row[0, 1 : 1 + len(scenario.trajectory.start)] = scenario.trajectory.start
    return row
