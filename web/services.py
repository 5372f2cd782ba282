"""What a session uses of the server."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.server.runs.service import RunService
from slipgrasp.server.studies.service import StudyService
from slipgrasp.web.model.pacing import FramePacer
from slipgrasp.web.page.session_directory import SessionDirectory
from slipgrasp.web.workers.saved_runs import SavedRuns


@dataclass(frozen=True, slots=True, eq=False)
class Services:
    """What every session of a dashboard shares.

    Attributes:
        runs: Simulates and saves.
        saved: Knows which runs are kept already.
        studies: Runs studies, one at a time.
        directory: Knows every session by its key.
        pacer: Lets the sessions that play share the processor.
    """

    runs: RunService
    saved: SavedRuns
    studies: StudyService
    directory: SessionDirectory
    pacer: FramePacer
