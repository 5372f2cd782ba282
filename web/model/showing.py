"""What it takes to put a run on the screen; plain values, no viewer."""

from __future__ import annotations

from dataclasses import replace

from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.playback import (
    Playback,
    TimeWindow,
    WindowChoice,
    start_playback,
    whole_window,
    window_of,
)
from slipgrasp.web.model.replay import Replay
from slipgrasp.web.model.view import RunStage, RunStatus, Shown, ViewState


def show(view: ViewState, shown: Shown, stage: RunStage, *, afresh: bool) -> ViewState:
    """Puts a run on the screen.

    Args:
        view: What is on the screen now.
        shown: The run.
        stage: How far its request has come with it.
        afresh: Whether it has nothing to do with what was shown: the play head starts anew.
            Else it stays where it is, as far as the run goes.
    """
    playback, choice = view.playback, view.choice
    if playback is None or afresh:
        playback, choice = start_playback(shown.result), WindowChoice.SLIP
    else:
        playback = _kept_in(window_of(shown.result, choice, playback.window), playback, shown)
    return replace(view, shown=shown, playback=playback, choice=choice, status=RunStatus(stage))


def _kept_in(window: TimeWindow, playback: Playback, shown: Shown) -> Playback:
    """The play head in the window of another run; one that rests stays, the window holds it.

    Else a knob that is moved there would from then on act elsewhere.
    """
    if playback.playing:
        return playback.within(window)
    time = whole_window(shown.result).clamp(playback.time)
    return playback.within(TimeWindow(min(window.start, time), max(window.end, time)))


def show_replay(view: ViewState, recording: Replay) -> ViewState:
    """Puts a recording on the screen; a run that is still computed is void then."""
    ticket, draft, editing = view.ticket + 1, Draft.from_replay(recording), view.editing
    afresh = draft.origin != view.draft.origin
    if view.shown is not None and draft != view.draft:
        editing = editing.begin(view.draft)
    view = replace(view, ticket=ticket, draft=draft, editing=editing, replay=recording, ghost=None)
    shown = Shown(ticket, recording.result, 0.0, recording)
    return show(view, shown, RunStage.REPLAY, afresh=afresh)


def with_status(view: ViewState, status: RunStatus) -> ViewState:
    """Tells what became of the latest request."""
    return replace(view, status=status)
