"""Recordings displayed by pages: each is decoded once, in bounded memory."""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection
from contextlib import AbstractContextManager
from pathlib import Path
from weakref import WeakKeyDictionary

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.file.atomic_file import PART_SUFFIX
from slipgrasp.recordings.file.size import read_size, size_of_run
from slipgrasp.recordings.measured.overlay import laid_over, thinned
from slipgrasp.recordings.measured.recording import read_measured, read_outline
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.server.budget import SMALL_BYTES, Lease, MemoryBudget, Need
from slipgrasp.web.model.replay import Replay, Source, moment_words, open_replay, read_run

_File = tuple[Path, int, int, int]


class OpenRecordings:
    """Opens recordings for pages; each uses memory as long as a page displays it.

    Pages that display the same recording share one decoded run. Large recordings are read one at a
    time, and so are small ones.

    Args:
        store: Stored runs.
        memory: Memory budget.

    Attributes:
        memory: Memory budget.
    """

    def __init__(self, store: RecordingStore, memory: MemoryBudget) -> None:
        self.memory = memory
        self._store = store
        # The entry disappears when a page ends or displays another run.
        self._open: WeakKeyDictionary[Replay, _File | None] = WeakKeyDictionary()
        self._lock = threading.Lock()
        # Small recordings do not wait for large ones.
        self._turns = threading.Lock(), threading.Lock()

    def open(
        self,
        source: Source,
        instead_of: Collection[Replay] = (),
        should_stop: Callable[[], bool] = lambda: False,
        below: RunResult | None = None,
    ) -> Replay:
        """Reads a recording, or shares the run of a page that already has it.

        Args:
            source: Recording to open.
            instead_of: Replays that the page will no longer display; their memory counts as free
                unless other pages display them.
            should_stop: Called repeatedly; True stops the reading.
            below: Run on which measured data are overlaid; without it they are rejected.

        Raises:
            MemoryLimitError: If the recording needs more memory than the budget.
            ServiceBusyError: If there is not enough free memory at present.
            RecordingError: As in `open_replay`.
        """
        path = self._store.get(source).path if isinstance(source, str) else source
        file = _file_at(path)
        if below is not None and isinstance(source, str) and self._store.get(source).is_measured:
            return self._open_measured(self._store.get(source), below)

        def read(path: Path) -> RunResult:
            return self._find(file) or self._read(path, instead_of, should_stop)

        with self._turns[file is not None and file[2] >= SMALL_BYTES]:
            replay = open_replay(self._store, source, read)
            with self._lock:
                self._open[replay] = file
        return replay

    def _open_measured(self, stored: StoredRun, below: RunResult) -> Replay:
        outline = read_outline(stored.path)
        numbers = outline.sampling.samples * (1 + len(outline.columns))
        with self.memory.reserve(Need.to_read_numbers(numbers)) as lease:
            measured = thinned(read_measured(stored.path))
            result = laid_over(below, measured)
            lease.keep(result, size_of_run(result))
        moment = moment_words(stored.created)
        return Replay(stored.display_name, moment, result, stored.id, measured=measured)

    def reserve_for(self, *runs: RunResult) -> AbstractContextManager[Lease]:
        """Reserves the memory to compare or draw runs.

        Raises:
            ServiceBusyError: If no memory becomes free for some time.
        """
        return self.memory.reserve(Need.to_work_on(*runs))

    def _read(
        self,
        path: Path,
        instead_of: Collection[Replay],
        should_stop: Callable[[], bool],
    ) -> RunResult:
        """Reads a run, which uses memory until no page displays it."""
        need = Need.to_open(read_size(path, unfinished=path.suffix == PART_SUFFIX))
        with self.memory.reserve_to_hold(need, self._held_only_by(instead_of)) as lease:
            result = read_run(path, should_stop)
            lease.keep(result, size_of_run(result))
        return result

    def _find(self, file: _File | None) -> RunResult | None:
        with self._lock:
            shown = [replay for replay, other in self._open.items() if other == file]
        return shown[0].result if file and shown else None

    def _held_only_by(self, replays: Collection[Replay]) -> int:
        """Memory of the runs that belong only to these replays."""
        with self._lock:
            others = {id(replay.result) for replay in self._open if replay not in replays}
        runs = {id(replay.result): replay.result for replay in replays if replay in self._open}
        return sum(size_of_run(run) for number, run in runs.items() if number not in others)


def _file_at(path: Path) -> _File | None:
    """Identity of a file, with its size as the third item; None if the file does not exist."""
    try:
        found = path.stat()
    except FileNotFoundError:
        return None
    return path, found.st_ino, found.st_size, found.st_mtime_ns
