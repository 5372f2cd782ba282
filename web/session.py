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
    Mailbox,
    ResetScenario,
    RunFinished,
    RunRefused,
    RunSaved,
    SaveFailed,
    Seek,
    SetParameter,
    SetSpeed,
    Step,
    TogglePlay,
)
from web.playback import (
    SPEEDS,
    Playback,
    WindowChoice,
    neighbouring_time,
    speed_for,
    start_playback,
    window_of,
)
from web.preview_worker import PreviewWorker
from web.sampling import sample_at
from web.saved_runs import SavedRuns
from web.screen import Screen
from web.view import Draft, RunStage, RunStatus, Shown, ViewState

__all__ = ["Session", "frame_wait", "is_save_due"]

FIRST_PRESET = "paper-case-2"

_REST_BEFORE_SAVING = 0.5
_FRAME_INTERVAL = 1.0 / 25.0
_UNNOTICED_WAIT = 0.3
_TIME_TO_LEAVE = 1.0

_logger = logging.getLogger(__name__)


def is_save_due(stage: RunStage, rested: float) -> bool:
    """Whether the run on the screen is to be kept now.

    Args:
        stage: How far the latest request has come.
        rested: How long ago a knob was moved last [s].
    """
    return stage is RunStage.PREVIEW and rested >= _REST_BEFORE_SAVING


def frame_wait(playing: bool, stage: RunStage, waiting: bool, since_frame: float) -> float | None:
    """How long the loop may sleep while no intent comes [s]; None is for as long as it likes.

    Args:
        playing: Whether the play head moves.
        stage: How far the latest request has come.
        waiting: Whether a run is being computed.
        since_frame: How long ago the last frame was begun [s].
    """
    if playing:
        return max(_FRAME_INTERVAL - since_frame, 0.0)
    return 0.1 if waiting or stage is RunStage.PREVIEW else None


class Session:
    """What one connected browser sees and does.

    Args:
        client: The viewer.
        service: Simulates.
        saved: Keeps runs.
    """

    def __init__(self, client: viser.ClientHandle, service: RunService, saved: SavedRuns) -> None:
        self._client = client
        self._mailbox = Mailbox()
        self._worker = PreviewWorker(service, saved, self._mailbox.send)
        self._view = ViewState(
            draft=Draft.from_preset(FIRST_PRESET),
            status=RunStatus(RunStage.SIMULATING),
            choice=WindowChoice.SLIP,
        )
        self._gone = threading.Event()
        self._ticket = 0
        self._is_other_preset = True
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

    def _loop(self, screen: Screen) -> None:
        self._request_run()
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
                self._choose_preset(name)
            case ResetScenario():
                self._edit(Draft(self._view.draft.preset, self._view.draft.base))
            case CameraMoved(position, width, height):
                screen.camera.report(position, width, height)
            case FrameHand():
                screen.camera.frame()
            case RunFinished() | RunRefused() | RunSaved() | SaveFailed():
                self._take_answer(intent)
            case _:
                self._take_playback(intent)

    def _take_playback(self, intent: Intent) -> None:
        shown, playback = self._view.shown, self._view.playback
        if shown is None or playback is None:
            return
        match intent:
            case TogglePlay():
                self._play(replace(playback, playing=not playback.playing))
            case Seek(seconds) if math.isfinite(seconds):
                self._play(playback.seek(seconds))
            case Step(direction):
                self._play(playback.seek(neighbouring_time(shown.result, playback.time, direction)))
            case SetSpeed(name) if name in SPEEDS:
                self._play(replace(playback, speed=SPEEDS[name]))
            case ChooseWindow(choice):
                window = window_of(shown.result, choice)
                self._view = replace(self._view, choice=choice)
                self._play(replace(playback.within(window), speed=speed_for(window)))

    def _take_answer(self, answer: RunFinished | RunRefused | RunSaved | SaveFailed) -> None:
        if answer.ticket != self._ticket:
            return
        match answer:
            case RunFinished(ticket, result, elapsed):
                self._show(Shown(ticket, result, elapsed))
            case RunRefused(_, error):
                self._waiting_since = None
                self._set_status(RunStatus.refused(error))
            case RunSaved(_, stored):
                self._set_status(RunStatus(RunStage.SAVED, run_id=stored.id))
            case SaveFailed(_, message):
                self._set_status(RunStatus(RunStage.NOT_SAVED, (message,)))

    def _choose_preset(self, name: str) -> None:
        try:
            draft = Draft.from_preset(name)
        except ScenarioError as error:
            self._set_status(RunStatus.refused(error))
            return
        self._is_other_preset = True
        self._view = replace(self._view, choice=WindowChoice.SLIP)
        self._edit(draft)

    def _edit(self, draft: Draft) -> None:
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

    def _show(self, shown: Shown) -> None:
        """Puts a run on the screen; the play head stays where it is unless all is new."""
        playback = self._view.playback
        if playback is None or self._is_other_preset:
            playback = start_playback(shown.result)
        else:
            playback = playback.within(window_of(shown.result, self._view.choice))
        self._is_other_preset = False
        self._waiting_since = None
        self._view = replace(self._view, shown=shown)
        self._set_status(RunStatus(RunStage.PREVIEW))
        self._play(playback)

    def _play(self, playback: Playback) -> None:
        shown = self._view.shown
        if shown is not None:
            sample = sample_at(shown.result.trace, playback.time)
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
