"""Play, pause, step, speed and scrub, below a strip that shows every contact's phases."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Coroutine, Iterator
from html import escape
from typing import Any

import numpy as np
import viser

from core.result import RunResult
from core.types import ContactPhase
from web.colours import BELIEVED_CONE, CONE, GHOST, PHASES, css
from web.intents.intent import Intent, Send
from web.intents.picture import FrameHand
from web.intents.playback import ChooseWindow, Seek, SetSpeed, Step, TogglePlay, Zoom
from web.playback import SPEEDS, Playback, TimeWindow, WindowChoice
from web.replay import Replay
from web.view import Shown, ViewState

__all__ = ["PlaybackPanel", "phase_runs", "strip_html"]

_INTERVAL = 0.08
_SETTLING_TIME = 1.0
_CELLS = 320
_PLAY, _PAUSE = "▶ Play", "❚❚ Pause"
_BACK, _FORTH = "◂ step", "step ▸"
_CHOICES: dict[str, WindowChoice] = {choice.value: choice for choice in WindowChoice}
_LEGEND = {
    ContactPhase.STICK: "sticks",
    ContactPhase.SLIP_FORWARD: "slips forward",
    ContactPhase.SLIP_BACKWARD: "slips backward",
}


class PlaybackPanel:
    """Moves the play head.

    Args:
        gui: Where it goes.
        send: Takes the intents.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._send = send
        self._strip = gui.add_html("")
        self._time = gui.add_slider(
            "time [s]", 0.0, 1.0, 0.001, 0.0, hint="Where the play head is."
        )
        self._buttons = gui.add_button_group("play", (_BACK, _PAUSE, _FORTH))
        self._speed = gui.add_dropdown(
            "speed", tuple(SPEEDS), initial_value="1", hint="Simulated seconds per second."
        )
        self._window = gui.add_button_group("show", tuple(_CHOICES))
        self._commands = [
            gui.add_command("Play or pause", hotkey="P", icon=viser.Icon.PLAYER_PLAY),
            gui.add_command("Step forward", hotkey="N", icon=viser.Icon.PLAYER_SKIP_FORWARD),
            gui.add_command("Step back", hotkey="B", icon=viser.Icon.PLAYER_SKIP_BACK),
            gui.add_command("Look at the whole hand", hotkey="H", icon=viser.Icon.FOCUS_CENTERED),
        ]
        self._connect()
        self._drawn: tuple[int, TimeWindow] | None = None
        self._drawn_at = 0.0
        self._was_playing = False
        self._paused_at = -math.inf

    def update(self, view: ViewState) -> None:
        """Shows where the play head stands."""
        if view.shown is None or view.playback is None:
            return
        playback, now = view.playback, time.monotonic()
        drawing = (view.shown.ticket, playback.window)
        if drawing == self._drawn and playback.playing and now - self._drawn_at < _INTERVAL:
            return
        if drawing != self._drawn:
            self._set_window(playback.window)
        self._drawn, self._drawn_at = drawing, now
        self._show_time(playback)
        self._buttons.options = (_BACK, _PAUSE if playback.playing else _PLAY, _FORTH)
        self._speed.value = next(n for n, speed in SPEEDS.items() if speed == playback.speed)
        self._strip.content = strip_html(view.shown, playback)

    def remove(self) -> None:
        """Takes everything off the page."""
        for element in (self._strip, self._time, self._buttons, self._speed, self._window):
            element.remove()
        for command in self._commands:
            command.remove()

    def _connect(self) -> None:
        self._time.on_update(self._passing(lambda: Seek(float(self._time.value))))
        self._speed.on_update(self._passing(lambda: SetSpeed(self._speed.value)))
        self._window.on_click(self._passing(lambda: _window_intent(self._window.value)))
        moves = {_BACK: Step(-1), _FORTH: Step(1)}
        self._buttons.on_click(self._passing(lambda: moves.get(self._buttons.value, TogglePlay())))
        for command, intent in zip(
            self._commands, (TogglePlay(), Step(1), Step(-1), FrameHand()), strict=True
        ):
            command.on_trigger(lambda _, intent=intent: self._send(intent))

    def _passing(
        self, intent: Callable[[], Intent]
    ) -> Callable[[viser.GuiEvent[Any]], Coroutine[Any, Any, None]]:
        """A callback that passes on what the user asks for.

        It runs in the viewer server's event loop, where the order in which a user does things
        is kept, and a value is read before the program can set another one.
        """

        async def callback(event: viser.GuiEvent[Any]) -> None:
            # Values that the program sets come without a client; they must not come back.
            if event.client_id is not None:
                self._send(intent())

        return callback

    def _show_time(self, playback: Playback) -> None:
        """Moves the slider.

        A user who takes hold of it while it moves, or has just stopped it, may be overtaken
        by values that are still on their way; the slider is then told once more where it
        stands.
        """
        if self._was_playing and not playback.playing:
            self._paused_at = self._drawn_at
        if not playback.playing and self._drawn_at - self._paused_at < _SETTLING_TIME:
            at_start = playback.time == playback.window.start
            self._time.value = playback.window.end if at_start else playback.window.start
        self._was_playing = playback.playing
        self._time.value = playback.window.clamp(playback.time)

    def _set_window(self, window: TimeWindow) -> None:
        """Lets the slider span a window; its value must never be outside."""
        self._time.min = min(self._time.min, window.start)
        self._time.max = max(self._time.max, window.end)
        self._time.value = window.clamp(self._time.value)
        self._time.min, self._time.max = window.start, window.end
        self._time.step = max(window.length / 1000.0, 1e-6)


def _window_intent(name: str) -> Intent:
    """What a button asks for; its name comes from a browser."""
    choice = _CHOICES.get(name, WindowChoice.SLIP)
    return Zoom() if choice is WindowChoice.CLOSER else ChooseWindow(choice)


def phase_runs(
    result: RunResult, contact: int, window: TimeWindow, cells: int = _CELLS
) -> Iterator[tuple[float, float, ContactPhase]]:
    """Stretches of one phase, as shares of a window: start, end, phase.

    Args:
        result: The run.
        contact: Which contact.
        window: What the strip shows.
        cells: How finely; many short phases become stripes of this width.
    """
    middles = window.start + (np.arange(cells) + 0.5) / cells * window.length
    rows = np.searchsorted(result.trace.times, middles, side="right") - 1
    phases = result.trace.phase[np.maximum(rows, 0), contact]
    starts = np.flatnonzero(np.diff(phases, prepend=2) != 0)
    for start, end in zip(starts, [*starts[1:], cells], strict=True):
        yield start / cells, end / cells, ContactPhase(int(phases[start]))


def strip_html(shown: Shown, playback: Playback) -> str:
    """Where the run comes from, a bar per contact in its phases' colours, and the play head."""
    result = shown.result
    window = playback.window
    bars = "".join(
        _bar_html(name, phase_runs(result, i, window))
        for i, name in enumerate(result.scenario.finger_names)
    )
    share = (playback.time - window.start) / max(window.length, 1e-12)
    head = (
        f"<div style='position:absolute;top:-3px;bottom:-3px;left:calc(3.2em + (100% - 3.2em)*"
        f"{share:.4f} - 1px);width:2px;background:currentColor'></div>"
    )
    legend = "".join(
        "<span style='margin-right:1em;white-space:nowrap'>"
        f"<span style='color:{css(PHASES[phase])}'>■</span> {word}</span> "
        for phase, word in _LEGEND.items()
    )
    return (
        "<div style='padding:0.3em 0.75em 0.4em;font-size:0.8em'>"
        f"<div style='margin-bottom:0.3em'>{_origin_html(shown.replay)}</div>"
        f"<div style='position:relative'>{bars}{head}</div>"
        f"<div style='margin-top:0.35em'>{legend}<span style='float:right'>"
        f"<b>{_clock(playback.time)}</b></span></div>"
        f"<div>{_marks_legend()}</div></div>"
    )


def _origin_html(replay: Replay | None) -> str:
    """Whether this was computed just now, or what recording it is read from."""
    if replay is None:
        return "<b>Live run</b>"
    colour = css(GHOST)
    return (
        f"<b style='color:white;background:{colour};padding:0 0.5em;border-radius:0.3em'>Replay</b>"
        f" <b>{escape(replay.name)}</b>, recorded {escape(replay.recorded)}"
    )


def _clock(seconds: float) -> str:
    return f"{1e3 * seconds:.1f} ms" if seconds < 1.0 else f"{seconds:.3f} s"


def _marks_legend() -> str:
    """What the lines of the scene mean."""
    return "".join(
        f"<span style='margin-right:1em;white-space:nowrap'><span style='color:{css(colour)};"
        f"font-weight:700'>{sign}</span> {word}</span> "
        for sign, colour, word in (
            ("━", CONE, "friction cone"),
            ("┅", BELIEVED_CONE, "as the controller believes"),
            ("┅", GHOST, "desired pose"),
        )
    )


def _bar_html(name: str, runs: Iterator[tuple[float, float, ContactPhase]]) -> str:
    pieces = "".join(
        f"<div style='position:absolute;left:{100 * start:.2f}%;width:{100 * (end - start):.2f}%;"
        f"top:0;bottom:0;background:{css(PHASES[phase])}'></div>"
        for start, end, phase in runs
    )
    return (
        "<div style='display:flex;height:1em;margin-bottom:2px;line-height:1'>"
        f"<span style='width:3.2em;flex:none'>{escape(name)}</span>"
        f"<div style='position:relative;flex:1'>{pieces}</div></div>"
    )
