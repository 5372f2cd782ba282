"""Times of slip, and the time range for a close-up."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.types import ContactPhase

_SHORTEST = 1e-3
_LONGEST_SHARE = 0.25
_MERGED_SHARE = 0.02
_LEAST_SHARE = 1e-3
_BEFORE = 0.15
_AFTER = 0.6
_GAP = 3.0  # [mm]


class Window(NamedTuple):
    """A time range [s]."""

    start: float
    end: float


class View(NamedTuple):
    """A time range, and its position on the page [mm]."""

    name: str
    window: Window
    left: float
    width: float

    @property
    def time_label(self) -> str:
        """Label of its time axis."""
        return r"$t$ [s]" if self.name == "whole" else r"$t$ [s], closer look"


def views_of(
    whole: Window, look: Window | None, left: float, width: float, share: float
) -> tuple[View, ...]:
    """A close-up on the left, if there is one, and the whole run.

    Args:
        whole: Time range of the whole run.
        look: Time range of the close-up; None without one.
        left: Start of both on the page [mm].
        width: Their width [mm].
        share: Fraction of the width for the close-up.
    """
    if look is None:
        return (View("whole", whole, left, width),)
    narrow = share * width
    rest = View("whole", whole, left + narrow + _GAP, width - narrow - _GAP)
    return (View("slip", look, left, narrow), rest)


class PhaseSpan(NamedTuple):
    """A time range in which the phase of a contact is constant [s]."""

    phase: ContactPhase
    start: float
    end: float


def whole_run(result: RunResult) -> Window:
    """From the start to the end of the run; never empty."""
    start, end = float(result.trace.times[0]), result.end_time
    return Window(start, max(end, start + _SHORTEST))


def phase_spans(result: RunResult, contact: int) -> tuple[PhaseSpan, ...]:
    """The phases of one contact in time order; every run starts in stick."""
    start, end = whole_run(result)
    changes = [change for change in result.phase_changes if change.contact == contact]
    times = [start, *(change.time for change in changes), end]
    phases = [ContactPhase.STICK, *(change.to_phase for change in changes)]
    spans = zip(phases, pairwise(times), strict=True)
    return tuple(PhaseSpan(phase, *times) for phase, times in spans if times[1] > times[0])


def closer_look(result: RunResult) -> Window | None:
    """The longest episode of slip, with a margin.

    Returns:
        The time range, or None if nothing slips or if the episode is easy to see in a figure of the
        whole run.
    """
    start, end = whole_run(result)
    duration = end - start
    episodes = _slip_episodes(result, gap=_MERGED_SHARE * duration)
    if not episodes:
        return None
    longest = max(episodes, key=lambda episode: episode.end - episode.start)
    length = max(longest.end - longest.start, _LEAST_SHARE * duration)
    if length > _LONGEST_SHARE * duration:
        return None
    return Window(
        max(start, longest.start - _BEFORE * length), min(end, longest.end + _AFTER * length)
    )


def _slip_episodes(result: RunResult, gap: float) -> list[Window]:
    """Times at which any contact slips; episodes separated by at most a gap are merged."""
    slips = sorted(
        Window(span.start, span.end)
        for contact in range(result.trace.shape.num_contacts)
        for span in phase_spans(result, contact)
        if span.phase is not ContactPhase.STICK
    )
    episodes: list[Window] = []
    for slip in slips:
        if episodes and slip.start <= episodes[-1].end + gap:
            episodes[-1] = Window(episodes[-1].start, max(episodes[-1].end, slip.end))
        else:
            episodes.append(slip)
    return episodes
