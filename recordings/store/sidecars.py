"""Sidecars: a JSON document next to each stored item, which describes it."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from threading import Lock
from typing import Any, Generic, TypeVar

from pydantic import TypeAdapter, ValidationError

from slipgrasp.recordings.file.atomic_file import atomic_file
from slipgrasp.recordings.store.run_files import checked_time, read_document

_logger = logging.getLogger(__name__)

StoredT = TypeVar("StoredT")


class Sidecars(Generic[StoredT]):
    """The sidecars of a folder; one is written at a time.

    Args:
        folder: Folder of the sidecars.
        kind: A dataclass with the fields ``id``, ``created`` and ``finding``.
        is_possible: Returns whether the numbers of a sidecar are plausible.
    """

    def __init__(
        self, folder: Path, kind: type[StoredT], is_possible: Callable[[StoredT], bool]
    ) -> None:
        self._folder = folder
        self._kind = kind
        self._reader: TypeAdapter[Any] = TypeAdapter(kind)
        self._is_possible = is_possible
        self._lock = Lock()

    def path_of(self, stored_id: str) -> Path:
        """Path of a sidecar, which may not exist."""
        return self._folder / f"{stored_id}.json"

    def read(self, stored_id: str) -> StoredT | None:
        """The content of a sidecar; None if it is missing, or not usable.

        Defects of an unusable one are logged.
        """
        document = read_document(self.path_of(stored_id))
        if not document:
            return None
        facts = {**document, "id": stored_id, "created": checked_time(document.get("created"))}
        try:
            stored: StoredT = self._reader.validate_python({**facts, "finding": ""})
        except ValidationError as error:
            finding = error.errors(include_url=False)[0]
            where = ".".join(map(str, finding["loc"]))
            kind = self._kind.__name__.removeprefix("Stored").lower()
            _logger.warning("the sidecar of %s %s: %s: %s", kind, stored_id, where, finding["msg"])
            return None
        return stored if self._is_possible(stored) else None

    def write(self, stored: Any) -> None:
        """Writes a sidecar.

        Raises:
            RecordingBusyError: If another process is writing it.
            RecordingWriteError: If it cannot be written; the old one is then unchanged.
        """
        document = asdict(stored)
        del document["finding"]
        text = json.dumps(document, ensure_ascii=False, indent=1).encode()
        with self._lock, atomic_file(self.path_of(stored.id), overwrite=True) as stream:
            stream.write(text)
