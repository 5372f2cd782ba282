from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import ContactPhase, Outcome, PhaseChange
from slipgrasp.recordings.exceptions import DamagedRecordingError
from slipgrasp.recordings.file import documents
from slipgrasp.recordings.file.reader import read_as_stated, read_recording
from slipgrasp.recordings.file.versions import FIRST_FORMAT_WITH, FORMAT_VERSION
from slipgrasp.recordings.file.writer import RecordingWriter, write_recording


def test_a_run_reads_back_bit_for_bit(any_run, same_run, tmp_path):
    write_recording(any_run, tmp_path / "run.mcap")

    same_run(read_recording(tmp_path / "run.mcap"), any_run)


def test_the_runs_that_are_compared_slip_stop_end_early_and_warn(short_run, lost_run):
    assert short_run.outcome is Outcome.COMPLETED
    assert len(short_run.phase_changes) == 4
    assert lost_run.outcome is Outcome.SEPARATED
    assert lost_run.reason is not None
    assert lost_run.warnings


def test_a_recording_that_was_read_writes_the_same_bytes_again(short_run, tmp_path):
    write_recording(short_run, tmp_path / "first.mcap")

    write_recording(read_recording(tmp_path / "first.mcap"), tmp_path / "second.mcap")

    assert (tmp_path / "first.mcap").read_bytes() == (tmp_path / "second.mcap").read_bytes()


def test_negative_zero_and_the_smallest_and_largest_numbers_survive(short_run, same_run, tmp_path):
    rows = short_run.trace.to_rows()
    extremes = [-0.0, 5e-324, -2.2250738585072014e-308, 1.7976931348623157e308, 0.1 + 0.2]
    rows[:5, 1] = extremes
    run = replace(short_run, trace=Trace.from_rows(short_run.trace.shape, rows))

    write_recording(run, tmp_path / "run.mcap")

    same_run(read_recording(tmp_path / "run.mcap"), run)


def test_a_trace_of_many_chunks_reads_back_in_order(short_run, same_run, tmp_path):
    rows = np.tile(short_run.trace.to_rows(), (60, 1))
    rows[:, 0] = np.linspace(0.0, 20.0, len(rows))
    changes = tuple(
        PhaseChange(
            time=i * 1e-3,
            contact=i % 2,
            from_phase=ContactPhase.SLIP_BACKWARD,
            to_phase=ContactPhase.SLIP_FORWARD,
        )
        for i in range(20_000)
    )
    trace = Trace.from_rows(short_run.trace.shape, rows)
    run = replace(short_run, trace=trace, phase_changes=changes)

    write_recording(run, tmp_path / "run.mcap")

    same_run(read_as_stated(tmp_path / "run.mcap"), run)


def test_samples_written_in_pieces_are_the_samples_written_at_once(short_run, same_run, tmp_path):
    path = tmp_path / "run.mcap"
    rows = short_run.trace.to_rows()
    shape = short_run.trace.shape

    with RecordingWriter(path, short_run.scenario, shape) as writer:
        for piece in np.array_split(rows, 7):
            writer.write(Trace.from_rows(shape, piece), ())
        writer.write(Trace.from_rows(shape, rows[:0]), short_run.phase_changes)
        writer.write_ending(short_run)

    same_run(read_recording(path), short_run)


@pytest.mark.parametrize(
    ("version", "counts"),
    [
        (1, (17, 4)),
        *((version, (12, 2)) for version in (2, 3, 4, 5)),
        *((7, (51, 2)), (8, (51, 3)), (9, (55, 2)), (10, (51, 1)), (11, (10, 0))),
    ],
)
def test_a_recording_of_any_format_reads_back_and_is_written_in_the_present_one(
    same_run, tmp_path, version, counts
):
    run = read_recording(Path(__file__).parent / "data" / f"format-{version}.mcap")
    assert (len(run.trace), len(run.phase_changes)) == counts
    assert bool(run.provenance.kernel) == (version > 1)

    write_recording(run, tmp_path / "present.mcap")

    same_run(read_recording(tmp_path / "present.mcap"), run)


def test_a_metric_that_is_newer_than_a_file_is_computed_from_its_samples(
    short_run, monkeypatch, tmp_path
):
    with monkeypatch.context() as past:
        past.setattr(documents, "asdict", lambda value: without_effort(asdict(value)))
        write_recording(short_run, tmp_path / "older.mcap")
    with pytest.raises(DamagedRecordingError, match="its end document is malformed"):
        read_recording(tmp_path / "older.mcap")

    monkeypatch.setitem(FIRST_FORMAT_WITH, "torque_effort", FORMAT_VERSION + 1)
    metrics = read_recording(tmp_path / "older.mcap").metrics

    assert metrics.torque_effort == pytest.approx(short_run.metrics.torque_effort, rel=1e-2)
    assert without_effort(asdict(metrics)) == without_effort(asdict(short_run.metrics))


def without_effort(values):
    return {name: value for name, value in values.items() if name != "torque_effort"}
