"""Some signals of a segment: bit for bit those of the whole recording, for a part of its cost."""

from __future__ import annotations

import tracemalloc
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.signals import SIGNALS
from slipgrasp.recordings.exceptions import DamagedRecordingError, RecordingError
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.segment import Segment, read_outline, read_segment
from slipgrasp.recordings.file.writer import write_recording

ALL = frozenset(signal.name for signal in SIGNALS)


@pytest.fixture(scope="module")
def run() -> RunResult:
    """Of many chunks, with phase changes at both ends."""
    values = {"simulation.duration": 7.0, "simulation.output_rate": 1000.0}
    return simulate(with_values(load_scenario("paper-case-1"), values))


@pytest.fixture(scope="module")
def path(run: RunResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("segment") / "run.mcap"
    write_recording(run, path)
    return path


@pytest.mark.parametrize(
    "signals", [ALL, {"slip"}, {"times"}, {"phase", "joint_torque"}, {"times", "estimates"}]
)
@pytest.mark.parametrize(("start", "end"), [(0.0, 1e9), (1.0, 1.5), (3.0, 3.0), (6.9, 8.0)])
def test_a_segment_is_that_of_the_whole_recording(run, path, signals, start, end) -> None:
    found = read_segment(path, Segment(signals=frozenset(signals), start=start, end=end))
    inside = (run.trace.times >= start) & (run.trace.times <= end)
    assert inside.sum() == len(found) > 0
    for name in {"times", *signals}:
        part, whole = getattr(found, name), getattr(run.trace, name)[inside]
        assert part.dtype == whole.dtype and np.array_equal(part, whole), name
    read = {signal.topic for signal in SIGNALS if signal.name in signals}
    assert not found.absent & set(signals)
    assert {s.name for s in SIGNALS if s.topic not in read and run.trace.shape.has(s)} - {
        "times"
    } <= found.absent


def test_both_rows_of_an_event_are_in_a_segment_that_begins_or_ends_with_it(run, path) -> None:
    times = run.trace.times
    event = next(b for a, b in pairwise(times.tolist()) if a == b and b > 0.0)
    for start, end in ((event, 9.0), (0.0, event), (event, event)):
        found = read_segment(path, Segment(signals=frozenset({"phase"}), start=start, end=end))
        assert np.array_equal(found.times, times[(times >= start) & (times <= end)])
        assert (found.times == event).sum() >= 2


def test_a_segment_beyond_the_end_is_empty(path) -> None:
    assert len(read_segment(path, Segment(signals=ALL, start=8.0))) == 0


def test_an_outline_has_the_columns_and_no_rows(run, path) -> None:
    outline = read_outline(path)
    assert (outline.shape, outline.absent, len(outline)) == (run.trace.shape, frozenset(), 0)


def test_two_columns_take_a_fraction_of_the_memory(path) -> None:
    peaks = []
    for read in (
        lambda: read_recording(path),
        lambda: read_segment(path, Segment(signals=frozenset({"slip"}), start=2.0, end=2.1)),
    ):
        tracemalloc.start()
        read()
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < peaks[0] / 3


def test_a_byte_flipped_anywhere_is_noticed_also_outside_the_segment(path, tmp_path) -> None:
    whole, damaged = path.read_bytes(), tmp_path / "damaged.mcap"
    segment = Segment(signals=frozenset({"slip"}), start=1.0, end=1.1)
    for place in np.linspace(20, len(whole) - 20, 60).astype(int):
        data = bytearray(whole)
        data[place] ^= 4
        damaged.write_bytes(data)
        with pytest.raises(RecordingError):
            read_segment(damaged, segment)
    damaged.write_bytes(whole[:-1000])
    with pytest.raises(DamagedRecordingError):
        read_segment(damaged, segment)
