"""Keyboard shortcuts: one table for the script, the command list and the help."""

from __future__ import annotations

import json
from collections.abc import Collection
from dataclasses import dataclass

from viser import Icon, IconName

from slipgrasp.web.model.disturbances import DisturbanceKind
from slipgrasp.web.model.intents.compare import EndComparison
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.picture import FrameHand, RestoreLayout, ToggleLecture, ToggleMark
from slipgrasp.web.model.intents.playback import (
    ChangeSpeed,
    ChooseWindow,
    GoToEdge,
    GoToNextSlip,
    JumpToEvent,
    Step,
    TogglePlay,
    Zoom,
)
from slipgrasp.web.model.intents.scenario import AddDisturbance, Redo, Undo
from slipgrasp.web.model.intents.tour import ToggleTour
from slipgrasp.web.model.playback import WindowChoice
from slipgrasp.web.page.intents_schema import posted


@dataclass(frozen=True, slots=True)
class KeyCommand:
    """A keyboard shortcut.

    Attributes:
        keys: Alternative keys: a browser's name of the key, or an upper-case letter, with optional
            prefixes ``Ctrl+`` (also Cmd) and ``Shift+``.
        text: Description.
        intent: Its intent.
        icon: Icon in the list of commands.
        tab: The tab that shows its effect; empty for any tab.
    """

    keys: tuple[str, ...]
    text: str
    intent: Intent
    icon: IconName
    tab: str = ""


def _command(keys: str, text: str, icon: IconName, intent: Intent, tab: str = "") -> KeyCommand:
    return KeyCommand(tuple(keys.split()), text, intent, icon, tab)


RUN_TAB = "Run"
KEYS: tuple[KeyCommand, ...] = (
    _command("Space P", "Play or pause", Icon.PLAYER_PLAY, TogglePlay()),
    _command("ArrowLeft", "Step back", Icon.PLAYER_TRACK_PREV, Step(-1)),
    _command("ArrowRight", "Step forward", Icon.PLAYER_TRACK_NEXT, Step(1)),
    _command("Shift+ArrowLeft [", "Previous event", Icon.PLAYER_SKIP_BACK, JumpToEvent(-1)),
    _command("Shift+ArrowRight ]", "Next event", Icon.PLAYER_SKIP_FORWARD, JumpToEvent(1)),
    _command(
        "N", "Next slip; after the last one the first", Icon.PLAYER_TRACK_NEXT, GoToNextSlip()
    ),
    _command(
        "Home", "Go to the start of the range, or of the run", Icon.ARROW_BAR_TO_LEFT, GoToEdge(-1)
    ),
    _command(
        "End", "Go to the end of the range, or of the run", Icon.ARROW_BAR_TO_RIGHT, GoToEdge(1)
    ),
    _command("ArrowUp +", "Play faster", Icon.TRENDING_UP, ChangeSpeed(1)),
    _command("ArrowDown -", "Play slower", Icon.TRENDING_DOWN, ChangeSpeed(-1)),
    _command("S", "Show the slip", Icon.WAVE_SINE, ChooseWindow(WindowChoice.SLIP)),
    _command("W", "Show the whole run", Icon.ARROWS_HORIZONTAL, ChooseWindow(WindowChoice.WHOLE)),
    _command("Z", "Zoom in at the play head", Icon.ZOOM_IN, Zoom()),
    _command(
        "M", "Set or remove the second cursor of the charts", Icon.RULER_MEASURE, ToggleMark()
    ),
    _command("F", "Show the object from the front", Icon.FOCUS_CENTERED, FrameHand()),
    _command("H", "Show the whole hand from the front", Icon.HAND_STOP, FrameHand(whole=True)),
    _command(
        "L",
        "Lecture mode: large view, timeline and one chart",
        Icon.PRESENTATION,
        ToggleLecture(),
        RUN_TAB,
    ),
    _command("R", "Restore the layout of the panels", Icon.LAYOUT, RestoreLayout()),
    _command("T", "Start or leave the tour of the presets", Icon.ROUTE, ToggleTour(), RUN_TAB),
    _command("1", "Push the object", Icon.ARROW_BIG_DOWN, AddDisturbance(DisturbanceKind.PUSH)),
    _command(
        "2",
        "Wet the face that is nearest to slipping",
        Icon.DROPLET,
        AddDisturbance(DisturbanceKind.LOW_FRICTION_PATCH),
    ),
    _command(
        "3",
        "Increase mass and inertia by half",
        Icon.BUCKET_DROPLET,
        AddDisturbance(DisturbanceKind.POUR),
    ),
    _command("Ctrl+Z", "Undo", Icon.ARROW_BACK_UP, Undo()),
    _command("Ctrl+Shift+Z Ctrl+Y", "Redo", Icon.ARROW_FORWARD_UP, Redo()),
    _command("X", "Dismiss the ghost", Icon.GHOST_OFF, EndComparison()),
)

_SIGNS = {
    "ArrowLeft": "←",
    "ArrowRight": "→",
    "ArrowUp": "↑",
    "ArrowDown": "↓",
    "-": "−",
}


def keys_of(intent: Intent) -> str:
    """The keys of an intent as text: ``Space or P``.

    Raises:
        LookupError: If no key has this intent.
    """
    for command in KEYS:
        if command.intent == intent:
            return _shown(command)
    raise LookupError(f"no key does {intent}")


def keys_html(known: Collection[Intent] | None = None) -> str:
    """The table as an HTML element for the script.

    Args:
        known: Supported intents; all of them if None.
    """
    rows = [
        {"keys": command.keys, "shown": _shown(command), "text": command.text}
        | {"intent": posted(command.intent), "tab": command.tab}
        for command in KEYS
        if known is None or command.intent in known
    ]
    # Text in a script element must not look like its end tag.
    content = json.dumps(rows, ensure_ascii=True).replace("<", "\\u003c")
    return f'<script type="application/json" id="sg-keys">{content}</script>'


def _shown(command: KeyCommand) -> str:
    return " or ".join("+".join(_SIGNS.get(p, p) for p in _parts(key)) for key in command.keys)


def _parts(key: str) -> list[str]:
    return ["+"] if key == "+" else key.split("+")
