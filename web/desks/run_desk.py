"""The desk of the scenario: what is asked for is simulated, shown, and saved once it rests."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import ClassVar

from core.exceptions import ScenarioError
from core.simulator import kernel_progress
from web.desks.desk import Desk
from web.intents.intent import Intent, Send
from web.intents.runs import RunFinished, RunRefused, RunSaved, SaveFailed
from web.intents.scenario import ChoosePreset, ResetScenario, SetParameter
from web.pacing import is_save_due
from web.preview_worker import PreviewWorker
from web.services import Services
from web.showing import show, show_replay, with_status
from web.view import Draft, RunStage, RunStatus, Shown, ViewState

__all__ = ["RunDesk"]

_UNNOTICED_WAIT = 0.3
_LOOK_AGAIN = 0.1


class RunDesk(Desk):
    """Turns the draft into a run.

    Args:
        services: Simulates and saves.
        send: Takes the worker's answers.
        simulates_first: Whether it starts with the run of the first draft.
    """

    takes: ClassVar[tuple[type[Intent], ...]] = (
        SetParameter,
        ChoosePreset,
        ResetScenario,
        RunFinished,
        RunRefused,
        RunSaved,
        SaveFailed,
    )

    def __init__(self, services: Services, send: Send, *, simulates_first: bool) -> None:
        self._worker = PreviewWorker(services.runs, services.saved, send)
        self.workers = (self._worker,)
        self._simulates_first = simulates_first
        self._is_other_scenario = True
        self._edited_at = -math.inf
        self._waiting_since: float | None = None

    def start(self, view: ViewState) -> ViewState:
        """Asks for the run of the first draft."""
        return self._request_run(view) if self._simulates_first else view

    def take(self, intent: Intent, view: ViewState) -> ViewState:
        """Edits the draft, or shows what the worker answers."""
        match intent:
            case SetParameter(key, value):
                return self._edit(view, view.draft.edited(key, value))
            case ChoosePreset(name):
                self._is_other_scenario = True
                return self._start_from(view, name)
            case ResetScenario():
                return self._start_from(view, view.draft.origin)
            case RunFinished() | RunRefused() | RunSaved() | SaveFailed():
                return view if intent.ticket != view.ticket else self._answered(intent, view)
            case _:
                return view

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """Keeps a run that rests, and tells about one that takes long."""
        if view.shown and is_save_due(view.status.stage, now - self._edited_at):
            self._worker.save(view.shown.ticket, view.shown.result)
            return with_status(view, RunStatus(RunStage.SAVING))
        if self._waiting_since is not None and now - self._waiting_since > _UNNOTICED_WAIT:
            return with_status(view, _busy_status())
        return view

    def wait(self, now: float, view: ViewState) -> float | None:
        """Looks again while something is computed or is to be saved."""
        busy = self._waiting_since is not None or view.status.stage is RunStage.PREVIEW
        return _LOOK_AGAIN if busy else None

    def _answered(
        self, answer: RunFinished | RunRefused | RunSaved | SaveFailed, view: ViewState
    ) -> ViewState:
        match answer:
            case RunFinished(ticket, result, elapsed):
                afresh, self._is_other_scenario = self._is_other_scenario, False
                self._waiting_since = None
                shown = Shown(ticket, result, elapsed)
                return show(view, shown, RunStage.PREVIEW, afresh=afresh)
            case RunRefused(_, error):
                self._waiting_since = None
                return with_status(view, RunStatus.refused(error))
            case RunSaved(_, stored):
                return with_status(view, RunStatus(RunStage.SAVED, run_id=stored.id))
            case SaveFailed(_, message):
                return with_status(view, RunStatus(RunStage.NOT_SAVED, (message,)))

    def _start_from(self, view: ViewState, origin: str) -> ViewState:
        """Shows a recording again, or computes a preset as it comes."""
        recording, draft = view.replay, view.draft
        if recording is not None and origin == recording.label:
            self._waiting_since = None
            return show_replay(view, recording)
        try:
            known = origin == draft.origin
            fresh = Draft(origin, draft.base) if known else Draft.from_preset(origin)
        except ScenarioError as error:
            return with_status(view, RunStatus.refused(error))
        return self._edit(view, fresh)

    def _edit(self, view: ViewState, draft: Draft) -> ViewState:
        self._edited_at = time.monotonic()
        # What is still being opened comes too late.
        return self._request_run(replace(view, draft=draft, opening=view.opening + 1))

    def _request_run(self, view: ViewState) -> ViewState:
        """Asks for the run of the draft; an older one that is still computed is void then."""
        view = replace(view, ticket=view.ticket + 1)
        try:
            scenario = view.draft.scenario()
        except ScenarioError as error:
            self._waiting_since = None
            return with_status(view, RunStatus.refused(error))
        if self._waiting_since is None:
            self._waiting_since = time.monotonic()
        self._worker.simulate(view.ticket, scenario)
        return view


def _busy_status() -> RunStatus:
    ready = kernel_progress()
    if ready < 1.0:
        return RunStatus(RunStage.COMPILING, (f"{ready:.0%}",))
    return RunStatus(RunStage.SIMULATING)
