"""Keeping what is left of recordings whose writer was killed, or whose file was cut off."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, count
from pathlib import Path

from slipgrasp.core.file_lock import try_lock
from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.exceptions import (
    DamagedRecordingError,
    ForeignRecordingError,
    NothingToRecoverError,
    RecordingBusyError,
    RecordingError,
)
from slipgrasp.recordings.file.atomic_file import PART_SUFFIX, RECORDING_PART, lock_in_place
from slipgrasp.recordings.file.reader import read_as_stated, read_unfinished
from slipgrasp.recordings.file.writer import REGULAR_SUFFIX, write_recording

RECORDING_SUFFIX = ".mcap"
DAMAGED_SUFFIX = ".damaged"
RECOVERING_SUFFIX = ".recovering.part"

_COPIES = tuple(RECORDING_SUFFIX + suffix for suffix in (RECOVERING_SUFFIX, REGULAR_SUFFIX))

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class Recovered:
    """What was kept of a file.

    Attributes:
        path: The new, whole recording.
        result: The run so far.
        lost_bytes: How much of the old file could not be used.
    """

    path: Path
    result: RunResult
    lost_bytes: int


def recover(source: Path, output: Path, *, overwrite: bool = False) -> Recovered:
    """Writes what a file holds up to its first missing or damaged byte as a whole recording.

    Args:
        source: The damaged or unfinished file; it stays as it is.
        output: The recording to write.
        overwrite: Whether an existing file is replaced.

    Raises:
        NothingToRecoverError: If the file is whole, or holds no sample.
        RecordingBusyError: If it is being written right now.
        RecordingError: If it cannot be read at all, or the output cannot be written.
    """
    if source.suffix == PART_SUFFIX and _is_being_written(source):
        raise RecordingBusyError(source, "another run is writing it right now")
    if source.suffix != PART_SUFFIX and _is_whole(source):
        raise NothingToRecoverError(source, "it is a whole recording")
    recovered = _recover(source, output, overwrite=overwrite)
    _delete_if_orphaned(recovered_name(source).with_name(f"{output.name}{REGULAR_SUFFIX}"))
    return recovered


def _recover(source: Path, output: Path, *, overwrite: bool) -> Recovered:
    unfinished = read_unfinished(source)
    write_recording(
        unfinished.result,
        output,
        overwrite=overwrite,
        display_rate=unfinished.display_rate,
        part_suffix=RECOVERING_SUFFIX,
    )
    return Recovered(output, unfinished.result, unfinished.unread_bytes)


def recovered_name(source: Path) -> Path:
    """Where the rest of a file goes unless told otherwise: beside it."""
    name = source.name.removesuffix(PART_SUFFIX)
    stem = name.removesuffix(RECORDING_SUFFIX)
    return source.with_name(name if name != source.name else f"{stem}.recovered{RECORDING_SUFFIX}")


def recover_orphans(folder: Path) -> list[Recovered]:
    """Recovers every recording in a folder that nobody writes any more.

    What holds no sample is kept as ``NAME.damaged``; nothing is deleted but empty files and what
    another file holds completely.
    """
    left = unfinished_files(folder)
    delete_orphaned_copies(left)
    found = (recover_if_orphaned(part) for part in recordings_among(left))
    return [recovered for recovered in found if recovered is not None]


def unfinished_files(folder: Path) -> list[Path]:
    """Files in a folder that are being written, or were when their writer was killed."""
    # One pass, and no path for the others: there may be hundreds of thousands.
    names = os.listdir(folder) if folder.is_dir() else ()
    return [folder / name for name in sorted(names) if name.endswith(PART_SUFFIX)]


def delete_orphaned_copies(unfinished: Iterable[Path]) -> None:
    """Deletes what is left of recoveries and regular copies; what they were made of is there."""
    for copy in unfinished:
        if copy.name.endswith(_COPIES):
            _delete_if_orphaned(copy)


def recordings_among(unfinished: Iterable[Path]) -> list[Path]:
    """Those of the unfinished files that are recordings themselves."""
    return [part for part in unfinished if part.name.endswith(RECORDING_PART)]


def recover_if_orphaned(part: Path) -> Recovered | None:
    """What `recover_orphan` does, with a warning in the log in place of an error."""
    try:
        return recover_orphan(part)
    except (OSError, RecordingError) as error:
        _logger.warning("'%s' could not be recovered: %s", part, error)
    return None


def recover_orphan(part: Path) -> Recovered | None:
    """Recovers one file of `recordings_among`.

    Args:
        part: The file. It goes once what it holds is on disk under its own name.

    Returns:
        What was kept; None if somebody writes it, if it is empty, or if a recovery was killed
        after its end.

    Raises:
        NothingToRecoverError: If it holds no sample; it is then kept as ``NAME.damaged``.
        RecordingError: If it cannot be read, or its recording cannot be written.
        OSError: If the disk fails.
    """
    if part.is_symlink():
        return None
    with part.open("rb") as stream:
        if not lock_in_place(stream, part):
            return None
        if part.stat().st_size and not _was_recovered(part):
            return _recover_orphan(part)
        part.unlink()
    return None


def _recover_orphan(part: Path) -> Recovered:
    """Turns a part into a recording of its age; the part goes once that is on disk.

    A part that is not at fault, because the disk is full or a newer program wrote it, stays.
    """
    times = part.stat()
    try:
        recovered = _recover(part, recovered_name(part), overwrite=False)
    except (DamagedRecordingError, ForeignRecordingError, NothingToRecoverError):
        part.rename(_free_name(part.with_name(part.name.removesuffix(PART_SUFFIX))))
        raise
    os.utime(recovered.path, ns=(times.st_atime_ns, times.st_mtime_ns))
    part.unlink()
    return recovered


def _free_name(path: Path) -> Path:
    """``NAME.damaged``, or with a number if there is one already."""
    wanted = path.with_name(path.name + DAMAGED_SUFFIX)
    others = (wanted.with_name(f"{wanted.name}.{number}") for number in count(1))
    return next(name for name in chain([wanted], others) if not name.exists())


def _is_being_written(part: Path) -> bool:
    """Whether another writer holds a file; False if there is none."""
    try:
        with part.open("rb") as stream:
            return not try_lock(stream)
    except OSError:
        return False


def _was_recovered(part: Path) -> bool:
    """Whether the recording that it would become is there already, with all its samples."""
    recording = recovered_name(part)
    if not recording.exists():
        return False
    kept, left = read_as_stated(recording), read_unfinished(part).result
    rows = left.trace.to_rows()
    return (
        kept.scenario == left.scenario
        and kept.trace.to_rows()[: len(rows)].tobytes() == rows.tobytes()
    )


def _delete_if_orphaned(copy: Path) -> None:
    with suppress(OSError), copy.open("rb") as stream:
        if lock_in_place(stream, copy):
            copy.unlink()


def _is_whole(path: Path) -> bool:
    try:
        read_as_stated(path)
    except RecordingError:
        return False
    return True
