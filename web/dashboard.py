"""The dashboard: a viewer server, and one session per connected browser."""

from __future__ import annotations

import threading
import warnings

import viser

from slipgrasp.server.fits.service import FitService
from slipgrasp.server.runs.service import RunService
from slipgrasp.server.studies.service import StudyService
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.model.given_hand import NO_HAND, GivenHand
from slipgrasp.web.model.replay import Source
from slipgrasp.web.page.session_directory import SessionDirectory
from slipgrasp.web.reducers.frame_pacing import FramePacer
from slipgrasp.web.scene.camera import FIELD_OF_VIEW, OPENING
from slipgrasp.web.screen import apply_theme
from slipgrasp.web.session import Services, Session
from slipgrasp.web.standalone.page_file import write_usual_page
from slipgrasp.web.workers.live_runs import LiveRuns
from slipgrasp.web.workers.open_recordings import OpenRecordings
from slipgrasp.web.workers.saved_runs import SavedRuns

_CLOSING_TIME = 5.0


class Dashboard:
    """Serves the dashboard on a separate loopback port, behind a relay.

    Args:
        runs: Simulates and saves.
        studies: Runs studies.
        fits: Fits recordings.
        first: Recording that every page shows first; a run if None.
        hand: Hand with which the dashboard is started.

    Attributes:
        directory: Finds the session of a page.
        recordings: Recordings that pages show.
    """

    def __init__(
        self,
        runs: RunService,
        studies: StudyService,
        fits: FitService,
        first: Source | None = None,
        hand: GivenHand = NO_HAND,
    ) -> None:
        # A viewer may disconnect within a frame; viser drops the rest and warns each time.
        warnings.filterwarnings("ignore", message="Queued a .* on a closed connection")
        self.directory = SessionDirectory()
        self.recordings = OpenRecordings(runs.store, runs.memory)
        self._services = Services(
            runs,
            LiveRuns(runs),
            SavedRuns(runs),
            self.recordings,
            studies,
            fits,
            self.directory,
            FramePacer(),
            write_usual_page,
            hand,
        )
        self._first = first
        self._sessions: dict[int, Session] = {}
        self._lock = threading.Lock()
        self._server = ViewerServer("slipgrasp")
        apply_theme(self._server.gui, dark=False)
        # Until the first run is shown; its scene then sets the camera.
        self._server.initial_camera.fov = FIELD_OF_VIEW
        self._server.initial_camera.position = OPENING.position
        self._server.initial_camera.look_at = OPENING.look_at
        self._server.on_client_connect(self._open)
        self._server.on_client_disconnect(self._close)

    @property
    def port(self) -> int:
        """The loopback port of the relay."""
        return self._server.get_port()

    @property
    def num_sessions(self) -> int:
        """The number of connected browsers."""
        with self._lock:
            return len(self._sessions)

    def close(self) -> None:
        """Ends every session, and then the server."""
        with self._lock:
            sessions = list(self._sessions.values())
            self._sessions.clear()
        for session in sessions:
            session.close()
        for session in sessions:
            session.join(_CLOSING_TIME)
        self._server.stop()

    # Both run in the viewer server's event loop, so that a viewer that disconnects immediately is
    # not closed before it is opened.
    async def _open(self, client: viser.ClientHandle) -> None:
        session = Session(client, self._services, self._first)
        with self._lock:
            self._sessions[client.client_id] = session
        session.start()

    async def _close(self, client: viser.ClientHandle) -> None:
        with self._lock:
            session = self._sessions.pop(client.client_id, None)
        if session is not None:
            session.close()
