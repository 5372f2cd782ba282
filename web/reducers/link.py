"""The reducer of links, which name a run and a time."""

from __future__ import annotations

import math
from dataclasses import replace

from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.intents.recordings import (
    OpenLink,
    OpenRecording,
    RecordingOpened,
    RecordingUnreadable,
)
from slipgrasp.web.model.playback import whole_window
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.reducers.reducer import Reducer

_SHOWN_LENGTH = 40


class LinkReducer(Reducer):
    """Opens the run of a link, then moves the play head to its time.

    It follows the reducer of recordings, which shows the run.

    Args:
        send: Requests a run from the reducer of recordings.
    """

    def __init__(self, send: Send) -> None:
        self._send = send
        self._wanted: OpenLink | None = None

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Requests the run of a link, and continues after the answer."""
        match intent:
            case OpenLink(run):
                self._wanted = intent
                self._send(OpenRecording(run))
                return replace(view, notice="")
            case OpenRecording(run_id) if self._wanted and run_id != self._wanted.run:
                self._wanted = None  # The user has requested something else.
            case RecordingOpened(number, _) if self._wanted:
                wanted, self._wanted = self._wanted, None
                # Other numbers answer other requests.
                return view if number != view.opening else _arrive(wanted.time, view)
            case RecordingUnreadable(number, message) if self._wanted:
                self._wanted = None
                if number == view.opening:
                    return replace(view, notice=f"The link could not be opened: {message}.")
        return view


def _arrive(written: str, view: ViewState) -> ViewState:
    """Moves the play head to the time of the link."""
    if view.shown is None or view.playback is None or not written:
        return view
    time = linked_time(written)
    if time is None:
        notice = (
            f"The time '{written[:_SHOWN_LENGTH]}' in the link is not a number of seconds; it is "
            "ignored."
        )
        return replace(view, notice=notice)
    whole = whole_window(view.shown.result)
    return replace(view, playback=view.playback.reach(time, whole))


def linked_time(written: str) -> float | None:
    """The time of a link [s]; None if it is invalid."""
    try:
        time = float(written)
    except ValueError:
        return None
    return time if math.isfinite(time) else None
