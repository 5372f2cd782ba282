"""The thread that lists and opens recordings for one session."""

from __future__ import annotations

import threading
from dataclasses import dataclass

from recordings.exceptions import RecordingError
from recordings.store import RecordingStore
from web.intents import RecordingOpened, RecordingsListed, RecordingUnreadable, Send
from web.replay import Source, open_replay

__all__ = ["ROWS_PER_PAGE", "Librarian"]

ROWS_PER_PAGE = 8


@dataclass(frozen=True, slots=True)
class _Open:
    number: int
    source: Source


class Librarian:
    """Answers the latest request for a recording, and the latest for a page of the list.

    Args:
        store: The stored runs.
        send: Takes the answers.
    """

    def __init__(self, store: RecordingStore, send: Send) -> None:
        self._store, self._send = store, send
        self._wake = threading.Condition()
        self._opening: _Open | None = None
        self._page: int | None = None
        self._closed = False
        self._thread = threading.Thread(target=self._work, name="librarian", daemon=True)
        self._thread.start()

    def open(self, number: int, source: Source) -> None:
        """Asks for a recording; one that still waits is forgotten.

        Args:
            number: What the answer is to be recognised by.
            source: The recording.
        """
        with self._wake:
            self._opening = _Open(number, source)
            self._wake.notify()

    def list(self, page: int) -> None:
        """Asks for a page of the list, 0 has the newest."""
        with self._wake:
            self._page = page
            self._wake.notify()

    def close(self) -> None:
        """Ends the thread once it has answered what it is at."""
        with self._wake:
            self._closed = True
            self._wake.notify()

    def join(self, timeout: float) -> None:
        """Waits until the thread has ended [s]."""
        self._thread.join(timeout)

    def _work(self) -> None:
        while True:
            with self._wake:
                self._wake.wait_for(
                    lambda: self._closed or self._opening is not None or self._page is not None
                )
                if self._closed:
                    return
                opening, page = self._opening, self._page
                self._opening = self._page = None
            if opening is not None:
                self._open(opening)
            if page is not None:
                self._list(page)

    def _open(self, job: _Open) -> None:
        try:
            self._send(RecordingOpened(job.number, open_replay(self._store, job.source)))
        except RecordingError as error:
            self._send(RecordingUnreadable(job.number, str(error)))

    def _list(self, page: int) -> None:
        """Answers with the last page where there are fewer."""
        count = self._store.count()
        page = max(min(page, (count - 1) // ROWS_PER_PAGE), 0)
        runs = self._store.list(offset=page * ROWS_PER_PAGE, limit=ROWS_PER_PAGE)
        self._send(RecordingsListed(page, count, tuple(runs)))
