"""Finding runs by what is told of them, without reading their files each time.

Before every search one look over the folder finds what was changed, is new or is gone.
Sidecars of those are read at once; recordings without one take long to read, so of these
only as many as fit into a moment, and those that are about to be shown. What is known of the runs
is kept in a table, which is made from their files, and made again whenever it will not do.
"""

from __future__ import annotations

import json
import logging
import sqlite3
import time
import weakref
import zlib
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from threading import Lock
from typing import Any

from slipgrasp.core.run.provenance import program_version
from slipgrasp.core.trace.types import Outcome
from slipgrasp.core.words.display_name import preset_titles
from slipgrasp.recordings.exceptions import RecordingNotFoundError
from slipgrasp.recordings.store.description import Description, figures_of
from slipgrasp.recordings.store.run_files import RunFiles
from slipgrasp.recordings.store.run_query import FIGURES, RunQuery
from slipgrasp.recordings.store.stored_run import StoredRun

INDEX_NAME = "catalogue.sqlite"
READING_SECONDS = 0.25

_JOURNALS = ("", "-journal", "-wal", "-shm")
_UNREAD = Description(title="", controller="", summary={})
IN_MEMORY = ":memory:"
BUSY_SECONDS = 0.2

# Another one whenever the same columns hold something else.
_CONTENT = 3

_COLUMNS = (
    ("id", "TEXT PRIMARY KEY"),
    ("stamp", "TEXT NOT NULL"),
    ("is_read", "INTEGER NOT NULL"),
    ("created", "REAL NOT NULL"),
    ("size", "INTEGER NOT NULL"),
    ("title", "TEXT COLLATE NOCASE"),
    ("name", "TEXT COLLATE NOCASE"),
    ("preset", "TEXT"),
    ("controller", "TEXT"),
    ("outcome", "TEXT"),
    ("tags", "TEXT NOT NULL"),
    *((name, "REAL") for name in FIGURES),
    # Long ones make their row long; they come last so that a search need not pass over them.
    ("words", "TEXT NOT NULL"),
)
_RUNS = f"CREATE TABLE runs ({', '.join(f'{name} {kind}' for name, kind in _COLUMNS)})"
_DOCUMENTS = "CREATE TABLE documents (id TEXT PRIMARY KEY, content TEXT NOT NULL)"
_PUT = f"INSERT OR REPLACE INTO runs VALUES ({', '.join('?' * len(_COLUMNS))})"
_PUT_DOCUMENT = "INSERT OR REPLACE INTO documents VALUES (?, ?)"

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Entry:
    """A run for the table.

    Attributes:
        stored: What is told of it.
        stamp: Of the files that tell it.
        is_read: Whether they tell all; a recording without a sidecar takes long to read.
    """

    stored: StoredRun
    stamp: str
    is_read: bool


class IndexTable:
    """The table.

    Args:
        path: Its file, made if it is missing, or `IN_MEMORY`.

    Raises:
        sqlite3.Error: If the file is damaged, foreign, outdated or cannot be used; also from
            every method.
    """

    def __init__(self, path: Path | str) -> None:
        self._connection = sqlite3.connect(
            path, timeout=BUSY_SECONDS, isolation_level=None, check_same_thread=False
        )
        self._closer = weakref.finalize(self, self._connection.close)
        try:
            self._prepare()
        except sqlite3.Error:
            self.close()
            raise

    def close(self) -> None:
        """Closes the file."""
        self._closer()

    def _prepare(self) -> None:
        expected = _version()
        # What a power cut may damage is made again; that of a killed process stays whole.
        self._connection.execute("PRAGMA synchronous = NORMAL")
        with self._connection:
            self._connection.execute("BEGIN IMMEDIATE")
            (version,) = self._connection.execute("PRAGMA user_version").fetchone()
            (num_tables,) = self._connection.execute(
                "SELECT count(*) FROM sqlite_master"
            ).fetchone()
            if num_tables == 0 and version == 0:
                self._connection.execute(_RUNS)
                self._connection.execute(_DOCUMENTS)
                self._connection.execute(f"PRAGMA user_version = {expected}")
            elif version != expected:
                raise sqlite3.DatabaseError("another version made it")
        (finding,) = self._connection.execute("PRAGMA quick_check(1)").fetchone()
        if finding != "ok":
            raise sqlite3.DatabaseError(finding)

    def stamps(self) -> dict[str, str]:
        """Id and stamp of every run."""
        return dict(self._connection.execute("SELECT id, stamp FROM runs"))

    def unread(self) -> list[str]:
        """Ids of runs whose recording is not read yet, newest first."""
        rows = self._connection.execute(
            "SELECT id FROM runs WHERE NOT is_read ORDER BY created DESC, id DESC"
        )
        return [run_id for (run_id,) in rows]

    def apply(self, gone: Iterable[str], changed: Iterable[Entry]) -> None:
        """Brings the table up to date, all or nothing.

        Args:
            gone: Ids of runs that are no longer there.
            changed: Runs that are new, or of which something else is told now.
        """
        removed = [(run_id,) for run_id in gone]
        with self._connection:
            self._connection.execute("BEGIN IMMEDIATE")
            self._connection.executemany("DELETE FROM runs WHERE id = ?", removed)
            self._connection.executemany("DELETE FROM documents WHERE id = ?", removed)
            for entry in changed:
                document = json.dumps(entry.stored.told(), ensure_ascii=False)
                self._connection.execute(_PUT, _row(entry))
                self._connection.execute(_PUT_DOCUMENT, (entry.stored.id, document))

    def find(self, query: RunQuery) -> tuple[list[str], int]:
        """Ids of the runs of one page, and how many there are on all pages."""
        terms = list(_terms(query))
        where = " AND ".join(term for term, _ in terms) or "1"
        values = [value for _, value in terms]
        key, direction = query.sort_key, "DESC" if query.is_falling else "ASC"
        rows = self._connection.execute(
            f"SELECT id FROM runs WHERE {where} "
            f"ORDER BY NULLIF({key}, '') IS NULL, {key} {direction}, id {direction} "
            "LIMIT ? OFFSET ?",
            [*values, -1 if query.limit is None else query.limit, query.offset],
        )
        ids = [run_id for (run_id,) in rows]
        (count,) = self._connection.execute(
            f"SELECT count(*) FROM runs WHERE {where}", values
        ).fetchone()
        return ids, count

    def get(self, run_id: str, recording: Path) -> StoredRun:
        """What the table tells of a run."""
        row = self._connection.execute(
            "SELECT content FROM documents WHERE id = ?", (run_id,)
        ).fetchone()
        try:
            content = json.loads(row[0])
            content["tags"] = tuple(content["tags"])
            if content["summary"]:
                Description.from_document(content)
            return StoredRun(id=run_id, path=recording, **content)
        except (ArithmeticError, KeyError, TypeError, ValueError) as error:
            raise sqlite3.DatabaseError("malformed document") from error


def _version() -> int:
    """Another number for other columns, and whenever the same file may tell something else."""
    decisive = (_RUNS, _DOCUMENTS, _CONTENT, program_version(), preset_titles())
    return zlib.crc32(repr(decisive).encode()) >> 1 or 1


def _terms(query: RunQuery) -> Iterator[tuple[str, Any]]:
    """Conditions in SQL, each with its value."""
    if query.preset is not None:
        yield "preset = ?", query.preset
    if query.controller is not None:
        yield "controller = ?", query.controller
    if query.outcome is not None:
        yield "outcome = ?", query.outcome.value
    for tag in query.tags:
        yield "instr(tags, ?)", _enclosed(tag)
    if query.created_from is not None:
        yield "created >= ?", query.created_from.timestamp()
    if query.created_to is not None:
        yield "created <= ?", query.created_to.timestamp()
    if query.text:
        yield "instr(words, ?)", query.text.casefold()
    for condition in query.conditions:
        yield f"{condition.figure} {condition.operator} ?", condition.value


def _row(entry: Entry) -> list[Any]:
    stored = entry.stored
    figures = figures_of(stored.summary) if stored.summary else {}
    outcome = stored.summary.get("outcome", Outcome.FAILED.value)
    told = [stored.title, stored.name, stored.preset, stored.controller, outcome]
    return [
        stored.id,
        entry.stamp,
        entry.is_read,
        datetime.fromisoformat(stored.created).timestamp(),
        stored.size,
        *(told if entry.is_read else [None, stored.name, None, None, None]),
        "".join(map(_enclosed, stored.tags)),
        *(figures.get(name) for name in FIGURES),
        "\n".join((stored.title, stored.display_name, stored.notes)).casefold(),
    ]


def _enclosed(tag: str) -> str:
    """A tag that is found as a whole only; no tag holds the end of a line."""
    return f"\n{tag}\n"


@dataclass(frozen=True, slots=True)
class FoundRuns:
    """One page of what a search found.

    Attributes:
        runs: The runs of the page.
        count: How many there are on all pages.
        unread: How many recordings of the folder were not read yet; searches may miss them.
    """

    runs: list[StoredRun]
    count: int
    unread: int


class RunIndex:
    """Searches a folder; safe to use from several threads.

    Args:
        files: The runs.
        reading_seconds: How long a search may read recordings that have no sidecar [s].
    """

    def __init__(self, files: RunFiles, reading_seconds: float = READING_SECONDS) -> None:
        self._files = files
        self._reading_seconds = reading_seconds
        self._lock = Lock()
        self._table: IndexTable | None = None
        self._stamps: dict[str, str] = {}

    def find(self, query: RunQuery) -> FoundRuns:
        """Searches the runs that are there now."""
        with self._lock:
            for replacement in (self._replace, self._retreat):
                try:
                    return self._find(query)
                except sqlite3.Error as error:
                    _logger.warning("the catalogue of recordings is made again: %s", error)
                    replacement(error)
            return self._find(query)

    def forget(self, run_id: str) -> None:
        """Has a run read again that was changed too quickly for its files' times to tell."""
        with self._lock:
            if run_id in self._stamps:
                self._stamps[run_id] = ""

    def close(self) -> None:
        """Closes the table; it is opened again when it is needed."""
        with self._lock:
            self._close()

    def _find(self, query: RunQuery) -> FoundRuns:
        if not self._files.path.is_dir():
            return FoundRuns([], 0, 0)
        table = self._table or self._open()
        self._refresh(table)
        ids, count = table.find(query)
        unread = set(table.unread())
        if due := [run_id for run_id in ids if run_id in unread]:
            unread -= self._read(table, due)
        found = [table.get(run_id, self._files.recording(run_id)) for run_id in ids]
        runs = [run for run in found if run.id in self._stamps]
        return FoundRuns(runs, count - (len(found) - len(runs)), len(unread))

    def _refresh(self, table: IndexTable) -> None:
        present = self._files.scan()
        gone = self._stamps.keys() - present.keys()
        new = [run_id for run_id, stamp in present.items() if self._stamps.get(run_id) != stamp]
        if gone or new:
            entries = [self._from_sidecar(run_id, present[run_id]) for run_id in new]
            table.apply(gone, filter(None, entries))
            self._stamps = present
        if unread := table.unread():
            self._read(table, unread, time.monotonic() + self._reading_seconds)

    def _from_sidecar(self, run_id: str, stamp: str) -> Entry | None:
        """A run as far as its sidecar tells of it; None if it has gone meanwhile."""
        sidecar = self._files.read_sidecar(run_id)
        description = sidecar.description or _UNREAD
        try:
            stored = self._files.put_together(run_id, sidecar, description)
        except RecordingNotFoundError:
            return None
        return Entry(stored, stamp, is_read=description is not _UNREAD)

    def _read(
        self, table: IndexTable, ids: Iterable[str], deadline: float | None = None
    ) -> set[str]:
        """Reads recordings, at least one; returns the ids of those that were read or are gone."""
        found: list[Entry] = []
        done: set[str] = set()
        gone: set[str] = set()
        for run_id in ids:
            done.add(run_id)
            stamp = self._stamps.get(run_id)
            if stamp is None:
                continue  # another process has just added it; the next listing finds it
            try:
                found.append(Entry(self._files.read(run_id), stamp, is_read=True))
            except RecordingNotFoundError:
                del self._stamps[run_id]
                gone.add(run_id)
            if deadline is not None and time.monotonic() > deadline:
                break
        table.apply(gone, found)
        return done

    def _open(self) -> IndexTable:
        path = self._path()
        if path.is_symlink():
            raise sqlite3.DatabaseError("its file is a link, which is not followed")
        return self._use(IndexTable(path))

    def _use(self, table: IndexTable) -> IndexTable:
        self._table, self._stamps = table, table.stamps()
        return table

    def _replace(self, error: sqlite3.Error) -> None:
        """Throws the file away, unless another process is using it."""
        self._close()
        if isinstance(error, sqlite3.OperationalError) and "locked" in str(error):
            self._retreat(error)
            return
        for suffix in _JOURNALS:
            with suppress(OSError):
                self._path().with_name(INDEX_NAME + suffix).unlink(missing_ok=True)

    def _retreat(self, error: sqlite3.Error) -> None:
        """Does without a file until this process ends."""
        self._close()
        self._use(IndexTable(IN_MEMORY))

    def _close(self) -> None:
        if self._table is not None:
            self._table.close()
        self._table, self._stamps = None, {}

    def _path(self) -> Path:
        return self._files.path / INDEX_NAME
