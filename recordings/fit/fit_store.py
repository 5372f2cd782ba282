"""Folder of fits: ``fits/ID.json`` has a request and its end, ``fits/ID/`` the files of the fit."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from slipgrasp.recordings.exceptions import (
    DamagedRecordingError,
    RecordingError,
    RecordingNotFoundError,
    RecordingWriteError,
)
from slipgrasp.recordings.fit.request import FitRequest
from slipgrasp.recordings.fit.run_fit import JOURNAL_SUFFIX, report_path
from slipgrasp.recordings.store.identifiers import ID
from slipgrasp.recordings.store.job_store import JobStore, StoredJob
from slipgrasp.recordings.store.store import RecordingStore

FITS_FOLDER = "fits"

EndState = Literal["completed", "cancelled", "failed"]


class FitNotFoundError(RecordingNotFoundError):
    """The fit does not exist."""

    noun = "fit"


@dataclass(frozen=True, slots=True, kw_only=True)
class FitEnd:
    """End of a fit.

    Attributes:
        state: ``completed`` if it has a report.
        evaluations: Number of its runs, without those of twins.
        message: Reason why it has no report, in a sentence.
    """

    state: EndState
    evaluations: int
    message: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredFit(StoredJob):
    """A fit in the store.

    Attributes:
        request: Request of the fit.
        end: Its end; None while it is unfinished.
    """

    request: FitRequest
    end: FitEnd | None = None

    @property
    def is_possible(self) -> bool:
        """Whether its numbers are valid."""
        return self.end is None or self.end.evaluations >= 0


class FitStore(JobStore[StoredFit]):
    """Stores fits in a folder of the data directory.

    Args:
        data_directory: The folder of the runs.
        runs: The runs.
    """

    noun = "fit"

    def __init__(self, data_directory: Path, runs: RecordingStore) -> None:
        super().__init__(data_directory / FITS_FOLDER, runs, StoredFit)

    def create(
        self, request: FitRequest, *, idempotency_key: str = "", request_digest: str = ""
    ) -> StoredFit:
        """Stores a new fit without runs.

        Raises:
            RecordingWriteError: If a file cannot be written.
            StorageFullError: If there is no space.
        """
        self.runs.check_space()
        new: dict[str, Any] = self._new(idempotency_key, request_digest)
        stored = StoredFit(**new, request=request)
        folder = self.study_path(stored.id).parent
        try:
            folder.mkdir(parents=True)
        except OSError as error:
            raise RecordingWriteError(folder, error.strerror or "no folder") from error
        self._write_sidecar(stored)
        return stored

    def get(self, fit_id: str) -> StoredFit:
        """One fit by its id.

        Raises:
            FitNotFoundError: If it does not exist, for any form of the id.
        """
        stored = self._read_sidecar(fit_id) if ID.fullmatch(fit_id) else None
        if stored is None:
            raise FitNotFoundError(fit_id)
        return stored

    def used_recordings(self) -> set[str]:
        """The recordings that fits still need."""
        fits = self.unfinished()
        return {each for fit in fits for each in (fit.request.recording, *fit.request.held_out)}

    def note_end(self, stored: StoredFit, end: FitEnd) -> StoredFit:
        """Stores the end of a fit; for a fit without report, only the request is kept."""
        ended = replace(stored, end=end)
        self._write_sidecar(ended)
        if end.state != "completed":
            self._journal(stored.id).unlink(missing_ok=True)
        return ended

    def delete(self, fit_id: str) -> None:
        """Deletes a fit permanently; its recordings are kept.

        Raises:
            FitNotFoundError: If there is none.
            RecordingError: If it cannot be deleted.
        """
        self.get(fit_id)
        try:
            self._sidecar(fit_id).unlink()
            shutil.rmtree(self.study_path(fit_id).parent)
        except FileNotFoundError:
            pass
        except OSError as error:
            raise RecordingError(f"cannot delete fit '{fit_id}': {error.strerror}") from error

    def study_path(self, fit_id: str) -> Path:
        """Path of the study of its runs, which exists once the fit is complete."""
        return self._folder / fit_id / "fit.mcap"

    def page_path(self, fit_id: str) -> Path:
        """Path of its report as a page."""
        return self.study_path(fit_id).with_suffix(".html")

    def report_path(self, fit_id: str) -> Path:
        """Path of its report as JSON."""
        return report_path(self.study_path(fit_id))

    def read_report(self, fit_id: str) -> dict[str, Any]:
        """The report of a complete fit as plain values.

        Raises:
            RecordingError: If it is missing or damaged.
        """
        path = self.report_path(fit_id)
        try:
            report = json.loads(path.read_bytes())
        except (OSError, ValueError) as error:
            raise DamagedRecordingError(path.name, "it is not the report of a fit") from error
        return report

    def find_complete(self, fit_id: str) -> FitEnd | None:
        """The end of a fit whose files are all written; its journal is deleted last."""
        if self._journal(fit_id).exists() or not self.page_path(fit_id).exists():
            return None
        return FitEnd(state="completed", evaluations=self.read_report(fit_id)["evaluations"])

    def _journal(self, fit_id: str) -> Path:
        path = self.study_path(fit_id)
        return path.with_name(path.name + JOURNAL_SUFFIX)

    def _find_names(self) -> Iterator[str]:
        return (path.stem for path in self._folder.glob("*.json"))
