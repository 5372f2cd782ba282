"""Errors about recordings, with messages of one sentence."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Self

from slipgrasp.core.exceptions import SlipgraspError

if TYPE_CHECKING:
    from slipgrasp.core.run.claims import Contradiction


class RecordingError(SlipgraspError):
    """Base class of errors about recordings."""


class RecordingNotFoundError(RecordingError):
    """The recording does not exist."""

    noun = "recording"

    def __init__(self, name: str) -> None:
        super().__init__(f"there is no {self.noun} '{_shown(name)}'")


class RecordingExistsError(RecordingError):
    """The output file exists."""

    def __init__(self, path: Path) -> None:
        self.path = path
        super().__init__(f"'{_shown(path)}' already exists; --force replaces it")


class RecordingBusyError(RecordingError):
    """The file is being written, or is unfinished after its writer was killed."""

    def __init__(self, path: Path, cause: str) -> None:
        self.path = path
        super().__init__(f"cannot write '{_shown(path)}': {cause}")


class RecordingWriteError(RecordingError):
    """The file cannot be written: disk, permission, or numbers that are not finite."""

    def __init__(self, path: Path, cause: str) -> None:
        self.path = path
        super().__init__(f"cannot write '{_shown(path)}': {cause}")


class ForeignRecordingError(RecordingError):
    """The file is not a recording of this program."""

    def __init__(self, name: str, finding: str) -> None:
        super().__init__(f"'{_shown(name)}' is not a slipgrasp recording: {finding}")


class NoRunError(RecordingError):
    """The recording holds measured data where a run is needed."""

    def __init__(self, name: str) -> None:
        super().__init__(
            f"'{_shown(name)}' contains measured data, not a run; 'slipgrasp diff' compares it "
            "with a run, 'slipgrasp fit' fits a scenario to it, 'slipgrasp export' writes it as a "
            "table"
        )


class NewerRecordingError(RecordingError):
    """The file has a newer format than this version of the program supports."""

    def __init__(self, name: str, version: int, known: int) -> None:
        super().__init__(
            f"'{_shown(name)}' has recording format {version}, this program reads up to {known}; "
            "install a newer slipgrasp"
        )


class DamagedRecordingError(RecordingError):
    """Parts of the recording are missing or changed."""

    def __init__(self, name: str, finding: str) -> None:
        super().__init__(f"the recording '{_shown(name)}' is damaged: {finding}")


class AlteredRecordingError(DamagedRecordingError):
    """All checksums are correct, but the content of the file was changed."""

    def __init__(self, name: str) -> None:
        super().__init__(name, "it was altered: its samples or documents do not match their hash")


class ContradictoryRecordingError(DamagedRecordingError):
    """Statements in the file contradict its samples."""

    def __init__(self, name: str, found: Sequence[Contradiction]) -> None:
        more = f", and {len(found) - 1} more" if len(found) > 1 else ""
        super().__init__(name, f"it contradicts itself: {found[0]}{more}")


class NothingToRecoverError(RecordingError):
    """The file is complete, or contains no recoverable sample."""

    def __init__(self, name: str | Path, finding: str) -> None:
        super().__init__(f"there is nothing to recover from '{_shown(name)}': {finding}")


class AnnotationError(RecordingError):
    """A name, notes or tags of a run that exceed their limits."""

    def __init__(self, field: str, finding: str) -> None:
        self.field = field
        super().__init__(f"{field}: {finding}")


class QueryError(RecordingError):
    """An invalid search of the recordings.

    Attributes:
        value: Invalid value.
        known: Allowed values; empty if there is no list.
    """

    def __init__(self, value: str, finding: str, known: Sequence[str] = ()) -> None:
        self.value = value
        self.known = tuple(known)
        super().__init__(finding)


class RecordingChangedError(RecordingError):
    """A run was changed since the client read it."""

    def __init__(self, run_id: str) -> None:
        super().__init__(f"run '{_shown(run_id)}' was changed meanwhile; read it again")


class UploadError(RecordingError):
    """An uploaded file is not a valid recording."""


class StorageFullError(RecordingError):
    """Another recording would exceed the quota of the folder, or the space on its disk."""

    @classmethod
    def over_quota(cls, folder: Path, used: int, quota: int, incoming: int = 0) -> Self:
        """The files of the folder reach their quota, or would with the next recording."""
        wanted = f"{_size(incoming)} more" if incoming else "another"
        return cls(
            f"the recordings in '{_shown(folder)}' use {_size(used)} of their quota of "
            f"{_size(quota)}, and there is no space for {wanted}; delete some, or raise the quota"
        )

    @classmethod
    def low_disk(cls, folder: Path, free: int, floor: int, incoming: int = 0) -> Self:
        """Too little free space would be left on the disk."""
        wanted = f", with {_size(incoming)} to be added" if incoming else ""
        return cls(
            f"the disk of '{_shown(folder)}' has {_size(free)} free and {_size(floor)} must stay "
            f"free{wanted}; delete recordings or other files"
        )


class FolderInUseError(RecordingError):
    """Another service uses the same folder."""

    def __init__(self, folder: Path, owner: str) -> None:
        by = f" (process {owner})" if owner else ""
        super().__init__(
            f"another service uses the folder '{_shown(folder)}'{by}; stop it, or choose "
            "another folder with --data-dir"
        )


def _size(num_bytes: int) -> str:
    for unit, factor in (("TB", 10**12), ("GB", 10**9), ("MB", 10**6), ("kB", 10**3)):
        if num_bytes >= factor:
            return f"{num_bytes / factor:.4g} {unit}"
    return f"{num_bytes} bytes"


def told_within(error: Exception, folder: Path) -> str:
    """The message of an error without the location of the data folder.

    Args:
        error: The error.
        folder: The folder; paths in it are shown relative to it.
    """
    shown = _shown(folder)
    told = str(error).replace(f"'{shown}'", "the data folder")
    return told.replace(f"'{shown}{os.sep}", "'")


def _shown(name: str | Path) -> str:
    return "".join(c if c.isprintable() else "?" for c in str(name)[:500])
