"""The folder of studies: the files alone say what there is; sidecars only save reading."""

from __future__ import annotations

from pathlib import Path

import pytest

from core.executors import make_executor
from core.loading import load_scenario
from core.study.definition import Study
from core.study.loading import study_from_mapping
from recordings.atomic_file import part_of
from recordings.exceptions import RecordingNotFoundError, StorageFullError
from recordings.storage_limits import StorageLimits
from recordings.store import RecordingStore
from recordings.study.conductor import conduct
from recordings.study.study_store import StoredStudy, StudyNotFoundError, StudyStore
from recordings.study.writer import StudyWriter


@pytest.fixture
def runs(tmp_path: Path) -> RecordingStore:
    return RecordingStore(tmp_path)


@pytest.fixture
def store(tmp_path: Path, runs: RecordingStore) -> StudyStore:
    return StudyStore(tmp_path, runs)


def make_study(title: str = "heavier", recordings: str = "none") -> Study:
    mapping = {
        "title": title,
        "base": "paper-case-1",
        "set": {"simulation.duration": 0.05},
        "vary": {"object.mass": {"values": [0.8, 1.2]}},
        "recordings": recordings,
    }
    return study_from_mapping(mapping, load_scenario)


def finish(store: StudyStore, stored: StoredStudy, study: Study) -> StoredStudy:
    path = store.path_of(stored.id)
    with make_executor("inline") as executor, StudyWriter(path, study) as writer:
        end = conduct(
            study,
            executor,
            writer,
            should_stop=lambda: False,
            watch=lambda row: None,
            keep=lambda member: store.keep_recording(stored, member),
        )
        writer.finish(end)
    return store.note_end(stored, end)


def test_a_study_is_there_from_the_moment_it_is_asked_for(store: StudyStore) -> None:
    stored = store.create(make_study(), idempotency_key="mine", request_digest="abc")
    assert store.get(stored.id) == stored
    assert store.list() == ([stored], 1)
    assert store.unfinished() == [stored]
    assert store.find_by_key("mine") == stored
    assert store.find_by_key("yours") is None
    assert (stored.num_runs, stored.keys, stored.title) == (2, ("object.mass",), "heavier")


def test_a_finished_study_tells_its_end(store: StudyStore) -> None:
    study = make_study()
    stored = finish(store, store.create(study), study)
    assert store.get(stored.id) == stored
    assert stored.end is not None
    assert stored.end.outcomes == {"completed": 2}
    assert store.unfinished() == []


def test_without_its_sidecar_a_study_tells_the_same_but_when_it_was_made(
    store: StudyStore, tmp_path: Path
) -> None:
    study = make_study()
    stored = finish(store, store.create(study), study)
    (tmp_path / "studies" / f"{stored.id}.json").write_bytes(
        b'{"id": "',
    )
    again = store.get(stored.id)
    assert (again.end, again.title, again.keys) == (stored.end, stored.title, stored.keys)


def test_an_end_that_was_not_noted_is_read_from_the_file(store: StudyStore) -> None:
    study = make_study()
    created = store.create(study)
    ended = finish(store, created, study)
    store._write_sidecar(created)
    assert store.get(created.id) == ended


def test_studies_are_listed_newest_first_and_page_by_page(store: StudyStore) -> None:
    made = [store.create(make_study(f"number {k}")) for k in range(5)]
    found, count = store.list(offset=1, limit=2)
    assert count == 5
    assert found == [made[3], made[2]]
    assert store.unfinished() == made


def test_recordings_of_a_study_are_runs_and_made_twice_they_are_one(
    store: StudyStore, runs: RecordingStore
) -> None:
    study = make_study(recordings="all")
    stored = store.create(study)
    finish(store, stored, study)
    kept = runs.list()
    assert {run.name for run in kept} == {"heavier, run 0", "heavier, run 1"}
    assert {run.tags for run in kept} == {(f"study {stored.id}",)}
    store.path_of(stored.id).rename(part_of(store.path_of(stored.id)))
    part_of(store.path_of(stored.id)).write_bytes(b"")
    finish(store, stored, study)
    assert {run.id for run in runs.list()} == {run.id for run in kept}
    masses = sorted(runs.open(run.id).scenario.object.mass for run in kept)
    assert masses == [0.8, 1.2]


def test_a_deleted_study_is_gone_and_its_recordings_stay(
    store: StudyStore, runs: RecordingStore, tmp_path: Path
) -> None:
    study = make_study(recordings="all")
    stored = finish(store, store.create(study), study)
    store.delete(stored.id)
    assert list((tmp_path / "studies").iterdir()) == []
    assert runs.count() == 2
    with pytest.raises(StudyNotFoundError):
        store.delete(stored.id)


@pytest.mark.parametrize("study_id", ["", "..", "../x", "abc", "A" * 12, "a" * 13, "x" * 300, "\0"])
def test_no_study_has_such_an_id(store: StudyStore, study_id: str) -> None:
    with pytest.raises(RecordingNotFoundError, match="there is no study"):
        store.get(study_id)


def test_a_full_folder_takes_no_study(tmp_path: Path) -> None:
    runs = RecordingStore(tmp_path, StorageLimits(quota=1))
    (tmp_path / "a.bin").write_bytes(b"too much")
    with pytest.raises(StorageFullError):
        StudyStore(tmp_path, runs).create(make_study())
    assert StudyStore(tmp_path, runs).list() == ([], 0)
