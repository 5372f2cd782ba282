"""The play head: controls, below a timeline with every contact's phases."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

import viser

from slipgrasp.core.scenario import Scenario
from slipgrasp.recordings.palette import CONE, GHOST, PHASES, WATER, Rgb
from slipgrasp.web.model.colours import BELIEVED_CONE, PUSH, css, sign
from slipgrasp.web.model.events import HINTS, PHASE_HINTS, PHASE_WORDS, WORDS, phases_in
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.intents.playback import (
    ChangeSpeed,
    ChooseWindow,
    GoToEdge,
    GoToNextSlip,
    JumpToEvent,
    Seek,
    SetSpeed,
    Step,
    TogglePlay,
    Zoom,
)
from slipgrasp.web.model.playback import PACED, SPEEDS, Playback, WindowChoice, whole_window
from slipgrasp.web.model.view import Ghost, Shown, ViewState
from slipgrasp.web.page.keys import KEYS, KeyCommand, keys_of
from slipgrasp.web.page.markup import change_attribute, click_attribute
from slipgrasp.web.panels.strip import clock_words, strip_html

_ICONS = {
    "start": "M5 4h3v16H5zM20 4v16L9 12z",
    "previous event": "M12 4v16L3 12zM21 4v16l-9-8z",
    "step back": "M17 5h3v14h-3zM14 5v14L4 12z",
    "play": "M7 4v16l13-8z",
    "pause": "M6 4h4v16H6zM14 4h4v16h-4z",
    "step forward": "M4 5h3v14H4zM10 5v14l10-7z",
    "next event": "M12 4v16l9-8zM3 4v16l9-8z",
    "next slip": "M3 5h14l-7 12zM18 5h3v14h-3z",
    "end": "M16 4h3v16h-3zM4 4v16l11-8z",
}
_WINDOWS: dict[WindowChoice, tuple[str, Intent]] = {
    WindowChoice.SLIP: (
        "Shows the time range in which contacts slip",
        ChooseWindow(WindowChoice.SLIP),
    ),
    WindowChoice.WHOLE: (
        "Shows the run from its start to its end",
        ChooseWindow(WindowChoice.WHOLE),
    ),
    WindowChoice.CLOSER: ("Zooms in four times at the play head", Zoom()),
}


class PlaybackPanel:
    """Shows the play head, and lets the user move it.

    Changes are sent immediately, and the page's script moves the play head.

    Args:
        gui: Parent of the widgets.
        send: Accepts the intents.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self.strip = gui.add_html("")
        self.transport = gui.add_html("")
        for row in KEYS:
            _add_command(gui, send, row)
        self._drawn: tuple[object, ...] = ()
        self._controls: tuple[object, ...] = ()

    def update(self, view: ViewState) -> None:
        """Draws the timeline for another run or window, and the controls for another state."""
        if view.shown is None or view.playback is None:
            return
        playback = view.playback
        drawn = (view.shown, view.ghost, playback.window)
        if drawn != self._drawn:
            self._drawn = drawn
            strip = strip_html(view.shown.result, playback, view.ghost)
            caption = caption_html(view.shown, view.ghost, playback.time)
            self.strip.content = caption + strip
        choice = view.choice
        if choice is WindowChoice.SLIP and playback.window == whole_window(view.shown.result):
            choice = WindowChoice.WHOLE  # as of a run without slip
        controls = (playback.playing, playback.speed, playback.pace is None, choice)
        if controls != self._controls:
            self._controls = controls
            self.transport.content = transport_html(playback, choice)


def _add_command(gui: viser.GuiApi, send: Send, row: KeyCommand) -> None:
    """An entry in the list of commands; the page's script handles its key."""
    description = f"Key: {keys_of(row.intent)}"
    command = gui.add_command(row.text, description=description, icon=row.icon)
    command.on_trigger(lambda _: send(row.intent))


def caption_html(shown: Shown, ghost: Ghost | None, time: float) -> str:
    """Name of the run, key of the colours, and time.

    Args:
        shown: The run.
        ghost: The ghost.
        time: Initial time of the play head [s].
    """
    scenario = shown.result.scenario
    of_hand = _hand_signs(scenario) if scenario.space.has_hand else ()
    legend = "".join(
        f'<span><i style="color:{colour}">{sign}</i> {word}</span>'
        for sign, colour, word in (*of_hand, *_disturbance_signs(scenario))
    )
    hints = HINTS.get(scenario.space, PHASE_HINTS)
    words = WORDS.get(scenario.space, PHASE_WORDS)
    phases = "".join(
        f'<span title="{hints[phase]}"><i style="color:{sign(PHASES[phase])}">■</i> '
        f"{words[phase]}</span>"
        for phase in phases_in(scenario)
    )
    pale = (
        ""
        if ghost is None
        else f"<span class='sg-ghost-name' title='{escape(ghost.label)}'>"
        f"<i style='opacity:0.4'>▬</i> ghost: {escape(ghost.label)}</span>"
    )
    return (
        f'<div class="sg-caption">{_origin_html(shown)}'
        f'<b class="sg-clock" data-sg-clock>{clock_words(time)}</b>'
        f'<span class="sg-legend">{phases}{legend}{pale}</span></div>'
    )


def _hand_signs(scenario: Scenario) -> Iterator[tuple[str, str, str]]:
    """Symbol, colour and name of the marks of a hand."""
    is_pyramid = scenario.friction_cone == "pyramid"
    yield "━", _legible(CONE), f"friction {'pyramid' if is_pyramid else 'cone'}"
    yield "┅", _legible(BELIEVED_CONE), "estimated"
    yield "┅", _legible(GHOST), "desired pose"


def _disturbance_signs(scenario: Scenario) -> Iterator[tuple[str, str, str]]:
    """Symbol, colour and name of each kind of disturbance in a scenario."""
    if scenario.patches:
        yield "≈", _legible(WATER), "low-friction patch"
    if scenario.pulses:
        yield "➔", _legible(PUSH), "push"


def _legible(colour: Rgb) -> str:
    """A colour of the scene as CSS, legible on a light and a dark page."""
    return f"color-mix(in srgb, {css(colour)} 80%, currentColor)"


def _origin_html(shown: Shown) -> str:
    """Whether the run was just computed, or from which recording it was read."""
    replay = shown.replay
    if replay is None:
        name = escape(shown.name)
        return f'<span class="sg-origin" title="{name}"><b>Live run</b> {name}</span>'
    name, badge = escape(replay.name), f'class="sg-badge" style="background:{css(GHOST)}"'
    return (
        f'<span class="sg-origin" title="{name}"><b {badge}>Replay</b> '
        f"<b>{name}</b><span>, recorded {escape(replay.recorded)}</span></span>"
    )


def transport_html(playback: Playback, choice: WindowChoice, *, is_alone: bool = False) -> str:
    """Buttons to play, step and jump; exact time, speed and time range; link and keys.

    Args:
        playback: The play head.
        choice: The choice of the time range.
        is_alone: Whether the page has no server, and so no link, variable speed or time range of
            the slip.
    """
    link = (
        '<button type="button" data-sg-copy-link '
        'title="Copies a link to this run at this time, for any browser of this machine">'
        "Copy link</button>"
    )
    return (
        f'<div class="sg-transport">{_moves_html(playback)}{_time_html(playback)}'
        f"{_speed_html(playback, with_pace=not is_alone)}"
        f'<span class="sg-group">{_windows_html(choice, with_slip=not is_alone)}</span>'
        f'<span class="sg-group">{"" if is_alone else link}'
        '<button type="button" data-sg-help aria-label="Keys" title="All keys (?)">?</button>'
        "</span></div>"
    )


def _moves_html(playback: Playback) -> str:
    """Buttons to play, step and jump."""
    play = "pause" if playback.playing else "play"
    moves = "".join(
        (
            _icon_button("start", GoToEdge(-1)),
            _icon_button("previous event", JumpToEvent(-1)),
            _icon_button("step back", Step(-1)),
            _icon_button(play, TogglePlay()),
            _icon_button("step forward", Step(1)),
            _icon_button("next event", JumpToEvent(1)),
            _icon_button("next slip", GoToNextSlip()),
            _icon_button("end", GoToEdge(1)),
        )
    )
    return f'<span class="sg-group">{moves}</span>'


def _icon_button(icon: str, intent: Intent) -> str:
    label = icon.capitalize()
    hint = f"{label} ({keys_of(intent)})"
    wide = " class='sg-play'" if isinstance(intent, TogglePlay) else ""
    return (
        f'<button type="button"{wide} aria-label="{label}" title="{escape(hint)}" '
        f'{click_attribute(intent)}><svg viewBox="0 0 24 24" aria-hidden="true">'
        f'<path d="{_ICONS[icon]}"/></svg></button>'
    )


def _time_html(playback: Playback) -> str:
    return (
        '<label class="sg-field" title="Where the play head is; type an exact time [s]">'
        '<span>t</span><input type="number" step="any" aria-label="time [s]" data-sg-time '
        f'value="{playback.time:.6g}" {change_attribute(Seek, "time")}>'
        "<span>s</span></label>"
    )


def _speed_html(playback: Playback, *, with_pace: bool) -> str:
    at_one = playback.speed if playback.pace is None else None
    paced = _option(PACED, PACED, is_chosen=at_one is None) if with_pace else ""
    options = paced + "".join(
        _option(name, f"{name}×", is_chosen=speed == at_one) for name, speed in SPEEDS.items()
    )
    slower = keys_of(ChangeSpeed(-1))
    faster = keys_of(ChangeSpeed(1))
    hint = (
        f"Simulated seconds per second; slower with {slower}, faster with {faster}. "
        f"{PACED}: each slip takes some seconds, the time between slips one"
    )
    return (
        f'<label class="sg-field" title="{hint}"><select aria-label="speed" '
        f"{change_attribute(SetSpeed, 'name')}>{options}</select></label>"
    )


def _option(value: str, label: str, *, is_chosen: bool) -> str:
    return f'<option value="{value}"{" selected" if is_chosen else ""}>{label}</option>'


def _windows_html(chosen: WindowChoice, *, with_slip: bool) -> str:
    """Buttons that show another time range of the run."""
    return "".join(
        f'<button type="button" aria-pressed="{str(choice is chosen).lower()}" '
        f'title="{hint} ({keys_of(intent)})" {click_attribute(intent)}>{choice.value}</button>'
        for choice, (hint, intent) in _WINDOWS.items()
        if with_slip or choice is not WindowChoice.SLIP
    )
