"""A run whose law is not ours, simulated in a process of its own.

A law that never answers, fills the memory or breaks the process it runs in costs that run, with
the reason.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from slipgrasp.core.executors.executor import Caller, Cancelled, ShouldStop
from slipgrasp.core.executors.limits import WorkerLimits
from slipgrasp.core.executors.single import SingleTasks, WorkerDiedError
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.chosen_laws import custom_law_in
from slipgrasp.core.scenario.law_loading import LawReference, admit, refer_to
from slipgrasp.core.trace.types import Outcome, Reason
from slipgrasp.core.words.interruptions import describe_stop, describe_worker_death
from slipgrasp.recordings.file.recorder import failed_by_disk, record

_PATIENCE = 5.0
"""How much longer than the computing time of a run its process may take [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class IsolatedRun:
    """A run as a task.

    Attributes:
        scenario: What to simulate.
        law: The law that it needs.
        wall_limit: Computing time after which it ends as ``limit`` [s].
        path: The recording to write; None for none.
    """

    scenario: Scenario
    law: LawReference
    wall_limit: float
    path: Path | None = None


def simulate_isolated(run: IsolatedRun, caller: Caller) -> tuple[RunResult, str | None]:
    """Simulates a run, in any process.

    Returns:
        The run, and why its recording is not complete; None if it is, or there is none.

    Raises:
        LawError: If the law is not the same here.
        ScenarioError: If the scenario cannot be simulated.
        RecordingWriteError: If the recording cannot be begun.
    """
    admit(run.law)
    if run.path is None:
        return simulate(run.scenario, should_stop=caller, wall_limit=run.wall_limit), None
    return record_or_say_why(run.scenario, run.path, caller, caller.report, run.wall_limit)


def record_or_say_why(
    scenario: Scenario,
    path: Path,
    should_stop: ShouldStop,
    progress: Callable[[float], None],
    wall_limit: float,
) -> tuple[RunResult, str | None]:
    """Simulates and records at once; what cannot be recorded is not begun.

    Returns:
        The run with the last samples of its trace alone, and why its recording is not complete;
        None if it is.

    Raises:
        ScenarioError: If the scenario cannot be simulated.
        RecordingWriteError: If the recording cannot be begun.
    """
    recorded = record(
        scenario,
        path,
        progress=progress,
        should_stop=should_stop,
        wall_limit=wall_limit,
        only_recorded=True,
        keep_trace=False,
    )
    if recorded.failure is None:
        return recorded.result, None
    return failed_by_disk(recorded.result, recorded.failure), str(recorded.failure)


class IsolatedRuns:
    """Simulates such runs in processes that stay warm."""

    def __init__(self, wall_limit: float, max_running: int) -> None:
        """Starts nothing yet.

        Args:
            wall_limit: Computing time after which a run ends as ``limit`` [s].
            max_running: How many share the memory of the machine.
        """
        limits = WorkerLimits.shared_by(max_running)
        self._wall_limit = wall_limit
        self._tasks = SingleTasks(replace(limits, task_seconds=wall_limit + _PATIENCE))

    def simulate(self, scenario: Scenario, should_stop: ShouldStop) -> RunResult:
        """Simulates a run.

        Args:
            scenario: What to simulate.
            should_stop: Asked about 20 times a second; True ends the run as ``stopped``.
        """
        return self._do(self._task(scenario), should_stop, _ignore)[0]

    def record(
        self,
        scenario: Scenario,
        path: Path,
        should_stop: ShouldStop,
        progress: Callable[[float], None],
    ) -> tuple[RunResult, str | None]:
        """Simulates and records at once; see `record_or_say_why`."""
        return self._do(self._task(scenario, path), should_stop, progress)

    def _task(self, scenario: Scenario, path: Path | None = None) -> IsolatedRun:
        law = custom_law_in(scenario)
        assert law is not None, "runs of built-in laws need no isolation"
        return IsolatedRun(
            scenario=scenario, law=refer_to(law), wall_limit=self._wall_limit, path=path
        )

    def _do(
        self, run: IsolatedRun, should_stop: ShouldStop, progress: Callable[[float], None]
    ) -> tuple[RunResult, str | None]:
        try:
            return self._tasks.do(simulate_isolated, run, should_stop, progress)
        except Cancelled:
            stop = describe_stop(0.0)
            return _not_begun(run.scenario, Outcome.STOPPED, stop), stop.message
        except WorkerDiedError as death:
            told = f"the process of the law '{run.law.identity.name}' {death}"
            return _not_begun(run.scenario, Outcome.FAILED, describe_worker_death(told)), told

    def close(self) -> None:
        """Ends the processes."""
        self._tasks.close()


def needs_isolation(scenario: Scenario) -> bool:
    """Whether a scenario has a law that may break its process, and that another one finds."""
    law = custom_law_in(scenario)
    return law is not None and bool(law.source or law.origin)


def _not_begun(scenario: Scenario, outcome: Outcome, reason: Reason) -> RunResult:
    simulation = Simulation(scenario)
    simulation.end(outcome, reason)
    return simulation.result()


def _ignore(share: float) -> None:
    """Nobody asks how far it is."""
