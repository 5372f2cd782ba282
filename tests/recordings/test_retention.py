"""What goes by age, number and size, and that nothing goes which somebody has marked."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from slipgrasp.core.executors import make_executor
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.study.loading import study_from_mapping
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.study.retention import (
    KEEP_ALL,
    Expired,
    Retention,
    Rule,
    TrustedClock,
    delete_expired,
    find_expired,
    in_share,
)
from slipgrasp.recordings.study.scheduler import schedule_runs
from slipgrasp.recordings.study.study_store import StoredStudy, StudyStore
from slipgrasp.recordings.study.writer import StudyWriter
from tests.recordings.studying import write_study

NOW = datetime(2030, 1, 31, tzinfo=UTC)


@pytest.fixture(scope="module")
def result() -> RunResult:
    return simulate(with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.01}))


@pytest.fixture
def runs(tmp_path: Path) -> RecordingStore:
    return RecordingStore(tmp_path)


@pytest.fixture
def studies(tmp_path: Path, runs: RecordingStore) -> StudyStore:
    return StudyStore(tmp_path, runs)


def save_aged(runs: RecordingStore, result: RunResult, days: float) -> str:
    stored = runs.save(result)
    sidecar = stored.path.with_suffix(".json")
    document = json.loads(sidecar.read_text())
    document["created"] = (NOW - timedelta(days=days)).isoformat()
    sidecar.write_text(json.dumps(document))
    return stored.id


def told(expired: list[Expired]) -> list[tuple[str, Rule]]:
    return [(each.run.id, each.rule) for each in expired]


def test_without_a_rule_everything_stays(runs, studies, result) -> None:
    save_aged(runs, result, 10_000)
    assert find_expired(runs, studies, KEEP_ALL, NOW) == []


def test_what_is_older_goes_and_what_is_as_old_stays(runs, studies, result) -> None:
    ids = [save_aged(runs, result, days) for days in (0, 29.9, 30, 30.1, 400)]
    found = find_expired(runs, studies, Retention(max_age=timedelta(days=30)), NOW)
    assert told(found) == [(ids[3], Rule.AGE), (ids[4], Rule.AGE)]


def test_the_newest_of_a_number_stay(runs, studies, result) -> None:
    ids = [save_aged(runs, result, days) for days in (3, 1, 2, 4)]
    found = find_expired(runs, studies, Retention(max_runs=2), NOW)
    assert told(found) == [(ids[0], Rule.COUNT), (ids[3], Rule.COUNT)]
    assert len(find_expired(runs, studies, Retention(max_runs=0), NOW)) == 4


def test_the_newest_that_fit_a_size_stay_and_none_older_than_one_that_goes(
    runs, studies, result
) -> None:
    longer = simulate(with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.5}))
    ids = [save_aged(runs, r, days) for r, days in ((result, 1), (longer, 2), (result, 3))]
    small, large = (runs.get(ids[k]).size for k in (0, 1))
    assert large > small
    found = find_expired(runs, studies, Retention(max_bytes=2 * small), NOW)
    assert told(found) == [(ids[1], Rule.SIZE), (ids[2], Rule.SIZE)]
    assert find_expired(runs, studies, Retention(max_bytes=2 * small + large), NOW) == []


@pytest.mark.parametrize("mark", [{"name": "a"}, {"notes": "b"}, {"tags": ["c"]}])
def test_what_is_marked_stays_and_takes_no_place(runs, studies, result, mark) -> None:
    ids = [save_aged(runs, result, days) for days in (1, 2, 3)]
    runs.annotate(ids[1], **mark)
    rules = Retention(max_age=timedelta(days=2.5), max_runs=1, max_bytes=runs.get(ids[0]).size)
    assert told(find_expired(runs, studies, rules, NOW)) == [(ids[2], Rule.AGE)]
    runs.annotate(ids[1], name="", notes="", tags=[])
    assert (ids[1], Rule.COUNT) in told(find_expired(runs, studies, rules, NOW))


def test_a_run_that_is_marked_after_it_was_found_is_not_deleted(runs, studies, result) -> None:
    ids = [save_aged(runs, result, days) for days in (1, 2, 3)]
    found = find_expired(runs, studies, Retention(max_runs=0), NOW)
    runs.annotate(ids[1], tags=["keep"])
    runs.delete(ids[2])
    assert told(delete_expired(runs, found)) == [(ids[0], Rule.COUNT)]
    assert [run.id for run in runs.list()] == [ids[1]]


def begun(studies: StudyStore, is_finished: bool) -> StoredStudy:
    """A study of two runs that keeps the recordings of both."""
    mapping = {
        "title": "heavier",
        "base": "paper-case-1",
        "set": {"simulation.duration": 0.05},
        "vary": {"object.mass": {"values": [0.8, 1.2]}},
        "recordings": "all",
    }
    study = study_from_mapping(mapping, load_scenario)
    stored = studies.create(study)
    path, keep = studies.path_of(stored.id), studies.keeper_of(stored)
    if is_finished:
        return studies.note_end(stored, write_study(study, path, keep=keep))
    with make_executor("inline") as executor, StudyWriter(path, study) as writer:
        options = {"should_stop": lambda: False, "watch": lambda row: None, "keep": keep}
        schedule_runs(study, executor, writer, **options)
    return stored


def test_recordings_of_a_study_go_once_it_is_finished_unless_somebody_marked_them(
    runs, studies
) -> None:
    stored = begun(studies, is_finished=True)
    recorded = runs.list()
    assert len(recorded) == 2 and all(run.name and run.tags for run in recorded)
    assert len(find_expired(runs, studies, Retention(max_runs=0), NOW)) == 2
    runs.annotate(recorded[0].id, name="the one for the report")
    (found,) = find_expired(runs, studies, Retention(max_runs=0), NOW)
    assert found.run.id == recorded[1].id
    studies.delete(stored.id)
    assert find_expired(runs, studies, Retention(max_runs=0), NOW) == []


def test_recordings_of_a_study_in_progress_stay(runs, studies) -> None:
    begun(studies, is_finished=False)
    assert runs.count() == 2
    assert find_expired(runs, studies, Retention(max_runs=0), NOW) == []


def test_a_name_that_only_looks_like_that_of_a_study_is_a_mark(runs, studies, result) -> None:
    stored = begun(studies, is_finished=True)
    run_id = save_aged(runs, result, 1)
    runs.annotate(run_id, name="heavier, run 0", tags=[f"study {stored.id}"])
    found = find_expired(runs, studies, Retention(max_runs=0), NOW)
    assert run_id not in [each.run.id for each in found]


def test_a_start_deletes_no_more_than_a_tenth_of_the_folder_the_oldest(
    runs, studies, result
) -> None:
    ids = [save_aged(runs, result, days) for days in range(21)]
    for rules in (Retention(max_age=timedelta(days=-1)), Retention(max_runs=0)):
        found = find_expired(runs, studies, rules, NOW)
        assert len(found) == 21
        at_start = in_share(found, runs.count(), at_start=True)
        assert [each.run.id for each in at_start] == ids[-2:]
    assert len(in_share(found[:1], num_runs=1, at_start=True)) == 1


def test_later_number_and_size_hold_at_once_and_age_a_tenth_at_a_time(
    runs, studies, result
) -> None:
    ids = [save_aged(runs, result, days) for days in range(20)]
    rules = Retention(max_runs=4, max_age=timedelta(days=9.5))
    found = find_expired(runs, studies, rules, NOW)
    later = in_share(found, runs.count(), at_start=False)
    assert told(later) == [(one, Rule.COUNT) for one in ids[4:10]] + [
        (one, Rule.AGE) for one in ids[18:]
    ]


def test_a_clock_that_is_days_past_the_newest_run_is_not_trusted(runs, result) -> None:
    save_aged(runs, result, 0)
    passed = [100.0]
    ahead = TrustedClock(runs, lambda: NOW + timedelta(days=400), lambda: passed[0])
    assert ahead.now() == NOW + timedelta(days=3)
    assert ahead.lag() == timedelta(days=397)
    passed[0] += 86_400.0
    assert ahead.now() == NOW + timedelta(days=4)
    for days in (-1000, 0, 2.9):
        right = TrustedClock(runs, lambda days=days: NOW + timedelta(days=days), lambda: 0.0)
        assert right.now() == NOW + timedelta(days=days) and not right.lag()


def test_a_folder_without_runs_has_nothing_to_doubt_the_clock_by(runs) -> None:
    assert TrustedClock(runs, lambda: NOW, lambda: 0.0).now() == NOW
