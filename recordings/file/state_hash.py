"""Hash of every bit of the samples, phase changes and ticks of a run.

It grows with the run, so that a recording can contain it after every chunk, and does not depend on
the division into chunks. It excludes scenario, versions and container: runs with equal hashes are
equal, wherever they are stored.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.types import PhaseChange
from slipgrasp.recordings.file.versions import (
    FIRST_FORMAT_WITH_SHA256,
    FIRST_FORMAT_WITH_TICKS,
    FORMAT_VERSION,
)

HASH_BYTES = 16

_CHANGE = struct.Struct("<dibb")


class StateHash:
    """The hash of the samples, phase changes and ticks added so far.

    Args:
        format_version: Format of the recording.
    """

    def __init__(self, format_version: int = FORMAT_VERSION) -> None:
        self._samples = (
            hashlib.sha256()
            if format_version >= FIRST_FORMAT_WITH_SHA256
            else hashlib.blake2b(digest_size=HASH_BYTES)
        )
        self._changes = hashlib.blake2b(digest_size=HASH_BYTES)
        self._ticks = hashlib.sha256() if format_version >= FIRST_FORMAT_WITH_TICKS else None

    def add_samples(self, rows: NDArray[np.float64]) -> None:
        """Adds samples in the form of `slipgrasp.core.trace.trace.Trace.to_rows`."""
        self._samples.update(np.ascontiguousarray(rows, dtype="<f8").data)

    def add_phase_changes(self, changes: Iterable[PhaseChange]) -> None:
        """Adds phase changes."""
        for change in changes:
            phases = change.from_phase, change.to_phase
            self._changes.update(_CHANGE.pack(change.time, change.contact, *phases))

    def add_ticks(self, rows: NDArray[np.float64]) -> None:
        """Adds ticks in the form of `slipgrasp.core.trace.ticks.Ticks.to_rows`."""
        if self._ticks is not None:
            self._ticks.update(np.ascontiguousarray(rows, dtype="<f8").data)

    def digest(self) -> bytes:
        """The hash so far, `HASH_BYTES` bytes."""
        ticks = () if self._ticks is None else (self._ticks.digest(),)
        return digest_of(self._samples.digest(), self._changes.digest(), *ticks)


def state_hash(result: RunResult) -> str:
    """The hash of a run, as 32 hexadecimal digits."""
    state = StateHash()
    state.add_samples(result.trace.to_rows())
    state.add_phase_changes(result.phase_changes)
    if result.ticks is not None:
        state.add_ticks(result.ticks.to_rows())
    return state.digest().hex()


def digest_of(*parts: bytes) -> bytes:
    """Hash of several pieces of data, separated by their lengths."""
    digest = hashlib.blake2b(digest_size=HASH_BYTES)
    for part in parts:
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part)
    return digest.digest()
