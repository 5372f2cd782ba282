"""What the reducer of the scenario makes of a page."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from slipgrasp.core.run.result import RunResult
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.playback import Playback, TimeWindow, WindowChoice
from slipgrasp.web.model.view import RunStage, RunStatus, Shown, ViewState
from slipgrasp.web.reducers.scenario import ScenarioReducer

AT_REST = Playback(time=0.5, window=TimeWindow(0.0, 7.0), speed=1.0, playing=False)


def view_of(result: RunResult, **others: Any) -> ViewState:
    """The page with a run, such as case II, at rest in the middle of its first second."""
    view = ViewState(
        draft=Draft.from_preset("paper-case-2"),
        status=RunStatus(RunStage.SAVED),
        choice=WindowChoice.WHOLE,
        shown=Shown(1, result, 0.01),
        playback=AT_REST,
    )
    return replace(view, **others)


def first_view(**others: Any) -> ViewState:
    """The page before its first run is there."""
    status = RunStatus(RunStage.SIMULATING)
    return replace(
        ViewState(Draft.from_preset("paper-case-1"), status, WindowChoice.SLIP), **others
    )


def at(view: ViewState, time: float) -> ViewState:
    """The view with its play head at another time."""
    assert view.playback is not None
    return replace(view, playback=replace(view.playback, time=time))


def after(view: ViewState, *intents: Intent) -> ViewState:
    """The view after intents."""
    reducer = ScenarioReducer()
    for intent in intents:
        view = reducer.reduce(intent, view)
    return view
