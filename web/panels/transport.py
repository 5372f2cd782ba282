"""The controls of the play head as HTML; the page's own script knows what their attributes mean."""

from __future__ import annotations

from html import escape
from typing import Any

from slipgrasp.web.model.playback import SPEEDS, Playback, WindowChoice
from slipgrasp.web.page.keys import keys_of
from slipgrasp.web.page.markup import CHOSEN, change_attribute, click_attribute

_ICONS = {
    "start": "M5 4h3v16H5zM20 4v16L9 12z",
    "previous event": "M12 4v16L3 12zM21 4v16l-9-8z",
    "step back": "M17 5h3v14h-3zM14 5v14L4 12z",
    "play": "M7 4v16l13-8z",
    "pause": "M6 4h4v16H6zM14 4h4v16h-4z",
    "step forward": "M4 5h3v14H4zM10 5v14l10-7z",
    "next event": "M12 4v16l9-8zM3 4v16l9-8z",
    "end": "M16 4h3v16h-3zM4 4v16l11-8z",
}


def transport_html(playback: Playback, choice: WindowChoice) -> str:
    """Buttons to play, step and jump; speed, exact time and window; link and keys.

    Args:
        playback: The play head.
        choice: Which stretch of the run is shown.
    """
    play = "pause" if playback.playing else "play"
    moves = "".join(
        (
            _icon_button("start", "Start", "go-to-edge", direction=-1),
            _icon_button("previous event", "Previous event", "jump-to-event", direction=-1),
            _icon_button("step back", "Step back", "step", direction=-1),
            _icon_button(play, play.capitalize(), "toggle-play"),
            _icon_button("step forward", "Step forward", "step", direction=1),
            _icon_button("next event", "Next event", "jump-to-event", direction=1),
            _icon_button("end", "End", "go-to-edge", direction=1),
        )
    )
    return (
        '<div class="sg-transport">'
        f'<span class="sg-group">{moves}</span>'
        f"{_time_html(playback)}{_speed_html(playback)}"
        f'<span class="sg-group">{_windows_html(choice)}</span>'
        '<span class="sg-group"><button type="button" data-sg-copy-link '
        'title="Copies a link to this run at this time, for any browser of this machine">'
        "Copy link</button>"
        '<button type="button" data-sg-help aria-label="Keys" title="All keys (?)">?</button>'
        "</span></div>"
    )


def _icon_button(icon: str, label: str, kind: str, **fields: Any) -> str:
    hint = f"{label} ({keys_of(kind, **fields)})"
    wide = " class='sg-play'" if kind == "toggle-play" else ""
    return (
        f'<button type="button"{wide} aria-label="{label}" title="{escape(hint)}" '
        f'{click_attribute(kind, **fields)}><svg viewBox="0 0 24 24" aria-hidden="true">'
        f'<path d="{_ICONS[icon]}"/></svg></button>'
    )


def _time_html(playback: Playback) -> str:
    return (
        '<label class="sg-field" title="Where the play head is; type an exact time [s]">'
        '<span>t</span><input type="number" step="any" aria-label="time [s]" data-sg-time '
        f'value="{playback.time:.6g}" {change_attribute("seek", time=CHOSEN)}>'
        "<span>s</span></label>"
    )


def _speed_html(playback: Playback) -> str:
    options = "".join(
        f'<option value="{name}"{" selected" if speed == playback.speed else ""}>{name}×</option>'
        for name, speed in SPEEDS.items()
    )
    slower = keys_of("change-speed", direction=-1)
    faster = keys_of("change-speed", direction=1)
    hint = f"Simulated seconds per second; slower with {slower}, faster with {faster}"
    return (
        f'<label class="sg-field" title="{hint}"><span>speed</span><select aria-label="speed" '
        f"{change_attribute('set-speed', name=CHOSEN)}>{options}</select></label>"
    )


def _windows_html(choice: WindowChoice) -> str:
    return "".join(
        (
            _window_button(
                "slip", choice is WindowChoice.SLIP, "choose-window", choice=WindowChoice.SLIP.value
            ),
            _window_button(
                "whole run",
                choice is WindowChoice.WHOLE,
                "choose-window",
                choice=WindowChoice.WHOLE.value,
            ),
            _window_button("closer", choice is WindowChoice.CLOSER, "zoom"),
        )
    )


def _window_button(label: str, is_chosen: bool, kind: str, **fields: Any) -> str:
    hints = {
        "slip": "Shows the stretch in which contacts slip",
        "whole run": "Shows the run from its start to its end",
        "closer": "Looks four times closer at the play head",
    }
    return (
        f'<button type="button" aria-pressed="{str(is_chosen).lower()}" '
        f'title="{hints[label]} ({keys_of(kind, **fields)})" '
        f"{click_attribute(kind, **fields)}>{label}</button>"
    )
