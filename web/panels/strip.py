"""The timeline as HTML: a lane per contact with its phases, events, and a time axis.

The page's script moves the play head over it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from itertools import cycle
from typing import NamedTuple

import numpy as np

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import FINGERS, PHASES
from slipgrasp.web.model.colours import css, sign
from slipgrasp.web.model.events import EventKind, RunEvent, events_of
from slipgrasp.web.model.intents.playback import Seek
from slipgrasp.web.model.intents.selection import Select
from slipgrasp.web.model.playback import Playback, TimeWindow
from slipgrasp.web.model.selection import finger_part
from slipgrasp.web.model.view import Ghost
from slipgrasp.web.page.markup import click_attribute, clickable

_CELLS = 480
_NUM_TICKS = 6
_MARK_WIDTH = 0.012
_TOLD_EVENTS = 6
_NO_PHASE = -9
_SIGNS = {
    EventKind.SLIP: "▼",
    EventKind.STICK: "▲",
    EventKind.CHANGE: "◆",
    EventKind.PUSH: "►",
    EventKind.LOW_FRICTION_PATCH: "●",
    EventKind.END: "■",
}
_NAME_HINT = "Shows the controls of this finger; its lines in the charts have this colour"
_WEIGHTS = (
    EventKind.END,
    EventKind.PUSH,
    EventKind.LOW_FRICTION_PATCH,
    EventKind.CHANGE,
    EventKind.SLIP,
    EventKind.STICK,
)


class Tick(NamedTuple):
    """A label of the time axis.

    Attributes:
        share: Position in the window, from 0 to 1.
        label: Number, in the unit of the axis.
    """

    share: float
    label: str


def strip_html(result: RunResult, playback: Playback, ghost: Ghost | None) -> str:
    """The timeline over the window of a play head.

    Args:
        result: The run.
        playback: Window, and initial position of the play head.
        ghost: The ghost; its phases are a thin lane below each lane.
    """
    window = playback.window
    pale = None if ghost is None else ghost.run
    ticks, unit = axis_ticks(window)
    names = "".join(
        f"<span {clickable(_NAME_HINT, Select(finger_part(i)))} "
        f'style="--sg-finger:{sign(colour)}">{escape(name)}</span>'
        for i, (name, colour) in enumerate(
            zip(result.scenario.finger_names, cycle(FINGERS), strict=False)
        )
    )
    lanes = "".join(
        _lane_html(result, pale, contact, window) for contact in range(len(result.scenario.fingers))
    )
    share = (playback.time - window.start) / max(window.length, 1e-12)
    line = f'<div class="sg-head" data-sg-head="" style="--sg-share:{share:.5f}"></div>'
    return (
        f'<div class="sg-strip{" sg-with-ghost" if pale else ""}">'
        f'<div class="sg-names"><span class="sg-events"></span>{names}'
        f'<span class="sg-axis">{unit}</span></div>'
        '<div class="sg-track" data-sg-track="" tabindex="0" role="group" '
        'aria-label="Time: click or drag to move the play head">'
        f'<div class="sg-events">{_marks_html(events_of(result), window)}</div>'
        f'{lanes}<div class="sg-axis">{_ticks_html(ticks)}</div>{line}</div></div>'
    )


def phase_spans(
    result: RunResult, contact: int, window: TimeWindow, cells: int = _CELLS
) -> Iterator[tuple[int, int, ContactPhase]]:
    """Time ranges of one phase, in cells of a window: first cell, number of cells, phase.

    A cell with any slip counts as slip. After the end of a run there are none.

    Args:
        result: The run.
        contact: Index of the contact.
        window: Time range of the timeline.
        cells: Number of cells; shorter ranges have the width of a cell.
    """
    times, phase = result.trace.times, result.trace.phase[:, contact]
    edges = window.start + np.arange(cells + 1) / cells * window.length
    rows = np.maximum(np.searchsorted(times, edges, side="right") - 1, 0)
    slipping = np.flatnonzero(phase)
    first = np.searchsorted(slipping, rows[:-1])
    slips = np.append(slipping, len(times))[first] <= rows[1:]
    phases = np.where(slips, np.append(phase[slipping], 0)[first], 0)
    count = int(np.searchsorted(edges[:-1], times[-1], side="right"))
    starts = np.flatnonzero(np.diff(phases[:count], prepend=_NO_PHASE) != 0)
    ends = [*starts[1:], count][: len(starts)]
    for start, end in zip(starts, ends, strict=True):
        yield int(start), int(end - start), ContactPhase(int(phases[start]))


def axis_ticks(window: TimeWindow) -> tuple[list[Tick], str]:
    """Labels of a time axis at round times, and their unit.

    Args:
        window: Time range of the axis.
    """
    scale, unit = (1e3, "ms") if window.end < 1.0 else (1.0, "s")
    start, end = scale * window.start, scale * window.end
    step = _round_step((end - start) / _NUM_TICKS)
    digits = max(-math.floor(math.log10(step) + 1e-9), 0)
    first, last = math.ceil(start / step - 1e-9), math.floor(end / step + 1e-9)
    length = max(end - start, 1e-12)
    return [
        Tick((number * step - start) / length, f"{number * step:.{digits}f}")
        for number in range(first, last + 1)
    ], unit


def clock_words(seconds: float) -> str:
    """Formats the time next to the play head; the page's script uses the same format."""
    return f"{1e3 * seconds:.1f} ms" if seconds < 1.0 else f"{seconds:.3f} s"


def _round_step(least: float) -> float:
    """The smallest of 1, 2 and 5 times a power of ten that is not smaller."""
    power = 10.0 ** math.floor(math.log10(max(least, 1e-9)))
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= least - 1e-12)


def _lane_html(result: RunResult, pale: RunResult | None, contact: int, window: TimeWindow) -> str:
    lane = _bars_html("sg-lane", phase_spans(result, contact, window))
    if pale is None:
        return lane
    has_contact = contact < len(pale.scenario.fingers)
    spans = phase_spans(pale, contact, window) if has_contact else ()
    return lane + _bars_html("sg-ghost-lane", spans)


def _bars_html(name: str, spans: Iterable[tuple[int, int, ContactPhase]]) -> str:
    bars = "".join(
        f'<rect x="{start}" width="{length}" height="1" fill="{css(PHASES[phase])}"/>'
        for start, length, phase in spans
    )
    return (
        f'<svg class="{name}" viewBox="0 0 {_CELLS} 1" preserveAspectRatio="none" '
        f'aria-hidden="true">{bars}</svg>'
    )


def _marks_html(events: Iterable[RunEvent], window: TimeWindow) -> str:
    """A mark per event; overlapping ones are merged."""
    bins: dict[int, list[RunEvent]] = {}
    for event in events:
        if window.start <= event.time <= window.end:
            share = (event.time - window.start) / max(window.length, 1e-12)
            bins.setdefault(round(share / _MARK_WIDTH), []).append(event)
    return "".join(_mark_html(together, window) for together in bins.values())


def _mark_html(events: Sequence[RunEvent], window: TimeWindow) -> str:
    event = min(events, key=lambda event: _WEIGHTS.index(event.kind))
    share = (event.time - window.start) / max(window.length, 1e-12)
    told = [f"{clock_words(e.time)}: {e.text}" for e in events[:_TOLD_EVENTS]]
    if len(events) > _TOLD_EVENTS:
        told.append(f"and {len(events) - _TOLD_EVENTS} more")
    colour = "currentColor" if event.phase is None else sign(PHASES[event.phase])
    return (
        f'<span class="sg-mark" role="button" {_click_of(event)} '
        f'style="left:{100 * share:.2f}%;color:{colour}" title="{escape(chr(10).join(told))}">'
        f"{_SIGNS[event.kind]}</span>"
    )


def _click_of(event: RunEvent) -> str:
    """Attribute of an event: a click moves the play head there and selects its part."""
    selected = (Select(event.part),) if event.part else ()
    return click_attribute(Seek(event.time), *selected)


def _ticks_html(ticks: Iterable[Tick]) -> str:
    return "".join(
        f'<span style="left:{100 * tick.share:.2f}%">{tick.label}</span>' for tick in ticks
    )
