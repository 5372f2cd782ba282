"""Checks friction, patches and the times of events."""

from __future__ import annotations

from collections.abc import Iterator

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario import Scenario

MAX_ROWS = 2_000_000


def check_times(scenario: Scenario) -> Iterator[FieldError]:
    """Checks the size of the trace, and that changes happen before the end."""
    simulation = scenario.simulation
    rows = simulation.duration * simulation.output_rate
    if rows > MAX_ROWS:
        words = (
            f"simulation.duration times output_rate gives {rows:.3g} samples, more than the "
            f"maximum {MAX_ROWS}; lower one of them"
        )
        key, rate = "simulation.output_rate", simulation.output_rate
        yield FieldError(key, rate, f"{MAX_ROWS} samples", words)
    for i, change in enumerate(scenario.changes):
        yield from _check_begin(scenario, f"changes.{i}.time", change.time)


def check_static_friction(scenario: Scenario) -> Iterator[FieldError]:
    """Checks that static friction is not smaller than sliding friction."""
    for i, finger in enumerate(scenario.fingers):
        least = finger.friction
        part = f"fingers.{i}" if scenario.space.has_hand else scenario.finger_names[i]
        if (static := finger.static_friction) is not None and static < least:
            limit = f"at least {part}.friction, {least:g}"
            words = (
                f"is {static:g}, less than the sliding friction {least:g}; raise it, lower "
                f"{part}.friction, or omit it to use one coefficient"
            )
            yield FieldError.at(f"{part}.static_friction", static, limit, words)


def check_patches(scenario: Scenario) -> Iterator[FieldError]:
    """Checks that a patch lies on a flat face and exists before the end of the run."""
    names = scenario.object.face_names
    if scenario.object.is_round and scenario.patches:
        words = (
            f"is '{scenario.patches[0].face}' of an object whose shape is "
            f"'{scenario.object.shape}', but curved faces do not support patches yet; omit the "
            "patches or choose another object.shape"
        )
        yield FieldError.at("patches.0.face", scenario.patches[0].face, "a flat face", words)
    for i, patch in enumerate(scenario.patches):
        key = f"patches.{i}"
        if patch.face not in names:
            words = (
                f"is '{patch.face}', which this object does not have; its faces are "
                f"{', '.join(names)}"
            )
            yield FieldError.at(f"{key}.face", patch.face, ", ".join(names), words)
        yield from _check_begin(scenario, f"{key}.start_time", patch.start_time)
        start, end = patch.start_time, patch.end_time
        if end is not None and end <= start:
            words = (
                f"is {end:g} s, not after its start_time {start:g} s; omit it for a permanent patch"
            )
            yield FieldError.at(f"{key}.end_time", end, f"after {start:g} s", words)


def check_pulses(scenario: Scenario) -> Iterator[FieldError]:
    """Checks that a pulse begins before the end of the run."""
    for i, pulse in enumerate(scenario.pulses):
        yield from _check_begin(scenario, f"pulses.{i}.time", pulse.time)


def _check_begin(scenario: Scenario, key: str, t: float) -> Iterator[FieldError]:
    duration = scenario.simulation.duration
    if t >= duration:
        words = f"is {t:g} s, not before the end of the run at {duration:g} s"
        yield FieldError.at(key, t, f"before the end at {duration:g} s", words)
