"""A table of runs to search; made from their files, and made again whenever it will not do."""

from __future__ import annotations

import json
import sqlite3
import weakref
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from slipgrasp.core.run.provenance import program_version
from slipgrasp.core.trace.types import Outcome
from slipgrasp.core.words.display_name import preset_titles
from slipgrasp.recordings.store.description import figures_of
from slipgrasp.recordings.store.run_query import FIGURES, RunQuery
from slipgrasp.recordings.store.stored_run import StoredRun

IN_MEMORY = ":memory:"
BUSY_SECONDS = 0.2

# Another one whenever the same columns hold something else.
_CONTENT = 2

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


class Catalogue:
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
            return StoredRun(id=run_id, path=recording, **content)
        except (KeyError, TypeError, ValueError) as error:
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
