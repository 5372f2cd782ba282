"""The state of the session for the page's script, in a hidden element."""

from __future__ import annotations

import json
import time
from html import escape
from typing import Any

import viser

from slipgrasp.web.model.playback import Playback, TimeWindow, whole_window
from slipgrasp.web.model.view import RunStage, ViewState

_INTERVAL = 0.5
_AT_START = Playback(time=0.0, window=TimeWindow(0.0, 1.0), speed=1.0, playing=False)


class SessionStatePanel:
    """Sends the state of the session to the page's script, which advances the time itself.

    Args:
        gui: Parent of the widgets.
        key: The key of the session.
    """

    def __init__(self, gui: viser.GuiApi, key: str) -> None:
        self._key = key
        self.session_state = gui.add_html("")
        self._told: dict[str, Any] = {}
        self._told_at = 0.0

    def update(self, view: ViewState) -> None:
        """Sends changes of the state, and regularly the position of the play head."""
        now, state = time.monotonic(), _state_of(view)
        playing = state["playing"]
        telling = {**state, "time": None} if playing else state
        if telling == self._told and not (playing and now - self._told_at >= _INTERVAL):
            return
        self._told, self._told_at = telling, now
        self.session_state.content = session_state_html(self._key, view)


def session_state_html(key: str, view: ViewState) -> str:
    """The hidden element.

    Args:
        key: The key of the session.
        view: The screen; before the first run, the play head is at the start.
    """
    state = {"session": key, **_state_of(view)}
    state["pace"] = state["pace"] and list(zip(*state["pace"], strict=True))
    return f'<i id="sg-session-state" hidden data-sg-state="{escape(json.dumps(state))}"></i>'


def _state_of(view: ViewState) -> dict[str, Any]:
    playback = view.playback or _AT_START
    return {
        "ready": _is_ready(view),
        "shows": view.shown is not None,
        "run": linked_run(view),
        "charts": view.charts.layout(),
        "notice": view.notice,
        "lecture": view.appearance.lecture,
        "time": playback.time,
        "start": playback.window.start,
        "end": playback.window.end,
        "duration": _duration(view),
        "speed": playback.speed,
        "pace": playback.pace,
        "playing": playback.playing,
    }


def _duration(view: ViewState) -> float:
    """The largest time that can be shown [s]."""
    return _AT_START.window.end if view.shown is None else whole_window(view.shown.result).end


def _is_ready(view: ViewState) -> bool:
    """Whether there is a first run to show, or a message instead."""
    waiting = view.status.stage in (RunStage.OPENING, RunStage.SIMULATING)
    return view.playback is not None or not waiting


def linked_run(view: ViewState) -> str:
    """The id in a link to the run on the screen; empty if it is not stored."""
    if view.shown is not None and view.shown.replay is not None:
        return view.shown.replay.run_id
    return view.status.run_id if view.status.stage is RunStage.SAVED else ""
