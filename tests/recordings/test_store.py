import json
import os
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import datetime

import pytest

from slipgrasp.core.file_lock import try_lock
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.trace.types import RunWarning
from slipgrasp.recordings.exceptions import (
    AnnotationError,
    ContradictoryRecordingError,
    RecordingChangedError,
    RecordingNotFoundError,
    RecordingWriteError,
    StorageFullError,
    UploadError,
)
from slipgrasp.recordings.file import documents
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.recordings.store import storage_limits
from slipgrasp.recordings.store.run_files import RunFiles
from slipgrasp.recordings.store.storage_limits import StorageLimits
from slipgrasp.recordings.store.store import RecordingStore, default_data_directory


@pytest.fixture
def store(tmp_path):
    return RecordingStore(tmp_path / "runs")


def test_a_saved_run_is_found_and_read_back(store, short_run, same_run):
    stored = store.save(short_run)

    assert re.fullmatch("[a-z0-9]{12}", stored.id)
    assert store.get(stored.id) == stored
    assert stored.title == short_run.scenario.title
    assert stored.summary == json.loads(json.dumps(short_run.summary()))
    same_run(store.open(stored.id), short_run)


def test_a_folder_that_is_not_there_yet_holds_no_runs(store):
    assert store.list() == []
    assert store.count() == 0


def test_a_deleted_run_is_gone_with_its_sidecar(store, short_run, tmp_path):
    stored = store.save(short_run)
    assert store.count() == len(store.list()) == 1

    store.delete(stored.id)

    assert store.count() == len(store.list()) == 0
    assert {path.name.partition(".")[0] for path in (tmp_path / "runs").iterdir()} == {"catalogue"}
    with pytest.raises(RecordingNotFoundError):
        store.delete(stored.id)


@pytest.mark.parametrize(
    "run_id", ["", "..", "../secret", "a/b", "ABCDEFGHIJKL", "a" * 11, "a" * 13, "a" * 12, "a\0b"]
)
def test_whatever_is_not_the_id_of_a_run_is_not_found(store, short_run, run_id):
    store.save(short_run)

    with pytest.raises(RecordingNotFoundError):
        store.get(run_id)


def test_a_link_that_leads_out_of_the_folder_is_not_followed(store, short_run, tmp_path):
    outside = store.save(short_run).path.rename(tmp_path / "outside.mcap")
    (tmp_path / "runs" / "aaaaaaaaaaaa.mcap").symlink_to(outside)

    assert store.list() == []
    with pytest.raises(RecordingNotFoundError):
        store.open("aaaaaaaaaaaa")


BROKEN_SIDECARS = [
    None,
    b"{",
    b"\xff",
    b'{"title": "\xed\xa0\x80"}',
    b"[" * 100_000,
    b'{"created": 1, "title": 1, "controller": 1, "summary": 1, "name": 1, "tags": "x"}',
    b'{"title": "x", "controller": "x", "summary": {"outcome": "completed", "metrics": {}}}',
    b'{"title": "\\ud800", "created": "0001-01-01T00:00+09:00", "tags": ["\\ud800"]}',
]


@pytest.mark.parametrize("content", BROKEN_SIDECARS)
def test_a_missing_or_broken_sidecar_is_derived_from_the_recording(store, short_run, content):
    stored = store.save(short_run)
    sidecar = stored.path.with_suffix(".json")
    sidecar.unlink()
    if content is not None:
        sidecar.write_bytes(content)

    for found in (store.get(stored.id), *store.list()):
        assert (found.title, found.summary) == (stored.title, stored.summary)
        assert (found.preset, found.controller) == (stored.preset, stored.controller)
        assert (found.name, found.notes, found.tags) == ("", "", ())
        assert datetime.fromisoformat(found.created).timestamp() == pytest.approx(
            stored.path.stat().st_mtime, abs=0.001
        )


def test_a_run_tells_preset_controller_and_size(store, short_run, run_without_unknowns):
    stored = store.save(short_run)
    assert (stored.preset, stored.controller) == ("paper-case-2", "theorem-4")
    assert stored.size == stored.path.stat().st_size
    other = replace(short_run, scenario=replace(short_run.scenario, title="of my own"))
    assert store.save(other).preset == ""


def test_a_run_is_recorded_at_its_reserved_place_and_registered(store, short_run, same_run):
    place = store.reserve()
    assert store.count() == 0 and place.path.parent.is_dir()
    with pytest.raises(RecordingNotFoundError):
        store.register(place, short_run)

    write_recording(short_run, place.path)
    stored = store.register(place, short_run)

    assert stored == store.get(place.id) == store.list()[0]
    same_run(store.open(place.id), short_run)


def test_a_run_whose_sidecar_cannot_be_written_is_kept(store, short_run, caplog):
    place = store.reserve()
    write_recording(short_run, place.path)
    place.path.with_suffix(".json").mkdir()

    stored = store.register(place, short_run)

    assert "without its sidecar" in caplog.text
    assert [run.id for run in store.list()] == [stored.id]
    assert store.get(stored.id).summary == stored.summary


def test_a_run_that_vanishes_is_not_found_instead_of_failing(store, short_run):
    stored = store.save(short_run)
    stored.path.with_suffix(".json").unlink()
    folder = RunFiles(stored.path.parent)
    assert folder.holds(stored.id)
    stored.path.unlink()

    with pytest.raises(RecordingNotFoundError, match=stored.id):
        folder.read(stored.id)
    assert store.list() == [] and store.count() == 0


def test_name_notes_and_tags_are_kept_and_survive_a_restart(store, short_run, tmp_path):
    stored = store.save(short_run)
    store.annotate(stored.id, name=" heavier ", tags=["a", "b", "a"])
    changed = store.annotate(stored.id, notes="first\nsecond\tline ✓")

    assert (changed.name, changed.notes, changed.tags) == (
        "heavier",
        "first\nsecond\tline ✓",
        ("a", "b"),
    )
    assert changed == store.get(stored.id) == RecordingStore(tmp_path / "runs").list()[0]
    assert (changed.created, changed.summary) == (stored.created, stored.summary)
    assert store.annotate(stored.id, name="", tags=[]).annotations == replace(
        changed.annotations, name="", tags=()
    )


@pytest.mark.parametrize(
    "wrong",
    [
        {"name": "x" * 201},
        {"name": "\ud800"},
        {"notes": "x" * 10_001},
        {"tags": ["x"] * 33},
        {"tags": [" "]},
        {"tags": "word"},
    ],
)
def test_what_is_beyond_the_bounds_is_refused_by_name_and_nothing_changes(store, short_run, wrong):
    stored = store.save(short_run)
    (field,) = wrong
    with pytest.raises(AnnotationError, match=rf"^{field}: \S") as refusal:
        store.annotate(stored.id, **wrong)
    assert refusal.value.field == field and len(str(refusal.value)) < 200
    assert store.get(stored.id) == stored


def test_a_change_made_for_an_older_revision_is_refused(store, short_run):
    stored = store.save(short_run)
    changed = store.annotate(stored.id, name="first", expected={stored.revision})

    with pytest.raises(RecordingChangedError, match="changed meanwhile"):
        store.annotate(stored.id, name="second", expected={stored.revision})

    assert store.get(stored.id).name == "first"
    assert store.get(stored.id).revision == changed.revision != stored.revision


def test_of_many_changes_at_once_for_one_revision_one_is_made(store, short_run):
    stored = store.save(short_run)

    def change(number):
        try:
            return store.annotate(stored.id, name=str(number), expected={stored.revision}).name
        except RecordingChangedError:
            return None

    with ThreadPoolExecutor(8) as pool:
        made = [name for name in pool.map(change, range(16)) if name]
    assert made == [store.get(stored.id).name]


def test_a_damaged_run_can_be_named_and_deleted(store, short_run):
    stored = store.save(short_run)
    stored.path.write_bytes(stored.path.read_bytes()[:-100])
    stored.path.with_suffix(".json").unlink()

    assert store.annotate(stored.id, name="broken").name == "broken"
    (listed,) = store.list()
    assert listed.name == "broken" and "damaged" in listed.title and listed.summary == {}
    store.delete(stored.id)
    assert store.list() == []


FORGED = {
    "text": {"warnings": (RunWarning(code="x", message="\ud800", count=1, first_time=0.0),)},
    "number": {"phase_change_count": 10**400},
}


@pytest.fixture(params=FORGED)
def forged(request, store, short_run, monkeypatch):
    """A recording of which every checksum fits, with an ending that cannot be told."""
    change = FORGED[request.param]
    if "warnings" in change:
        run = replace(short_run, **change)
    else:
        run = replace(short_run, metrics=replace(short_run.metrics, **change))
    place = store.reserve()
    with monkeypatch.context() as patch:
        patch.setattr(documents, "_to_json", json.dumps)
        write_recording(run, place.path)
    return place


def test_a_forged_ending_does_not_hide_the_other_runs(store, short_run, forged):
    whole = store.save(short_run)

    listed = {run.id: run for run in store.list()}

    assert listed[whole.id] == whole and store.get(whole.id) == whole
    assert "damaged" in listed[forged.id].title and listed[forged.id].summary == {}
    json.dumps(listed[forged.id].told(), ensure_ascii=False).encode()


def test_a_forged_ending_is_not_taken_as_an_upload(store, forged):
    content = forged.path.read_bytes()
    forged.path.unlink()
    with pytest.raises(UploadError, match="damaged"), store.upload(forged) as upload:
        upload.write(content)
        upload.finish()
    assert list(forged.path.parent.iterdir()) == []


@pytest.mark.parametrize("seconds", [10**12, -(10**10)])
def test_a_recording_with_an_impossible_time_is_listed(store, short_run, seconds):
    stored = store.save(short_run)
    stored.path.with_suffix(".json").unlink()
    os.utime(stored.path, (seconds, seconds))
    (listed,) = store.list()
    assert listed.summary == stored.summary and datetime.fromisoformat(listed.created)


def test_two_deletions_of_one_run_at_once_succeed_once(store, short_run):
    stored = store.save(short_run)

    def delete(_):
        try:
            store.delete(stored.id)
        except RecordingNotFoundError:
            return 0
        return 1

    with ThreadPoolExecutor(4) as pool:
        assert sum(pool.map(delete, range(4))) == 1


def test_no_run_is_begun_beyond_the_quota_until_others_are_deleted(short_run, tmp_path):
    size = RecordingStore(tmp_path / "other").save(short_run).size
    store = RecordingStore(tmp_path / "runs", StorageLimits(quota=2 * size))
    kept = [store.save(short_run), store.save(short_run)]

    with pytest.raises(StorageFullError, match=r"use .* of their quota of .* kB.* delete some"):
        store.save(short_run)
    assert store.count() == 2

    store.delete(kept[0].id)
    store.save(short_run)


def test_what_is_to_come_counts_against_the_quota(tmp_path):
    store = RecordingStore(tmp_path, StorageLimits(quota=1000))
    store.reserve(999)
    with pytest.raises(StorageFullError, match="1 kB"):
        store.reserve(1000)


def test_many_files_are_not_counted_every_time_but_before_anything_is_refused(
    tmp_path, monkeypatch
):
    for i in range(3):
        (tmp_path / f"{i}.mcap").write_bytes(bytes(100))
    monkeypatch.setattr(storage_limits, "_CHEAP", -1.0)
    monkeypatch.setattr(storage_limits, "_PAUSE", 1e9)
    limits = StorageLimits(quota=1000)
    limits.check(tmp_path, 600)
    (tmp_path / "more.mcap").write_bytes(bytes(300))
    limits.check(tmp_path, 600)  # Counted a moment ago: three files.
    with pytest.raises(StorageFullError):
        limits.check(tmp_path, 800)  # Beyond it even by that: counted anew, and refused.
    (tmp_path / "more.mcap").unlink()
    limits.check(tmp_path, 600)


def test_no_run_is_begun_where_the_disk_would_fill_up(short_run, tmp_path):
    store = RecordingStore(tmp_path, StorageLimits(min_free=1 << 50))
    with pytest.raises(StorageFullError, match=r"free and 1126 TB must stay free"):
        store.save(short_run)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_made_is_named(short_run, tmp_path):
    (tmp_path / "file").write_text("not a folder")

    with pytest.raises(RecordingWriteError, match="file"):
        RecordingStore(tmp_path / "file" / "runs").save(short_run)


def test_the_environment_chooses_the_data_directory(monkeypatch, tmp_path):
    monkeypatch.setenv("SLIPGRASP_DATA", str(tmp_path))
    assert default_data_directory() == tmp_path

    monkeypatch.delenv("SLIPGRASP_DATA")
    assert default_data_directory().name == "slipgrasp"


def test_a_copied_recording_that_contradicts_itself_is_listed_as_damaged(store, short_run):
    genuine = store.save(short_run)
    forged = replace(short_run, metrics=replace(short_run.metrics, held=True, torque_effort=2.0))
    path = genuine.path.with_name("forgedforged.mcap")
    write_recording(forged, path)

    listed = {run.id: run for run in store.list()}

    assert listed["forgedforged"].summary == {}
    assert "it contradicts itself" in listed["forgedforged"].title
    assert listed[genuine.id].summary["metrics"] == genuine.summary["metrics"]
    with pytest.raises(ContradictoryRecordingError, match="held is stated as True"):
        read_recording(path)


def test_a_run_that_contradicts_itself_is_not_told_of_as_if_it_were_true(store, short_run):
    with pytest.raises(ContradictoryRecordingError, match=r"ended at 0\.3 s of 5 s"):
        store.save(
            replace(
                short_run,
                scenario=with_values(short_run.scenario, {"simulation.duration": 5.0}),
            )
        )


@pytest.mark.parametrize(
    ("told", "edited"),
    [
        ('"held": false', '"held": true'),
        ('"name": "paper-case-2', '"name": "something else'),
        ('"title": "', '"title": "Another '),
        ('"end_time": 0.3', '"end_time": NaN'),
        ('"outcome": "completed"', '"outcome": "splendid"'),
    ],
)
def test_a_sidecar_that_was_edited_is_not_believed_but_its_annotations_are(
    store, short_run, told, edited
):
    stored = store.save(short_run)
    store.annotate(stored.id, notes="kept", tags=["kept too"])
    path = stored.path.with_suffix(".json")
    assert told in path.read_text()
    path.write_text(path.read_text().replace(told, edited))
    for found in (store.get(stored.id), *store.list()):
        assert (found.summary, found.title) == (stored.summary, stored.title)
        assert (found.created, found.notes, found.tags) == (stored.created, "kept", ("kept too",))
    assert store.annotate(stored.id, name="more").summary == stored.summary


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("phase_changes", [{"time": 0.0, "contact": 0, "from": "stick", "to": "adrift"}]),
        ("reason", {"code": "left_face"}),
        ("estimates", {"object.mass": None}),
        ("outcome", "adrift"),
        ("warnings", 3),
    ],
)
def test_a_sidecar_with_a_summary_no_run_has_is_not_believed_even_with_its_digest(
    store, short_run, key, value
):
    stored = store.save(short_run)
    forged = replace(stored, summary={**stored.summary, key: value})
    RunFiles(stored.path.parent).write_sidecar(forged)

    for found in (store.get(stored.id), *store.list()):
        assert found.summary == stored.summary


def test_an_annotation_that_is_not_valid_is_left_out_and_logged(store, short_run, caplog):
    stored = store.save(short_run)
    path = stored.path.with_suffix(".json")
    path.write_text(json.dumps({**json.loads(path.read_text()), "tags": 3, "notes": "kept"}))

    found = store.get(stored.id)

    assert (found.tags, found.notes) == ((), "kept")
    assert "invalid tags of a recording are omitted" in caplog.text


def test_a_recording_that_was_replaced_is_told_of_by_what_it_holds(store, short_run, lost_run):
    stored = store.save(short_run)
    write_recording(lost_run, stored.path, overwrite=True)

    (found,) = store.list()

    assert found.summary["outcome"] == lost_run.outcome.value
    assert found.display_name == lost_run.name != short_run.name


def test_a_sidecar_of_an_earlier_version_is_completed_from_the_recording(store, short_run):
    stored = store.save(short_run)
    path = stored.path.with_suffix(".json")
    document = json.loads(path.read_text())
    del document["digest"], document["summary"]["name"]
    path.write_text(json.dumps(document))

    assert store.get(stored.id).summary == stored.summary
    assert store.annotate(stored.id, name="mine").summary == stored.summary
    assert json.loads(path.read_text())["digest"]


def test_a_run_is_called_by_what_differs_until_a_user_names_it(store, short_run):
    stored = store.save(short_run)
    assert stored.display_name == short_run.name == "paper-case-2 · duration 0.3 s"
    assert stored.file_name("csv") == f"paper-case-2-duration-0.3-s-{stored.id}.csv"

    named = store.annotate(stored.id, name="für Anna")
    assert named.display_name == "für Anna"
    assert named.file_name("mcap") == f"f-r-Anna-{stored.id}.mcap"
    assert store.annotate(stored.id, name="").display_name == short_run.name


def test_what_a_killed_service_left_of_a_sidecar_goes_at_the_next_start(store, short_run):
    stored = store.save(short_run)
    left = stored.path.with_name(f"{stored.id}.json.part")
    left.write_bytes(b'{"created": "20')
    written = stored.path.with_name("anotherrun01.json.part")
    with written.open("wb") as stream:
        assert try_lock(stream)
        store.discard_unfinished([left, written])
        assert written.exists()
    assert not left.exists() and store.get(stored.id) == stored
