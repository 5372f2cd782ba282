"""Parameters, numbers and errors in words."""

from __future__ import annotations

import re
from collections.abc import Sequence

from core.exceptions import FieldError

__all__ = [
    "error_words",
    "joined",
    "key_words",
    "milliseconds",
    "sentence",
    "unit_after",
    "unit_words",
]

_PLACE_OF_CHANGE = re.compile(r"changes\.\d+\.(?P<what>value: |time)")
_WITH_COORDINATES = ("base", "start", "acceleration", "amplitude", "force", "pose")
_COORDINATES = ("x", "y", "theta")
_SUPERSCRIPTS = str.maketrans({"2": "²", "3": "³"})


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
            words += [] if part == "fingers" else [_singular(part) if following_is_index else part]
        elif parts[i - 1] == "fingers":
            words.append(names[int(part)])
        elif parts[i - 1] in _WITH_COORDINATES:
            words.append(_COORDINATES[int(part)])
        else:
            words.append(str(int(part) + 1))
    return " ".join(words).replace("_", " ")


def unit_words(unit: str) -> str:
    """A unit for a label, such as `` [kg m²]``; nothing for pure numbers."""
    return f" [{_raised(unit)}]" if _is_unit(unit) else ""


def unit_after(unit: str) -> str:
    """A unit to stand after a number, such as `` kg m²``; nothing for pure numbers."""
    return f" {_raised(unit)}" if _is_unit(unit) else ""


def error_words(error: FieldError) -> str:
    """What is wrong with a value that the user set, wherever in the scenario it ended up."""
    place = _PLACE_OF_CHANGE.match(error.message)
    if place is None:
        return error.message
    rest = error.message[place.end() :]
    return rest if place["what"] == "value: " else f"the time of the change{rest}"


def _is_unit(unit: str) -> bool:
    return unit not in ("", "1")


def _raised(unit: str) -> str:
    return unit.replace("^", "").translate(_SUPERSCRIPTS)


def milliseconds(time: float) -> str:
    """A time in milliseconds while that is short, else in seconds [s]."""
    return f"{1e3 * time:.0f} ms" if time < 1.0 else f"{time:.2f} s"


def joined(words: Sequence[str]) -> str:
    """Words as a list in a sentence: ``a, b and c``."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _singular(word: str) -> str:
    return word.removesuffix("es") if word.endswith(("sses", "ches")) else word.removesuffix("s")


def sentence(text: str) -> str:
    """The text as a sentence: a capital letter in front and a full stop behind."""
    return text[:1].upper() + text[1:].rstrip(".") + "."
