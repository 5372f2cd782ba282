"""Recordings that are opened: a stored run, or a file from anywhere."""

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
    """A recording that was opened.

    Attributes:
        name: What it is called: of a stored run its display name, of a file its own.
        recorded: When it was recorded, in words; of a file, when it was last written.
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
        """Its name among the scenarios to choose from; nothing else is called so."""
        return " · ".join(filter(None, (f"recording {self.name}", self.run_id)))


def read_run(path: Path, should_stop: Callable[[], bool] = lambda: False) -> RunResult:
    """The run in a file, which may be still being written (``.part``).

    Args:
        path: The file.
        should_stop: Asked again and again whether nobody needs it any more.

    Raises:
        RecordingError: As `open_replay`.
    """
    if path.suffix == PART_SUFFIX:
        return read_unfinished(path).result
    return read_recording(path, should_stop=should_stop)


def open_replay(
    store: RecordingStore, source: Source, read: Callable[[Path], RunResult] = read_run
) -> Replay:
    """Reads a recording.

    Args:
        store: The stored runs.
        source: What to open. A file that is still being written is read up to its last whole
            chunk; once it is finished, it has left its ``.part`` behind.
        read: Gives the run in a file.

    Raises:
        RecordingNotFoundError: If there is none.
        RecordingError: If it is damaged, or of another program.
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
    """A moment such as ``2026-11-21 10:05 UTC``.

    Args:
        stamp: The moment as ISO 8601; other text is returned, shortened.
    """
    try:
        moment = datetime.fromisoformat(stamp).astimezone(UTC)
    except (ValueError, OverflowError):
        return stamp[:40]
    return f"{moment:%Y-%m-%d %H:%M} UTC"
