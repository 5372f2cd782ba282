"""Search table of recordings: one row per run, in a file in the data folder.

It contains only data from the recordings and their sidecars. It is never synced to disk: it
survives the death of a process, and is rebuilt if a power failure damages it.
"""

from __future__ import annotations

import json
import sqlite3
import weakref
import zlib
from collections.abc import Iterable, Iterator
from contextlib import closing
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from slipgrasp.core.run.provenance import program_version
from slipgrasp.core.trace.types import Outcome
from slipgrasp.core.words.display_name import preset_titles
from slipgrasp.recordings.store.description import MEASURED, Description, figures_of
from slipgrasp.recordings.store.run_query import FIGURES, RunQuery
from slipgrasp.recordings.store.stored_run import StoredRun

PRIVATE = ""
"""Path of a temporary table, which SQLite stores on disk if it is large."""
BUSY_SECONDS = 0.5

_FIRST = 2000
"""Number of newest or oldest runs that are searched before all others."""

# Increased whenever the same columns have another content.
_CONTENT = 5

_COLUMNS = (
    ("id", "TEXT PRIMARY KEY"),
    ("stamp", "INTEGER NOT NULL"),
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
    # Long columns come last, so that searches of other columns need not read them.
    ("words", "TEXT NOT NULL"),
)
_SCHEMA = (
    f"CREATE TABLE runs ({', '.join(f'{name} {kind}' for name, kind in _COLUMNS)})",
    "CREATE INDEX newest ON runs (created, id)",
    "CREATE INDEX words ON runs (words)",
    "CREATE INDEX unread ON runs (created, id) WHERE NOT is_read",
    "CREATE TABLE descriptions (id TEXT PRIMARY KEY, content TEXT NOT NULL)",
)
_PUT = f"INSERT OR REPLACE INTO runs VALUES ({', '.join('?' * len(_COLUMNS))})"
_PUT_DESCRIPTION = "INSERT INTO descriptions VALUES (?, ?)"


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A run in the table.

    Attributes:
        stored: The run.
        stamp: Stamp of its files (`RunFiles.stamp`).
        is_read: Whether its description is known: without a sidecar it must be read from the
            recording, which is slow.
        description: Its description, stored in the table if there is no sidecar.
    """

    stored: StoredRun
    stamp: int
    is_read: bool = True
    description: Description | None = None


class IndexTable:
    """The search table.

    Args:
        path: Its file, created if missing, or `PRIVATE`.

    Raises:
        sqlite3.Error: If the file is damaged, foreign, outdated or unusable; also raised by every
        method.
    """

    def __init__(self, path: Path | str) -> None:
        self._path = path
        self._connection = _connect(path)
        self._closer = weakref.finalize(self, self._connection.close)
        try:
            self._prepare()
            self._inode = _inode(path)
        except sqlite3.Error:
            self.close()
            raise

    def close(self) -> None:
        """Closes the file."""
        self._closer()

    @property
    def is_in_place(self) -> bool:
        """Whether the open file still has its name."""
        return self._inode == _inode(self._path)

    def _prepare(self) -> None:
        expected = _version()
        # Readers and the integrity check do not block writers.
        self._connection.execute("PRAGMA journal_mode = WAL")
        # With syncing, every saved run would wait for the disk again.
        self._connection.execute("PRAGMA synchronous = OFF")
        with self._connection:
            self._connection.execute("BEGIN IMMEDIATE")
            (version,) = self._connection.execute("PRAGMA user_version").fetchone()
            (num_tables,) = self._connection.execute(
                "SELECT count(*) FROM sqlite_master"
            ).fetchone()
            if num_tables == 0 and version == 0:
                for statement in _SCHEMA:
                    self._connection.execute(statement)
                self._connection.execute(f"PRAGMA user_version = {expected}")
            elif version != expected:
                raise sqlite3.DatabaseError("another version created it")

    def check(self) -> None:
        """Checks every page; other threads can use the table meanwhile."""
        if self._path == PRIVATE:
            return
        with closing(_connect(self._path)) as connection:
            (finding,) = connection.execute("PRAGMA integrity_check(1)").fetchone()
        if finding != "ok":
            raise sqlite3.DatabaseError(finding)

    def stamps(self, after: str, limit: int) -> list[tuple[str, int]]:
        """Ids and stamps of runs in the order of ids, starting after an id."""
        return self._connection.execute(
            "SELECT id, stamp FROM runs WHERE id > ? ORDER BY id LIMIT ?", (after, limit)
        ).fetchall()

    def unread(self) -> list[str]:
        """Ids of runs whose recording has not been read, newest first."""
        rows = self._connection.execute(
            "SELECT id FROM runs WHERE NOT is_read ORDER BY created DESC, id DESC"
        )
        return [run_id for (run_id,) in rows]

    def apply(self, gone: Iterable[str], changed: Iterable[Entry]) -> None:
        """Updates the table in one transaction.

        Args:
            gone: Ids of deleted runs.
            changed: New or changed runs.
        """
        removed, entries = [(run_id,) for run_id in gone], list(changed)
        if not removed and not entries:
            return
        described = [(entry.stored.id, entry.description) for entry in entries]
        with self._connection:
            self._connection.execute("BEGIN IMMEDIATE")
            self._connection.executemany("DELETE FROM runs WHERE id = ?", removed)
            self._connection.executemany(_PUT, map(_row, entries))
            self._connection.executemany(
                "DELETE FROM descriptions WHERE id = ?",
                [*removed, *((run_id,) for run_id, _ in described)],
            )
            self._connection.executemany(
                _PUT_DESCRIPTION,
                [(run_id, _content(known)) for run_id, known in described if known is not None],
            )

    def find(self, query: RunQuery) -> tuple[dict[str, int], int]:
        """The runs of one page with their stamps, and the number of runs on all pages."""
        terms = list(_terms(query))
        where = " AND ".join(term for term, _ in terms) or "1"
        values = [value for _, value in terms]
        # Text is compared in its index, which takes half the time of reading the table.
        source = "runs INDEXED BY words" if query.text else "runs"
        if terms and query.sort_key == "created" and query.limit is not None:
            # Counting alone takes half the time of counting and sorting, if there are many results.
            page = self._find_among_first(query, where, values)
            if len(page) == query.limit:
                return page, self._count(source, where, values)
        # One pass over the table if runs are compared, none if it is sorted.
        counted = "count(*) OVER ()" if terms else "(SELECT count(*) FROM runs)"
        rows = self._connection.execute(
            f"SELECT id, stamp, {counted} FROM {source} WHERE {where} "
            f"ORDER BY {_order(query, is_narrowed=bool(terms))} LIMIT ? OFFSET ?",
            [*values, -1 if query.limit is None else query.limit, query.offset],
        ).fetchall()
        is_beyond = query.offset > 0 or query.limit == 0
        if not rows:
            return {}, self._count(source, where, values) if is_beyond else 0
        return {run_id: stamp for run_id, stamp, _ in rows}, rows[0][2]

    def _find_among_first(self, query: RunQuery, where: str, values: list[Any]) -> dict[str, int]:
        """Results among the first runs, in the order of creation."""
        order = f"ORDER BY {_order(query, is_narrowed=False)}"
        first = f"SELECT * FROM runs {order} LIMIT {_FIRST}"
        rows = self._connection.execute(
            f"SELECT id, stamp FROM ({first}) WHERE {where} {order} LIMIT ? OFFSET ?",
            [*values, query.limit, query.offset],
        )
        return dict(rows.fetchall())

    def count(self) -> int:
        """The number of runs in the table."""
        return self._count("runs", "1", [])

    def _count(self, source: str, where: str, values: list[Any]) -> int:
        (count,) = self._connection.execute(
            f"SELECT count(*) FROM {source} WHERE {where}", values
        ).fetchone()
        return int(count)

    def description(self, run_id: str) -> Description | None:
        """The description in the table of a run without a sidecar."""
        row = self._connection.execute(
            "SELECT content FROM descriptions WHERE id = ?", (run_id,)
        ).fetchone()
        if row is None:
            return None
        try:
            content = json.loads(row[0])
            if content["summary"]:
                return Description.from_document(content)
            kind = str(content["controller"])
            return Description(title=str(content["title"]), controller=kind, summary={})
        except (ArithmeticError, KeyError, TypeError, ValueError) as error:
            raise sqlite3.DatabaseError("malformed description") from error


def _connect(path: Path | str) -> sqlite3.Connection:
    return sqlite3.connect(
        path, timeout=BUSY_SECONDS, isolation_level=None, check_same_thread=False
    )


def _inode(path: Path | str) -> int | None:
    try:
        return Path(path).stat().st_ino if path else None
    except OSError:
        return None


def _content(description: Description) -> str:
    return json.dumps(asdict(description), ensure_ascii=False)


def _order(query: RunQuery, *, is_narrowed: bool) -> str:
    key, direction = query.sort_key, "DESC" if query.is_falling else "ASC"
    if key == "created":
        # Without its index if few results are expected, because an index scan would read all runs.
        return f"{'+' if is_narrowed else ''}created {direction}, id {direction}"
    return f"NULLIF({key}, '') IS NULL, {key} {direction}, id {direction}"


def _version() -> int:
    """Version of the table, which changes with its columns and their meaning."""
    decisive = (_SCHEMA, _CONTENT, program_version(), preset_titles())
    return zlib.crc32(repr(decisive).encode()) >> 1 or 1


def _terms(query: RunQuery) -> Iterator[tuple[str, Any]]:
    """SQL conditions with their values."""
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
    other = MEASURED if stored.is_measured else Outcome.FAILED.value
    outcome = stored.summary.get("outcome", other)
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
    """Encloses a tag so that only whole tags match; tags contain no line breaks."""
    return f"\n{tag}\n"
