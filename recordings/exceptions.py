"""Errors of recordings: each takes the facts and says in one sentence what is wrong."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Self

from slipgrasp.core.exceptions import SlipgraspError

if TYPE_CHECKING:
    from slipgrasp.core.run.claims import Contradiction


class RecordingError(SlipgraspError):
    """Base of everything that can go wrong with a recording."""


class RecordingNotFoundError(RecordingError):
    """There is no such recording."""

    def __init__(self, name: str) -> None:
        super().__init__(f"there is no recording '{_shown(name)}'")


class RecordingExistsError(RecordingError):
    """The file to be written is already there."""

    def __init__(self, path: Path) -> None:
        self.path = path
        super().__init__(
            f"'{_shown(path)}' already exists; it is replaced only on request (--force)"
        )


class RecordingBusyError(RecordingError):
    """A file of that name is being written, or was left by a writer that was killed."""

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
            f"'{_shown(name)}' holds measured data, and no run; 'slipgrasp diff' compares it with "
            "a run, 'slipgrasp fit' explains it, 'slipgrasp export' writes it as a table"
        )


class NewerRecordingError(RecordingError):
    """The file has a format that this version of the program does not know yet."""

    def __init__(self, name: str, version: int, known: int) -> None:
        super().__init__(
            f"'{_shown(name)}' has recording format {version}, this program reads up to {known}; "
            "install a newer slipgrasp"
        )


class DamagedRecordingError(RecordingError):
    """The file was a recording, but parts of it are missing or changed."""

    def __init__(self, name: str, finding: str) -> None:
        super().__init__(f"the recording '{_shown(name)}' is damaged: {finding}")


class AlteredRecordingError(DamagedRecordingError):
    """Every checksum fits, yet the file does not hold what was written into it."""

    def __init__(self, name: str) -> None:
        super().__init__(name, "it was altered: its samples or documents do not fit their hash")


class ContradictoryRecordingError(DamagedRecordingError):
    """What the file states of the run is not what its own samples give."""

    def __init__(self, name: str, found: Sequence[Contradiction]) -> None:
        more = f", and {len(found) - 1} more" if len(found) > 1 else ""
        super().__init__(name, f"it contradicts itself: {found[0]}{more}")


class NothingToRecoverError(RecordingError):
    """The file is whole, or holds no sample that could be kept."""

    def __init__(self, name: str | Path, finding: str) -> None:
        super().__init__(f"there is nothing to recover from '{_shown(name)}': {finding}")


class AnnotationError(RecordingError):
    """A name, notes or tags beyond what may be written about a run."""

    def __init__(self, field: str, finding: str) -> None:
        self.field = field
        super().__init__(f"{field}: {finding}")


class QueryError(RecordingError):
    """A search of the recordings that names something unknown, or cannot be read.

    Attributes:
        value: What was asked for.
        known: What can be asked for instead; empty where there is no list of it.
    """

    def __init__(self, value: str, finding: str, known: Sequence[str] = ()) -> None:
        self.value = value
        self.known = tuple(known)
        super().__init__(finding)


class RecordingChangedError(RecordingError):
    """What is stored of a run is no longer what the change was made for."""

    def __init__(self, run_id: str) -> None:
        super().__init__(f"run '{_shown(run_id)}' was changed meanwhile; read it again")


class UploadError(RecordingError):
    """A file that was sent is no recording that can be kept."""


class StorageFullError(RecordingError):
    """Another recording exceeds the quota of the folder, or the space on its disk."""

    @classmethod
    def over_quota(cls, folder: Path, used: int, quota: int, incoming: int = 0) -> Self:
        """The files of the folder take as much as they may, or would with what is to come."""
        wanted = f"{_size(incoming)} more" if incoming else "another"
        return cls(
            f"the recordings in '{_shown(folder)}' take {_size(used)} of the {_size(quota)} they "
            f"may take and there is no space for {wanted}; delete some, or raise the quota"
        )

    @classmethod
    def low_disk(cls, folder: Path, free: int, floor: int, incoming: int = 0) -> Self:
        """The disk would be left with less than must stay free."""
        wanted = f", with {_size(incoming)} to come" if incoming else ""
        return cls(
            f"the disk of '{_shown(folder)}' has {_size(free)} free and {_size(floor)} must stay "
            f"free{wanted}; delete recordings or other files"
        )


class FolderInUseError(RecordingError):
    """Another service keeps its recordings in the same folder."""

    def __init__(self, folder: Path, owner: str) -> None:
        by = f" (process {owner})" if owner else ""
        super().__init__(
            f"another service keeps its recordings in '{_shown(folder)}'{by}; stop it, or choose "
            "another folder with --data-dir"
        )


def _size(num_bytes: int) -> str:
    for unit, factor in (("TB", 10**12), ("GB", 10**9), ("MB", 10**6), ("kB", 10**3)):
        if num_bytes >= factor:
            return f"{num_bytes / factor:.4g} {unit}"
    return f"{num_bytes} bytes"


def told_within(error: Exception, folder: Path) -> str:
    """What an error says, to those who need not know where a folder is.

    Args:
        error: The error.
        folder: The folder; files in it are called by their path from there.
    """
    shown = _shown(folder)
    told = str(error).replace(f"'{shown}'", "the data folder")
    return told.replace(f"'{shown}{os.sep}", "'")


def _shown(name: str | Path) -> str:
    return "".join(c if c.isprintable() else "?" for c in str(name)[:500])
