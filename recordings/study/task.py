"""A task with some runs of a study: a pure function that any process can execute."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from slipgrasp.core.executors import Cancelled
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import prepare_kernel, run_to_end
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.law_loading import LawReference, admit
from slipgrasp.core.study.definition import KeptRecordings, Value, apply_values
from slipgrasp.core.trace.types import Outcome
from slipgrasp.core.words.interruptions import describe_worker_death
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.recordings.store.description import Description
from slipgrasp.recordings.study.study_row import RunHash, StudyRow, row_of

HASHED_AT_ONCE = 4096
"""Number of samples or ticks of a run after which they are hashed and released."""

WALL_LIMIT = 60.0
"""Elapsed time after which a run ends as ``limit`` [s], because later rows wait for its row."""

TASK_SECONDS = 0.5
"""Elapsed time after which the rest of a task returns to the queue [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyTask:
    """Some consecutive runs of a study.

    Attributes:
        first: Index of the first run.
        base: The base scenario.
        values: Values that each run sets, by dotted key.
        recordings: Runs whose recordings are returned.
        limits: Largest magnitudes of metrics; a run past one counts as not held.
        laws: Custom laws that the runs need.
    """

    first: int
    base: Scenario
    values: tuple[Mapping[str, Value], ...]
    recordings: KeptRecordings
    limits: Mapping[str, float] = field(default_factory=dict)
    laws: tuple[LawReference, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRecording:
    """The recording of a run: content of its file, and description."""

    data: bytes
    description: Description


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyRun:
    """The result of a run of a study: its row, and its recording if requested."""

    row: StudyRow
    recording: RunRecording | None = None


def run_task(task: StudyTask, cancelled: Callable[[], bool]) -> list[StudyRun]:
    """Simulates the runs of a task successively, as many as half a second allows.

    Slow runs are thus reported early, and distributed among all workers.

    Args:
        task: The runs.
        cancelled: Called every few milliseconds; True stops the simulation.

    Returns:
        The results of the first runs, at least one; each depends on the task alone.

    Raises:
        Cancelled: If it was stopped.
        LawError: If a law differs here.
        ScenarioError: If a scenario cannot be simulated.
    """
    prepare_kernel()
    for reference in task.laws:
        admit(reference)
    started = time.monotonic()
    done: list[StudyRun] = []
    for place in range(len(task.values)):
        done.append(_simulate(task, place, cancelled))
        if time.monotonic() - started > TASK_SECONDS:
            break
    return done


def lost_run(index: int, values: Mapping[str, Value], failure: str) -> StudyRun:
    """The row of a run whose worker died in every attempt."""
    row = StudyRow(
        index=index,
        values=dict(values),
        outcome=Outcome.FAILED,
        reason=describe_worker_death(failure),
        end_time=0.0,
        metrics={},
        state_hash="",
        kernel="",
    )
    return StudyRun(row=row)


def _simulate(task: StudyTask, place: int, cancelled: Callable[[], bool]) -> StudyRun:
    values = task.values[place]
    simulation, state = Simulation(apply_values(task.base, values)), RunHash()

    def look_on(simulation: Simulation) -> None:
        if task.recordings == "none":
            release_hashed(simulation, state)

    run_to_end(simulation, look_on, should_stop=cancelled, wall_limit=WALL_LIMIT)
    if simulation.outcome is Outcome.STOPPED:
        raise Cancelled
    state.take(simulation)
    row = row_of(task.first + place, values, simulation, state.hexdigest(), task.limits)
    ended_early = row.outcome is not Outcome.COMPLETED
    if task.recordings == "all" or (task.recordings == "ended-early" and ended_early):
        return StudyRun(row=row, recording=encode_recording(simulation.result()))
    return StudyRun(row=row)


def release_hashed(simulation: Simulation, state: RunHash) -> None:
    """Hashes new samples of a run if there are many, and releases them."""
    news = simulation.num_settled_rows - state.num_rows, simulation.num_ticks - state.num_ticks
    if max(news) >= HASHED_AT_ONCE:
        state.take(simulation)
        simulation.release(state.num_rows, state.num_ticks)


def encode_recording(result: RunResult) -> RunRecording:
    """The recording as bytes, because the worker may be on another machine."""
    description = Description.from_result(result)
    with tempfile.TemporaryDirectory(prefix="slipgrasp-") as folder:
        path = Path(folder) / "run.mcap"
        write_recording(result, path)
        return RunRecording(data=path.read_bytes(), description=description)
