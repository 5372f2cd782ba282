"""The file of a study: read back as written, continued where it stopped, never believed blindly."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from mcap.reader import make_reader

from slipgrasp.core.executors import Cancelled
from slipgrasp.core.executors.executor import never
from slipgrasp.core.executors.inline import InlineExecutor
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.custom_laws import custom_law, forget
from slipgrasp.core.scenario.law_choice import with_law
from slipgrasp.core.scenario.law_loading import register_law
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values
from slipgrasp.core.study.definition import Study
from slipgrasp.core.study.loading import study_from_mapping
from slipgrasp.core.trace.types import Outcome
from slipgrasp.core.words.interruptions import describe_stop, describe_wall_limit
from slipgrasp.recordings.exceptions import (
    DamagedRecordingError,
    ForeignRecordingError,
    RecordingBusyError,
    RecordingExistsError,
)
from slipgrasp.recordings.file.atomic_file import part_of
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.state_hash import state_hash
from slipgrasp.recordings.study import scheduler
from slipgrasp.recordings.study.reader import open_study
from slipgrasp.recordings.study.rebuild import RebuildError, rebuild
from slipgrasp.recordings.study.study_row import StudyRow, row_of
from slipgrasp.recordings.study.task import StudyRun
from slipgrasp.recordings.study.writer import RUNS_PER_CHUNK
from tests.recordings.studying import write_study

pytestmark = pytest.mark.slow

NUM_RUNS = 50


def make_study(**changes) -> Study:
    mapping = {
        "title": "grip on ice",
        "base": "paper-case-2",
        "set": {"simulation.duration": 0.3},
        "sampling": {"method": "random", "runs": NUM_RUNS // 2, "seed": 5},
        "vary": {
            "fingers.0.friction": {"min": 0.2, "max": 0.4},
            "fingers.1.friction": {"min": 0.2, "max": 0.4},
            "controller.lyapunov_weight": {"values": [1.0, 20.0]},
        },
        "recordings": "none",
    }
    return study_from_mapping({**mapping, **changes}, load_scenario)


def run_study(study: Study, path: Path, *, stop_after: int = 10**9) -> list[StudyRow]:
    """Runs it in this process until so many rows are there."""
    seen: list[StudyRow] = []
    write_study(study, path, seen.append, lambda: len(seen) >= stop_after)
    return seen


def read_rows(path: Path) -> list[StudyRow]:
    with open_study(path) as reader:
        return list(reader.rows())


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("study") / "study.mcap"
    run_study(make_study(), path)
    return path


def test_rows_are_read_back_as_they_were_watched(finished: Path, tmp_path: Path) -> None:
    rows = run_study(make_study(), tmp_path / "again.mcap")
    assert [row.index for row in rows] == list(range(NUM_RUNS))
    assert read_rows(finished) == rows
    with open_study(finished) as reader:
        assert reader.study == make_study()
        assert reader.end is None
        assert sum(1 for _ in reader.rows()) == NUM_RUNS
        assert reader.end is not None
        assert reader.end.state == "completed"
        assert sum(reader.end.outcomes.values()) == NUM_RUNS


def test_equal_studies_are_equal_files(finished: Path, tmp_path: Path) -> None:
    run_study(make_study(), tmp_path / "again.mcap")
    assert (tmp_path / "again.mcap").read_bytes() == finished.read_bytes()


def test_every_row_is_that_of_its_scenario_simulated_alone(finished: Path) -> None:
    study = make_study()
    for row in read_rows(finished)[::7]:
        result = simulate(with_values(study.base, row.values))
        assert result.scenario == study.scenario_of(row.index)
        assert row.state_hash == state_hash(result)
        assert row.outcome is result.outcome
        assert row.end_time == result.end_time
        assert row.reason == result.reason
        assert row.metrics == result.metrics.flattened()
        assert rebuild(study, row).summary() == result.summary()


def test_a_row_that_was_altered_is_not_rebuilt(finished: Path) -> None:
    row = read_rows(finished)[3]
    altered = replace(row, values={**row.values, "fingers.0.friction": 0.3})
    with pytest.raises(RebuildError, match="run 3 differs from its result"):
        rebuild(make_study(), altered)


def test_a_run_that_its_computing_time_ended_is_not_rebuilt(finished: Path) -> None:
    row = replace(
        read_rows(finished)[3], outcome=Outcome.LIMIT, reason=describe_wall_limit(0.02, 60.0)
    )
    with pytest.raises(RebuildError, match="run 3 reached its limit of elapsed time"):
        rebuild(make_study(), row)


def test_rebuilding_can_be_given_up(finished: Path) -> None:
    study = make_study(base="paper-case-1", set={"simulation.duration": 30.0})
    row = replace(read_rows(finished)[3], values={})
    with pytest.raises(Cancelled):
        rebuild(study, row, should_stop=lambda: True)
    with pytest.raises(RebuildError, match="run 3 takes more than 0 s of elapsed time"):
        rebuild(study, row, wall_limit=0.0)


def test_the_mcap_library_reads_the_rows(finished: Path) -> None:
    with finished.open("rb") as stream:
        messages = list(make_reader(stream).iter_messages())
    assert [message.log_time for _, _, message in messages] == list(range(NUM_RUNS))
    assert {channel.message_encoding for _, channel, _ in messages} == {"json"}


def test_an_interrupted_study_goes_on_behind_its_last_row(finished: Path, tmp_path: Path) -> None:
    path = tmp_path / "study.mcap"
    first = run_study(make_study(), path, stop_after=1)
    assert RUNS_PER_CHUNK <= len(first) < NUM_RUNS
    assert not path.exists()
    assert read_rows(part_of(path)) == first
    second = run_study(make_study(), path)
    assert [row.index for row in itertools.chain(first, second)] == list(range(NUM_RUNS))
    assert path.read_bytes() == finished.read_bytes()
    assert not part_of(path).exists()


def test_slow_runs_are_written_one_by_one_and_give_the_same_file_in_the_end(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("slipgrasp.recordings.study.task.TASK_SECONDS", 0.0)
    monkeypatch.setattr("slipgrasp.recordings.study.scheduler.WRITE_INTERVAL", 0.0)
    path = tmp_path / "study.mcap"
    first = run_study(make_study(), path, stop_after=7)
    assert [row.index for row in first] == list(range(7))
    assert read_rows(part_of(path)) == first
    second = run_study(make_study(), path)
    assert [row.index for row in second] == list(range(7, NUM_RUNS))
    assert path.read_bytes() == finished.read_bytes()
    assert [file.name for file in tmp_path.iterdir()] == ["study.mcap"]


def test_a_part_torn_anywhere_goes_on_to_the_same_file(finished: Path, tmp_path: Path) -> None:
    whole = finished.read_bytes()
    for cut in range(0, len(whole), len(whole) // 7):
        path = tmp_path / f"{cut}.mcap"
        part_of(path).write_bytes(whole[:cut])
        run_study(make_study(), path)
        assert path.read_bytes() == whole


def test_a_part_of_another_study_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "study.mcap"
    run_study(make_study(), path, stop_after=1)
    before = part_of(path).read_bytes()
    with pytest.raises(RecordingBusyError, match="belongs to another study"):
        run_study(make_study(title="another"), path)
    assert part_of(path).read_bytes() == before


def test_a_finished_study_is_not_replaced(finished: Path) -> None:
    with pytest.raises(RecordingExistsError):
        run_study(make_study(), finished)


def test_a_flipped_byte_is_noticed(finished: Path, tmp_path: Path) -> None:
    whole = finished.read_bytes()
    for place in range(100, len(whole), len(whole) // 40):
        path = tmp_path / "flipped.mcap"
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :])
        with pytest.raises(DamagedRecordingError):
            read_rows(path)


def test_a_study_is_no_recording_of_a_run(finished: Path) -> None:
    with pytest.raises(ForeignRecordingError, match="it is a study"):
        read_recording(finished)


def test_recordings_are_given_back_as_asked(tmp_path: Path) -> None:
    study = make_study(
        sampling={"method": "list"},
        vary={},
        runs=[{"object.mass": 1.0}, {"fingers.0.friction": 0.05, "fingers.1.friction": 0.4}],
        recordings="ended-early",
    )
    kept: list[StudyRun] = []

    def keep(run: StudyRun) -> str:
        kept.append(run)
        return "id"

    rows: list[StudyRow] = []
    write_study(study, tmp_path / "s.mcap", rows.append, keep=keep)
    (run,) = kept
    assert [row.recording for row in rows] == [None, "id"]
    path = tmp_path / "run.mcap"
    assert run.recording is not None
    path.write_bytes(run.recording.data)
    assert state_hash(read_recording(path)) == run.row.state_hash == rows[1].state_hash


class _LateExecutor(InlineExecutor):
    """Does one task, and never gives another; it is asked only whether to stop."""

    def map(self, function, tasks, *, should_stop):
        yield from super().map(function, itertools.islice(tasks, 1), should_stop=never)
        while not should_stop():
            pass


@pytest.mark.parametrize(("step", "waits"), [(0.4, False), (0.0, True)])
def test_finished_rows_wait_neither_for_the_next_task_nor_are_lost_in_a_stop(
    tmp_path: Path, monkeypatch, step: float, waits: bool
) -> None:
    study, clock, asked = make_study(), itertools.count(0.0, step), itertools.count()
    monkeypatch.setattr(scheduler, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    rows: list[StudyRow] = []
    seen: list[int] = []

    def should_stop() -> bool:
        seen.append(len(rows))
        return next(asked) > 9

    end = write_study(study, tmp_path / "s.mcap", rows.append, should_stop, _LateExecutor())
    assert 0 < len(rows) < RUNS_PER_CHUNK
    assert seen[-1] == (0 if waits else len(rows))
    assert end.state == "cancelled" and end.runs == len(rows)


def test_a_definition_made_by_hand_is_validated_again(tmp_path: Path) -> None:
    study = make_study()
    mapping = {"base": study.base.to_mapping(), "vary": {"object.mass": {"values": [1.0, 2.0]}}}
    by_hand = study_from_mapping(mapping, scenario_from_mapping)
    run_study(by_hand, tmp_path / "s.mcap")
    with open_study(tmp_path / "s.mcap") as reader:
        assert reader.study == by_hand


def test_a_row_is_not_complete_before_its_duration() -> None:
    long = {"simulation.duration": 600.0, "controller.control_period": 0.001}
    simulation = Simulation(with_values(load_scenario("paper-case-1"), long))
    simulation.advance()
    simulation.end(Outcome.COMPLETED, describe_stop(simulation.time))

    row = row_of(0, {}, simulation, "")

    assert row.outcome is Outcome.FAILED and row.reason is not None
    assert row.reason.code == "contradictory_end"
    assert row.reason.message.endswith(f"ended at {simulation.summary().end_time:g} s of 600 s")
    assert row.metrics["held"] is False


class Steady:
    """Carries the object with a fixed grip."""

    version = "1"

    def command(self, seen, memory, out):
        force = 40.0 * seen.contact_normal
        force[:, 1] += seen.model.object_mass * seen.model.gravity / len(seen.slip)
        out.torque[:] = np.einsum("nij,ni->nj", seen.jacobian, force)


class Changed(Steady):
    """The same under another version."""

    name = "steady"
    version = "2"


@pytest.fixture
def steady_study():
    register_law(Steady)
    base = with_law(load_scenario("composite-case-2"), "steady")
    base = with_values(base, {"simulation.duration": 0.02})
    yield study_from_mapping(
        {
            "base": "base",
            "vary": {"object.mass": {"min": 0.8, "max": 1.2, "count": 2 * NUM_RUNS}},
            "recordings": "none",
        },
        lambda _: base,
    )
    forget("steady")


def test_a_study_names_the_law_that_computed_it_and_is_rebuilt_with_no_other(
    tmp_path, steady_study
):
    path = tmp_path / "study.mcap"
    rows = run_study(steady_study, path)
    with open_study(path) as reader:
        study = reader.study
    (identity,) = study.computed_by
    assert (identity.name, identity.version) == ("steady", "1")
    assert identity == custom_law("steady").identity
    assert state_hash(rebuild(study, rows[1])) == rows[1].state_hash
    register_law(Changed)
    with pytest.raises(RebuildError, match="computed with the law 'steady', version 1"):
        rebuild(study, rows[1])


def test_a_study_is_not_continued_with_another_version_of_its_law(tmp_path, steady_study):
    path = tmp_path / "study.mcap"
    run_study(steady_study, path, stop_after=2)
    assert part_of(path).exists()
    register_law(Changed)
    with pytest.raises(RecordingBusyError, match="another version of its control law"):
        run_study(steady_study, path)
