import json
import re
from concurrent.futures import ThreadPoolExecutor

import pytest

from recordings import (
    DamagedRecordingError,
    RecordingNotFoundError,
    RecordingStore,
    RecordingWriteError,
    default_data_directory,
)


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


def test_runs_are_listed_newest_first_and_by_pages(store, short_run):
    saved = [store.save(short_run).id for _ in range(5)]

    assert [stored.id for stored in store.list()] == saved[::-1]
    assert [stored.id for stored in store.list(offset=1, limit=2)] == [saved[3], saved[2]]
    assert store.list(offset=99) == []
    assert store.count() == 5


def test_a_deleted_run_is_gone_with_its_sidecar(store, short_run, tmp_path):
    stored = store.save(short_run)

    store.delete(stored.id)

    assert list((tmp_path / "runs").iterdir()) == []
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


def test_a_missing_or_broken_sidecar_is_derived_from_the_recording(store, short_run, tmp_path):
    stored = store.save(short_run)
    sidecar = tmp_path / "runs" / f"{stored.id}.json"
    for text in (None, "{", "[]", '{"created": "now"}'):
        sidecar.unlink(missing_ok=True)
        if text is not None:
            sidecar.write_text(text)
        found = store.get(stored.id)
        assert (found.title, found.summary) == (stored.title, stored.summary)


def test_a_damaged_recording_does_not_hide_the_others(store, short_run):
    broken, whole = store.save(short_run), store.save(short_run)
    broken.path.write_bytes(b"")
    broken.path.with_suffix(".json").unlink()

    listed = {stored.id: stored for stored in store.list()}

    assert listed[whole.id] == whole
    assert "damaged" in listed[broken.id].title
    with pytest.raises(DamagedRecordingError):
        store.open(broken.id)


def test_when_it_was_saved_stands_beside_the_recording_and_not_inside(store, short_run):
    one, other = store.save(short_run), store.save(short_run)

    assert one.path.read_bytes() == other.path.read_bytes()
    sidecar = json.loads(one.path.with_suffix(".json").read_text())
    assert sidecar["created"] == one.created


def test_threads_can_save_at_the_same_time(store, short_run):
    with ThreadPoolExecutor(4) as pool:
        saved = list(pool.map(lambda _: store.save(short_run).id, range(12)))

    assert sorted(saved) == sorted(stored.id for stored in store.list())


def test_a_folder_that_cannot_be_made_is_named(short_run, tmp_path):
    (tmp_path / "file").write_text("not a folder")

    with pytest.raises(RecordingWriteError, match="file"):
        RecordingStore(tmp_path / "file" / "runs").save(short_run)


def test_the_environment_chooses_the_data_directory(monkeypatch, tmp_path):
    monkeypatch.setenv("SLIPGRASP_DATA", str(tmp_path))
    assert default_data_directory() == tmp_path

    monkeypatch.delenv("SLIPGRASP_DATA")
    assert default_data_directory().name == "slipgrasp"
