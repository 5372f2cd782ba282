"""The play head: its controls, below a strip that shows every contact's phases."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

import viser

from slipgrasp.core.scenario import Scenario
from slipgrasp.recordings.palette import CONE, GHOST, PHASES, Rgb
from slipgrasp.web.model.colours import BELIEVED_CONE, PUSH, WATER, css, sign
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.view import Ghost, Shown, ViewState
from slipgrasp.web.model.words import PHASE_HINTS, PHASE_WORDS
from slipgrasp.web.page.intents_schema import PageGestures
from slipgrasp.web.page.keys import KEYS, keys_of
from slipgrasp.web.panels.strip import clock_words, strip_html
from slipgrasp.web.panels.transport import transport_html


class PlaybackPanel:
    """Shows where the play head stands, and lets the user move it.

    Everything is sent when it changes, and the page's own script moves the play head.

    Args:
        gui: Where it goes.
        send: Takes the intents.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self.strip = gui.add_html("")
        self.transport = gui.add_html("")
        self._commands = [_add_command(gui, send, number) for number in range(len(KEYS))]
        self._drawn: tuple[object, ...] = ()
        self._controls: tuple[object, ...] = ()

    def update(self, view: ViewState) -> None:
        """Draws the strip for another run or window, and the controls for another state."""
        if view.shown is None or view.playback is None:
            return
        playback = view.playback
        drawn = (view.shown, view.ghost, playback.window)
        if drawn != self._drawn:
            self._drawn = drawn
            strip = strip_html(view.shown.result, playback, view.ghost)
            caption = caption_html(view.shown, view.ghost, playback.time)
            self.strip.content = caption + strip
        controls = (playback.playing, playback.speed, view.choice)
        if controls != self._controls:
            self._controls = controls
            self.transport.content = transport_html(playback, view.choice)

    def remove(self) -> None:
        """Takes everything off the page."""
        self.strip.remove()
        self.transport.remove()
        for command in self._commands:
            command.remove()


def _add_command(gui: viser.GuiApi, send: Send, number: int) -> viser.CommandHandle:
    """An entry in the list of commands; its key is listened for by the page's own script."""
    row = KEYS[number]
    (intent,) = PageGestures.model_validate([row.gesture]).intents()
    keys = keys_of(**row.gesture)
    command = gui.add_command(row.text, description=f"Key: {keys}", icon=row.icon)
    command.on_trigger(lambda _: send(intent))
    return command


def caption_html(shown: Shown, ghost: Ghost | None, time: float) -> str:
    """Which run it is, what the colours mean, and the time.

    Args:
        shown: The run.
        ghost: The run that is drawn pale.
        time: Where the play head stands at first [s].
    """
    legend = "".join(
        f'<span><i style="color:{colour}">{sign}</i> {word}</span>'
        for sign, colour, word in (
            ("━", _legible(CONE), "friction cone"),
            ("┅", _legible(BELIEVED_CONE), "as believed"),
            ("┅", _legible(GHOST), "desired pose"),
            *_disturbance_signs(shown.result.scenario),
        )
    )
    phases = "".join(
        f'<span title="{PHASE_HINTS[phase]}"><i style="color:{sign(PHASES[phase])}">■</i> '
        f"{word}</span>"
        for phase, word in PHASE_WORDS.items()
    )
    pale = "" if ghost is None else f"<span><i>▬</i> pale: {escape(ghost.label)}</span>"
    return (
        f'<div class="sg-caption">{_origin_html(shown)}'
        f'<b class="sg-clock" data-sg-clock>{clock_words(time)}</b>'
        f'<span class="sg-legend">{phases}{legend}{pale}</span></div>'
    )


def _disturbance_signs(scenario: Scenario) -> Iterator[tuple[str, str, str]]:
    """Sign, colour and word of what happens in a run."""
    if scenario.patches:
        yield "≈", _legible(WATER), "wet spot"
    if scenario.pulses:
        yield "➔", _legible(PUSH), "push"


def _legible(colour: Rgb) -> str:
    """A colour of the scene as CSS, legible on a bright and on a dark page."""
    return f"color-mix(in srgb, {css(colour)} 80%, currentColor)"


def _origin_html(shown: Shown) -> str:
    """Whether this was computed just now, or what recording it is read from."""
    replay = shown.replay
    if replay is None:
        return f'<span class="sg-origin"><b>Live run</b> {escape(shown.name)}</span>'
    return (
        f'<span class="sg-origin"><b class="sg-badge" style="background:{css(GHOST)}">Replay</b> '
        f"<b>{escape(replay.name)}</b>, recorded {escape(replay.recorded)}</span>"
    )
