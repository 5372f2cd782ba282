"""How each way in which runs end looks on a map: by colour, and without colours as well."""

from __future__ import annotations

from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.palette import HELD as HELD_COLOUR
from slipgrasp.recordings.palette import OUTCOMES, Rgb
from slipgrasp.recordings.study.ways import HELD, WAYS

_HATCHES = {
    Outcome.COMPLETED: "",
    Outcome.LEFT_FACE: "////",
    Outcome.SEPARATED: "...",
    Outcome.CHATTERING: "xxxx",
    Outcome.INCONSISTENT: "++++",
    Outcome.SINGULAR: "oo",
    Outcome.LIMIT: "||||",
    Outcome.STOPPED: "--",
    Outcome.RECOVERED: "--",
    Outcome.FAILED: "**",
}
_HATCHES_BY_REASON = {
    "model_estimate_singular": "\\\\\\\\",
    "painleve": "----",
    "step_underflow": "||||",
    "stiff_loop": "////",
    "nonfinite_state": "xxxx",
    "event_stall": "....",
}
_MARKERS = {
    Outcome.COMPLETED: "s",
    Outcome.LEFT_FACE: "^",
    Outcome.SEPARATED: "v",
    Outcome.CHATTERING: "X",
    Outcome.INCONSISTENT: "P",
    Outcome.DIVERGED: "D",
    Outcome.SINGULAR: "h",
    Outcome.LIMIT: "<",
    Outcome.STOPPED: ">",
    Outcome.RECOVERED: ">",
    Outcome.FAILED: "*",
}


def colour_of(way: int) -> Rgb:
    """The colour of a way, one per outcome."""
    return HELD_COLOUR if way == HELD else OUTCOMES[WAYS[way].outcome]


def hatch_of(way: int) -> str:
    """The hatch of a way of failing; none where the object is held."""
    if way == HELD:
        return ""
    reason = WAYS[way].reason
    return _HATCHES_BY_REASON[reason] if reason else _HATCHES[WAYS[way].outcome]


def marker_of(way: int) -> str:
    """The shape of a point."""
    return "o" if way == HELD else _MARKERS[WAYS[way].outcome]
