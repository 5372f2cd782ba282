"""Parameters, numbers and errors in words."""

from __future__ import annotations

import re
from collections.abc import Sequence

from core.exceptions import FieldError

__all__ = [
    "error_words",
    "joined",
    "milliseconds",
    "sentence",
]

_PLACE_OF_CHANGE = re.compile(r"changes\.\d+\.(?P<what>value: |time)")


def error_words(error: FieldError) -> str:
    """What is wrong with a value that the user set, wherever in the scenario it ended up."""
    place = _PLACE_OF_CHANGE.match(error.message)
    if place is None:
        return error.message
    rest = error.message[place.end() :]
    return rest if place["what"] == "value: " else f"the time of the change{rest}"


def milliseconds(time: float) -> str:
    """A time in milliseconds while that is short, else in seconds [s]."""
    return f"{1e3 * time:.0f} ms" if time < 1.0 else f"{time:.2f} s"


def joined(words: Sequence[str]) -> str:
    """Words as a list in a sentence: ``a, b and c``."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def sentence(text: str) -> str:
    """The text as a sentence: a capital letter in front and a full stop behind."""
    return text[:1].upper() + text[1:].rstrip(".") + "."
