"""Styles of outcome categories on a map, by colour and by hatch."""

from __future__ import annotations

from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.palette import HELD as HELD_COLOUR
from slipgrasp.recordings.palette import OUTCOMES, Rgb
from slipgrasp.recordings.study.categories import CATEGORIES, HELD

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
    "short_run": "----",
    "past_limit": "\\\\",
    "model_estimate_singular": "\\\\\\\\",
    "nonfinite_torque": "ooo",
    "turned_too_far": "\\\\..",
    "painleve": "----",
    "step_underflow": "||||",
    "unbounded_grasp_force": "....",
    "stiff_loop": "////",
    "nonfinite_state": "xxxx",
    "event_stall": "....",
    "joint_limit": "OO",
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


def colour_of(category: int) -> Rgb:
    """The colour of a category, one per outcome."""
    return HELD_COLOUR if category == HELD else OUTCOMES[CATEGORIES[category].outcome]


def hatch_of(category: int) -> str:
    """The hatch of a category of failures; none if the object is held."""
    if category == HELD:
        return ""
    reason = CATEGORIES[category].reason
    return _HATCHES_BY_REASON[reason] if reason else _HATCHES[CATEGORIES[category].outcome]


def marker_of(category: int) -> str:
    """The shape of a point."""
    return "o" if category == HELD else _MARKERS[CATEGORIES[category].outcome]
