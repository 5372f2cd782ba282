"""Thread that lists, opens and changes stored runs, for a session."""

from __future__ import annotations

import time
from collections.abc import Collection
from functools import partial

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.recordings.exceptions import RecordingError, RecordingNotFoundError
from slipgrasp.recordings.store.run_query import RunQuery
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.recordings import (
    AnnotateRecording,
    DeleteRecording,
    RecordingChanged,
    RecordingOpened,
    RecordingRefused,
    RecordingsListed,
    RecordingUnreadable,
)
from slipgrasp.web.model.replay import Replay, Source
from slipgrasp.web.model.run_list import ROWS_PER_PAGE, RunFilter
from slipgrasp.web.workers.open_recordings import OpenRecordings
from slipgrasp.web.workers.worker import QueueWorker

NUM_RECENT = 30


class LibraryWorker(QueueWorker):
    """Handles the latest requests for a recording and a page of the list, and all changes.

    Args:
        store: Stored runs.
        recordings: Opens stored runs.
        send: Receives the results.
    """

    def __init__(self, store: RecordingStore, recordings: OpenRecordings, send: Send) -> None:
        super().__init__("library-worker")
        self._store, self._recordings, self._send = store, recordings, send

    def open(self, number: int, source: Source, instead_of: Collection[Replay] = ()) -> None:
        """Requests a recording; drops an older request that is still waiting.

        Args:
            number: Number of the request, repeated in the result.
            source: The recording.
            instead_of: Replays that the page will no longer display.
        """
        self.ask(partial(self._open, number, source, instead_of), "open")

    def list(self, page: int, wanted: RunFilter, chosen_id: str = "") -> None:
        """Requests a page of the list.

        Args:
            page: Index of the page; page 0 has the newest runs.
            wanted: Filter of the runs.
            chosen_id: Run whose full description is shown, on any page.
        """
        self.ask(partial(self._list, page, wanted, chosen_id), "list")

    def annotate(self, request: AnnotateRecording) -> None:
        """Requests to store the annotations of a run."""
        self.ask(partial(self._annotate, request), must=True)

    def delete(self, request: DeleteRecording) -> None:
        """Requests the deletion of a run."""
        self.ask(partial(self._delete, request), must=True)

    def _open(self, number: int, source: Source, instead_of: Collection[Replay]) -> None:
        try:
            replay = self._recordings.open(source, instead_of, self.is_closed)
            self._send(RecordingOpened(number, replay))
        except SlipgraspError as error:
            self._send(RecordingUnreadable(number, str(error)))

    def _list(self, page: int, wanted: RunFilter, chosen_id: str) -> None:
        """Sends the requested page, or the last one if there are fewer."""
        started = time.monotonic()
        found = self._store.find(wanted.query(page))
        last = max((found.count - 1) // ROWS_PER_PAGE, 0)
        if page > last:
            page, found = last, self._store.find(wanted.query(last))
        recent = self._store.find(RunQuery(limit=NUM_RECENT)).runs
        chosen = self._get(chosen_id) if chosen_id else None
        self._send(
            RecordingsListed(
                page=page,
                count=found.count,
                runs=tuple(found.runs),
                recent=tuple(recent),
                chosen_id=chosen_id,
                chosen=chosen,
                elapsed=time.monotonic() - started,
            )
        )

    def _get(self, run_id: str) -> StoredRun | None:
        try:
            return self._store.get(run_id)
        except RecordingNotFoundError:
            return None

    def _annotate(self, request: AnnotateRecording) -> None:
        tags = [tag for tag in map(str.strip, request.tags.split(",")) if tag]
        try:
            stored = self._store.annotate(
                request.run_id,
                name=request.name,
                notes=request.notes,
                tags=tags,
                expected=[request.revision],
            )
        except RecordingError as error:
            self._send(RecordingRefused("Not changed", str(error)))
            return
        self._send(RecordingChanged(request.run_id, stored))

    def _delete(self, request: DeleteRecording) -> None:
        try:
            self._store.delete(request.run_id, expected=[request.revision])
        except RecordingError as error:
            self._send(RecordingRefused("Not deleted", str(error)))
            return
        self._send(RecordingChanged(request.run_id, None))
