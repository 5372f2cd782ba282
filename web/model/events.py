"""Events of a run: start and end of slip, changes of values, end of the run."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import (
    RAIL,
    SUPPORT,
    RailScenario,
    Scenario,
    Space,
    SpatialScenario,
    SupportScenario,
)
from slipgrasp.core.scenario.geometry import contact_frame
from slipgrasp.core.scenario.law_choice import LAW
from slipgrasp.core.trace.types import (
    SLIPS_ALONG_BOTH_TANGENTS,
    SLIPS_ALONG_ONE_TANGENT,
    ContactPhase,
    Outcome,
    PhaseChange,
)
from slipgrasp.core.words.parameter_words import key_words
from slipgrasp.web.model.disturbances import disturbance_words, disturbances_of
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.laws import law_change_words, main_changes
from slipgrasp.web.model.playback import neighbouring_time
from slipgrasp.web.model.selection import PATCH, PUSH

PHASE_WORDS = {
    ContactPhase.STICK: "sticks",
    ContactPhase.SLIP_FORWARD: "slips clockwise",
    ContactPhase.SLIP_BACKWARD: "slips counterclockwise",
    ContactPhase.SLIP: "slips",
    **dict.fromkeys(SLIPS_ALONG_ONE_TANGENT, "slips along one tangent"),
    **dict.fromkeys(SLIPS_ALONG_BOTH_TANGENTS, "slips along both"),
}
PHASE_HINTS = {
    ContactPhase.STICK: "The fingertip moves with the face",
    ContactPhase.SLIP_FORWARD: "The fingertip slips forward: clockwise around the object",
    ContactPhase.SLIP_BACKWARD: "The fingertip slips backward: counterclockwise around the object",
    ContactPhase.SLIP: "The fingertip slides on its face, in a variable direction",
    **dict.fromkeys(
        SLIPS_ALONG_ONE_TANGENT,
        "The fingertip slides along one tangent of its face and sticks along the other",
    ),
    **dict.fromkeys(
        SLIPS_ALONG_BOTH_TANGENTS,
        "The fingertip slides along both tangents of its face, with independent friction",
    ),
}
WORDS = {
    RAIL: {
        ContactPhase.STICK: "sticks",
        ContactPhase.SLIP_FORWARD: "slips: forward along the rail",
        ContactPhase.SLIP_BACKWARD: "slips: back along the rail",
    }
}
"""Names of phases where fingertips are not the only contacts."""
HINTS = {
    SUPPORT: {
        ContactPhase.STICK: "The body rests on the support",
        ContactPhase.SLIP: "The body slides on the support",
    },
    RAIL: {
        ContactPhase.STICK: "The fingertip sticks to the object, or the object to the rail",
        ContactPhase.SLIP_FORWARD: "It slips; the object moves along the rail",
        ContactPhase.SLIP_BACKWARD: "It slips; the object moves back along the rail",
    },
}
"""Hints of phases where fingertips are not the only contacts."""
# Contacts where they are not named after fingers.
_NAMES: Mapping[Space, tuple[str, ...]] = {SUPPORT: ("body",), RAIL: ("fingertip", "object")}
# Phases by friction model; the pyramid has one phase of each kind.
_PHASES = {
    "line": (ContactPhase.STICK, ContactPhase.SLIP_FORWARD, ContactPhase.SLIP_BACKWARD),
    "cone": (ContactPhase.STICK, ContactPhase.SLIP),
    "pyramid": (
        ContactPhase.STICK,
        SLIPS_ALONG_ONE_TANGENT[0],
        SLIPS_ALONG_BOTH_TANGENTS[0],
    ),
}


class EventKind(StrEnum):
    """Kind of event."""

    SLIP = "slip"
    STICK = "stick"
    CHANGE = "change"
    PUSH = "push"
    LOW_FRICTION_PATCH = "low-friction patch"
    END = "end"


@dataclass(frozen=True, slots=True)
class RunEvent:
    """An event of a run.

    Attributes:
        time: Time of the event [s].
        kind: Kind of event.
        text: Description.
        phase: New phase of the contact; None for other events.
        part: Related part of the scenario; empty if there is none.
    """

    time: float
    kind: EventKind
    text: str
    phase: ContactPhase | None = None
    part: str = ""


def phases_in(scenario: Scenario) -> tuple[ContactPhase, ...]:
    """Possible phases of a contact, one of each kind."""
    return _PHASES[scenario.friction_cone]


def events_of(result: RunResult) -> list[RunEvent]:
    """All events of a run, in time order."""
    during = [*_phase_events(result), *_timed_changes(result), *_disturbances(result)]
    happened = [event for event in during if event.time <= result.end_time]
    return sorted([*happened, _end_of(result)], key=lambda event: event.time)


def neighbouring_event_time(result: RunResult, time: float, direction: int) -> float:
    """Time of the next (1) or the previous (-1) event [s].

    Args:
        result: The run.
        time: Current time [s].
        direction: 1 or -1; after the last event the result is the end of the run, before the first
            event its start.
    """
    first = float(result.trace.times[0])
    times = np.unique([first, *(event.time for event in events_of(result))])
    return neighbouring_time(times, time, direction)


def next_slip_time(result: RunResult, time: float) -> float | None:
    """Time of the next onset of slip [s]; after the last one the first; None without slip.

    Args:
        result: The run.
        time: Current time [s].
    """
    times = [event.time for event in _phase_events(result) if event.kind is EventKind.SLIP]
    later = [each for each in times if each > time]
    return min(later or times, default=None)


def _phase_events(result: RunResult) -> Iterator[RunEvent]:
    names = _NAMES.get(result.scenario.space, result.scenario.finger_names)
    for change in result.phase_changes:
        name = names[change.contact]
        text = f"{name} {_what_it_does(result, change)}"
        sticks = change.to_phase is ContactPhase.STICK
        kind = EventKind.STICK if sticks else EventKind.SLIP
        yield RunEvent(change.time, kind, text, change.to_phase)


def _what_it_does(result: RunResult, change: PhaseChange) -> str:
    if change.to_phase is ContactPhase.STICK:
        return "sticks again"
    starts = change.from_phase is ContactPhase.STICK
    return f"{'starts' if starts else 'turns'} to slip {_way(result, change)}".rstrip()


def _way(result: RunResult, change: PhaseChange) -> str:
    """Direction in which the fingertip slips on its face, as seen at that time."""
    row = min(int(np.searchsorted(result.trace.times, change.time)), len(result.trace) - 1)
    scenario = result.scenario
    if isinstance(scenario, SupportScenario):
        return ""
    if isinstance(scenario, RailScenario):
        sign, angle = int(change.to_phase), scenario.finger.angle
        if change.contact > 0:
            return _direction_words(sign, 0.0)
        return _direction_words(-sign * math.sin(angle), -sign * math.cos(angle))
    if isinstance(scenario, SpatialScenario):
        return _way_on_face(result, change, row)
    frame = contact_frame(scenario.object, scenario.fingers[change.contact])
    turned = frame.curvature * float(result.trace.slip[row, change.contact])
    angle = float(result.trace.object_pose[row, 2]) - turned
    (tx, ty), sign = frame.tangent, int(change.to_phase)
    return _direction_words(
        sign * (math.cos(angle) * tx - math.sin(angle) * ty),
        sign * (math.sin(angle) * tx + math.cos(angle) * ty),
    )


def _way_on_face(result: RunResult, change: PhaseChange, row: int) -> str:
    """Like `_way`, for a spatial hand, seen from outside the object with the first tangent up."""
    slips = result.trace.slip_velocity[row:, 2 * change.contact : 2 * change.contact + 2]
    moving = slips[np.any(slips != 0.0, axis=1)]
    if len(moving) == 0:
        return "on its face"
    up, right = moving[0].tolist()
    return f"{_direction_words(right, up)} on its face"


def _direction_words(right: float, up: float) -> str:
    if abs(up) >= abs(right):
        return "up" if up > 0.0 else "down"
    return "to the right" if right > 0.0 else "to the left"


def _timed_changes(result: RunResult) -> Iterator[RunEvent]:
    draft = Draft.starting_from("", result.scenario)
    for change in main_changes(draft):
        if change.key == LAW:
            text = f"the control law becomes {law_change_words(draft, change)}"
        else:
            scenario = result.scenario
            words = key_words(change.key, scenario.finger_names, scenario.space)
            text = f"{words} becomes {change.value}"
        yield RunEvent(change.time, EventKind.CHANGE, text)


def _disturbances(result: RunResult) -> Iterator[RunEvent]:
    """Starts of pushes, starts and ends of low-friction patches."""
    counts = {PUSH: 0, PATCH: 0}
    for disturbance in disturbances_of(result.scenario):
        place = disturbance.place
        part, counts[place] = f"{place}.{counts[place]}", counts[place] + 1
        kind = EventKind.PUSH if place == PUSH else EventKind.LOW_FRICTION_PATCH
        yield RunEvent(disturbance.time, kind, disturbance_words(disturbance), part=part)
        end_time = disturbance.values.get("end_time")
        if end_time is not None:
            face = str(disturbance.values["face"]).replace("-", " ")
            yield RunEvent(end_time, kind, f"the low-friction patch on {face} disappears")


def _end_of(result: RunResult) -> RunEvent:
    """The end of the run, with the reason for an early end."""
    if result.reason is not None:
        return RunEvent(result.end_time, EventKind.END, f"the run ends: {result.reason.message}")
    completed = result.outcome is Outcome.COMPLETED
    text = "the run is complete" if completed else f"the run ends: {result.outcome.value}"
    return RunEvent(result.end_time, EventKind.END, text)
