"""Finding runs by what is told of them, without reading their files each time.

Before every search one look over the folder finds what was changed, is new or is gone.
Sidecars of those are read at once; recordings without one take long to read, so of these
only as many as fit into a moment, and those that are about to be shown.
"""

from __future__ import annotations

import logging
import sqlite3
import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

from slipgrasp.recordings.exceptions import RecordingNotFoundError
from slipgrasp.recordings.store.catalogue import IN_MEMORY, Catalogue, Entry
from slipgrasp.recordings.store.description import Description
from slipgrasp.recordings.store.run_folder import RunFolder
from slipgrasp.recordings.store.run_query import RunQuery
from slipgrasp.recordings.store.stored_run import StoredRun

CATALOGUE_NAME = "catalogue.sqlite"
READING_SECONDS = 0.25

_JOURNALS = ("", "-journal", "-wal", "-shm")
_UNREAD = Description(title="", controller="", summary={})
_logger = logging.getLogger(__name__)


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
        folder: The runs.
        reading_seconds: How long a search may read recordings that have no sidecar [s].
    """

    def __init__(self, folder: RunFolder, reading_seconds: float = READING_SECONDS) -> None:
        self._folder = folder
        self._reading_seconds = reading_seconds
        self._lock = Lock()
        self._catalogue: Catalogue | None = None
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
        """Closes the catalogue; it is opened again when it is needed."""
        with self._lock:
            self._close()

    def _find(self, query: RunQuery) -> FoundRuns:
        if not self._folder.path.is_dir():
            return FoundRuns([], 0, 0)
        catalogue = self._catalogue or self._open()
        self._refresh(catalogue)
        ids, count = catalogue.find(query)
        unread = set(catalogue.unread())
        if due := [run_id for run_id in ids if run_id in unread]:
            unread -= self._read(catalogue, due)
        found = [catalogue.get(run_id, self._folder.recording(run_id)) for run_id in ids]
        runs = [run for run in found if run.id in self._stamps]
        return FoundRuns(runs, count - (len(found) - len(runs)), len(unread))

    def _refresh(self, catalogue: Catalogue) -> None:
        present = self._folder.scan()
        gone = self._stamps.keys() - present.keys()
        new = [run_id for run_id, stamp in present.items() if self._stamps.get(run_id) != stamp]
        if gone or new:
            entries = [self._from_sidecar(run_id, present[run_id]) for run_id in new]
            catalogue.apply(gone, filter(None, entries))
            self._stamps = present
        if unread := catalogue.unread():
            self._read(catalogue, unread, time.monotonic() + self._reading_seconds)

    def _from_sidecar(self, run_id: str, stamp: str) -> Entry | None:
        """A run as far as its sidecar tells of it; None if it has gone meanwhile."""
        sidecar = self._folder.read_sidecar(run_id)
        description = sidecar.description or _UNREAD
        try:
            stored = self._folder.put_together(run_id, sidecar, description)
        except RecordingNotFoundError:
            return None
        return Entry(stored, stamp, is_read=description is not _UNREAD)

    def _read(
        self, catalogue: Catalogue, ids: Iterable[str], deadline: float | None = None
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
                found.append(Entry(self._folder.read(run_id), stamp, is_read=True))
            except RecordingNotFoundError:
                del self._stamps[run_id]
                gone.add(run_id)
            if deadline is not None and time.monotonic() > deadline:
                break
        catalogue.apply(gone, found)
        return done

    def _open(self) -> Catalogue:
        path = self._path()
        if path.is_symlink():
            raise sqlite3.DatabaseError("its file is a link, which is not followed")
        return self._use(Catalogue(path))

    def _use(self, catalogue: Catalogue) -> Catalogue:
        self._catalogue, self._stamps = catalogue, catalogue.stamps()
        return catalogue

    def _replace(self, error: sqlite3.Error) -> None:
        """Throws the file away, unless another process is using it."""
        self._close()
        if isinstance(error, sqlite3.OperationalError) and "locked" in str(error):
            self._retreat(error)
            return
        for suffix in _JOURNALS:
            with suppress(OSError):
                self._path().with_name(CATALOGUE_NAME + suffix).unlink(missing_ok=True)

    def _retreat(self, error: sqlite3.Error) -> None:
        """Does without a file until this process ends."""
        self._close()
        self._use(Catalogue(IN_MEMORY))

    def _close(self) -> None:
        if self._catalogue is not None:
            self._catalogue.close()
        self._catalogue, self._stamps = None, {}

    def _path(self) -> Path:
        return self._folder.path / CATALOGUE_NAME
