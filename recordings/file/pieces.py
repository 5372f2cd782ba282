"""Reads a recording chunk by chunk, in memory that does not depend on its length."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from os import PathLike
from typing import BinaryIO

import numpy as np

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.signals import SIGNALS
from slipgrasp.core.trace.ticks import Ticks
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import PhaseChange
from slipgrasp.recordings.file.contents import Contents
from slipgrasp.recordings.file.packing import MessageLayout
from slipgrasp.recordings.file.reader import Reading, TopicColumns, open_recording
from slipgrasp.recordings.file.schemas import CHECKPOINTS, PHASE_CHANGES, Topic, kept_fields


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """Part of a recording after the previous one.

    Attributes:
        trace: Samples; there may be none.
        phase_changes: Phase changes.
        ticks: Commands of the law; None if they were not read.
        run_of: Returns the run with some of the samples, all phase changes, and scenario and ending
            of the file; only the last part has the ending.
    """

    trace: Trace
    phase_changes: tuple[PhaseChange, ...]
    ticks: Ticks | None
    run_of: Callable[[Trace, tuple[PhaseChange, ...]], RunResult]

    @classmethod
    def of(cls, contents: Contents) -> Piece:
        """Creates a part from the content of a file."""
        changes, ticks = contents.phase_changes(), contents.ticks()
        return cls(contents.trace(), changes, ticks, contents.result_of)


def read_pieces(
    path: str | PathLike[str],
    signals: frozenset[str] | None = None,
    should_stop: Callable[[], bool] = lambda: False,
) -> Iterator[Piece]:
    """Reads a complete recording in parts of about one chunk.

    Checksums are compared as soon as their data have been read. Hashes and statements are not
    checked: `slipgrasp.recordings.file.reader.read_recording` does that.

    Args:
        path: The MCAP file.
        signals: Names of the signals to read, without ticks; everything if None.
        should_stop: Called repeatedly; True stops the reading.

    Raises:
        RecordingError: As `slipgrasp.recordings.file.reader.read_recording`, if it cannot be read.
    """
    with open_recording(path) as stream:
        for contents in _PieceReading(stream, str(path), signals).pieces(should_stop):
            yield Piece.of(contents)


def read_groups(
    path: str | PathLike[str], count: int, should_stop: Callable[[], bool] = lambda: False
) -> Iterator[Trace]:
    """Reads the samples of a complete recording in groups.

    Args:
        path: The MCAP file.
        count: Number of samples of each group; the last may have fewer.
        should_stop: As in `read_pieces`.

    Raises:
        RecordingError: As `read_pieces`.
    """
    waiting: list[Trace] = []
    for piece in read_pieces(path, should_stop=should_stop):
        waiting.append(piece.trace)
        if sum(map(len, waiting)) >= count:
            rows = joined(waiting)
            num_whole = len(rows) // count * count
            yield from (rows[start : start + count] for start in range(0, num_whole, count))
            waiting = [rows[num_whole:]]
    if len(rows := joined(waiting)):
        yield rows


def read_ending(
    path: str | PathLike[str], should_stop: Callable[[], bool] = lambda: False
) -> RunResult:
    """Reads a run with only its first and last samples.

    Args:
        path: The MCAP file; its format must contain all metrics (`RecordingSize.has_all_metrics`).
        should_stop: As in `read_pieces`.

    Returns:
        The run with only these samples, with their time and estimates.

    Raises:
        RecordingError: As `read_pieces`.
    """
    pieces = read_pieces(path, frozenset({"estimates"}), should_stop)
    last = next(pieces)
    rows, changes = last.trace, list(last.phase_changes)
    for last in pieces:
        rows = joined([rows, last.trace])
        rows = rows[:: max(1, len(rows) - 1)]
        changes += last.phase_changes
    return last.run_of(rows, tuple(changes))


def joined(parts: list[Trace]) -> Trace:
    """Joins traces of one shape."""
    first = parts[0]
    arrays = {
        signal.name: np.concatenate([getattr(part, signal.name) for part in parts])
        for signal in SIGNALS
    }
    return Trace(shape=first.shape, absent=first.absent, **arrays)


class _PieceReading(Reading):
    """One pass through a file that retains some of its signals."""

    def __init__(self, stream: BinaryIO, name: str, signals: frozenset[str] | None) -> None:
        super().__init__(stream, name)
        self._signals = signals

    def _columns_for(self, topic: Topic, layout: MessageLayout) -> TopicColumns:
        if self._signals is None or topic.name in (PHASE_CHANGES.name, CHECKPOINTS.name):
            return TopicColumns(layout)
        return TopicColumns(layout, kept_fields(topic, self._signals))
