"""The recordings that pages show: each decoded once, and together in bounded memory."""

from __future__ import annotations

import gc
import threading
from collections.abc import Callable, Collection
from contextlib import AbstractContextManager
from pathlib import Path
from weakref import WeakKeyDictionary

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.trace import SIGNALS
from slipgrasp.recordings.exceptions import RecordingError
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.server.reading import READ_COST, SMALL_BYTES
from slipgrasp.web.model.replay import Replay, Source, open_replay, read_run

Room = Callable[[int], AbstractContextManager[None]]
"""Within it so many bytes of memory may be used; raises `ServiceBusyError` where there are none."""

MAX_BYTES = 800_000_000

WORK_COST = 0.5
"""Memory for comparing or drawing runs, per byte of their traces."""

_MEGABYTE = 1e6

_File = tuple[Path, int, int, int]


class NoRoomError(RecordingError):
    """The recordings that pages show leave no memory for another one."""

    def __init__(self, needed: int, held: int, max_bytes: int) -> None:
        super().__init__(
            f"no room for it now: it takes {needed / _MEGABYTE:.0f} MB, and recordings that pages "
            f"show take {held / _MEGABYTE:.0f} of {max_bytes / _MEGABYTE:.0f} MB; close another "
            "page, or end a comparison, and open it again"
        )


class OpenRecordings:
    """Opens recordings for pages; each counts for as long as a page has it.

    Pages that show the same recording share one decoded run. Large ones are read one at a time,
    and so are small ones. What needs more than there is at all is opened if nothing else is.

    Args:
        store: The stored runs.
        room: The memory for what is made of runs.
        max_bytes: How much memory open recordings may take together.

    Attributes:
        room: As given.
    """

    def __init__(self, store: RecordingStore, room: Room, max_bytes: int = MAX_BYTES) -> None:
        self.room = room
        self._store, self._max_bytes = store, max_bytes
        # A page that ends, or shows another run, forgets its replay; nobody has to tell.
        self._open: WeakKeyDictionary[Replay, _File | None] = WeakKeyDictionary()
        self._lock = threading.Lock()
        # Nobody waits for a large recording but who opens a large one.
        self._turns = threading.Lock(), threading.Lock()

    @property
    def held_bytes(self) -> int:
        """How much memory open recordings take."""
        return self._held(())

    def open(
        self,
        source: Source,
        instead_of: Collection[Replay] = (),
        should_stop: Callable[[], bool] = lambda: False,
    ) -> Replay:
        """Reads a recording, or shares the run of a page that has it already.

        Args:
            source: What to open.
            instead_of: What the page will show no more: it counts only if others show it too.
            should_stop: Asked again and again whether nobody needs it any more.

        Raises:
            NoRoomError: If there is no memory for it.
            RecordingError: As `open_replay`.
        """
        path = self._store.get(source).path if isinstance(source, str) else source
        file = _file_at(path)
        needed = round(READ_COST * file[2]) if file else 0
        with self._turns[needed >= SMALL_BYTES]:
            known = self._find(file)
            if known is None:
                self._check_room(needed, instead_of)

            def read(path: Path) -> RunResult:
                return known or read_run(path, should_stop)

            replay = open_replay(self._store, source, read)
            with self._lock:
                self._open[replay] = file
        return replay

    def room_for(self, *runs: RunResult) -> AbstractContextManager[None]:
        """Within it runs may be compared or drawn.

        Raises:
            ServiceBusyError: If there is no memory for that for some time.
        """
        return self.room(round(WORK_COST * sum(map(_size_of, runs))))

    def _find(self, file: _File | None) -> RunResult | None:
        with self._lock:
            shown = [replay for replay, other in self._open.items() if other == file]
        return shown[0].result if file and shown else None

    def _check_room(self, needed: int, instead_of: Collection[Replay]) -> None:
        allowed = self._max_bytes - min(needed, self._max_bytes)
        if self._held(instead_of) <= allowed:
            return
        # Pages that ended may wait in cycles for the collector.
        gc.collect()
        if (held := self._held(instead_of)) > allowed:
            raise NoRoomError(needed, held, self._max_bytes)

    def _held(self, instead_of: Collection[Replay]) -> int:
        with self._lock:
            runs = {id(r.result): r.result for r in self._open if r not in instead_of}
        return sum(map(_size_of, runs.values()))


def _size_of(run: RunResult) -> int:
    return sum(getattr(run.trace, signal.name).nbytes for signal in SIGNALS)


def _file_at(path: Path) -> _File | None:
    """What tells a file from every other, its size third; None if there is none."""
    try:
        found = path.stat()
    except FileNotFoundError:
        return None
    return path, found.st_ino, found.st_size, found.st_mtime_ns
