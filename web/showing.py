"""What it takes to put a run on the screen; plain values, no viewer."""

from __future__ import annotations

from dataclasses import replace

from web.playback import WindowChoice, start_playback, window_of
from web.replay import Replay
from web.view import Draft, RunStage, RunStatus, Shown, ViewState

__all__ = ["show", "show_replay", "with_status"]


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
        playback = playback.within(window_of(shown.result, choice, playback.window))
    return replace(view, shown=shown, playback=playback, choice=choice, status=RunStatus(stage))


def show_replay(view: ViewState, recording: Replay) -> ViewState:
    """Puts a recording on the screen; a run that is still computed is void then."""
    ticket = view.ticket + 1
    view = replace(
        view, ticket=ticket, draft=Draft.from_replay(recording), replay=recording, ghost=None
    )
    shown = Shown(ticket, recording.result, 0.0, recording)
    return show(view, shown, RunStage.REPLAY, afresh=True)


def with_status(view: ViewState, status: RunStatus) -> ViewState:
    """Tells what became of the latest request."""
    return replace(view, status=status)
