"""Searching the stored runs, and a catalogue that is made again whenever it will not do."""

from __future__ import annotations

import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path

import pytest

from slipgrasp.core.run.metrics import metric_names
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.exceptions import QueryError
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.recordings.store import index_table, run_index
from slipgrasp.recordings.store.index_table import IndexTable
from slipgrasp.recordings.store.run_files import RunFiles, Sidecar
from slipgrasp.recordings.store.run_index import INDEX_NAME, RunIndex
from slipgrasp.recordings.store.run_query import (
    Condition,
    RunQuery,
    parse_end,
    parse_instant,
)
from slipgrasp.recordings.store.store import RecordingStore

pytestmark = pytest.mark.slow


@pytest.fixture
def store(tmp_path):
    return RecordingStore(tmp_path / "runs")


@pytest.fixture
def several(store, short_run, lost_run, run_without_unknowns):
    """Three runs that differ in everything, oldest first."""
    kept = [store.save(run) for run in (short_run, lost_run, run_without_unknowns)]
    store.annotate(kept[0].id, name="Straße", tags=["light", "report"])
    store.annotate(kept[1].id, name="heavy", notes="It slips.\nIt falls.", tags=["report"])
    for run, day in zip(kept, ("2026-01-01", "2026-01-02", "2026-01-03"), strict=True):
        set_in_sidecar(run.path, created=f"{day}T12:00:00.000+00:00")
    return [store.get(run.id) for run in kept]


def set_in_sidecar(recording: Path, **values) -> None:
    sidecar = recording.with_suffix(".json")
    document = json.loads(sidecar.read_text(encoding="utf-8"))
    sidecar.write_text(json.dumps({**document, **values}), encoding="utf-8")


def found(store: RecordingStore, **query) -> list[str]:
    listing = store.find(RunQuery(**query))
    assert listing.unread == 0 and listing.count >= len(listing.runs)
    return [run.id for run in listing.runs]


@pytest.mark.parametrize(
    ("query", "expected"),
    [
        ({}, [2, 1, 0]),
        ({"preset": "paper-case-2"}, [1, 0]),
        ({"controller": "theorem-3"}, [2]),
        ({"outcome": Outcome.COMPLETED}, [2, 0]),
        ({"tags": ("report",)}, [1, 0]),
        ({"tags": ("report", "light")}, [0]),
        ({"tags": ("repor",)}, []),
        ({"text": "SLIPS"}, [1]),
        ({"text": "STRASSE"}, [0]),
        ({"text": "case ii"}, [1, 0]),
        ({"text": "%"}, []),
        ({"created_from": parse_instant("2026-01-02")}, [2, 1]),
        ({"created_to": parse_instant("2026-01-02")}, [0]),
        ({"created_to": parse_end("2026-01-02")}, [1, 0]),
        ({"created_from": parse_instant("2026-01-02T13:00:00+01:00")}, [2, 1]),
        ({"sort": "name"}, [1, 0, 2]),
        ({"sort": "-name"}, [0, 1, 2]),
        ({"sort": "created", "offset": 1, "limit": 1}, [1]),
    ],
)
def test_runs_are_searched_and_sorted_by_what_is_told_of_them(store, several, query, expected):
    assert found(store, **query) == [several[i].id for i in expected]


@pytest.mark.parametrize("figure", ["end_time", *metric_names(2)])
def test_runs_are_searched_and_sorted_by_every_figure(store, several, figure):
    values = {run.id: figure_of(run, figure) for run in several}
    known = [run_id for run_id, value in values.items() if value is not None]
    rising = sorted(known, key=lambda run_id: (values[run_id], run_id))
    without = sorted(values.keys() - set(known))
    assert found(store, sort=figure) == rising + without
    assert found(store, sort=f"-{figure}") == rising[::-1] + without[::-1]
    for run_id in known:
        for operator, holds in OPERATORS.items():
            condition = Condition(figure, operator, float(values[run_id]))
            expected = {other for other in known if holds(values[other], values[run_id])}
            assert set(found(store, conditions=(condition,))) == expected


OPERATORS = {
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
    "=": lambda a, b: a == b,
}


def figure_of(run, figure: str):
    if figure == "end_time":
        return run.summary["end_time"]
    name, _, label = figure.rpartition("_")
    metrics = run.summary["metrics"]
    if name in metrics:
        places = {"0": 0, "1": 1, "x": 0, "y": 1, "theta": 2}
        return metrics[name][places[label]]
    return metrics[figure]


@pytest.mark.parametrize(
    ("text", "condition"),
    [
        ("slip_path_0<0.01", Condition("slip_path_0", "<", 0.01)),
        (" end_time >= 5e-1 ", Condition("end_time", ">=", 0.5)),
        ("held=true", Condition("held", "=", 1.0)),
        ("slipping_at_end=false", Condition("slipping_at_end", "=", 0.0)),
    ],
)
def test_a_condition_is_read_as_it_is_written(text, condition):
    assert Condition.parse(text) == condition


@pytest.mark.parametrize(
    "text",
    [
        "",
        "held",
        "slip_path_0<nan",
        "slip_path<1",
        "id=1",
        "held=1;drop table runs",
        "x" * 10_000,
        "\0<1",
    ],
)
def test_what_is_no_condition_is_refused(text):
    with pytest.raises(QueryError) as refusal:
        Condition.parse(text)
    assert len(str(refusal.value)) < 200


@pytest.mark.parametrize("sort", ["", "-", "id", "words", "+created", "--created", "created;"])
def test_an_order_that_is_none_is_refused(sort):
    with pytest.raises(QueryError, match="cannot be sorted"):
        RunQuery(sort=sort)


@pytest.mark.parametrize("text", ["", "now", "2026-13-01", "0001-01-01T00:00+09:00", "1", "\0"])
def test_a_time_that_is_none_is_refused(text):
    for parse in (parse_instant, parse_end):
        with pytest.raises(QueryError, match="ISO 8601"):
            parse(text)


def test_a_date_as_an_end_includes_its_whole_day():
    assert parse_end("2026-01-31") == datetime(2026, 1, 31, 23, 59, 59, 999_999, UTC)
    assert parse_end("9999-12-31").year == 9999
    assert parse_end("2026-01-31T08:30") == datetime(2026, 1, 31, 8, 30, tzinfo=UTC)


def test_new_changed_and_vanished_files_are_noticed(store, several, tmp_path, short_run):
    assert found(store) == [run.id for run in several[::-1]]
    copied = tmp_path / "runs" / "zzzzzzzzzzzz.mcap"
    shutil.copy(several[1].path, copied)
    several[2].path.unlink()
    set_in_sidecar(several[0].path, tags=["new"])

    assert set(found(store)) == {several[0].id, several[1].id, "zzzzzzzzzzzz"}
    assert found(store, tags=("new",)) == [several[0].id]
    assert len(found(store, outcome=Outcome(several[1].summary["outcome"]))) == 2

    copied.write_bytes(copied.read_bytes()[:1000])
    (listed,) = [run for run in store.list() if run.id == "zzzzzzzzzzzz"]
    assert "damaged" in listed.title and listed.size == 1000
    assert "zzzzzzzzzzzz" in found(store, outcome=Outcome.FAILED)


def test_two_stores_of_one_folder_list_the_same(store, several, short_run):
    other = RecordingStore(several[0].path.parent)
    assert other.list() == store.list()
    made = other.save(short_run)
    store.delete(several[0].id)
    assert store.list() == other.list() and made in store.list()
    store.close()
    assert store.list() == other.list()


def test_only_files_with_the_name_of_a_run_are_listed(store, several, tmp_path):
    folder = tmp_path / "runs"
    outside = tmp_path / "outside.mcap"
    shutil.copy(several[0].path, outside)
    (folder / "aaaaaaaaaaaa.mcap").symlink_to(outside)
    (folder / "bbbbbbbbbbbb.mcap").mkdir()
    for name in ("run.mcap", "CCCCCCCCCCCC.mcap", "dddddddddddd.mcap.part", "eeeeeeeeeeee.json"):
        shutil.copy(outside, folder / name)
    assert set(found(store)) == {run.id for run in several}


def test_a_sidecar_that_is_a_link_is_not_followed(store, several, tmp_path):
    sidecar = several[0].path.with_suffix(".json")
    sidecar.rename(tmp_path / "outside.json")
    sidecar.symlink_to(tmp_path / "outside.json")
    assert store.get(several[0].id).tags == ()
    assert found(store, tags=("light",)) == []


def catalogue_of(store_folder: Path) -> Path:
    return store_folder / INDEX_NAME


def spoil_with_garbage(path: Path) -> None:
    path.write_bytes(os.urandom(10_000))


def spoil_pages(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[1000:9000] = b"\xaa" * 8000
    path.write_bytes(content)


def spoil_with_other_columns(path: Path) -> None:
    (version,) = execute(path, "PRAGMA user_version")[0]
    path.unlink()
    execute(path, "CREATE TABLE runs (id TEXT, stamp TEXT)")
    execute(path, f"PRAGMA user_version = {version}")


def spoil_with_older_version(path: Path) -> None:
    execute(path, "PRAGMA user_version = 1")


def spoil_with_link(path: Path) -> None:
    path.rename(path.with_suffix(".elsewhere"))
    path.symlink_to(path.with_suffix(".elsewhere"))


def spoil_with_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def execute(path: Path, statement: str) -> list[tuple]:
    connection = sqlite3.connect(path)
    try:
        with connection:
            return connection.execute(statement).fetchall()
    finally:
        connection.close()


SPOILERS = [
    Path.unlink,
    spoil_with_garbage,
    spoil_pages,
    spoil_with_other_columns,
    spoil_with_older_version,
    spoil_with_link,
    spoil_with_folder,
]


@pytest.mark.parametrize("spoil", SPOILERS, ids=lambda spoil: spoil.__name__)
@pytest.mark.parametrize("reopen", [True, False])
def test_a_catalogue_that_will_not_do_is_made_again(store, several, spoil, reopen):
    before = store.list()
    path = catalogue_of(several[0].path.parent)
    if reopen:
        store.close()
    spoil(path)
    elsewhere = path.with_suffix(".elsewhere")
    planted = elsewhere.read_bytes() if elsewhere.exists() else None

    assert store.list() == before
    assert found(store, tags=("light",)) == [several[0].id]
    if reopen:
        assert RecordingStore(path.parent).list() == before
    if planted is not None:
        assert elsewhere.read_bytes() == planted and path.is_symlink() is not reopen


def test_a_malformed_description_in_the_catalogue_is_read_again_from_the_recording(store, several):
    several[0].path.with_suffix(".json").unlink()
    before = store.list()
    path = catalogue_of(several[0].path.parent)
    assert execute(path, "SELECT count(*) FROM descriptions") == [(1,)]
    execute(path, "UPDATE descriptions SET content = '[1]'")

    assert store.list() == before
    assert execute(path, "SELECT content FROM descriptions") != [("[1]",)]


def test_a_catalogue_that_another_process_locks_is_done_without(store, several):
    before = store.list()
    store.close()
    path = catalogue_of(several[0].path.parent)
    content = path.read_bytes()
    other = sqlite3.connect(path, isolation_level=None)
    try:
        other.execute("BEGIN EXCLUSIVE")
        assert store.list() == before
        store.annotate(several[0].id, name="while locked")
        assert store.find(RunQuery(text="while locked")).count == 1
        assert path.read_bytes() == content
    finally:
        other.close()


def noted_reads(monkeypatch) -> list[str]:
    """Ids of the runs whose sidecar is read from now on."""
    read, original = [], RunFiles.read_sidecar

    def note(self: RunFiles, run_id: str) -> Sidecar:
        read.append(run_id)
        return original(self, run_id)

    monkeypatch.setattr(RunFiles, "read_sidecar", note)
    return read


def test_recordings_without_sidecar_are_read_a_few_at_a_time(several):
    folder = several[0].path.parent
    for number in range(6):
        copied = folder / f"copied{number:06}.mcap"
        shutil.copy(several[1].path, copied)
        os.utime(copied, (number + 1, number + 1))
    index = RunIndex(RunFiles(folder), reading_seconds=0.0)
    heavy = RunQuery(outcome=Outcome(several[1].summary["outcome"]), limit=1)

    progress = [(found.count, found.unread) for found in (index.find(heavy) for _ in range(7))]

    assert progress == [(n, max(7 - n, 0)) for n in (2, 3, 4, 5, 6, 7, 7)]
    index.close()


def test_a_page_tells_all_of_its_runs_also_of_those_just_copied_into_the_folder(several):
    folder = several[0].path.parent
    for number in range(6):
        shutil.copy(several[1].path, folder / f"copied{number:06}.mcap")
    index = RunIndex(RunFiles(folder), reading_seconds=0.0)

    listing = index.find(RunQuery(limit=4))

    assert listing.count == 9 and [run.summary for run in listing.runs] == [several[1].summary] * 4
    assert listing.unread == 2
    index.close()


def test_files_may_come_and_go_while_they_are_listed(store, several, short_run):
    folder = several[0].path.parent
    stop = threading.Event()

    def come_and_go(letter: str) -> int:
        rounds = 0
        while not stop.is_set():
            copied = folder / f"{letter * 11}{rounds % 7}.mcap"
            shutil.copyfile(several[0].path, copied)
            (copied if rounds % 2 else several[2].path).unlink(missing_ok=True)
            rounds += 1
        return rounds

    with ThreadPoolExecutor(2) as pool:
        others = [pool.submit(come_and_go, letter) for letter in "ab"]
        try:
            for _ in range(30):
                assert {several[0].id, several[1].id} <= {run.id for run in store.list()}
                assert store.count() >= 2
        finally:
            stop.set()
        assert all(other.result() > 5 for other in others)


@pytest.fixture
def large(store, several, monkeypatch):
    """A store of a folder that counts as large and was looked at; the next look is far away."""
    monkeypatch.setattr(run_index, "SMALL", 1)
    monkeypatch.setattr(run_index, "_PAUSE", 1e12)
    assert len(store.list()) == 3
    return store


def refuse_to_scan(monkeypatch) -> None:
    def refuse(_self: RunFiles) -> None:
        raise AssertionError("the folder was looked over again")

    monkeypatch.setattr(RunFiles, "scan", refuse)


def test_a_large_folder_is_not_looked_over_for_each_search(large, several, monkeypatch):
    refuse_to_scan(monkeypatch)
    read = noted_reads(monkeypatch)
    assert large.list(limit=1) == [several[2]]
    assert found(large, tags=("light",)) == [several[0].id]
    assert read == [several[2].id, several[0].id]


def test_what_is_written_is_listed_at_once_in_a_large_folder(
    large, several, short_run, monkeypatch
):
    refuse_to_scan(monkeypatch)
    made = large.save(short_run)
    large.annotate(several[0].id, name="named")
    large.delete(several[1].id)

    assert set(found(large)) == {made.id, several[0].id, several[2].id}
    assert found(large, text="named") == [several[0].id]


WRITING_PROCESS = """
import sys
from pathlib import Path
from slipgrasp.recordings.store.store import RecordingStore
store = RecordingStore(Path(sys.argv[1]))
store.annotate(sys.argv[2], name="by another process")
store.delete(sys.argv[3])
"""


def test_what_another_process_writes_is_listed_at_once_in_a_large_folder(
    large, several, monkeypatch
):
    refuse_to_scan(monkeypatch)
    folder = str(several[0].path.parent)
    command = [sys.executable, "-c", WRITING_PROCESS, folder, several[0].id, several[1].id]
    subprocess.run(command, check=True)

    assert found(large, text="by another process") == [several[0].id]
    assert found(large) == [several[2].id, several[0].id]


def test_a_page_of_a_large_folder_is_true_of_its_files_before_the_next_look(
    large, several, lost_run
):
    set_in_sidecar(several[0].path, tags=["edited"])
    write_recording(lost_run, several[2].path, overwrite=True)
    several[1].path.unlink()

    page = {run.id: run for run in large.find(RunQuery(limit=10)).runs}

    assert page.keys() == {several[0].id, several[2].id}
    assert page[several[0].id].tags == ("edited",)
    assert page[several[2].id].summary["outcome"] == lost_run.outcome.value


def test_what_others_change_in_a_large_folder_is_found_by_the_next_look(
    store, several, monkeypatch
):
    monkeypatch.setattr(run_index, "SMALL", 1)
    monkeypatch.setattr(run_index, "_PAUSE", 0.0)
    store.list()
    shutil.copy(several[1].path, several[1].path.with_name("zzzzzzzzzzzz.mcap"))
    set_in_sidecar(several[0].path, tags=["edited"])
    several[2].path.unlink()

    assert {run.id for run in store.list()} == {several[0].id, several[1].id, "zzzzzzzzzzzz"}
    assert found(store, tags=("edited",)) == [several[0].id]


@pytest.mark.parametrize("spoil", [Path.unlink, spoil_pages])
def test_the_catalogue_of_a_large_folder_is_made_again(large, several, spoil):
    path = catalogue_of(several[0].path.parent)
    spoil(path)
    large.begin_listing()

    assert large.list() == several[::-1]
    assert found(large, tags=("light",)) == [several[0].id]


def test_a_folder_in_which_no_catalogue_can_be_made_is_listed(store, several, monkeypatch):
    before = store.list()
    store.close()

    class ReadOnly(IndexTable):
        def __init__(self, path: Path | str) -> None:
            if path:
                raise sqlite3.OperationalError("attempt to write a readonly database")
            super().__init__(path)

    monkeypatch.setattr(run_index, "IndexTable", ReadOnly)
    reader = RecordingStore(several[0].path.parent)
    assert reader.list() == before and found(reader, tags=("light",)) == [several[0].id]


KILLED_PROCESS = """
import os, signal, sys
from pathlib import Path
from slipgrasp.recordings.store import index_table, run_index
from slipgrasp.recordings.store.store import RecordingStore
run_index._BATCH = 1
enter, left = run_index.RunIndex.enter, [int(sys.argv[2])]
def enter_some(*arguments):
    left[0] -= 1
    if left[0] < 0:
        os.kill(os.getpid(), signal.SIGKILL)
    return enter(*arguments)
run_index.RunIndex.enter = enter_some
RecordingStore(Path(sys.argv[1])).list()
"""


@pytest.mark.parametrize("entered", [0, 2])
def test_a_process_killed_while_it_makes_the_catalogue_loses_nothing(store, several, entered):
    folder = several[0].path.parent
    command = [sys.executable, "-c", KILLED_PROCESS, str(folder), str(entered)]
    assert subprocess.run(command, check=False).returncode == -signal.SIGKILL
    assert execute(catalogue_of(folder), "SELECT count(*) FROM runs") == [(entered,)]

    assert store.list() == several[::-1]


@pytest.mark.parametrize("sort", ["created", "-created"])
def test_pages_of_a_search_are_the_same_however_many_runs_are_searched_first(
    store, several, monkeypatch, sort
):
    everything = [run.id for run in store.find(RunQuery(sort=sort, text="e")).runs]
    assert len(everything) > 2
    for first in range(5):
        monkeypatch.setattr(index_table, "_FIRST", first)
        for offset in range(4):
            page = store.find(RunQuery(sort=sort, text="e", offset=offset, limit=2))
            assert [run.id for run in page.runs] == everything[offset : offset + 2]
            assert page.count == len(everything)
