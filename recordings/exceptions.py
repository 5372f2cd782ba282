"""Errors of recordings: each takes the facts and says in one sentence what is wrong."""

from __future__ import annotations

from pathlib import Path

from core.exceptions import SlipgraspError

__all__ = [
    "AlteredRecordingError",
    "DamagedRecordingError",
    "ForeignRecordingError",
    "NewerRecordingError",
    "NothingToRecoverError",
    "RecordingError",
    "RecordingExistsError",
    "RecordingNotFoundError",
    "RecordingWriteError",
]


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


class RecordingWriteError(RecordingError):
    """The file cannot be written: disk, permission, or numbers that are not finite."""

    def __init__(self, path: Path, cause: str) -> None:
        self.path = path
        super().__init__(f"cannot write '{_shown(path)}': {cause}")


class ForeignRecordingError(RecordingError):
    """The file is not a recording of this program."""

    def __init__(self, name: str, finding: str) -> None:
        super().__init__(f"'{_shown(name)}' is not a slipgrasp recording: {finding}")


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


class NothingToRecoverError(RecordingError):
    """The file is whole, or holds no sample that could be kept."""

    def __init__(self, name: str | Path, finding: str) -> None:
        super().__init__(f"there is nothing to recover from '{_shown(name)}': {finding}")


def _shown(name: str | Path) -> str:
    return "".join(c if c.isprintable() else "?" for c in str(name)[:500])
