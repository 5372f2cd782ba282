"""Sentences about the slips of a hand: how far, until when, with which push, below which force."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.scenario import AnyPulse
from slipgrasp.core.trace.types import ContactPhase, Outcome, PhaseChange
from slipgrasp.core.words.phrases import joined, length_words, milliseconds, sentence, some_of

Values = NDArray[np.float64]

_SOON = 0.05
"""Longest time from a change to a slip that may be due to it [s]."""
_LEAST_FORCE = 1e-3  # [N]
_CLEARLY_MORE = 1.2
_TIP = "fingertip"
_PUSHES = 2
"""Largest number of pushes whose slips are named."""


def describe_slips(result: RunResult) -> str:
    """Slip distances and times of the contacts; without slip, the smallest margin."""
    names, paths = result.scenario.finger_names, result.metrics.slip_path
    spins = result.metrics.spin_path or (0.0,) * len(paths)
    # The spin of a contact that only sticks can be a rounding error.
    has_slipped = (result.trace.phase != ContactPhase.STICK).any(axis=0)
    slipped = [i for i, path in enumerate(paths) if path > 0.0 or has_slipped[i]]
    if not slipped:
        return f"No fingertip slipped{_describe_least_margin(result)}."
    who = some_of([names[i] for i in slipped], len(names), _TIP)
    lengths = {names[i]: length_words(paths[i]) for i in slipped}
    if len(set(lengths.values())) == 1:
        slips = f"by {lengths[names[slipped[0]]]}"
    else:
        slips = f"({', '.join(f'{name}: {length}' for name, length in lengths.items())})"
    pivots = _describe_pivots([spins[i] for i in slipped])
    facts = (f"slipped {slips}", pivots, _describe_end_of_slip(result))
    return sentence(f"{who} {joined([fact for fact in facts if fact])}")


def _describe_pivots(spins: Sequence[float]) -> str:
    """The angle that some fingertips turned on their faces [rad]; empty if less than a degree."""
    degrees = {f"{math.degrees(spin):.0f}°" for spin in spins}
    largest = f"{math.degrees(max(spins)):.0f}°"
    if max(spins) < math.radians(1.0):
        return ""
    return f"pivoted by {largest}" if len(degrees) == 1 else f"pivoted by up to {largest}"


def describe_causes(result: RunResult) -> Iterator[str]:
    """Fingertips that began to slip with the first two such pushes, and after the first change."""
    every = _onsets(result)
    pushes = sorted(result.scenario.pulses, key=lambda push: push.time)
    yield from islice(filter(None, (_push_words(result, push, every) for push in pushes)), _PUSHES)
    onsets = [c for c in every if c.time > 0.0]
    for change in sorted(result.scenario.changes, key=lambda change: change.time):
        soon = [c for c in onsets if change.time <= c.time <= change.time + _SOON]
        if soon:
            yield (
                f"Within {milliseconds(_SOON)} after {change.parameter} changed at "
                f"t = {milliseconds(change.time)}, {_tips_of(result, soon)} began to slip."
            )
            return


def _push_words(result: RunResult, push: AnyPulse, onsets: Sequence[PhaseChange]) -> str:
    """Fingertips that began to slip during a push, or else at its end; empty if none did."""
    start, end = push.time, push.time + push.duration
    when = milliseconds(start)
    if start == 0.0 and (first := [c for c in onsets if c.time == start]):
        # They may slip without the push too.
        return f"A push acted from the start, when {_tips_of(result, first)} began to slip."
    if during := [c for c in onsets if start <= c.time < end]:
        return f"During the push at t = {when} {_tips_of(result, during)} began to slip."
    other = any(each.time == end for each in result.scenario.pulses)
    if not other and (then := [c for c in onsets if c.time == end]):
        return (
            f"As the push that began at t = {when} ended, {_tips_of(result, then)} began to slip."
        )
    return ""


def _onsets(result: RunResult) -> list[PhaseChange]:
    return [c for c in result.phase_changes if c.from_phase is ContactPhase.STICK]


def _tips_of(result: RunResult, changes: Sequence[PhaseChange]) -> str:
    """The fingertips of some phase changes, within a sentence."""
    names = result.scenario.finger_names
    return some_of([names[i] for i in sorted({c.contact for c in changes})], len(names), _TIP)


def _describe_end_of_slip(result: RunResult) -> str:
    last = result.metrics.last_slip_time
    if last is None or result.metrics.slipping_at_end:
        return ""
    starts = [c.contact for c in _onsets(result)]
    often = "last " if len(starts) > len(set(starts)) else ""
    return f"{often}stopped at t = {milliseconds(last)}"


def _describe_least_margin(result: RunResult) -> str:
    """Smallest additional tangential force that would have caused slip, with contact and time."""
    margins = [
        (margin, contact)
        for contact, margin in enumerate(result.metrics.minimum_friction_margin)
        if margin is not None
    ]
    if not margins or len(result.trace) < 2:
        return ""
    least, contact = min(margins)
    if least < 0.0:
        # Only if the run ended because no phase was consistent.
        return ""
    trace = result.trace
    # In the first row, the first command has no effect yet.
    row = 1 + int(np.argmin(trace.friction_margin[1:, contact]))
    where = result.scenario.finger_names[contact]
    when = milliseconds(float(trace.times[row]))
    return f"; the least margin was {least:.2g} N, {where} at t = {when}"


def describe_grip_force(result: RunResult) -> Iterator[str]:
    """Final normal force of the contact closest to slip, and the smallest sufficient force.

    The latter for the final state, and before it where more was needed.
    """
    if not _rests_at_end(result):
        return
    trace = result.trace
    normal = trace.normal_force[-1]
    # In the first row, the first command has no effect yet.
    needed = _needed_forces(result)[1:]
    i = int(np.argmin(normal - needed[-1]))
    force, least = _distinguished(float(normal[i]), float(needed[-1, i]))
    need = f"{least} N" if force != least else "all of it"
    slipping = trace.normal_force[trace.phase[:, i] != ContactPhase.STICK, i]
    more = "faster motion or a push can require more"
    most = math.ceil(10.0 * needed[:, i].max()) / 10.0  # with which it does not slip
    if slipping.size:
        more = f"earlier it slipped while it pressed with up to {slipping.max():.1f} N"
    elif most > needed[-1, i] + 0.1:
        more = f"earlier it needed up to {most:.1f} N"
    yield (
        f"At the end the {result.scenario.finger_names[i]} fingertip presses with {force} N and "
        f"needs {need} to stick; {more}."
    )


def describe_first_force(result: RunResult) -> str:
    """Describes, as a clause, the first normal force that is most below the one needed at the end.

    Empty if no fingertip pressed with clearly less, or if the run does not end at rest.
    """
    if not _rests_at_end(result):
        return ""
    trace, needed = result.trace, _needed_forces(result)[-1]
    # The last row of the first instant contains the effect of the first command.
    first = trace.normal_force[np.searchsorted(trace.times, trace.times[0], side="right") - 1]
    i = int(np.argmax(needed - first))
    if needed[i] < _CLEARLY_MORE * first[i]:
        return ""
    name = result.scenario.finger_names[i]
    return (
        f" and pressed the {name} fingertip with {first[i]:.3g} N; at the end it needs "
        f"{needed[i]:.3g} N"
    )


def _rests_at_end(result: RunResult) -> bool:
    """Whether a complete run ends with all contacts loaded, with friction and in stick."""
    last = result.trace[-1:]
    sticks = (last.phase == ContactPhase.STICK).all()
    has_friction = (last.friction_coefficient > 0.0).all()
    is_loaded = last.tangential_size.max() >= _LEAST_FORCE
    return bool(result.outcome is Outcome.COMPLETED and sticks and has_friction and is_loaded)


def _needed_forces(result: RunResult) -> Values:
    """Smallest normal forces at which no contact slips, shape ``(rows, contacts)`` [N]."""
    trace = result.trace
    friction, used = trace.friction_coefficient, trace.tangential_size
    if result.scenario.has_soft_fingers:
        # The moment about the normal uses part of the friction.
        used = friction * trace.normal_force - trace.friction_margin
    return used / np.where(friction > 0.0, friction, 1.0)


def _distinguished(one: float, other: float) -> tuple[str, str]:
    """Formats two forces with as many decimals as distinguish them, at most three."""
    pairs = [(f"{one:.{digits}f}", f"{other:.{digits}f}") for digits in (1, 2, 3)]
    return next((pair for pair in pairs if pair[0] != pair[1]), pairs[-1])
