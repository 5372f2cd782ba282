"""One user's session: a loop that takes intents, moves the play head and draws.

Nothing else touches the session's state: callbacks and the worker only send intents.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from dataclasses import replace

import viser

from core.exceptions import ScenarioError
from core.simulator import kernel_progress
from server.run_service import RunService
from web.intents import (
    CameraMoved,
    ChoosePreset,
    ChooseWindow,
    Close,
    FrameHand,
    Intent,
    ListRecordings,
    Mailbox,
    OpenRecording,
    RecordingOpened,
    RecordingsListed,
    RecordingUnreadable,
    ResetScenario,
    RunFinished,
    RunRefused,
    RunSaved,
    SaveFailed,
    SetParameter,
    Zoom,
)
from web.librarian import Librarian
from web.pacing import frame_wait, is_save_due
from web.play_head import moved
from web.playback import Playback, WindowChoice, start_playback, window_of
from web.preview_worker import PreviewWorker
from web.replay import Replay, Source
from web.sampling import Sampler
from web.saved_runs import SavedRuns
from web.screen import Screen
from web.view import Draft, RunStage, RunStatus, Shelf, Shown, ViewState

__all__ = ["Session"]

FIRST_PRESET = "paper-case-2"

_UNNOTICED_WAIT = 0.3
_TIME_TO_LEAVE = 1.0

_logger = logging.getLogger(__name__)


class Session:
    """What one connected browser sees and does.

    Args:
        client: The viewer.
        service: Simulates.
        saved: Keeps runs.
        first: The recording to show first; a run of the first preset if None.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        service: RunService,
        saved: SavedRuns,
        first: Source | None = None,
    ) -> None:
        self._client = client
        self._first = first
        self._mailbox = Mailbox()
        self._worker = PreviewWorker(service, saved, self._mailbox.send)
        self._librarian = Librarian(service.store, self._mailbox.send)
        self._view = ViewState(
            draft=Draft.from_preset(FIRST_PRESET),
            status=RunStatus(RunStage.SIMULATING if first is None else RunStage.OPENING),
            choice=WindowChoice.SLIP,
        )
        self._sampler: Sampler | None = None
        self._opening = 0
        self._gone = threading.Event()
        self._ticket = 0
        self._is_other_scenario = True
        self._edited_at = -math.inf
        self._waiting_since: float | None = None
        self._thread = threading.Thread(
            target=self._live, name=f"session-{client.client_id}", daemon=True
        )

    def start(self) -> None:
        """Begins to draw, in a thread of its own."""
        self._thread.start()

    def close(self) -> None:
        """Asks the session to end; a run that is being saved still is."""
        self._gone.set()
        self._mailbox.send(Close())

    def join(self, timeout: float) -> None:
        """Waits until the session has ended [s]."""
        self._thread.join(timeout)
        self._worker.join(timeout)
        self._librarian.join(timeout)

    def _live(self) -> None:
        try:
            self._loop(Screen(self._client, self._view, self._mailbox.send))
        except Exception:
            # The edge of the thread: one broken session must neither end silently nor spread.
            # A viewer that leaves in the middle of a frame is no error.
            if not self._gone.wait(_TIME_TO_LEAVE):
                _logger.exception("session %d ended by an error", self._client.client_id)
                self._client.add_notification(
                    "This session ended by an internal error",
                    "Reload the page to go on; runs that were saved are safe.",
                    color="red",
                )
        finally:
            self._worker.close()
            self._librarian.close()

    def _loop(self, screen: Screen) -> None:
        if self._first is None:
            self._request_run()
        else:
            self._open(self._first)
        self._librarian.list(0)
        drawn_at = time.monotonic()
        while True:
            wait = self._wait(time.monotonic() - drawn_at)
            intents = self._mailbox.receive(wait)
            if any(isinstance(intent, Close) for intent in intents):
                return
            for intent in intents:
                self._take(intent, screen)
            now = time.monotonic()
            self._pass_time(now - drawn_at)
            drawn_at = now
            screen.update(self._view)

    def _wait(self, since_frame: float) -> float | None:
        playback = self._view.playback
        playing = playback is not None and playback.playing
        return frame_wait(
            playing, self._view.status.stage, self._waiting_since is not None, since_frame
        )

    def _take(self, intent: Intent, screen: Screen) -> None:
        match intent:
            case SetParameter(key, value):
                self._edit(self._view.draft.edited(key, value))
            case ChoosePreset(name):
                self._is_other_scenario = True
                self._start_from(name)
            case ResetScenario():
                self._start_from(self._view.draft.origin)
            case CameraMoved(position, width, height):
                screen.camera.report(position, width, height)
            case FrameHand():
                screen.camera.frame()
            case ListRecordings(page):
                self._librarian.list(page)
            case OpenRecording(run_id):
                self._open(run_id)
            case RecordingsListed() | RecordingOpened() | RecordingUnreadable():
                self._take_from_librarian(intent)
            case RunFinished() | RunRefused() | RunSaved() | SaveFailed():
                self._take_answer(intent)
            case _:
                self._move_play_head(intent)

    def _move_play_head(self, intent: Intent) -> None:
        shown, playback = self._view.shown, self._view.playback
        if shown is None or playback is None:
            return
        if isinstance(intent, ChooseWindow):
            self._view = replace(self._view, choice=intent.choice)
        elif isinstance(intent, Zoom):
            self._view = replace(self._view, choice=WindowChoice.CLOSER)
        self._play(moved(playback, intent, shown.result))

    def _take_answer(self, answer: RunFinished | RunRefused | RunSaved | SaveFailed) -> None:
        if answer.ticket != self._ticket:
            return
        match answer:
            case RunFinished(ticket, result, elapsed):
                self._show(Shown(ticket, result, elapsed), RunStage.PREVIEW)
            case RunRefused(_, error):
                self._waiting_since = None
                self._set_status(RunStatus.refused(error))
            case RunSaved(_, stored):
                self._set_status(RunStatus(RunStage.SAVED, run_id=stored.id))
                self._librarian.list(self._view.shelf.page)
            case SaveFailed(_, message):
                self._set_status(RunStatus(RunStage.NOT_SAVED, (message,)))

    def _take_from_librarian(
        self, answer: RecordingsListed | RecordingOpened | RecordingUnreadable
    ) -> None:
        shelf = self._view.shelf
        match answer:
            case RecordingsListed(page, count, runs):
                self._view = replace(self._view, shelf=Shelf(page, count, runs, shelf.message))
            case RecordingOpened(number, recording) if number == self._opening:
                self._view = replace(self._view, replay=recording, shelf=replace(shelf, message=""))
                self._is_other_scenario = True
                self._show_replay(recording)
            case RecordingUnreadable(number, message) if number == self._opening:
                self._view = replace(self._view, shelf=replace(shelf, message=message))
                if self._view.shown is None:
                    self._set_status(RunStatus(RunStage.UNREADABLE, (message,)))

    def _open(self, source: Source) -> None:
        """Asks for a recording; what is on the screen stays until it is there."""
        self._opening += 1
        self._librarian.open(self._opening, source)

    def _show_replay(self, recording: Replay) -> None:
        """Puts a recording on the screen; a run that is still computed is void then."""
        self._ticket += 1
        self._view = replace(self._view, draft=Draft.from_replay(recording))
        self._show(Shown(self._ticket, recording.result, 0.0, recording), RunStage.REPLAY)

    def _start_from(self, origin: str) -> None:
        """Shows a recording again, or computes a preset as it comes."""
        recording, draft = self._view.replay, self._view.draft
        if recording is not None and origin == recording.label:
            self._show_replay(recording)
            return
        try:
            known = origin == draft.origin
            self._edit(Draft(origin, draft.base) if known else Draft.from_preset(origin))
        except ScenarioError as error:
            self._set_status(RunStatus.refused(error))

    def _edit(self, draft: Draft) -> None:
        self._opening += 1  # What is still being opened comes too late.
        self._view = replace(self._view, draft=draft)
        self._edited_at = time.monotonic()
        self._request_run()

    def _request_run(self) -> None:
        """Asks for the run of the draft; an older one that is still computed is void then."""
        self._ticket += 1
        try:
            scenario = self._view.draft.scenario()
        except ScenarioError as error:
            self._waiting_since = None
            self._set_status(RunStatus.refused(error))
            return
        if self._waiting_since is None:
            self._waiting_since = time.monotonic()
        self._worker.simulate(self._ticket, scenario)

    def _show(self, shown: Shown, stage: RunStage) -> None:
        """Puts a run on the screen; the play head stays where it is unless all is new."""
        playback = self._view.playback
        if playback is None or self._is_other_scenario:
            playback = start_playback(shown.result)
            self._view = replace(self._view, choice=WindowChoice.SLIP)
        else:
            playback = playback.within(window_of(shown.result, self._view.choice, playback.window))
        self._is_other_scenario = False
        self._waiting_since = None
        self._sampler = Sampler(shown.result.trace)
        self._view = replace(self._view, shown=shown)
        self._set_status(RunStatus(stage))
        self._play(playback)

    def _play(self, playback: Playback) -> None:
        if self._sampler is not None:
            sample = self._sampler.at(playback.time)
            self._view = replace(self._view, playback=playback, sample=sample)

    def _set_status(self, status: RunStatus) -> None:
        self._view = replace(self._view, status=status)

    def _pass_time(self, elapsed: float) -> None:
        """Moves the play head, keeps a run that rests, and tells about a run that takes long."""
        now, shown = time.monotonic(), self._view.shown
        if self._view.playback is not None and self._view.playback.playing:
            self._play(self._view.playback.advance(elapsed))
        if shown and is_save_due(self._view.status.stage, now - self._edited_at):
            self._set_status(RunStatus(RunStage.SAVING))
            self._worker.save(shown.ticket, shown.result)
        if self._waiting_since is not None and now - self._waiting_since > _UNNOTICED_WAIT:
            ready = kernel_progress()
            if ready < 1.0:
                self._set_status(RunStatus(RunStage.COMPILING, (f"{ready:.0%}",)))
            else:
                self._set_status(RunStatus(RunStage.SIMULATING))
