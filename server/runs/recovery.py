"""Recovers behind the answers what a killed service, or a full disk, has left of runs."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterable
from pathlib import Path

from slipgrasp.recordings.exceptions import RecordingWriteError, StorageFullError
from slipgrasp.recordings.file.recovery import (
    delete_orphaned_copies,
    parts_in,
    recover_if_orphaned,
)
from slipgrasp.recordings.store.store import RecordingStore

PAUSE = 5.0
"""Between two looks whether the disk has room again for what it has left [s]."""

_logger = logging.getLogger(__name__)


class RunRecovery:
    """Recovers runs one after the other in a thread; safe to use from several threads.

    Args:
        store: Where the runs are kept.
        folder: The folder of the store.

    Attributes:
        is_done: Set once nothing of a killed service is left to recover.
    """

    def __init__(self, store: RecordingStore, folder: Path) -> None:
        self._store = store
        self._folder = folder
        self._lock = threading.Lock()
        self._orphans: set[str] = set()
        self._cut_off: dict[str, Path] = {}
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self.is_done = threading.Event()

    def start(self) -> None:
        """Begins with what a killed service has left."""
        delete_orphaned_copies(self._folder)
        parts = parts_in(self._folder)
        self._orphans = {_run_of(part) for part in parts}
        self._thread = threading.Thread(target=self._work, args=(parts,), name="recovery")
        self._thread.start()

    def close(self) -> None:
        """Leaves what is not begun to the next service."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()

    @property
    def run_ids(self) -> list[str]:
        """Runs that are still to be recovered."""
        with self._lock:
            return sorted(self._orphans | set(self._cut_off))

    def is_orphan(self, run_id: str) -> bool:
        """Whether a run was left by a killed service, and is still to be recovered."""
        with self._lock:
            return run_id in self._orphans

    def note_cut_off(self, part: Path) -> None:
        """Takes down what the disk has left of a run; it is recovered once there is room."""
        with self._lock:
            self._cut_off[_run_of(part)] = part

    def _work(self, parts: Iterable[Path]) -> None:
        try:
            for part in parts:
                if self._closing.is_set():
                    return
                self._recover(part)
                with self._lock:
                    self._orphans.discard(_run_of(part))
        finally:
            self.is_done.set()
        while not self._closing.wait(PAUSE):
            self._recover_cut_off()

    def _recover_cut_off(self) -> None:
        with self._lock:
            waiting = list(self._cut_off.values())
        for part in waiting:
            if self._has_room_for(part):
                self._recover(part)
            if not part.exists():
                with self._lock:
                    del self._cut_off[_run_of(part)]

    def _has_room_for(self, part: Path) -> bool:
        try:
            self._store.check_room(part.stat().st_size)
        except (OSError, RecordingWriteError, StorageFullError):
            return False
        return True

    def _recover(self, part: Path) -> None:
        if (recovered := recover_if_orphaned(part)) is not None:
            _logger.warning("recovered '%s' of a run that was cut off", recovered.path)


def _run_of(part: Path) -> str:
    return part.name.partition(".")[0]
