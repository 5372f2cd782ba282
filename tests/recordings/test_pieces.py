"""Long runs: written while they are made and read piece by piece, in memory that does not grow."""

from __future__ import annotations

import io
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import run_to_end, simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings import export as exports
from slipgrasp.recordings.exceptions import DamagedRecordingError
from slipgrasp.recordings.export import DATA_FORMATS, ExportFormat
from slipgrasp.recordings.file import recorder
from slipgrasp.recordings.file.pieces import read_ending, read_pieces
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.recorder import record
from slipgrasp.recordings.file.size import read_size
from slipgrasp.recordings.file.state_hash import state_hash
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.recordings.store.description import Description
from slipgrasp.recordings.study.study_row import RunHash
from slipgrasp.recordings.study.task import release_hashed

NAMES = ["paper-case-1", "spatial-box"]


def long_run(name: str, duration: float) -> Scenario:
    values = {"simulation.duration": duration, "simulation.output_rate": 2000.0}
    return with_values(load_scenario(name), values)


@pytest.mark.parametrize("name", NAMES)
def test_a_run_that_leaves_memory_as_it_is_written_is_the_same_file(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder, "FLUSH_INTERVAL", 0.0)
    scenario = long_run(name, 3.0)

    recorded = record(scenario, tmp_path / "a.mcap", keep_trace=False)

    whole = simulate(scenario)
    write_recording(whole, tmp_path / "b.mcap")
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()
    assert replace(recorded.result, trace=whole.trace, ticks=whole.ticks).summary() == (
        whole.summary()
    )
    kept = recorded.result.trace.to_rows()
    assert len(kept) < len(whole.trace)
    np.testing.assert_array_equal(kept, whole.trace.to_rows()[-len(kept) :])
    assert recorded.result.summary() == whole.summary()


def test_recording_a_run_takes_no_more_memory_the_longer_it_is(tmp_path: Path) -> None:
    record(long_run("paper-case-1", 0.1), tmp_path / "first.mcap", keep_trace=False)

    def peak(duration: float) -> int:
        tracemalloc.start()
        try:
            path = tmp_path / f"{duration}.mcap"
            record(long_run("paper-case-1", duration), path, keep_trace=False)
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    short, long = peak(3.0), peak(9.0)
    rows_more = 6.0 * 2000.0 * 72 * 8
    assert long - short < 0.1 * rows_more


def test_what_was_released_is_counted_and_what_follows_is_there() -> None:
    simulation = Simulation(long_run("paper-case-1", 7.0))
    rows, ticks = [], []
    while not simulation.finished:
        simulation.advance()
        rows.append(simulation.trace_from(sum(map(len, rows))).to_rows())
        ticks.append(simulation.ticks_from(sum(map(len, ticks))).to_rows())
        simulation.release(sum(map(len, rows)), sum(map(len, ticks)))
    whole = simulate(simulation.scenario)
    assert whole.ticks is not None
    np.testing.assert_array_equal(np.concatenate(rows), whole.trace.to_rows())
    np.testing.assert_array_equal(np.concatenate(ticks), whole.ticks.to_rows())
    assert (simulation.num_rows, simulation.num_ticks) == (len(whole.trace), len(whole.ticks))
    assert simulation.num_released_rows > 0


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("export", [each for each in DATA_FORMATS if each.long_writer])
def test_a_table_that_is_written_as_the_recording_is_read_is_the_same_file(
    name: str, export: ExportFormat, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exports, "ROWS_AT_ONCE", 400)
    monkeypatch.setattr(exports, "ROWS_PER_GROUP", 700)
    path, whole, long = tmp_path / "run.mcap", io.BytesIO(), io.BytesIO()
    write_recording(simulate(long_run(name, 2.0)), path)

    export.write(read_recording(path), whole)
    export.write_long(path, long)

    assert read_size(path).has_all_metrics
    told = Description.from_result(read_ending(path))
    assert told == Description.from_result(read_recording(path))
    assert long.getvalue() == whole.getvalue()


@pytest.mark.parametrize("name", NAMES)
def test_the_pieces_of_a_recording_are_its_run(name: str, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    write_recording(simulate(long_run(name, 3.0)), path)

    pieces = list(read_pieces(path))

    whole = read_recording(path)
    assert len(pieces) > 3 and max(len(piece.trace) for piece in pieces) <= len(whole.trace) // 3
    rows = np.concatenate([piece.trace.to_rows() for piece in pieces])
    np.testing.assert_array_equal(rows, whole.trace.to_rows())
    assert tuple(c for piece in pieces for c in piece.phase_changes) == whole.phase_changes
    ticks = [piece.ticks.to_rows() for piece in pieces if piece.ticks is not None]
    assert whole.ticks is not None
    np.testing.assert_array_equal(np.concatenate(ticks), whole.ticks.to_rows())


def test_a_damaged_byte_is_found_by_who_reads_piece_by_piece(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    write_recording(simulate(long_run("paper-case-1", 1.0)), path)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    with pytest.raises(DamagedRecordingError):
        list(read_pieces(path))


@pytest.mark.parametrize("name", NAMES)
def test_a_run_of_a_study_is_hashed_while_it_leaves_memory(name: str) -> None:
    scenario = long_run(name, 5.0)
    simulation, state = Simulation(scenario), RunHash()
    run_to_end(simulation, lambda running: release_hashed(running, state))
    state.take(simulation)

    assert state.hexdigest() == state_hash(simulate(scenario))
    assert simulation.num_released_rows > simulation.num_rows // 4
