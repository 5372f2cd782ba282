"""Searches runs without reading their files each time.

The files are authoritative; `IndexTable` is a cache for searches. Changes by this program are
entered immediately. Changes by others are found by scanning the folder: before every search if it
is small; otherwise in a background thread, for at most a twentieth of the time, with pauses so that
searches are not delayed. The runs on a page are read from their files, so that a page is never
outdated.
"""

from __future__ import annotations

import logging
import math
import sqlite3
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from slipgrasp.recordings.exceptions import RecordingNotFoundError
from slipgrasp.recordings.store.description import Description
from slipgrasp.recordings.store.index_table import PRIVATE, Entry, IndexTable
from slipgrasp.recordings.store.run_files import RunFiles
from slipgrasp.recordings.store.run_query import RunQuery
from slipgrasp.recordings.store.stored_run import StoredRun

INDEX_NAME = "catalogue.sqlite"
READING_SECONDS = 0.25

SMALL = 2000
"""Largest number of runs that are scanned before every search, in some ten milliseconds."""
_PAUSE = 20.0
"""Ratio of the interval between scans to the duration of a scan."""
_REST = 3.0
"""Ratio of pauses to work in a background scan."""
_BATCH = 500
_STAMPS = 5000
_CORRECTIONS = 5
"""Number of repeated searches if runs on a page differ from the table."""

_JOURNALS = ("", "-journal", "-wal", "-shm")
_UNREAD = Description(title="", controller="", summary={})

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class FoundRuns:
    """One page of search results.

    Attributes:
        runs: The runs of the page.
        count: Total number of results on all pages.
        unread: Number of recordings that have not been read yet, which searches may miss.
    """

    runs: list[StoredRun]
    count: int
    unread: int


class RunIndex:
    """Searches a folder; thread-safe.

    Args:
        files: The files of the runs.
        reading_seconds: Time limit of a search for reading recordings without sidecars [s].
    """

    def __init__(self, files: RunFiles, reading_seconds: float = READING_SECONDS) -> None:
        self._files = files
        self._reading_seconds = reading_seconds
        self._lock = threading.RLock()
        self._starting = threading.Lock()
        self._table: IndexTable | None = None
        self._look: _Look | None = None

    def find(self, query: RunQuery) -> FoundRuns:
        """Searches the runs in the folder."""
        for replacement in (self._replace, self._retreat):
            table = self._table
            try:
                return self._find(query)
            except sqlite3.Error as error:
                with self._lock:
                    if self._table is table:  # otherwise another thread has done so
                        _logger.warning("the catalogue of recordings is rebuilt: %s", error)
                        replacement(error)
        return self._find(query)

    def begin(self) -> None:
        """Starts scanning the folder, to shorten the wait of the first search."""
        with self._starting, suppress(sqlite3.Error):
            self._begin(in_background=True)

    def note(self, run_id: str) -> None:
        """Updates the entry of a run whose files were just written or deleted."""
        with suppress(sqlite3.Error), self._lock:
            # Without a usable table, the next search creates one.
            if self._table is not None or self._path().is_file():
                self._correct(self._opened(), [run_id])

    def close(self) -> None:
        """Closes the table; it is reopened on demand."""
        with self._lock:
            look = self._close()
        if look is not None:
            look.finish()

    def _find(self, query: RunQuery) -> FoundRuns:
        if not self._files.path.is_dir():
            return FoundRuns([], 0, 0)
        left = self._bring_up_to_date(everything=query.limit is None)
        with self._lock:
            table = self._opened()
            if unread := table.unread():
                self._read(table, unread, time.monotonic() + self._reading_seconds)
            page, count = self._true_page(table, query)
            waiting = set(table.unread())
            self._read(table, due := [run_id for run_id in page if run_id in waiting])
            runs = list(self._runs(table, page))
            return FoundRuns(runs, count - len(page) + len(runs), left + len(waiting - {*due}))

    def _bring_up_to_date(self, *, everything: bool) -> int:
        """Scans the folder if due; returns the number of runs to be entered.

        Args:
            everything: Whether to wait until all are entered.
        """
        with self._starting:
            look = self._begin(in_background=self._look is not None and not self._look.is_small)
            look.is_useful.wait()
        if everything:
            look.finish()
        if look.error is not None:
            raise look.error
        return look.left

    def _begin(self, *, in_background: bool) -> _Look:
        with self._lock:
            table = self._opened()
            if self._look is None or self._look.is_due:
                is_first = self._look is None
                in_background = in_background and table.count() > SMALL
                self._look = _Look(self, table, is_first=is_first, in_background=in_background)
                self._look.start()
            return self._look

    def _true_page(self, table: IndexTable, query: RunQuery) -> tuple[list[str], int]:
        """A page of runs that agree with the table, and the total number."""
        page, count = table.find(query)
        for _ in range(_CORRECTIONS):
            outdated = [each for each, stamp in page.items() if self._files.stamp(each) != stamp]
            if not outdated:
                break
            self._correct(table, outdated)
            page, count = table.find(query)
        return list(page), count

    def _runs(self, table: IndexTable, ids: Iterable[str]) -> Iterator[StoredRun]:
        """Selects existing runs."""
        for run_id in ids:
            with suppress(RecordingNotFoundError):
                sidecar = self._files.read_sidecar(run_id)
                description = sidecar.description or table.description(run_id)
                description = description or self._files.describe(run_id)
                yield self._files.put_together(run_id, sidecar, description)

    def enter(self, table: IndexTable, ids: Iterable[str]) -> bool:
        """Enters changed runs; returns whether the table is still in use."""
        entries = {run_id: self._entry(run_id) for run_id in ids}
        with self._lock:
            if table is not self._table:
                return False
            stamps = {run_id: self._files.stamp(run_id) for run_id in entries}
            # Changes since it was read have been recorded, or will be found by the next scan.
            current = [
                each for each in entries.values() if each and each.stamp == stamps[each.stored.id]
            ]
            table.apply([run_id for run_id, stamp in stamps.items() if stamp is None], current)
        return True

    def compare(self, table: IndexTable, pause: Callable[[], None]) -> tuple[list[str], int]:
        """Ids of runs that differ from the table, and their number.

        Args:
            table: The table.
            pause: Called about every hundredth of a second.
        """
        present = self._files.scan(pause)
        count, gone, last = len(present), [], ""
        while True:
            pause()
            with self._lock:
                rows = table.stamps(last, _STAMPS) if table is self._table else []
            if not rows:
                return [*present, *gone], count
            last = rows[-1][0]
            gone += [run_id for run_id, _ in rows if run_id not in present]
            for run_id, stamp in rows:
                if present.get(run_id) == stamp:
                    del present[run_id]

    def _entry(self, run_id: str, description: Description | None = None) -> Entry | None:
        """An up-to-date entry of a run; None if it was deleted.

        Args:
            run_id: The run.
            description: Description from its recording, if that was read.
        """
        stamp = self._files.stamp(run_id)
        if stamp is None:
            return None
        sidecar = self._files.read_sidecar(run_id)
        known = sidecar.description or description
        try:
            stored = self._files.put_together(run_id, sidecar, known or _UNREAD)
        except RecordingNotFoundError:
            return None
        kept = None if sidecar.description else description
        return Entry(stored=stored, stamp=stamp, is_read=known is not None, description=kept)

    def _correct(self, table: IndexTable, ids: Iterable[str]) -> None:
        entries = {run_id: self._entry(run_id) for run_id in ids}
        gone = [run_id for run_id, entry in entries.items() if entry is None]
        table.apply(gone, filter(None, entries.values()))

    def _read(self, table: IndexTable, ids: Iterable[str], deadline: float | None = None) -> None:
        """Reads recordings within the time limit, at least one."""
        found: list[Entry] = []
        gone: list[str] = []
        for run_id in ids:
            try:
                entry = self._entry(run_id, self._files.describe(run_id))
            except RecordingNotFoundError:
                entry = None
            if entry is None:
                gone.append(run_id)
            else:
                found.append(entry)
            if deadline is not None and time.monotonic() > deadline:
                break
        table.apply(gone, found)

    def _opened(self) -> IndexTable:
        """The table, reopened if its file was deleted or replaced."""
        if self._table is not None and not self._table.is_in_place:
            self._close()
        if self._table is None:
            path = self._path()
            if path.is_symlink():
                raise sqlite3.DatabaseError("its file is a link, which is not allowed")
            if not path.exists():
                self._discard()  # auxiliary files of a deleted table
            self._table = IndexTable(path)
        return self._table

    def _replace(self, error: sqlite3.Error) -> None:
        """Deletes the file, unless another process is using it."""
        self._close()
        if isinstance(error, sqlite3.OperationalError) and "locked" in str(error):
            self._retreat(error)
        else:
            self._discard()

    def _retreat(self, _error: sqlite3.Error) -> None:
        """Uses a temporary table until this process ends."""
        self._close()
        self._table = IndexTable(PRIVATE)

    def _discard(self) -> None:
        for suffix in _JOURNALS:
            with suppress(OSError):
                self._path().with_name(INDEX_NAME + suffix).unlink(missing_ok=True)

    def _close(self) -> _Look | None:
        """Closes the table; returns the scan that ends because of this."""
        if self._table is not None:
            self._table.close()
        look, self._table, self._look = self._look, None, None
        return look

    def _path(self) -> Path:
        return self._files.path / INDEX_NAME


class _Look(threading.Thread):
    """One scan of the folder.

    Args:
        index: Index that enters the changes.
        table: Table for the comparison.
        is_first: Whether the table was just opened, so that all its pages are checked.
        in_background: Whether searches do not wait for it.

    Attributes:
        is_useful: Set when searches need not wait any longer.
        left: Number of changed runs to be entered.
        error: Error that ended it, if any.
    """

    def __init__(
        self, index: RunIndex, table: IndexTable, *, is_first: bool, in_background: bool
    ) -> None:
        super().__init__(name="look over recordings", daemon=True)
        self.is_useful = threading.Event()
        self.left = 0
        self.error: OSError | sqlite3.Error | None = None
        if in_background:
            self.is_useful.set()
        self._index = index
        self._table = table
        self._is_first = is_first
        self._count = 0
        self._pause = 0.0
        self._next = math.inf
        self._is_awaited = threading.Event()
        self._spent = 0.0

    @property
    def is_small(self) -> bool:
        """Whether the folder is small enough to be scanned before every search."""
        return self._count <= SMALL

    @property
    def is_due(self) -> bool:
        """Whether it has ended, and the next one is due."""
        return time.monotonic() >= self._next

    def finish(self) -> None:
        """Waits for its end, which is hastened."""
        self._is_awaited.set()
        self.join()

    def run(self) -> None:
        """Compares folder and table, and enters the differences."""
        try:
            self._work()
        except (OSError, sqlite3.Error) as error:
            self.error = error
        finally:
            self._next = time.monotonic() + self._pause
            self.is_useful.set()

    def _work(self) -> None:
        # Measured in processor time, so that other load does not delay the next scan.
        began = time.thread_time()
        changed, self._count = self._index.compare(self._table, self._rest)
        self._pause = 0.0 if self.is_small else _PAUSE * (time.thread_time() - began)
        changed.sort(reverse=True)  # ids increase with time, and the newest are requested first
        self.left = len(changed)
        while changed:
            batch, changed = changed[:_BATCH], changed[_BATCH:]
            if not self._index.enter(self._table, batch):
                return
            self.left = len(changed)
            self._let_search()
        self._let_search()
        if self._is_first:
            self._table.check()

    def _rest(self) -> None:
        if self.is_useful.is_set():
            self._is_awaited.wait(_REST * (time.thread_time() - self._spent))
        self._spent = time.thread_time()

    def _let_search(self) -> None:
        if not self.is_small:
            self.is_useful.set()
