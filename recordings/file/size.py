"""How much memory a run takes, found without reading its samples."""

from __future__ import annotations

import os
from dataclasses import dataclass
from os import PathLike

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.signals import TraceShape
from slipgrasp.core.trace.ticks import Ticks
from slipgrasp.recordings.file.reader import Reading, open_recording
from slipgrasp.recordings.file.schemas import PHASE_CHANGES, SAMPLE_TOPICS, TICKS
from slipgrasp.recordings.file.versions import FIRST_FORMAT_WITH_STEP_METRICS

_NUMBER = 8
_UNPACKED_PER_BYTE = 6
_PHASE_CHANGE = 700
"""A phase change with its place in a summary [bytes]."""


@dataclass(frozen=True, slots=True)
class RecordingSize:
    """How much a run holds.

    Attributes:
        shape: Shape of its trace.
        samples: Samples of the trace.
        ticks: Ticks of sampled control.
        phase_changes: Phase changes.
        has_all_metrics: Whether its file states all metrics; else they follow from its samples.
    """

    shape: TraceShape
    samples: int
    ticks: int
    phase_changes: int = 0
    has_all_metrics: bool = True

    @property
    def num_bytes(self) -> int:
        """Memory of all of it."""
        numbers = self.samples * self.shape.num_columns + self.ticks * Ticks.num_columns(self.shape)
        return _NUMBER * numbers + _PHASE_CHANGE * self.phase_changes


def size_of_run(run: RunResult) -> int:
    """Memory of a run [bytes]."""
    ticks = 0 if run.ticks is None else len(run.ticks)
    size = RecordingSize(run.trace.shape, len(run.trace), ticks, len(run.phase_changes))
    return size.num_bytes


def read_size(path: str | PathLike[str], *, unfinished: bool = False) -> RecordingSize:
    """Size of the run in a recording, as its index states it; one chunk is unpacked at most.

    Args:
        path: The MCAP file.
        unfinished: Whether it may end anywhere. Then it states nothing, and is taken for as well
            packed as a hand at rest.

    Raises:
        RecordingError: As `slipgrasp.recordings.file.reader.read_recording`, if not even its
            beginning can be read.
    """
    with open_recording(path) as stream:
        if unfinished:
            shape, _ = Reading(stream, str(path), unfinished=True).outline()
            most = _UNPACKED_PER_BYTE * os.fstat(stream.fileno()).st_size
            return RecordingSize(shape, most // (_NUMBER * shape.num_columns), 0)
        shape, version, counts = Reading(stream, str(path)).counts()
    samples = max(counts.get(topic.name, 0) for topic in SAMPLE_TOPICS)
    return RecordingSize(
        shape,
        samples,
        counts.get(TICKS.name, 0),
        counts.get(PHASE_CHANGES.name, 0),
        has_all_metrics=version >= FIRST_FORMAT_WITH_STEP_METRICS,
    )
