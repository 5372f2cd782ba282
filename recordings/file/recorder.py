"""Simulates and records at the same time, so that a run survives the death of its process.

A chunk is written when it is full, or when the last one is older than `FLUSH_INTERVAL`. Written
data are passed to the operating system immediately (they survive the death of this process) and to
the disk every `SYNC_INTERVAL` (they survive a power failure).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import run_to_end
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.trace.types import Outcome, RunWarning
from slipgrasp.core.words.interruptions import describe_disk_failure
from slipgrasp.recordings.exceptions import (
    RecordingBusyError,
    RecordingError,
    RecordingExistsError,
    RecordingWriteError,
)
from slipgrasp.recordings.file.atomic_file import part_of
from slipgrasp.recordings.file.foxglove.layouts import DISPLAY_RATE
from slipgrasp.recordings.file.reader import read_unfinished
from slipgrasp.recordings.file.writer import RecordingWriter

FLUSH_INTERVAL = 0.25
SYNC_INTERVAL = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Recorded:
    """A run and its recording.

    Attributes:
        result: The run; ``failed`` if the disk failed before its end. It has a warning
            ``not_saved`` if its recording is incomplete. Without a retained trace, only its last
            samples.
        failure: Reason for an incomplete recording; None if it is complete.
    """

    result: RunResult
    failure: RecordingError | None


def record(
    scenario: Scenario,
    path: Path,
    *,
    overwrite: bool = False,
    display_rate: float = DISPLAY_RATE,
    progress: Callable[[float], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
    wall_limit: float | None = None,
    only_recorded: bool = False,
    keep_trace: bool = True,
) -> Recorded:
    """Runs a scenario to the end and records it, at first in ``PATH.part``.

    The file equals that of `slipgrasp.recordings.file.writer.write_recording`. If the disk fails,
    the written samples can be recovered from ``PATH.part``.

    Args:
        scenario: Scenario to simulate.
        path: The file to write.
        overwrite: Whether to replace an existing file.
        display_rate: Rate of the display topics, 0 for none [Hz].
        progress: Called with the simulated fraction, 0 to 1, after every chunk.
        should_stop: Called after every chunk; True ends the run as ``stopped``.
        wall_limit: Elapsed time, without suspensions, after which the run ends as ``limit`` [s].
        only_recorded: Whether to simulate nothing if the recording cannot be started.
        keep_trace: Whether the result has the whole trace; otherwise samples are released after
            they are written, and memory does not depend on the length of the run.

    Raises:
        ScenarioError: If the scenario cannot be simulated.
        RecordingWriteError: If ``only_recorded`` is set and the recording cannot be started.
        RecordingExistsError: If the file exists and may not be replaced.
        RecordingBusyError: If its ``.part`` exists.
    """
    simulation = Simulation(scenario)
    recorder: _Recorder | None = None
    result: RunResult | None = None

    def watch(simulation: Simulation) -> None:
        if recorder is not None:
            recorder.take(simulation)
        if progress is not None:
            progress(simulation.progress)

    run = partial(run_to_end, simulation, watch, should_stop=should_stop, wall_limit=wall_limit)
    writer = RecordingWriter(
        path,
        scenario,
        simulation.shape,
        provenance=simulation.provenance,
        overwrite=overwrite,
        display_rate=display_rate,
        keep_part=True,
    )
    try:
        with writer:
            recorder = _Recorder(writer, keep_trace=keep_trace)
            run()
            result = simulation.result()
            recorder.finish(simulation, result)
    except RecordingBusyError:
        raise  # The unfinished file belongs to another writer.
    except (RecordingExistsError, RecordingWriteError) as failure:
        if result is None:
            if isinstance(failure, RecordingExistsError):
                raise
            if only_recorded:
                _drop_if_empty(part_of(path))
                raise
            run()
        _drop_if_empty(part_of(path))
        return Recorded(unsaved(simulation.result(), failure), failure)
    except BaseException:  # For example a second Ctrl-C during a law that never returns.
        _drop_if_empty(part_of(path))
        raise
    return Recorded(result, None)


class _Recorder:
    """Writes a run to its recording during the simulation."""

    def __init__(self, writer: RecordingWriter, *, keep_trace: bool) -> None:
        self._writer = writer
        self._keeps_trace = keep_trace
        self._failure: OSError | RecordingWriteError | None = None
        self._flushed_at = self._synced_at = time.monotonic()

    def take(self, simulation: Simulation) -> None:
        """Writes new samples when they are due; a disk failure ends the run."""
        writer, now = self._writer, time.monotonic()
        is_due = now - self._flushed_at >= FLUSH_INTERVAL
        num_new = simulation.num_settled_rows - writer.num_samples
        if not is_due and num_new < writer.samples_per_chunk:
            return
        try:
            writer.write(
                simulation.trace_from(writer.num_samples),
                simulation.phase_changes_from(writer.num_phase_changes),
                simulation.ticks_from(writer.num_ticks),
            )
            if not self._keeps_trace:
                simulation.release(writer.num_samples, writer.num_ticks)
            if is_due:
                writer.flush()
            if now - self._synced_at >= SYNC_INTERVAL:
                writer.sync()
                self._synced_at = now
        except (OSError, RecordingWriteError) as error:
            self._failure = error
            simulation.end(Outcome.FAILED, describe_disk_failure(error, simulation.time))
        self._flushed_at = now

    def finish(self, simulation: Simulation, result: RunResult) -> None:
        """Writes the rest of the run.

        Args:
            simulation: The finished run.
            result: Its result.

        Raises:
            OSError, RecordingWriteError: If the disk fails now or failed before.
        """
        if self._failure is not None:
            raise self._failure
        writer = self._writer
        rest = result.trace[writer.num_samples - simulation.num_released_rows :]
        changes = result.phase_changes[writer.num_phase_changes :]
        writer.write(rest, changes, simulation.ticks_from(writer.num_ticks))
        writer.write_ending(result)


def failed_by_disk(result: RunResult, failure: RecordingError) -> RunResult:
    """The run as ``failed``, because its recording is incomplete."""
    if result.outcome is Outcome.FAILED:
        return result
    reason = describe_disk_failure(failure, result.end_time)
    return replace(result, outcome=Outcome.FAILED, reason=reason)


def unsaved(result: RunResult, failure: RecordingError) -> RunResult:
    """The run with a warning that it is not saved."""
    warning = RunWarning(
        code="not_saved", message=str(failure), count=1, first_time=result.end_time
    )
    return replace(result, warnings=(*result.warnings, warning))


def _drop_if_empty(part: Path) -> None:
    """Deletes an unfinished file without a recoverable sample."""
    try:
        read_unfinished(part)
    except RecordingError:
        part.unlink(missing_ok=True)
