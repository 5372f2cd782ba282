"""The longest runs, in small: everything ends, or is refused in words."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.long_runs import measure, record, request_of
from benchmarks.processes import peak_of
from benchmarks.service import serve

pytestmark = pytest.mark.slow


def test_runs_figure_and_readers_end_or_are_refused_in_words() -> None:
    found = measure(duration=0.5, output_rate=10_000.0, readers=2, seed=1)
    assert found.outcomes == {"completed": 4}
    assert all(5_000 < samples < 6_000 for samples in found.samples)
    assert found.tally.counts["figure", "200"] == len(found.figure_seconds) > 0
    assert found.tally.faults == []
    assert 0 < found.first_peak <= found.peak


def test_the_memory_of_a_service_does_not_grow_with_the_length_of_a_run(tmp_path: Path) -> None:
    samples = 4.0 * 10_000 * 139 * 8
    with serve(tmp_path) as service:
        peaks: list[int] = []
        for duration in (1.0, 5.0):
            record(service, [request_of(duration, 10_000.0, 0.25)])
            peaks.append(peak_of(service.process.pid))
    assert peaks[1] - peaks[0] < 0.5 * samples
