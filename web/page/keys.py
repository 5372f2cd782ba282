"""The keys of the dashboard: one table for the script, the list of commands and the help."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from viser import Icon, IconName


@dataclass(frozen=True, slots=True)
class KeyCommand:
    """What a key does.

    Attributes:
        keys: The keys, any of which does it: a browser's name of the key, a letter in
            upper case, with ``Ctrl+`` (also Cmd) and ``Shift+`` before it.
        text: What it does, in words.
        gesture: What the page posts for it.
        icon: Its icon in the list of commands.
    """

    keys: tuple[str, ...]
    text: str
    gesture: Mapping[str, Any]
    icon: IconName


def _command(keys: str, text: str, icon: IconName, kind: str, **fields: str | int) -> KeyCommand:
    return KeyCommand(tuple(keys.split()), text, {"kind": kind, **fields}, icon)


KEYS: tuple[KeyCommand, ...] = (
    _command("Space P", "Play or pause", Icon.PLAYER_PLAY, "toggle-play"),
    _command("ArrowLeft", "Step back", Icon.PLAYER_TRACK_PREV, "step", direction=-1),
    _command("ArrowRight", "Step forward", Icon.PLAYER_TRACK_NEXT, "step", direction=1),
    _command(
        "Shift+ArrowLeft [", "Previous event", Icon.PLAYER_SKIP_BACK, "jump-to-event", direction=-1
    ),
    _command(
        "Shift+ArrowRight ]", "Next event", Icon.PLAYER_SKIP_FORWARD, "jump-to-event", direction=1
    ),
    _command("Home", "Go to the start", Icon.ARROW_BAR_TO_LEFT, "go-to-edge", direction=-1),
    _command("End", "Go to the end", Icon.ARROW_BAR_TO_RIGHT, "go-to-edge", direction=1),
    _command("ArrowUp +", "Play faster", Icon.TRENDING_UP, "change-speed", direction=1),
    _command("ArrowDown -", "Play slower", Icon.TRENDING_DOWN, "change-speed", direction=-1),
    _command("S", "Show the slip", Icon.WAVE_SINE, "choose-window", choice="slip"),
    _command(
        "W", "Show the whole run", Icon.ARROWS_HORIZONTAL, "choose-window", choice="whole run"
    ),
    _command("Z", "Look closer at the play head", Icon.ZOOM_IN, "zoom"),
    _command("F H", "Look at the whole hand from the front", Icon.FOCUS_CENTERED, "frame-hand"),
    _command("Ctrl+Z", "Undo", Icon.ARROW_BACK_UP, "undo"),
    _command("Ctrl+Shift+Z Ctrl+Y", "Redo", Icon.ARROW_FORWARD_UP, "redo"),
    _command("X", "Dismiss the ghost: take the pale run away", Icon.GHOST_OFF, "end-comparison"),
)

_SIGNS = {
    "ArrowLeft": "←",
    "ArrowRight": "→",
    "ArrowUp": "↑",
    "ArrowDown": "↓",
    "-": "−",
}


def keys_of(kind: str, **fields: str | int) -> str:
    """The keys that do something, as they are shown to a user: ``Space or P``.

    Args:
        kind: What is asked for.
        fields: The rest of it.

    Raises:
        LookupError: If no key does it.
    """
    gesture = {"kind": kind, **fields}
    for command in KEYS:
        if command.gesture == gesture:
            return _shown(command)
    raise LookupError(f"no key does {gesture}")


def keys_html() -> str:
    """The table as an element of the page that the script reads."""
    rows = [
        {"keys": command.keys, "shown": _shown(command), "text": command.text}
        | {"intent": command.gesture}
        for command in KEYS
    ]
    # Nothing within a script element may look like its end.
    content = json.dumps(rows, ensure_ascii=True).replace("<", "\\u003c")
    return f'<script type="application/json" id="sg-keys">{content}</script>'


def _shown(command: KeyCommand) -> str:
    return " or ".join("+".join(_SIGNS.get(p, p) for p in _parts(key)) for key in command.keys)


def _parts(key: str) -> list[str]:
    return ["+"] if key == "+" else key.split("+")
