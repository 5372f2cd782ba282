"""Recovers recordings that are unfinished or damaged."""

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
    """A recovered recording.

    Attributes:
        path: The new, complete recording.
        result: The run so far.
        lost_bytes: Size of the unusable part of the old file [bytes].
    """

    path: Path
    result: RunResult
    lost_bytes: int


def recover(source: Path, output: Path, *, overwrite: bool = False) -> Recovered:
    """Writes the valid beginning of a file as a complete recording.

    Args:
        source: The damaged or unfinished file; it is not changed.
        output: The recording to write.
        overwrite: Whether to replace an existing file.

    Raises:
        NothingToRecoverError: If the file is complete, or contains no sample.
        RecordingBusyError: If it is being written.
        RecordingError: If it cannot be read, or the output cannot be written.
    """
    if source.suffix == PART_SUFFIX and _is_being_written(source):
        raise RecordingBusyError(source, "another run is writing it")
    if source.suffix != PART_SUFFIX and _is_whole(source):
        raise NothingToRecoverError(source, "it is a complete recording")
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
    """Default name of the recovered recording, in the same folder."""
    name = source.name.removesuffix(PART_SUFFIX)
    stem = name.removesuffix(RECORDING_SUFFIX)
    return source.with_name(name if name != source.name else f"{stem}.recovered{RECORDING_SUFFIX}")


def recover_orphans(folder: Path) -> list[Recovered]:
    """Recovers every unfinished recording in a folder that no process is writing.

    Files without samples are renamed to ``NAME.damaged``. Empty files, originals of recovered runs
    and leftover copies are deleted.
    """
    left = unfinished_files(folder)
    delete_orphaned_copies(left)
    found = (recover_if_orphaned(part) for part in recordings_among(left))
    return [recovered for recovered in found if recovered is not None]


def unfinished_files(folder: Path) -> list[Path]:
    """Files in a folder that are being written, or whose writer was killed."""
    # One pass over names alone, because there may be hundreds of thousands of files.
    names = os.listdir(folder) if folder.is_dir() else ()
    return [folder / name for name in sorted(names) if name.endswith(PART_SUFFIX)]


def delete_orphaned_copies(unfinished: Iterable[Path]) -> None:
    """Deletes leftover files of interrupted recoveries and copies; their originals still exist."""
    for copy in unfinished:
        if copy.name.endswith(_COPIES):
            _delete_if_orphaned(copy)


def recordings_among(unfinished: Iterable[Path]) -> list[Path]:
    """Selects the unfinished recordings."""
    return [part for part in unfinished if part.name.endswith(RECORDING_PART)]


def recover_if_orphaned(part: Path) -> Recovered | None:
    """Calls `recover_orphan`, and logs a warning in place of an error."""
    try:
        return recover_orphan(part)
    except (OSError, RecordingError) as error:
        _logger.warning("'%s' could not be recovered: %s", part, error)
    return None


def recover_orphan(part: Path) -> Recovered | None:
    """Recovers one file from `recordings_among`.

    Args:
        part: The unfinished file, which is deleted after the recovered recording is on disk.

    Returns:
        The recovered recording; None if the file is being written or empty, or was already
        recovered.

    Raises:
        NothingToRecoverError: If it contains no sample; it is then renamed to ``NAME.damaged``.
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
    """Converts an unfinished file to a recording with its time stamp, then deletes it.

    An intact file is not changed if the disk is full or a newer program wrote it.
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
    """``NAME.damaged``, with a number if that exists."""
    wanted = path.with_name(path.name + DAMAGED_SUFFIX)
    others = (wanted.with_name(f"{wanted.name}.{number}") for number in count(1))
    return next(name for name in chain([wanted], others) if not name.exists())


def _is_being_written(part: Path) -> bool:
    """Whether another process is writing a file; False if it does not exist."""
    try:
        with part.open("rb") as stream:
            return not try_lock(stream)
    except OSError:
        return False


def _was_recovered(part: Path) -> bool:
    """Whether the recording exists already, with all samples of the unfinished file."""
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
