"""Opened recordings: a stored run, or a file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.exceptions import RecordingNotFoundError
from slipgrasp.recordings.file.atomic_file import PART_SUFFIX
from slipgrasp.recordings.file.reader import read_recording, read_unfinished
from slipgrasp.recordings.measured.recording import MeasuredRecording
from slipgrasp.recordings.store.store import RecordingStore

Source = str | Path
"""The id of a stored run, or a file."""


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Replay:
    """An opened recording.

    Attributes:
        name: Display name of a stored run, or name of a file.
        recorded: Time of recording as text; for a file, its modification time.
        result: The run.
        run_id: Its id in the store, empty for a file.
        is_unfinished: Whether it is still being written, or was never finished.
        measured: The measured data that it holds; None if it holds a run.
    """

    name: str
    recorded: str
    result: RunResult
    run_id: str = ""
    is_unfinished: bool = False
    measured: MeasuredRecording | None = None

    @property
    def label(self) -> str:
        """Its unique name in the list of scenarios."""
        return " · ".join(filter(None, (f"recording {self.name}", self.run_id)))


def read_run(path: Path, should_stop: Callable[[], bool] = lambda: False) -> RunResult:
    """Reads the run in a file, which may still be written (``.part``).

    Args:
        path: The file.
        should_stop: Called repeatedly; True stops the reading.

    Raises:
        RecordingError: As in `open_replay`.
    """
    if path.suffix == PART_SUFFIX:
        return read_unfinished(path).result
    return read_recording(path, should_stop=should_stop)


def open_replay(
    store: RecordingStore, source: Source, read: Callable[[Path], RunResult] = read_run
) -> Replay:
    """Reads a recording.

    Args:
        store: Store of the runs.
        source: Recording to open. An unfinished file is read up to its last complete chunk; when it
            is finished, its name no longer ends in ``.part``.
        read: Reads the run in a file.

    Raises:
        RecordingNotFoundError: If it does not exist.
        RecordingError: If it is damaged, or from another program.
    """
    if isinstance(source, str):
        stored = store.get(source)
        recorded = moment_words(stored.created)
        return Replay(stored.display_name, recorded, read(stored.path), stored.id)
    if source.suffix == PART_SUFFIX:
        try:
            result = read(source)
            return Replay(source.name, _last_written(source), result, is_unfinished=True)
        except RecordingNotFoundError:
            source = source.with_suffix("")
    result = read(source)
    return Replay(source.name, _last_written(source), result)


def _last_written(path: Path) -> str:
    try:
        seconds = path.stat().st_mtime
    except FileNotFoundError:
        raise RecordingNotFoundError(str(path)) from None
    return moment_words(datetime.fromtimestamp(seconds, UTC).isoformat())


def moment_words(stamp: str) -> str:
    """Formats a time, such as ``2026-11-21 10:05 UTC``.

    Args:
        stamp: Time in ISO 8601; other text is returned, shortened.
    """
    try:
        moment = datetime.fromisoformat(stamp).astimezone(UTC)
    except (ValueError, OverflowError):
        return stamp[:40]
    return f"{moment:%Y-%m-%d %H:%M} UTC"
