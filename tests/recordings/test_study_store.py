"""The folder of studies: the files alone say what there is; sidecars only save reading."""

from __future__ import annotations

import json
import threading
from dataclasses import asdict
from pathlib import Path

import pytest

from slipgrasp.core.file_lock import try_lock
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.study.definition import Study
from slipgrasp.core.study.loading import study_from_mapping
from slipgrasp.recordings.exceptions import RecordingNotFoundError, StorageFullError
from slipgrasp.recordings.file.atomic_file import part_of
from slipgrasp.recordings.store.storage_limits import StorageLimits
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.study.documents import StudyEnd
from slipgrasp.recordings.study.study_store import StoredStudy, StudyNotFoundError, StudyStore
from slipgrasp.recordings.study.writer import StudyWriter
from tests.recordings.studying import write_study

pytestmark = pytest.mark.slow


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
    end = write_study(study, store.path_of(stored.id), keep=store.keeper_of(stored))
    return store.note_end(stored, end)


def test_a_study_is_there_from_the_moment_it_is_asked_for(store: StudyStore) -> None:
    stored = store.create(make_study(), idempotency_key="mine", request_digest="abc")
    assert store.get(stored.id) == stored
    assert store.list() == ([stored], 1)
    assert store.unfinished() == [stored]
    assert store.find_by_key("mine") == stored
    assert store.find_by_key("yours") is None
    assert (stored.num_runs, stored.keys, stored.title) == (2, ("object.mass",), "heavier")


def test_a_finished_study_tells_its_end_also_without_its_sidecar(
    store: StudyStore, tmp_path: Path
) -> None:
    study = make_study()
    stored = finish(store, store.create(study), study)
    assert store.get(stored.id) == stored
    assert stored.end is not None
    assert stored.end.outcomes == {"completed": 2}
    assert store.unfinished() == []
    (tmp_path / "studies" / f"{stored.id}.json").write_bytes(
        b'{"id": "',
    )
    again = store.get(stored.id)
    assert (again.end, again.title, again.keys) == (stored.end, stored.title, stored.keys)


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


def test_a_study_is_told_though_its_sidecar_is_being_written(
    store: StudyStore, caplog: pytest.LogCaptureFixture
) -> None:
    study = make_study()
    created = store.create(study)
    part = store.path_of(created.id).with_suffix(".json.part")
    with part.open("wb") as elsewhere:
        assert try_lock(elsewhere)
        ended = finish(store, created, study)
        assert ended.end is not None and ended.end.state == "completed"
        assert store.get(created.id) == ended
        assert store.find_end(created.id) == ended.end
        caplog.clear()
        assert store.list() == ([ended], 1) and caplog.records == []
    store._write_sidecar(created)
    assert StudyStore(part.parents[1], RecordingStore(part.parents[1])).get(created.id) == ended


def test_a_study_that_ends_while_others_look_is_always_there(store: StudyStore) -> None:
    study, made = make_study(), []
    seen: list[object] = []
    is_over = threading.Event()

    def look() -> None:
        while not is_over.is_set():
            expected = set(made)
            found, count = store.list()
            seen.append(expected <= {stored.id for stored in found} and count >= len(expected))
            seen.extend(store.get(study_id).finding == "" for study_id in expected)

    threads = [threading.Thread(target=look) for _ in range(3)]
    for thread in threads:
        thread.start()
    for _ in range(10):
        stored = store.create(study)
        made.append(stored.id)
        with StudyWriter(store.path_of(stored.id), study) as writer:
            end = StudyEnd(state="cancelled", runs=0, outcomes={})
            writer.finish(end)
        assert store.note_end(stored, end).end == end
    is_over.set()
    for thread in threads:
        thread.join()
    assert len(seen) > 30 and all(seen)
    for study_id in made:
        sidecar = store.path_of(study_id).with_suffix(".json")
        assert json.loads(sidecar.read_text())["end"] == asdict(end)


def test_a_sidecar_that_cannot_be_true_is_not_believed_and_the_log_says_why(
    store: StudyStore, caplog: pytest.LogCaptureFixture
) -> None:
    study = make_study()
    stored = finish(store, store.create(study), study)
    sidecar = store.path_of(stored.id).with_suffix(".json")
    written = json.loads(sidecar.read_text())
    for key, value in (
        ("created", "\ud800"),
        ("title", "\udfff"),
        ("created", "yesterday"),
        ("num_runs", -1),
        ("num_runs", 10**9),
        ("end", {"state": "completed", "runs": 3, "outcomes": {}}),
        ("keys", None),
        ("recordings", "some"),
    ):
        sidecar.write_text(json.dumps({**written, key: value}))
        again = store.get(stored.id)
        assert (again.end, again.title, again.num_runs) == (stored.end, stored.title, 2), key
    assert f"the sidecar of study {stored.id}: recordings: Input should be" in caplog.text


def test_only_files_of_the_folder_itself_are_studies(store: StudyStore) -> None:
    study = make_study()
    stored = finish(store, store.create(study), study)
    folder = store.path_of(stored.id).parent
    (folder / "eeeeeeeeeee1.mcap").symlink_to(store.path_of(stored.id))
    (folder / "eeeeeeeeeee2.mcap.part").symlink_to(store.path_of(stored.id))
    (folder / "eeeeeeeeeee3.mcap").mkdir()
    for number in (1, 2, 3):
        with pytest.raises(StudyNotFoundError):
            store.get(f"eeeeeeeeeee{number}")
        with pytest.raises(StudyNotFoundError):
            store.delete(f"eeeeeeeeeee{number}")
    assert store.list() == ([stored], 1)


def test_a_damaged_study_is_listed_with_what_is_wrong_and_can_be_deleted(
    store: StudyStore, caplog: pytest.LogCaptureFixture
) -> None:
    study = make_study()
    stored = finish(store, store.create(study), study)
    folder = store.path_of(stored.id).parent
    whole = store.path_of(stored.id).read_bytes()
    damaged = {"aaaaaaaaaaa1.mcap": b"", "aaaaaaaaaaa2.mcap": whole[: len(whole) // 2]}
    damaged |= {"aaaaaaaaaaa3.mcap.part": b"of another program"}
    for name, content in damaged.items():
        (folder / name).write_bytes(content)
    (folder / "aaaaaaaaaaa1.json").mkdir()

    for _ in range(3):
        found, count = store.list()
    assert count == len(found) == 4
    assert [one.id for one in found if one.finding] == [f"aaaaaaaaaaa{k}" for k in (3, 2, 1)]
    assert all(name in one.finding for name, one in zip(damaged, found[:0:-1], strict=True))
    assert len(caplog.records) == 3, "it is read and told once"
    assert store.unfinished() == []
    for study_id in ("aaaaaaaaaaa1", "aaaaaaaaaaa2", "aaaaaaaaaaa3"):
        store.delete(study_id)
    assert store.list() == ([stored], 1)


def test_that_recordings_find_no_room_is_logged_once_and_counted_in_the_end(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    store = StudyStore(tmp_path, RecordingStore(tmp_path, StorageLimits(quota=100_000)))
    study = make_study(recordings="all")
    stored = store.create(study)
    (tmp_path / "filler").write_bytes(bytes(100_000))
    ended = finish(store, stored, study)
    assert ended.end is not None and ended.end.message == "2 recordings could not be stored"
    (record,) = caplog.records
    assert f"run 0 of study {stored.id}" in record.message and "quota" in record.message


def test_a_full_folder_takes_no_study(tmp_path: Path) -> None:
    runs = RecordingStore(tmp_path, StorageLimits(quota=1))
    (tmp_path / "a.bin").write_bytes(b"too much")
    with pytest.raises(StorageFullError):
        StudyStore(tmp_path, runs).create(make_study())
    assert StudyStore(tmp_path, runs).list() == ([], 0)
