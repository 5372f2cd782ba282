"""Folders of studies and fits: a sidecar, a JSON document, describes each without its files."""

from __future__ import annotations

import json
import logging
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from threading import Lock
from typing import Any, ClassVar, Generic, TypeVar

from pydantic import TypeAdapter, ValidationError

from slipgrasp.recordings.exceptions import RecordingNotFoundError
from slipgrasp.recordings.file.atomic_file import atomic_file
from slipgrasp.recordings.store.identifiers import ID, IdSource
from slipgrasp.recordings.store.run_files import checked_time, iso_time, read_document
from slipgrasp.recordings.store.store import RecordingStore

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredJob:
    """A study or fit in its store.

    Attributes:
        id: Its id, twelve letters and digits.
        created: Time of its creation, ISO 8601 in UTC.
        end: Its end; None while it is unfinished.
        idempotency_key: Idempotency key of its request; may be empty.
        request_digest: Digest of that request.
        finding: Reason why it cannot be read; empty if it can.
    """

    id: str
    created: str
    end: object = None
    idempotency_key: str = ""
    request_digest: str = ""
    finding: str = ""

    @property
    def is_possible(self) -> bool:
        """Whether its numbers are valid."""
        return True


StoredT = TypeVar("StoredT", bound=StoredJob)


class JobStore(ABC, Generic[StoredT]):
    """Stores jobs of one kind in a folder, and their recordings among the runs.

    Args:
        folder: The folder.
        runs: Store of the runs.
        kind: Class of a stored job.
    """

    noun: ClassVar[str]

    def __init__(self, folder: Path, runs: RecordingStore, kind: type[StoredT]) -> None:
        self._folder = folder
        self.runs = runs
        self._ids = IdSource()
        self._reader: TypeAdapter[Any] = TypeAdapter(kind)
        self._lock = Lock()

    @abstractmethod
    def get(self, job_id: str, /) -> StoredT:
        """One job by its id.

        Raises:
            RecordingNotFoundError: If it does not exist, for any text.
        """

    @abstractmethod
    def delete(self, job_id: str, /) -> None:
        """Deletes a job permanently; recordings of its runs are retained.

        Raises:
            RecordingNotFoundError: If it does not exist.
            RecordingError: If it cannot be deleted.
        """

    @abstractmethod
    def _find_names(self) -> Iterable[str]:
        """Names of files that belong to jobs, without suffixes."""

    def list(self, offset: int = 0, limit: int | None = None) -> tuple[list[StoredT], int]:
        """Jobs, newest first, and their number.

        Args:
            offset: Number of the newest jobs to skip.
            limit: Largest number of jobs; all if None.
        """
        ids = self._list_ids()
        end = None if limit is None else offset + limit
        return [*self._read_all(ids[offset:end])], len(ids)

    def find_by_key(self, idempotency_key: str) -> StoredT | None:
        """The job that was requested with an idempotency key, if any."""
        jobs = self._read_all(self._list_ids())
        return next((job for job in jobs if job.idempotency_key == idempotency_key), None)

    def unfinished(self) -> list[StoredT]:
        """Unfinished jobs that can continue, oldest first."""
        jobs = self._read_all(self._list_ids())
        return [job for job in jobs if job.end is None and not job.finding][::-1]

    def _list_ids(self) -> list[str]:
        return sorted({*filter(ID.fullmatch, self._find_names())}, reverse=True)

    def _read_all(self, ids: list[str]) -> Iterator[StoredT]:
        for job_id in ids:
            # A job that is deleted meanwhile no longer counts.
            with suppress(RecordingNotFoundError):
                yield self.get(job_id)

    def _new(self, idempotency_key: str, request_digest: str) -> dict[str, str]:
        """Id, time and request of a new job."""
        now = datetime.now(UTC)
        return {
            "id": self._ids.new(now),
            "created": iso_time(now),
            "idempotency_key": idempotency_key,
            "request_digest": request_digest,
        }

    def _sidecar(self, job_id: str) -> Path:
        return self._folder / f"{job_id}.json"

    def _read_sidecar(self, job_id: str) -> StoredT | None:
        """The content of a sidecar; None if it is missing, or not usable.

        Defects of an unusable one are logged.
        """
        document = read_document(self._sidecar(job_id))
        if not document:
            return None
        facts = {**document, "id": job_id, "created": checked_time(document.get("created"))}
        try:
            stored: StoredT = self._reader.validate_python({**facts, "finding": ""})
        except ValidationError as error:
            finding = error.errors(include_url=False)[0]
            where = ".".join(map(str, finding["loc"]))
            _logger.warning(
                "the sidecar of %s %s: %s: %s", self.noun, job_id, where, finding["msg"]
            )
            return None
        return stored if stored.is_possible else None

    def _write_sidecar(self, stored: StoredT) -> None:
        """Writes a sidecar; one is written at a time.

        Raises:
            RecordingBusyError: If another process is writing it.
            RecordingWriteError: If it cannot be written; the old one is then unchanged.
        """
        document = asdict(stored)
        del document["finding"]
        text = json.dumps(document, ensure_ascii=False, indent=1).encode()
        with self._lock, atomic_file(self._sidecar(stored.id), overwrite=True) as stream:
            stream.write(text)
