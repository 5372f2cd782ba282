"""The reducer of links: a run and a time that the address of the page names."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar

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
    """Opens the run of a link, and puts the play head where the link says once it is there.

    Its place is behind the reducer of the recordings, which shows the run.

    Args:
        send: Asks the reducer of the recordings to open a run.
    """

    takes: ClassVar[tuple[type[Intent], ...]] = (
        OpenLink,
        OpenRecording,
        RecordingOpened,
        RecordingUnreadable,
    )

    def __init__(self, send: Send) -> None:
        self._send = send
        self._wanted: OpenLink | None = None

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Asks for the run of a link, and does the rest when there is an answer."""
        match intent:
            case OpenLink(run):
                self._wanted = intent
                self._send(OpenRecording(run))
                return replace(view, notice="")
            case OpenRecording(run_id) if self._wanted and run_id != self._wanted.run:
                self._wanted = None  # The user wants to see something else by now.
            case RecordingOpened(number, _) if self._wanted:
                wanted, self._wanted = self._wanted, None
                # Another number answers what was asked for before or after.
                return view if number != view.opening else _arrive(wanted.time, view)
            case RecordingUnreadable(number, message) if self._wanted:
                self._wanted = None
                if number == view.opening:
                    return replace(view, notice=f"The link could not be opened: {message}.")
        return view


def _arrive(written: str, view: ViewState) -> ViewState:
    """Puts the play head where the link says."""
    if view.shown is None or view.playback is None or not written:
        return view
    time = linked_time(written)
    if time is None:
        notice = (
            f"The time '{written[:_SHOWN_LENGTH]}' of the link is no number of seconds; "
            "it is left out."
        )
        return replace(view, notice=notice)
    whole = whole_window(view.shown.result)
    return replace(view, playback=view.playback.reach(time, whole))


def linked_time(written: str) -> float | None:
    """The time that a link names [s]; None if it is no time."""
    try:
        time = float(written)
    except ValueError:
        return None
    return time if math.isfinite(time) else None
