"""What happens in a run, as moments: slip begins and ends, values change, the run ends."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from core.parameter_words import key_words
from core.result import RunResult
from core.types import ContactPhase, Outcome, PhaseChange
from web.scenario.incidents import incident_words, incidents_of

__all__ = ["EventKind", "RunEvent", "events_of", "neighbouring_event_time"]


class EventKind(StrEnum):
    """What kind of thing happens."""

    SLIP = "slip"
    STICK = "stick"
    CHANGE = "change"
    PUSH = "push"
    WET_SPOT = "wet spot"
    END = "end"


@dataclass(frozen=True, slots=True)
class RunEvent:
    """Something that happens in a run.

    Attributes:
        time: When [s].
        kind: What.
        text: The same in words.
        phase: The phase that a contact has from then on; None if no contact is concerned.
    """

    time: float
    kind: EventKind
    text: str
    phase: ContactPhase | None = None


def events_of(result: RunResult) -> list[RunEvent]:
    """Everything that happens in a run, in time order."""
    during = [*_phase_events(result), *_timed_changes(result), *_incidents(result)]
    happened = [event for event in during if event.time <= result.end_time]
    return sorted([*happened, _end_of(result)], key=lambda event: event.time)


def neighbouring_event_time(result: RunResult, time: float, direction: int) -> float:
    """The time of the next (1) or the previous (-1) event [s].

    Args:
        result: The run.
        time: From where [s].
        direction: Which way; beyond the last event lies the end of the run, before the first
            its start.
    """
    first = float(result.trace.times[0])
    times = np.unique([first, *(event.time for event in events_of(result))])
    if direction > 0:
        place = int(np.searchsorted(times, time, side="right"))
    else:
        place = int(np.searchsorted(times, time, side="left")) - 1
    return float(times[min(max(place, 0), len(times) - 1)])


def _phase_events(result: RunResult) -> Iterator[RunEvent]:
    names = result.scenario.finger_names
    for change in result.phase_changes:
        text = f"{names[change.contact]} {_what_it_does(change)}"
        sticks = change.to_phase is ContactPhase.STICK
        kind = EventKind.STICK if sticks else EventKind.SLIP
        yield RunEvent(change.time, kind, text, change.to_phase)


def _what_it_does(change: PhaseChange) -> str:
    if change.to_phase is ContactPhase.STICK:
        return "sticks again"
    way = "forward" if change.to_phase is ContactPhase.SLIP_FORWARD else "backward"
    starts = change.from_phase is ContactPhase.STICK
    return f"starts to slip {way}" if starts else f"turns to slip {way}"


def _timed_changes(result: RunResult) -> Iterator[RunEvent]:
    for change in result.scenario.changes:
        words = key_words(change.parameter, result.scenario.finger_names)
        text = f"{words} becomes {change.value}"
        yield RunEvent(change.time, EventKind.CHANGE, text)


def _incidents(result: RunResult) -> Iterator[RunEvent]:
    """Pushes as they begin, wet spots as they come and go."""
    for incident in incidents_of(result.scenario):
        is_push = incident.place == "pulses"
        kind = EventKind.PUSH if is_push else EventKind.WET_SPOT
        yield RunEvent(incident.time, kind, incident_words(incident))
        end_time = incident.values.get("end_time")
        if end_time is not None:
            face = str(incident.values["face"]).replace("-", " ")
            yield RunEvent(end_time, kind, f"the wet spot on {face} dries")


def _end_of(result: RunResult) -> RunEvent:
    """The end, with its reason where it came early."""
    if result.reason is not None:
        return RunEvent(result.end_time, EventKind.END, f"the run ends: {result.reason.message}")
    completed = result.outcome is Outcome.COMPLETED
    text = "the run is complete" if completed else f"the run ends: {result.outcome.value}"
    return RunEvent(result.end_time, EventKind.END, text)
