"""Parameters, numbers and errors in words."""

from __future__ import annotations

import re
from collections.abc import Sequence

from core.exceptions import FieldError
from core.types import ContactPhase

__all__ = [
    "PHASE_HINTS",
    "PHASE_WORDS",
    "error_words",
    "key_words",
    "unit_after",
    "unit_words",
]

PHASE_WORDS = {
    ContactPhase.STICK: "sticks",
    ContactPhase.SLIP_FORWARD: "slips forward",
    ContactPhase.SLIP_BACKWARD: "slips backward",
}
PHASE_HINTS = {
    ContactPhase.STICK: "The fingertip moves with the face",
    ContactPhase.SLIP_FORWARD: "The fingertip slips forward: clockwise around the object",
    ContactPhase.SLIP_BACKWARD: "The fingertip slips backward: counterclockwise around the object",
}

_PLACE_OF_CHANGE = re.compile(r"changes\.\d+\.(?P<what>value: |time)")
_WITH_COORDINATES = ("base", "start", "acceleration", "amplitude", "force", "pose")
_COORDINATES = ("x", "y", "theta")
# Names and symbols that a key cannot spell.
_SPELLED = {
    "lyapunov_weight": "Lyapunov weight Q",
    "adaptation_gain": "adaptation gain Γ",
    "position_gain": "position gain Kₚ",
    "velocity_gain": "velocity gain Kᵥ",
}


def key_words(key: str, names: Sequence[str]) -> str:
    """A dotted key in words: ``fingers.0.link_masses.1`` as ``left link mass 2``.

    Args:
        key: The key.
        names: What the fingers are called.
    """
    parts = key.split(".")
    words: list[str] = []
    for i, part in enumerate(parts):
        following_is_index = i + 1 < len(parts) and parts[i + 1].isdigit()
        if not part.isdigit():
            word = _singular(part) if following_is_index else part
            words += [] if part == "fingers" else [_SPELLED.get(part, word)]
        elif parts[i - 1] == "fingers":
            words.append(names[int(part)])
        elif parts[i - 1] in _WITH_COORDINATES:
            words.append(_COORDINATES[int(part)])
        else:
            words.append(str(int(part) + 1))
    return " ".join(words).replace("_", " ").replace("controller kind", "control law")


def unit_words(unit: str) -> str:
    """A unit for a label, such as `` [kg m²]``; nothing for pure numbers."""
    return f" [{unit}]" if _is_unit(unit) else ""


def unit_after(unit: str) -> str:
    """A unit to stand after a number, such as `` kg m²``; nothing for pure numbers."""
    return f" {unit}" if _is_unit(unit) else ""


def error_words(error: FieldError) -> str:
    """What is wrong with a value that the user set, wherever in the scenario it ended up."""
    place = _PLACE_OF_CHANGE.match(error.message)
    if place is None:
        return error.message
    rest = error.message[place.end() :]
    return rest if place["what"] == "value: " else f"the time of the change{rest}"


def _is_unit(unit: str) -> bool:
    return unit not in ("", "1")


def _singular(word: str) -> str:
    return word.removesuffix("es") if word.endswith(("sses", "ches")) else word.removesuffix("s")
