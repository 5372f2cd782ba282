"""A run in progress: segments of constant parameters, advanced in short chunks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Self

import numpy as np

from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.laws.own_law import ANSWERED, ASKED
from slipgrasp.core.kernel.loop.output import rows_in, settled_rows, take_rows, ticks_in
from slipgrasp.core.kernel.loop.progress import ROWS_BEFORE_PAUSE, TICKS_BEFORE_PAUSE
from slipgrasp.core.kernel.loop.status import LAW_FAILED, LEFT_FACE, REACHED, RUNNING
from slipgrasp.core.run.engine import make_engine
from slipgrasp.core.run.law_code import LawCode, Replay, set_parameters
from slipgrasp.core.run.metrics import compute_metrics
from slipgrasp.core.run.provenance import Provenance, present_provenance
from slipgrasp.core.run.result import RunResult, RunSummary
from slipgrasp.core.run.stepping import Tick
from slipgrasp.core.scenario import Change, Scenario
from slipgrasp.core.scenario.chosen_laws import custom_law_in, diagnostics_of
from slipgrasp.core.scenario.custom_laws import OUTSIDE, Diagnostic, LawIdentity
from slipgrasp.core.scenario.validation import check_scenario
from slipgrasp.core.trace.signals import TraceShape
from slipgrasp.core.trace.ticks import Ticks
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import ContactPhase, Outcome, PhaseChange, Reason
from slipgrasp.core.words.endings import describe_end
from slipgrasp.core.words.interruptions import describe_law_failure
from slipgrasp.core.words.warnings import describe_warnings

_STEPS_PER_PIECE = 1000


class Simulation:
    """One run in progress, advanced piece by piece so that it can be watched and stopped.

    Attributes:
        scenario: What is simulated.
        shape: Shape of its trace.
        outcome: How it ended, None while it goes on.
        num_released_rows: First rows of the trace that it no longer holds, see `release`.
        num_released_ticks: First ticks that it no longer holds.
    """

    def __init__(self, scenario: Scenario, *, keep_trace: bool = True) -> None:
        """Prepares the run.

        Args:
            scenario: What to simulate.
            keep_trace: Whether to store the trace; without it only `summary` can be had.

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

    @classmethod
    def replaying(cls, result: RunResult, *, every_law: bool = False) -> Self:
        """The run of a recording again, with the recorded answers of its law instead of its code.

        Args:
            result: A run that has its ticks.
            every_law: Whether the answers of built-in laws are taken too; else those are computed.
        """
        assert result.ticks is not None, "a recording of this format has no ticks"
        simulation = cls.__new__(cls)
        simulation._keeps_trace = True
        simulation._replays_all = every_law
        simulation._prepare(result.scenario, result.trace.shape.diagnostics)
        simulation._law = Replay(result.ticks, simulation._run.own, simulation._size)
        simulation._identity = result.provenance.law
        return simulation

    def ticks(self) -> Iterator[Tick]:
        """Steps the run from outside, control tick by control tick.

        Each waits for its torque::

            simulation = Simulation(scenario)
            for tick in simulation.ticks():
                tick.torque = -0.1 * tick.seen.joint_velocity
            result = simulation.result()

        The law of the scenario is not asked; the run has the law ``outside`` instead.

        Raises:
            ScenarioError: If control is continuous, which has no ticks.
        """
        assert self._run.begun == 0, "a run is stepped from its beginning"
        scenario = replace(
            self.scenario, controller=replace(self.scenario.controller, kind=OUTSIDE)
        )
        check_scenario(scenario, with_law=False)
        self._prepare(scenario, ())
        self._identity = LawIdentity(OUTSIDE, "", "")
        own, tick = self._run.own, Tick(self._run.own, self._size)
        while not self.finished:
            self.advance()
            if own.asked == ASKED:
                yield tick.arrive()
                own.asked = ANSWERED

    _law: LawCode | Replay | None
    _identity: LawIdentity | None
    _replays_all = False
    num_released_rows = num_released_ticks = 0

    def _prepare(self, scenario: Scenario, diagnostics: tuple[Diagnostic, ...]) -> None:
        """Everything of a run that has not begun."""
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
        # The kernel sets them again as it begins; a run may end before that.
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
        """Whether the run has ended."""
        return self.outcome is not None

    @property
    def time(self) -> float:
        """Simulation time reached [s]."""
        return float(self._run.now)

    @property
    def progress(self) -> float:
        """Simulated share of the duration, 0 to 1."""
        return min(1.0, self.time / self.scenario.simulation.duration)

    def advance(self) -> None:
        """Advances by one piece of at most about 50 ms of computing."""
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
        """Begins the next segment, or ends the run."""
        if status == REACHED and not self._timetable.is_last:
            self._begin_stretch(self._engine.pass_instant())
        elif status == LEFT_FACE and self._engine.cross_edge(int(self._run.concerned)):
            self._begin_stretch([])
        else:
            self._finish(status)

    def end(self, outcome: Outcome, reason: Reason) -> None:
        """Ends the run early for a reason outside the model; what was simulated is kept."""
        if not self.finished:
            self.outcome, self._reason = outcome, reason

    def release(self, rows: int, ticks: int) -> None:
        """Drops the first rows and ticks of the run from memory, as far as blocks of them end.

        `result` then has the rest of the trace, at least its last row; the indices of rows and
        ticks elsewhere still count from the start of the run.

        Args:
            rows: How many rows nobody needs here any more.
            ticks: How many ticks likewise.
        """
        while len(self._rows) > 1 and self.num_released_rows + len(self._rows[0]) <= rows:
            self.num_released_rows += len(self._rows.pop(0))
        while self._ticks and self.num_released_ticks + len(self._ticks[0]) <= ticks:
            self.num_released_ticks += len(self._ticks.pop(0))

    def result(self) -> RunResult:
        """The run so far, but for what was released; ``stopped`` if it has not ended."""
        assert self._keeps_trace, "a run that keeps no trace has only a summary"
        outcome = self.outcome or Outcome.STOPPED
        return RunResult(
            scenario=self.scenario,
            trace=Trace.from_rows(self.shape, self.all_rows()),
            phase_changes=tuple(self._changes),
            outcome=outcome,
            reason=self._reason,
            warnings=describe_warnings(self._run),
            metrics=compute_metrics(self._run, self.shape, outcome),
            provenance=self.provenance,
            ticks=self.ticks_from(self.num_released_ticks),
        )

    def all_rows(self) -> np.ndarray:
        """The held trace as rows ``(rows, shape.num_columns)``, see `Trace.to_rows`."""
        rows = rows_in(self._outlet, self.shape.num_columns)
        if self._run.tally.rows == 0:
            return _start_row(self.shape, self.scenario)
        if self._rows:
            return np.concatenate([*self._rows, rows])
        # The buffer is written on while the run goes on.
        return rows if self.finished else rows.copy()

    @property
    def num_rows(self) -> int:
        """Rows of the trace so far."""
        return self._num_taken_rows + int(self._outlet.num_rows)

    @property
    def num_settled_rows(self) -> int:
        """Rows that never change: while a slip is young, others may yet come between the rest."""
        if self.finished:
            return self.num_rows
        return self._num_taken_rows + settled_rows(self._run, self._outlet)

    @property
    def _num_taken_rows(self) -> int:
        """Rows that have left the kernel's buffer."""
        return self.num_released_rows + sum(map(len, self._rows))

    def trace_from(self, row: int) -> Trace:
        """The settled rows of the trace so far, from one of them on that was not released."""
        return Trace.from_rows(self.shape, self.rows_from(row))

    def rows_from(self, row: int) -> np.ndarray:
        """The same as rows ``(rows, shape.num_columns)``, see `Trace.to_rows`."""
        end = self.num_settled_rows
        last = rows_in(self._outlet, self.shape.num_columns)
        blocks = [*self._rows, last[: end - self._num_taken_rows]]
        parts: list[np.ndarray] = []
        while end > row:
            block = blocks.pop()
            start = end - len(block)
            parts.append(block[max(row - start, 0) :])
            end = start
        parts.append(np.empty((0, self.shape.num_columns)))
        return np.concatenate(parts[::-1])

    @property
    def num_ticks(self) -> int:
        """Control ticks so far; 0 where control is continuous."""
        held = sum(map(len, self._ticks)) + int(self._outlet.num_ticks)
        return self.num_released_ticks + held

    def ticks_from(self, tick: int) -> Ticks:
        """What the law answered so far, from one of the ticks on that was not released."""
        last = ticks_in(self._outlet, Ticks.num_columns(self.shape))
        held = np.concatenate([*self._ticks, last])
        return Ticks.from_rows(self.shape, held[tick - self.num_released_ticks :])

    def phase_changes_from(self, index: int) -> tuple[PhaseChange, ...]:
        """The phase changes so far, from one of them on."""
        return tuple(self._changes[index:])

    @property
    def provenance(self) -> Provenance:
        """What computes the run."""
        return replace(present_provenance(self.scenario.space), law=self._identity)

    def summary(self) -> RunSummary:
        """The run without its trace; ``stopped`` while it goes on."""
        outcome = self.outcome or Outcome.STOPPED
        estimates = self._engine.estimates
        return RunSummary(
            scenario=self.scenario,
            outcome=outcome,
            reason=self._reason,
            end_time=float(self._run.tally.time),
            estimates=dict(zip(self.shape.unknowns, estimates.tolist(), strict=True)),
            metrics=compute_metrics(self._run, self.shape, outcome),
            warnings=describe_warnings(self._run),
        )

    def _collect(self) -> None:
        """Takes rows and phase changes out of the kernel's buffers."""
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
        """Switches to the constants that hold from now on."""
        before, self._model = self._model, self._pack()
        for change in changes:
            self._reset_estimate(change)
        self._same_ticks = before.law.period == self._model.law.period
        self._first = False
        self._run.begun = 0

    def _pack(self) -> Record:
        """The constants of the present segment."""
        model, present = self._engine.pack(), self._timetable.present
        model.num_diagnostics = len(self.shape.diagnostics)
        if self._replays_all:
            model.law.facts.is_own = True
        set_parameters(custom_law_in(present), present.controller.parameters, self._run.own)
        return model

    def _reset_estimate(self, change: Change) -> None:
        """A timed change of an initial estimate sets the estimate anew."""
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
        # Of the last row: the present state has none where it is not finite.
        self.outcome, self._reason = describe_end(
            status, contact, self.scenario, self._timetable.present, last, float(last.times[0])
        )

    def _last_row(self) -> np.ndarray:
        if self._run.tally.rows == 0:
            return _start_row(self.shape, self.scenario)
        if self._keeps_trace:
            rows = rows_in(self._outlet, self.shape.num_columns)
            return rows[-1:] if len(rows) else self._rows[-1][-1:]
        return self._engine.last_row(self._model)


def _start_row(shape: TraceShape, scenario: Scenario) -> np.ndarray:
    """All that is known of a run whose first row is not finite: where it starts."""
    row = np.zeros((1, shape.num_columns))
    row[0, 1 : 1 + len(scenario.trajectory.start)] = scenario.trajectory.start
    return row
