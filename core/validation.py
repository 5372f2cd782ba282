"""What a single field cannot say: conditions between the fields of a scenario."""

from __future__ import annotations

import math
from collections.abc import Iterator

from core.exceptions import FieldError, ScenarioError
from core.geometry import contact_frame, tip_distance
from core.scenario import FingerParameters, Scenario
from core.unknowns import parse_unknown

__all__ = ["check_scenario"]

MAX_ROWS = 2_000_000
MIN_CONTROL_PERIOD = 1e-4
MIN_POSITION_GAIN = 1e-3
MIN_SINE_OF_SECOND_JOINT = 1e-3


def check_scenario(scenario: Scenario) -> None:
    """Raises if the fields of a scenario do not fit together.

    Raises:
        ScenarioError: With one entry per wrong field.
    """
    errors = [
        *_check_start_pose(scenario),
        *_check_estimates(scenario),
        *_check_gains(scenario),
        *_check_least_gain(scenario),
        *_check_control(scenario),
        *_check_times(scenario),
    ]
    if errors:
        raise ScenarioError(errors)


def _check_start_pose(scenario: Scenario) -> Iterator[FieldError]:
    for i, finger in enumerate(scenario.fingers):
        frame = contact_frame(scenario.object, finger)
        if not frame.slip_minimum < 0.0 < frame.slip_maximum:
            half = 0.5 * (frame.slip_maximum - frame.slip_minimum)
            yield FieldError(
                field=f"fingers.{i}.contact_offset",
                value=finger.contact_offset,
                limit=f"-{half:g} … {half:g} m",
                message=(
                    f"fingers.{i}.contact_offset is {finger.contact_offset:g} m, beyond the end of"
                    f" the face at {half:g} m"
                ),
            )
        yield from _check_reach(i, finger, tip_distance(scenario, i))


def _check_reach(i: int, finger: FingerParameters, distance: float) -> Iterator[FieldError]:
    first, second = finger.link_lengths
    cosine = (distance**2 - first**2 - second**2) / (2.0 * first * second)
    near, far = abs(first - second), first + second
    if abs(cosine) > 1.0:
        yield FieldError(
            field=f"fingers.{i}.base",
            value=distance,
            limit=f"{near:g} … {far:g} m",
            message=(
                f"fingers.{i} cannot reach its contact: it is {distance:.4g} m from the base, the "
                f"finger reaches {near:g} … {far:g} m; move the base, the start pose or lengthen "
                "the links"
            ),
        )
    elif math.sqrt(1.0 - cosine**2) < MIN_SINE_OF_SECOND_JOINT:
        yield FieldError(
            field=f"fingers.{i}.base",
            value=distance,
            limit=f"inside {near:g} … {far:g} m",
            message=(
                f"fingers.{i} starts straight or folded (singular): its contact is {distance:.4g} "
                "m from the base; move the base or the start pose"
            ),
        )


def _check_estimates(scenario: Scenario) -> Iterator[FieldError]:
    seen: set[str] = set()
    kinds: set[str] = set()
    for i, estimate in enumerate(scenario.estimates):
        key = f"estimates.{i}"
        unknown = parse_unknown(scenario, estimate.parameter)
        if unknown is None:
            yield FieldError(
                field=f"{key}.parameter",
                value=estimate.parameter[:80],
                limit="object.mass, object.inertia, fingers.N.friction, fingers.N.link_masses.K",
                message=(
                    f"{key}.parameter '{estimate.parameter[:80]}' cannot be estimated; "
                    "object.mass, object.inertia, fingers.N.friction and fingers.N.link_masses.K "
                    "can"
                ),
            )
            continue
        if estimate.parameter in seen:
            yield FieldError(
                field=f"{key}.parameter",
                value=estimate.parameter,
                limit="each parameter once",
                message=f"{key}.parameter '{estimate.parameter}' is estimated twice",
            )
        seen.add(estimate.parameter)
        kinds.add(unknown.kind)
        low = -math.inf if estimate.minimum is None else estimate.minimum
        high = math.inf if estimate.maximum is None else estimate.maximum
        if not low <= estimate.initial <= high or low >= high:
            yield FieldError(
                field=f"{key}.initial",
                value=estimate.initial,
                limit=f"{low:g} … {high:g}",
                message=(
                    f"{key}.initial is {estimate.initial:g}, outside its own bounds {low:g} … "
                    f"{high:g}"
                ),
            )
    if {"link_mass", "friction"} <= kinds:
        yield FieldError(
            field="estimates",
            value=None,
            limit="link masses or friction, not both",
            message=(
                "estimates: link masses and friction cannot be unknown at once, their product "
                "makes the regression bilinear; estimate one kind and give the other"
            ),
        )


def _check_gains(scenario: Scenario) -> Iterator[FieldError]:
    num_coordinates = 3 + len(scenario.fingers)
    sizes = {
        "velocity_gain": num_coordinates,
        "lyapunov_weight": num_coordinates,
        "adaptation_gain": len(scenario.estimates),
    }
    for name, size in sizes.items():
        value = getattr(scenario.controller, name)
        if isinstance(value, tuple) and len(value) != size:
            yield FieldError(
                field=f"controller.{name}",
                value=len(value),
                limit=f"{size} numbers",
                message=f"controller.{name} has {len(value)} numbers; give one number, or {size}",
            )


def _check_least_gain(scenario: Scenario) -> Iterator[FieldError]:
    """A tiny K_p makes P12 = Q / (2 K_p) of Eq. 25 huge, and the adaptation with it."""
    gain = scenario.controller.position_gain
    for value in gain if isinstance(gain, tuple) else (gain,):
        if 0.0 < value < MIN_POSITION_GAIN:
            yield FieldError(
                field="controller.position_gain",
                value=value,
                limit=f"0 or at least {MIN_POSITION_GAIN:g} 1/s^2",
                message=(
                    f"controller.position_gain is {value:g} 1/s^2; 0 means no position feedback, "
                    f"otherwise at least {MIN_POSITION_GAIN:g} 1/s^2"
                ),
            )


def _check_control(scenario: Scenario) -> Iterator[FieldError]:
    period = scenario.controller.control_period
    if 0.0 < period < MIN_CONTROL_PERIOD:
        yield FieldError(
            field="controller.control_period",
            value=period,
            limit=f"0 or at least {MIN_CONTROL_PERIOD:g} s",
            message=(
                f"controller.control_period is {period:g} s; 0 means continuous control, otherwise"
                f" at least {MIN_CONTROL_PERIOD:g} s"
            ),
        )
    if len(scenario.fingers) > 2 and scenario.controller.grasp_force == "minimum":
        yield FieldError(
            field="controller.grasp_force",
            value="minimum",
            limit="none for more than two fingers",
            message=(
                "controller.grasp_force 'minimum' is available for two fingers; use 'none' for more"
            ),
        )


def _check_times(scenario: Scenario) -> Iterator[FieldError]:
    simulation = scenario.simulation
    rows = simulation.duration * simulation.output_rate
    if rows > MAX_ROWS:
        yield FieldError(
            field="simulation.output_rate",
            value=simulation.output_rate,
            limit=f"{MAX_ROWS} samples",
            message=(
                f"simulation.duration times output_rate asks for {rows:.3g} samples, at most "
                f"{MAX_ROWS}; lower one of them"
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
