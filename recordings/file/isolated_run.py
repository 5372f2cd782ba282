"""A run with a custom law, simulated in a separate process.

A law that never returns, exhausts the memory or crashes its process ends only its run, with a
reason.
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
"""Additional time for the process beyond the elapsed time of a run [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class IsolatedRun:
    """A run as a task.

    Attributes:
        scenario: Scenario to simulate.
        law: Its custom law.
        wall_limit: Elapsed time, without suspensions, after which the run ends as ``limit`` [s].
        path: The recording to write; None for no recording.
    """

    scenario: Scenario
    law: LawReference
    wall_limit: float
    path: Path | None = None


def simulate_isolated(run: IsolatedRun, caller: Caller) -> tuple[RunResult, str | None]:
    """Simulates a run, in any process.

    Returns:
        The run, and the reason for an incomplete recording; None if it is complete or not
        requested.

    Raises:
        LawError: If the law differs here.
        ScenarioError: If the scenario cannot be simulated.
        RecordingWriteError: If the recording cannot be started.
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
    """Simulates and records; without a recording, no simulation starts.

    Returns:
        The run with only the last samples of its trace, and the reason for an incomplete recording;
        None if it is complete.

    Raises:
        ScenarioError: If the scenario cannot be simulated.
        RecordingWriteError: If the recording cannot be started.
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
    """Simulates such runs in reused processes."""

    def __init__(self, wall_limit: float, max_running: int) -> None:
        """Creates the object without starting a process.

        Args:
            wall_limit: Elapsed time, without suspensions, after which a run ends as ``limit`` [s].
            max_running: Number of processes that share the memory of the machine.
        """
        limits = WorkerLimits.shared_by(max_running)
        self._wall_limit = wall_limit
        self._tasks = SingleTasks(replace(limits, task_seconds=wall_limit + _PATIENCE))

    def simulate(self, scenario: Scenario, should_stop: ShouldStop) -> RunResult:
        """Simulates a run.

        Args:
            scenario: Scenario to simulate.
            should_stop: Called about 20 times a second; True ends the run as ``stopped``.
        """
        return self._do(self._task(scenario), should_stop, _ignore)[0]

    def record(
        self,
        scenario: Scenario,
        path: Path,
        should_stop: ShouldStop,
        progress: Callable[[float], None],
    ) -> tuple[RunResult, str | None]:
        """Simulates and records; see `record_or_say_why`."""
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
        """Stops the processes."""
        self._tasks.close()


def needs_isolation(scenario: Scenario) -> bool:
    """Whether a scenario has a custom law that other processes can load."""
    law = custom_law_in(scenario)
    return law is not None and bool(law.source or law.origin)


def _not_begun(scenario: Scenario, outcome: Outcome, reason: Reason) -> RunResult:
    simulation = Simulation(scenario)
    simulation.end(outcome, reason)
    return simulation.result()


def _ignore(share: float) -> None:
    """Ignores the progress."""
