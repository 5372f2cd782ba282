"""Recordings for pages, where nobody else needs memory."""

from __future__ import annotations

from contextlib import nullcontext

from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.web.workers.open_recordings import MAX_BYTES, OpenRecordings


def recordings_in(store: RecordingStore, max_bytes: int = MAX_BYTES) -> OpenRecordings:
    """Opens the runs of a store."""
    return OpenRecordings(store, lambda _: nullcontext(), max_bytes)
