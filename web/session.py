"""One user's session: a loop that passes intents to reducers, and draws the resulting state.

Only this loop changes the state of the session; callbacks and workers send intents.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain

import viser

from slipgrasp.server.fits.service import FitService
from slipgrasp.server.runs.service import RunService
from slipgrasp.server.studies.service import StudyService
from slipgrasp.server.viewer.server import has_unsent
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.export import ExportFile
from slipgrasp.web.model.given_hand import GivenHand
from slipgrasp.web.model.intents.intent import Close, Intent
from slipgrasp.web.model.intents.mailbox import Mailbox
from slipgrasp.web.model.playback import WindowChoice
from slipgrasp.web.model.replay import Source
from slipgrasp.web.model.view import RunStage, RunStatus, ViewState
from slipgrasp.web.page.session_directory import SessionDirectory
from slipgrasp.web.reducers.charts import ChartsReducer
from slipgrasp.web.reducers.compare import CompareReducer
from slipgrasp.web.reducers.export import ExportReducer, WritePage
from slipgrasp.web.reducers.fit import FitReducer
from slipgrasp.web.reducers.frame_pacing import FramePacer
from slipgrasp.web.reducers.heavier import HeavierReducer
from slipgrasp.web.reducers.hints import HintsReducer
from slipgrasp.web.reducers.laws import LawsReducer
from slipgrasp.web.reducers.link import LinkReducer
from slipgrasp.web.reducers.picture import PictureReducer
from slipgrasp.web.reducers.playback import PlaybackReducer
from slipgrasp.web.reducers.premises import PremisesReducer
from slipgrasp.web.reducers.recordings import RecordingsReducer
from slipgrasp.web.reducers.reducer import Reducer
from slipgrasp.web.reducers.runs import RunReducer
from slipgrasp.web.reducers.scenario import ScenarioReducer
from slipgrasp.web.reducers.selection import SelectionReducer
from slipgrasp.web.reducers.study import StudyReducer
from slipgrasp.web.scene.camera import FrontCamera
from slipgrasp.web.screen import Screen
from slipgrasp.web.workers.live_runs import LiveRuns
from slipgrasp.web.workers.open_recordings import OpenRecordings
from slipgrasp.web.workers.saved_runs import SavedRuns
from slipgrasp.web.workers.worker import QueueWorker

FIRST_PRESET = "paper-case-1"
"""The preset of new sessions; its object stays held when a visitor pulls it."""
_TIME_TO_LEAVE = 1.0
_HEAD_START = 0.002  # [s]
_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class Services:
    """Services that all sessions of a dashboard share.

    Attributes:
        runs: Simulates and stores runs.
        live: Simulates runs for pages; pages with equal scenarios share one run.
        saved: Store of the runs.
        recordings: Opens recordings, and accounts for their memory.
        studies: Runs studies, one at a time.
        fits: Fits recordings, in the same queue.
        directory: All sessions by their keys.
        pacer: Shares the processor among playing sessions.
        write_page: Writes a run as a live page.
        hand: The hand with which the dashboard was started.
    """

    runs: RunService
    live: LiveRuns
    saved: SavedRuns
    recordings: OpenRecordings
    studies: StudyService
    fits: FitService
    directory: SessionDirectory
    pacer: FramePacer
    write_page: WritePage
    hand: GivenHand


class Session:
    """The session of one connected browser.

    Args:
        client: The viewer.
        services: Services that it shares with other sessions.
        first: The recording to show first; a run if None.
    """

    def __init__(
        self, client: viser.ClientHandle, services: Services, first: Source | None = None
    ) -> None:
        self._client = client
        self._mailbox = Mailbox()
        self._pacer = services.pacer
        self._directory = services.directory
        self._key = self._directory.enter(self._mailbox.send)
        self._camera = FrontCamera(client.camera)
        self._hand = services.hand
        self._view = _first_view(first, self._hand)
        self._drawn: ViewState | None = None
        self._reducers: Sequence[Reducer] = (
            ScenarioReducer(),
            SelectionReducer(),
            RunReducer(
                services.live,
                services.saved,
                self._mailbox.send,
                simulates_first=first is None,
            ),
            RecordingsReducer(services.runs.store, services.recordings, self._mailbox.send, first),
            CompareReducer(services.recordings, self._mailbox.send),
            PictureReducer(self._camera),
            PlaybackReducer(services.pacer, partial(has_unsent, client)),
            LinkReducer(self._mailbox.send),
            ChartsReducer(),
            LawsReducer(services.runs, self._mailbox.send),
            HeavierReducer(services.runs, self._mailbox.send),
            HintsReducer(services.runs, self._mailbox.send),
            PremisesReducer(self._mailbox.send),
            ExportReducer(
                services.recordings, self._mailbox.send, self._deliver, services.write_page
            ),
            FitReducer(services.fits, self._mailbox.send),
            StudyReducer(services.studies, services.recordings.memory, self._mailbox.send),
        )
        self._gone = threading.Event()
        self._thread = threading.Thread(
            target=self._live, name=f"session-{client.client_id}", daemon=True
        )

    def start(self) -> None:
        """Starts the loop in a separate thread."""
        self._thread.start()

    def close(self) -> None:
        """Asks the session to end; a save in progress is finished first."""
        self._gone.set()
        self._mailbox.send(Close())

    def join(self, timeout: float) -> None:
        """Waits for the thread and each worker of the session, at most `timeout` each [s]."""
        self._thread.join(timeout)
        for worker in self._workers():
            worker.join(timeout)

    def _deliver(self, file: ExportFile) -> None:
        """Sends a file to the browser to be saved."""
        self._client.send_file_download(file.name, file.content, save_immediately=True)

    def _live(self) -> None:
        try:
            self._loop(self._open_screen())
        except Exception:
            # Top level of the thread: a broken session must not end silently, nor affect others.
            # It is no error if the viewer disconnects during a frame. The page detects and
            # reports a lost session.
            if not self._gone.wait(_TIME_TO_LEAVE):
                _logger.exception("session %d ended with an error", self._client.client_id)
        finally:
            self._directory.remove(self._key)
            for worker in self._workers():
                worker.close()

    def _open_screen(self) -> Screen:
        send, meshes = self._mailbox.send, self._hand.meshes
        return Screen(self._client, self._camera, self._view, send, self._key, meshes)

    def _loop(self, screen: Screen) -> None:
        for reducer in self._reducers:
            self._view = reducer.start(self._view)
        while True:
            intents = self._mailbox.receive(self._wait())
            for intent in intents:
                self._take(intent)
            if any(isinstance(intent, Close) for intent in intents):
                return
            now = time.monotonic()
            for reducer in self._reducers:
                self._view = reducer.pass_time(now, self._view)
            is_due = self._drawn is None or self._has_new_run()
            if is_due or not any(reducer.expects_answer(now) for reducer in self._reducers):
                self._draw(screen, now)

    def _draw(self, screen: Screen, now: float) -> None:
        playing = self._view.playback is not None and self._view.playback.playing
        if playing and self._view is self._drawn:
            return  # The next frame follows soon, and updates everything that depends on the time.
        first = self._drawn_first(screen)
        self._drawn = self._view
        began = time.thread_time()
        for draw in first:
            self._send_drawing(draw)
            # Lets the sending loop take the interpreter lock before the rest is drawn.
            time.sleep(_HEAD_START)
        self._send_drawing(screen.update)
        if playing:
            self._pacer.drew(self._client.client_id, time.thread_time() - began, now)

    def _drawn_first(self, screen: Screen) -> tuple[Callable[[ViewState], None], ...]:
        """The drawings that are sent before the rest: of a new run, or of a moved play head."""
        if self._has_new_run():
            return (screen.update_run,)
        before, playback = self._drawn, self._view.playback
        has_moved = before is not None and before.playback is not playback
        # During playback, the next frame follows soon.
        is_paused = playback is not None and not playback.playing
        return (screen.update_scene,) if has_moved and is_paused else ()

    def _has_new_run(self) -> bool:
        """Whether the run to be shown has not been drawn yet."""
        drawn = None if self._drawn is None else self._drawn.shown
        return self._view.shown is not None and self._view.shown is not drawn

    def _send_drawing(self, draw: Callable[[ViewState], None]) -> None:
        """Sends a drawing of the view in one batch.

        Otherwise the sending loop would take the interpreter lock at every message, and wait for
        more after the first.
        """
        with self._client.atomic():
            draw(self._view)
        self._client.flush()

    def _take(self, intent: Intent) -> None:
        for reducer in self._reducers:
            self._view = reducer.reduce(intent, self._view)

    def _workers(self) -> Iterator[QueueWorker]:
        return chain.from_iterable(reducer.workers for reducer in self._reducers)

    def _wait(self) -> float | None:
        """The shortest time until a reducer needs the next tick; None if none does."""
        now = time.monotonic()
        waits = [reducer.wait(now, self._view) for reducer in self._reducers]
        return min((wait for wait in waits if wait is not None), default=None)


def _first_view(first: Source | None, hand: GivenHand) -> ViewState:
    return ViewState(
        draft=hand.draft or Draft.from_preset(FIRST_PRESET),
        status=RunStatus(RunStage.SIMULATING if first is None else RunStage.OPENING),
        choice=WindowChoice.SLIP,
        from_file=hand.draft,
    )
