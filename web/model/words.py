"""Parameters, numbers and errors in words."""

from __future__ import annotations

import re

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.trace.types import ContactPhase

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


def error_words(error: FieldError) -> str:
    """What is wrong with a value that the user set, wherever in the scenario it ended up."""
    place = _PLACE_OF_CHANGE.match(error.message)
    if place is None:
        return error.message
    rest = error.message[place.end() :]
    return rest if place["what"] == "value: " else f"the time of the change{rest}"
