"""Requests that may be repeated without repeating their effect, and their results.

Equal keys and requests give the same result. The run of a key is known after a restart too; a study
stores its own key.

Each key is one line in a file in the data folder. It contains only ids: the store knows whether the
run still exists.
"""

from __future__ import annotations

import json
import logging
import os
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import blake2b
from pathlib import Path
from typing import Any, Self, TextIO

from slipgrasp.recordings.exceptions import RecordingWriteError
from slipgrasp.recordings.file.atomic_file import atomic_file

KEYS_NAME = "idempotency-keys.jsonl"
MAX_KEYS = 10_000
MAX_FILE_BYTES = 4_000_000

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class KeyedRequest:
    """A request that may be repeated.

    Attributes:
        key: Idempotency key; may be empty.
        digest: Equal for requests with the same meaning, regardless of notation.
    """

    key: str
    digest: str

    @classmethod
    def of(cls, key: str, body: Any) -> Self:
        """Creates the request of a key.

        Args:
            key: Idempotency key; without one the request is always executed.
            body: Body as plain values for JSON.
        """
        return cls(key, _digest(json.dumps(body, sort_keys=True)) if key else "")


UNKEYED = KeyedRequest("", "")
"""A request that is always executed."""


class RequestKeys:
    """Recently used keys; not thread-safe.

    Args:
        path: The file.
        max_keys: Number of stored keys.
    """

    def __init__(self, path: Path, max_keys: int = MAX_KEYS) -> None:
        self._path = path
        self._max_keys = max_keys
        self._known: OrderedDict[str, tuple[str, str]] | None = None

    def find(self, key: str) -> tuple[str, str] | None:
        """Digest and run of the last request with a key, None if there is none."""
        return self._entries().get(_digest(key))

    def remember(self, request: KeyedRequest, run_id: str) -> None:
        """Stores the run of a request; in memory only if it cannot be written."""
        known = self._entries()
        name = _digest(request.key)
        known.pop(name, None)
        known[name] = (request.digest, run_id)
        while len(known) > self._max_keys:
            known.popitem(last=False)
        try:
            with _open_to_append(self._path) as stream:
                stream.write(_line(name, request.digest, run_id))
                size = stream.tell()
            if size > MAX_FILE_BYTES:
                self._rewrite(known)
        except (OSError, RecordingWriteError) as error:
            _logger.warning("an idempotency key will not outlive the service: %s", error)

    def _entries(self) -> OrderedDict[str, tuple[str, str]]:
        if self._known is None:
            self._known = OrderedDict()
            for name, digest, run_id in _read(self._path):
                self._known.pop(name, None)
                self._known[name] = (digest, run_id)
                if len(self._known) > self._max_keys:
                    self._known.popitem(last=False)
        return self._known

    def _rewrite(self, known: OrderedDict[str, tuple[str, str]]) -> None:
        with atomic_file(self._path, overwrite=True) as stream:
            stream.writelines(_line(name, *entry).encode() for name, entry in known.items())


def _open_to_append(path: Path) -> TextIO:
    """Opens the file itself: links are not followed."""
    flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
    return os.fdopen(os.open(path, flags, 0o666), "a", encoding="ascii")


def _digest(text: str) -> str:
    return blake2b(text.encode(), digest_size=16).hexdigest()


def _line(name: str, digest: str, run_id: str) -> str:
    # A line break comes first, so that an incomplete line does not spoil the next one.
    return "\n" + json.dumps([name, digest, run_id])


def _read(path: Path) -> Iterator[tuple[str, str, str]]:
    """Valid lines; a killed service may have left the last one incomplete."""
    try:
        if path.is_symlink() or path.stat().st_size > 2 * MAX_FILE_BYTES:
            return
        lines = path.read_bytes().splitlines()
    except OSError:
        return
    for line in lines:
        try:
            entry = json.loads(line)
        except ValueError:
            continue
        if isinstance(entry, list) and len(entry) == 3 and all(isinstance(e, str) for e in entry):
            yield entry[0], entry[1], entry[2]
