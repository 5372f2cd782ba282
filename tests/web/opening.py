"""Recordings for pages, where nobody else needs memory."""

from __future__ import annotations

from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.server.budget import DEFAULT_BYTES, MemoryBudget
from slipgrasp.web.workers.open_recordings import OpenRecordings


def recordings_in(store: RecordingStore, limit: int = DEFAULT_BYTES) -> OpenRecordings:
    """Opens the runs of a store."""
    return OpenRecordings(store, MemoryBudget(limit, patience=0.05))
