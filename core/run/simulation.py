"""A run in progress, with access to its results so far."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Self

import numpy as np

from slipgrasp.core.kernel.laws.own_law import ANSWERED, ASKED
from slipgrasp.core.kernel.loop.output import rows_in, settled_rows, ticks_in
from slipgrasp.core.run.computation import Computation, start_row
from slipgrasp.core.run.law_code import Replay
from slipgrasp.core.run.metrics import compute_metrics
from slipgrasp.core.run.provenance import Provenance, present_provenance
from slipgrasp.core.run.result import RunResult, RunSummary
from slipgrasp.core.run.stepping import Tick
from slipgrasp.core.scenario.custom_laws import OUTSIDE, LawIdentity
from slipgrasp.core.scenario.scenario import need_hand
from slipgrasp.core.scenario.validation import check_scenario
from slipgrasp.core.trace.ticks import Ticks
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import Outcome, PhaseChange
from slipgrasp.core.words.warnings import describe_warnings


class Simulation(Computation):
    """A run that advances in chunks, so that it can be watched and stopped.

    Attributes:
        scenario: Simulated scenario.
        shape: Shape of its trace.
        outcome: Outcome of the run, None while it is in progress.
        num_released_rows: Number of initial rows of the trace that were released, see `release`.
        num_released_ticks: Number of initial ticks that were released.
    """

    num_released_rows = num_released_ticks = 0

    @classmethod
    def replaying(cls, result: RunResult, *, every_law: bool = False) -> Self:
        """Returns a run that uses the recorded commands of its law instead of its code.

        Args:
            result: A run with recorded ticks.
            every_law: Whether commands of built-in laws are also taken from the recording.
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
        """Steps the run externally, one control tick at a time.

        Each tick waits for its torque::

            simulation = Simulation(scenario)
            for tick in simulation.ticks():
                tick.torque = -0.1 * tick.seen.joint_velocity
            result = simulation.result()

        The law of the scenario is not used; the run has the law ``outside`` instead.

        Raises:
            ScenarioError: If control is continuous, so that there are no ticks, or if the
                scenario has no hand.
        """
        assert self._run.begun == 0, "a run can only be stepped from its start"
        own = need_hand(self.scenario, "stepping with torques", "call advance instead")
        scenario = replace(own, controller=replace(own.controller, kind=OUTSIDE))
        check_scenario(scenario, with_law=False)
        self._prepare(scenario, ())
        self._identity = LawIdentity(OUTSIDE, "", "")
        own, tick = self._run.own, Tick(self._run.own, self._size)
        while not self.finished:
            self.advance()
            if own.asked == ASKED:
                yield tick.arrive()
                own.asked = ANSWERED

    def release(self, rows: int, ticks: int) -> None:
        """Releases the first rows and ticks from memory, in whole blocks.

        `result` then contains the rest of the trace, at least its last row; indices of rows and
        ticks still count from the start of the run.

        Args:
            rows: Number of rows that are no longer needed.
            ticks: Number of ticks that are no longer needed.
        """
        while len(self._rows) > 1 and self.num_released_rows + len(self._rows[0]) <= rows:
            self.num_released_rows += len(self._rows.pop(0))
        while self._ticks and self.num_released_ticks + len(self._ticks[0]) <= ticks:
            self.num_released_ticks += len(self._ticks.pop(0))

    def result(self) -> RunResult:
        """The run so far, without released parts; ``stopped`` if it has not ended."""
        assert self._keeps_trace, "a run without a trace has only a summary"
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
        """The retained trace as rows ``(rows, shape.num_columns)``, see `Trace.to_rows`."""
        rows = rows_in(self._outlet, self.shape.num_columns)
        if self._run.tally.rows == 0:
            return start_row(self.shape, self.scenario)
        if self._rows:
            return np.concatenate([*self._rows, rows])
        # Copied, because the run continues to write to the buffer.
        return rows if self.finished else rows.copy()

    @property
    def num_rows(self) -> int:
        """Number of rows of the trace so far."""
        return self._num_taken_rows + int(self._outlet.num_rows)

    @property
    def num_settled_rows(self) -> int:
        """Number of final rows: during a short slip, rows may still be inserted after these."""
        if self.finished:
            return self.num_rows
        return self._num_taken_rows + settled_rows(self._run, self._outlet)

    @property
    def _num_taken_rows(self) -> int:
        """Number of rows that have left the kernel's buffer."""
        return self.num_released_rows + sum(map(len, self._rows))

    def trace_from(self, row: int) -> Trace:
        """The final rows of the trace so far, from a row that was not released."""
        return Trace.from_rows(self.shape, self.rows_from(row))

    def rows_from(self, row: int) -> np.ndarray:
        """Like `trace_from`, but as rows ``(rows, shape.num_columns)``, see `Trace.to_rows`."""
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
        """Number of control ticks so far; 0 for continuous control."""
        held = sum(map(len, self._ticks)) + int(self._outlet.num_ticks)
        return self.num_released_ticks + held

    def ticks_from(self, tick: int) -> Ticks:
        """The commands of the law so far, from a tick that was not released."""
        last = ticks_in(self._outlet, Ticks.num_columns(self.shape))
        held = np.concatenate([*self._ticks, last])
        return Ticks.from_rows(self.shape, held[tick - self.num_released_ticks :])

    def phase_changes_from(self, index: int) -> tuple[PhaseChange, ...]:
        """The phase changes so far, from a given index."""
        return tuple(self._changes[index:])

    @property
    def provenance(self) -> Provenance:
        """Program, numerics and law that compute the run."""
        return replace(present_provenance(self.scenario.space), law=self._identity)

    def summary(self) -> RunSummary:
        """The run without its trace; ``stopped`` while it is in progress."""
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
