"""The run on the screen and its ghost as a pair; plain values, no viewer."""

from __future__ import annotations

from dataclasses import replace

from slipgrasp.web.model.playback import (
    TimeWindow,
    WindowChoice,
    slip_window,
    whole_window,
    window_of,
)
from slipgrasp.web.model.replay import Replay, moment_words
from slipgrasp.web.model.view import Comparing, Ghost, Pair, Shown, ViewState, show_replay


def pair_of(view: ViewState) -> Pair | None:
    """The two runs on the screen; None without a ghost."""
    if view.shown is None or view.ghost is None:
        return None
    return view.shown.ticket, view.ghost.shown.ticket


def with_ghost(view: ViewState, recording: Replay, ticket: int) -> ViewState:
    """Draws a recording as the ghost of the run on the screen.

    While the slip of the run is shown, the time range grows to hold that of both.

    Args:
        view: What is on the screen.
        recording: The recording.
        ticket: Identifies it among the runs of the session.
    """
    ghost = Ghost(Shown(ticket, recording.result, 0.0, recording), recording.name, is_chosen=True)
    view = replace(view, ghost=ghost, comparing=Comparing())
    if view.shown is None or view.playback is None or view.choice is not WindowChoice.SLIP:
        return view
    if ghost.run is None:
        return view
    own, other = slip_window(view.shown.result), slip_window(recording.result)
    whole = whole_window(view.shown.result)
    window = TimeWindow(
        whole.clamp(min(own.start, other.start)), whole.clamp(max(own.end, other.end))
    )
    return replace(view, playback=view.playback.within(window))


def without_ghost(view: ViewState) -> ViewState:
    """Shows the run on the screen alone."""
    return replace(view, ghost=None, comparing=Comparing())


def can_swap(view: ViewState) -> bool:
    """Whether either run could take the other's place: both are kept somewhere."""
    pale = view.ghost.shown.replay if view.ghost else None
    return (
        view.ghost is not None
        and view.ghost.run is not None
        and pale is not None
        and (_recording_on_screen(view) is not None)
    )


def swapped(view: ViewState, ticket: int) -> ViewState:
    """Swaps the run on the screen and the ghost; the play head stays.

    Args:
        view: What is on the screen.
        ticket: Identifies the run that becomes the ghost among the runs of the session.
    """
    recording = _recording_on_screen(view)
    pale = view.ghost.shown.replay if view.ghost else None
    if recording is None or pale is None or not can_swap(view):
        return view
    choice, playback = view.choice, view.playback
    view = show_replay(view, pale)
    if playback is not None:
        window = window_of(pale.result, WindowChoice.CLOSER, playback.window)
        view = replace(view, choice=choice, playback=playback.within(window))
    return with_ghost(view, recording, ticket)


def _recording_on_screen(view: ViewState) -> Replay | None:
    """The run on the screen as a recording; None while it is kept nowhere."""
    if view.shown is None or view.shown.replay is not None:
        return view.shown.replay if view.shown else None
    stored = next((run for run in view.run_list.recent if run.id == view.status.run_id), None)
    if stored is None:
        return None
    recorded = moment_words(stored.created)
    return Replay(stored.display_name, recorded, view.shown.result, stored.id)
