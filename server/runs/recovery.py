"""Recovers, in the background, runs cut off by a killed service or a full disk.

A separate process is used, because reading large files would block the interpreter.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from slipgrasp.core.executors import ExecutorError, Finished
from slipgrasp.core.executors.limits import WorkerLimits
from slipgrasp.core.executors.processes import ProcessExecutor
from slipgrasp.recordings.exceptions import RecordingWriteError, StorageFullError
from slipgrasp.recordings.file.recovery import (
    delete_orphaned_copies,
    recordings_among,
    unfinished_files,
)
from slipgrasp.recordings.store.recovering import Recovery, recover_run
from slipgrasp.recordings.store.store import RecordingStore

PAUSE = 5.0
"""Interval between checks of the free space on the disk [s]."""

TASK_SECONDS = 3600.0
"""Time limit of one recovery [s]; the workers have a low priority."""

_logger = logging.getLogger(__name__)


class RunRecovery:
    """Recovers runs one after the other; thread-safe.

    Args:
        store: Store of the runs.
        folder: Folder of the store.

    Attributes:
        is_done: Set when work on runs of a killed service has ended.
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
        """Starts to recover the runs of a killed service."""
        left = unfinished_files(self._folder)
        self._store.discard_unfinished(left)
        delete_orphaned_copies(left)
        parts = recordings_among(left)
        self._orphans = {_run_of(part) for part in parts}
        self._thread = threading.Thread(target=self._work, args=(parts,), name="recovery")
        self._thread.start()

    def close(self) -> None:
        """Leaves waiting runs to the next service."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()

    @property
    def run_ids(self) -> list[str]:
        """Runs that are not recovered yet."""
        with self._lock:
            return sorted(self._orphans | set(self._cut_off))

    def is_orphan(self, run_id: str) -> bool:
        """Whether a run of a killed service is still to be recovered."""
        with self._lock:
            return run_id in self._orphans

    def note_cut_off(self, part: Path) -> None:
        """Adds a run interrupted by a full disk; it is recovered when there is space."""
        with self._lock:
            self._cut_off[_run_of(part)] = part

    def _work(self, parts: Sequence[Path]) -> None:
        try:
            self._recover(parts)
        finally:
            self.is_done.set()
        while not self._closing.wait(PAUSE):
            self._recover_cut_off()

    def _recover_cut_off(self) -> None:
        with self._lock:
            waiting = list(self._cut_off.values())
        self._recover([part for part in waiting if self._has_space_for(part)])
        with self._lock:
            for part in waiting:
                if not part.exists():
                    del self._cut_off[_run_of(part)]

    def _has_space_for(self, part: Path) -> bool:
        try:
            self._store.check_space(part.stat().st_size)
        except (OSError, RecordingWriteError, StorageFullError):
            return False
        return True

    def _recover(self, parts: Sequence[Path]) -> None:
        """Recovers all runs, and logs failures."""
        if not parts:
            return
        limits = replace(WorkerLimits.shared_by(1), task_seconds=TASK_SECONDS)
        with ProcessExecutor(1, limits) as executor:
            try:
                for done in executor.map(recover_run, parts, should_stop=self._closing.is_set):
                    self._note(done)
            except ExecutorError as error:
                _logger.error("interrupted runs are not recovered: %s", error)
        with self._lock:
            self._orphans.difference_update(map(_run_of, parts))

    def _note(self, done: Finished[Path, Recovery]) -> None:
        path, fault = done.result or Recovery(fault=done.failure or "")
        if path:
            self._store.note(_run_of(done.task))
            _logger.warning("recovered the interrupted run '%s'", path)
        if fault:
            _logger.warning("'%s' could not be recovered: %s", done.task, fault)
        with self._lock:
            self._orphans.discard(_run_of(done.task))


def _run_of(part: Path) -> str:
    return part.name.partition(".")[0]
