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
        yield FieldError(
            field="simulation.output_rate",
            value=simulation.output_rate,
            limit=f"{MAX_ROWS} samples",
            message=(
                f"simulation.duration times output_rate gives {rows:.3g} samples, more than the "
                f"maximum {MAX_ROWS}; lower one of them"
            ),
        )
    for i, change in enumerate(scenario.changes):
        if change.time >= simulation.duration:
            yield FieldError(
                field=f"changes.{i}.time",
                value=change.time,
                limit=f"before the end at {simulation.duration:g} s",
                message=(
                    f"changes.{i}.time is {change.time:g} s, not before the end of the run at "
                    f"{simulation.duration:g} s"
                ),
            )


def check_static_friction(scenario: Scenario) -> Iterator[FieldError]:
    """Checks that static friction is not smaller than sliding friction."""
    for i, finger in enumerate(scenario.fingers):
        least = finger.friction
        part = f"fingers.{i}" if scenario.space.has_hand else scenario.finger_names[i]
        if finger.static_friction is not None and finger.static_friction < least:
            yield FieldError(
                field=f"{part}.static_friction",
                value=finger.static_friction,
                limit=f"at least {part}.friction, {least:g}",
                message=(
                    f"{part}.static_friction is {finger.static_friction:g}, less than the "
                    f"sliding friction {least:g}; raise it, lower {part}.friction, or omit it "
                    "to use one coefficient"
                ),
            )


def check_patches(scenario: Scenario) -> Iterator[FieldError]:
    """Checks that a patch lies on a flat face and exists before the end of the run."""
    names = scenario.object.face_names
    if scenario.object.is_round and scenario.patches:
        yield FieldError(
            field="patches.0.face",
            value=scenario.patches[0].face,
            limit="a flat face",
            message=(
                f"patches.0.face is '{scenario.patches[0].face}' of an object whose shape is "
                f"'{scenario.object.shape}', but curved faces do not support patches yet; omit "
                "the patches or choose another object.shape"
            ),
        )
    for i, patch in enumerate(scenario.patches):
        key = f"patches.{i}"
        if patch.face not in names:
            yield FieldError(
                field=f"{key}.face",
                value=patch.face,
                limit=", ".join(names),
                message=(
                    f"{key}.face is '{patch.face}', which this object does not have; its faces "
                    f"are {', '.join(names)}"
                ),
            )
        yield from _check_begin(scenario, f"{key}.start_time", patch.start_time)
        if patch.end_time is not None and patch.end_time <= patch.start_time:
            yield FieldError(
                field=f"{key}.end_time",
                value=patch.end_time,
                limit=f"after {patch.start_time:g} s",
                message=(
                    f"{key}.end_time is {patch.end_time:g} s, not after its start_time "
                    f"{patch.start_time:g} s; omit it for a permanent patch"
                ),
            )


def check_pulses(scenario: Scenario) -> Iterator[FieldError]:
    """Checks that a pulse begins before the end of the run."""
    for i, pulse in enumerate(scenario.pulses):
        yield from _check_begin(scenario, f"pulses.{i}.time", pulse.time)


def _check_begin(scenario: Scenario, key: str, t: float) -> Iterator[FieldError]:
    duration = scenario.simulation.duration
    if t >= duration:
        yield FieldError(
            field=key,
            value=t,
            limit=f"before the end at {duration:g} s",
            message=f"{key} is {t:g} s, not before the end of the run at {duration:g} s",
        )
