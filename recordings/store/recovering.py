"""Recovery of a run of a folder, as a task for another process."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from slipgrasp.recordings.exceptions import RecordingError
from slipgrasp.recordings.file.recovery import Recovered, recover_orphan
from slipgrasp.recordings.store.description import Description
from slipgrasp.recordings.store.run_files import RunFiles


class Recovery(NamedTuple):
    """Result of recovering an unfinished recording.

    Attributes:
        path: The recovered recording; empty if there is none.
        fault: Reason for the failure; empty if there is nothing to report.
    """

    path: str = ""
    fault: str = ""


def recover_run(part: Path, _should_stop: Callable[[], bool]) -> Recovery:
    """Recovers a run and describes it, so that it need not be read again.

    Args:
        part: A file from `slipgrasp.recordings.file.recovery.recordings_among`.
    """
    try:
        recovered = recover_orphan(part)
    except (OSError, RecordingError) as error:
        return Recovery(fault=str(error))
    if recovered is None:
        return Recovery()
    _describe(recovered)
    return Recovery(path=str(recovered.path))


def _describe(recovered: Recovered) -> None:
    """Writes the sidecar if possible; otherwise the recording suffices."""
    files, run_id = RunFiles(recovered.path.parent), recovered.path.name.partition(".")[0]
    with suppress(RecordingError):
        description = Description.from_result(recovered.result)
        known = files.read_sidecar(run_id)
        files.write_sidecar(files.put_together(run_id, known, description))
