"""Checks that the fingers touch existing faces and reach them."""

from __future__ import annotations

import math
from collections.abc import Iterator

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario import FingerParameters, PlanarScenario
from slipgrasp.core.scenario.geometry import contact_frame, tip_distance
from slipgrasp.core.scenario.validation.outline import check_outline

MIN_SINE_OF_SECOND_JOINT = 1e-3


def check_faces(scenario: PlanarScenario) -> Iterator[FieldError]:
    """Checks that every finger touches an existing face."""
    names = scenario.object.face_names
    for i, finger in enumerate(scenario.fingers):
        if finger.face not in names:
            shape = _shape_words(scenario)
            yield FieldError(
                field=f"fingers.{i}.face",
                value=finger.face,
                limit=", ".join(names),
                message=(
                    f"fingers.{i}.face is '{finger.face}', but the object is {shape} with the "
                    f"faces {', '.join(names)}"
                ),
            )


def _shape_words(scenario: PlanarScenario) -> str:
    if scenario.object.is_round:
        return "a circle"
    return "a polygon" if scenario.object.corners else "a rectangle (no corners)"


def check_start_pose(scenario: PlanarScenario) -> Iterator[FieldError]:
    """Checks that every fingertip starts on its face and within reach of its finger."""
    if any(check_outline(scenario)) or any(check_faces(scenario)):
        return
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
        if finger.kind == "links":
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
                f"finger reaches {near:g} … {far:g} m; move the base or the start pose, or "
                "lengthen the links"
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
