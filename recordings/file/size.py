"""Memory of a run, determined without reading its samples."""

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
"""Memory of a phase change and its entry in a summary [bytes]."""


@dataclass(frozen=True, slots=True)
class RecordingSize:
    """Numbers of samples, ticks and phase changes of a run.

    Attributes:
        shape: Shape of its trace.
        samples: Number of samples of the trace.
        ticks: Number of ticks of sampled control.
        phase_changes: Number of phase changes.
        has_all_metrics: Whether its file contains all metrics; otherwise they follow from samples.
    """

    shape: TraceShape
    samples: int
    ticks: int
    phase_changes: int = 0
    has_all_metrics: bool = True

    @property
    def num_bytes(self) -> int:
        """Memory of the run [bytes]."""
        numbers = self.samples * self.shape.num_columns + self.ticks * Ticks.num_columns(self.shape)
        return _NUMBER * numbers + _PHASE_CHANGE * self.phase_changes


def size_of_run(run: RunResult) -> int:
    """Memory of a run [bytes]."""
    ticks = 0 if run.ticks is None else len(run.ticks)
    size = RecordingSize(run.trace.shape, len(run.trace), ticks, len(run.phase_changes))
    return size.num_bytes


def read_size(path: str | PathLike[str], *, unfinished: bool = False) -> RecordingSize:
    """Size of the run in a recording, from its index; at most one chunk is decompressed.

    Args:
        path: The MCAP file.
        unfinished: Whether it may be incomplete; if so, the compression ratio of a hand
            at rest is assumed.

    Raises:
        RecordingError: As in `slipgrasp.recordings.file.reader.read_recording`, if its start cannot
            be read.
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
