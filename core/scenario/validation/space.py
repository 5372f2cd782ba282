"""Checks a scenario of a spatial hand: body, faces, reach, motion and control."""

from __future__ import annotations

import math
from collections.abc import Iterator

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario.chain import NUM_JOINTS, chain_start
from slipgrasp.core.scenario.spatial import SpatialFinger, SpatialObject, SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import (
    distance_inside,
    spatial_contact,
    tip_at_start,
)
from slipgrasp.core.scenario.validation.chains import check_joints, check_reach, check_within_limits
from slipgrasp.core.scenario.validation.hands import not_computed
from slipgrasp.core.scenario.validation.outline import check_outline

UNIT_LENGTH = 1e-6
LEAST_RADIUS = 1e-3  # as a fraction of the links' lengths, from the yaw axis


def check_body(scenario: SpatialScenario) -> Iterator[FieldError]:
    """Checks that the principal inertias are physical and the start attitude is a rotation."""
    inertias = scenario.object.inertias
    k = max(range(3), key=lambda axis: inertias[axis])
    others = sum(inertias) - inertias[k]
    if inertias[k] > others * (1.0 + UNIT_LENGTH):
        words = (
            f"is {inertias[k]:g} kg m², more than the sum of the other two, {others:g} kg m², "
            "which is impossible for a rigid body; lower it or raise the others"
        )
        yield FieldError.at(f"object.inertias.{k}", inertias[k], f"at most {others:g} kg m²", words)
    length = math.sqrt(sum(part * part for part in scenario.trajectory.start[3:]))
    if abs(length - 1.0) > UNIT_LENGTH:
        words = (
            f"to .6 are a quaternion of length {length:.7g}, but a rotation has length 1; divide "
            "them by this length"
        )
        yield FieldError.at("trajectory.start.3", length, "1", words)


def check_spatial_contacts(scenario: SpatialScenario) -> Iterator[FieldError]:
    """Checks that every fingertip starts on an existing face and within reach of its finger."""
    if any(check_outline(scenario)) or any(check_body(scenario)):
        return
    names = scenario.object.face_names
    for i, finger in enumerate(scenario.fingers):
        if finger.face not in names:
            words = f"is '{finger.face}', but the object has the faces {', '.join(names)}"
            yield FieldError.at(f"fingers.{i}.face", finger.face, ", ".join(names), words)
            continue
        beyond = _beyond_face(scenario.object, finger)
        if beyond >= 0.0:
            x, y = finger.contact_offset
            words = (
                f"is {x:g}, {y:g} m, {beyond:.4g} m beyond the edge of {finger.face}; move it "
                "towards 0, 0"
            )
            key = f"fingers.{i}.contact_offset"
            yield FieldError.at(key, f"{x:g}, {y:g}", f"on {finger.face}", words)
        if finger.kind == "links":
            yield from _check_reach(scenario, i)
        elif finger.kind == "chain":
            yield from _check_chain(scenario, i)


def _beyond_face(body: SpatialObject, finger: SpatialFinger) -> float:
    """Distance of the initial contact from its face [m]; negative inside."""
    if body.shape == "sphere":
        return math.hypot(*finger.contact_offset) - 0.5 * math.pi * body.radius
    return -distance_inside(spatial_contact(body, finger).outline, (0.0, 0.0))


def _check_reach(scenario: SpatialScenario, i: int) -> Iterator[FieldError]:
    x, y, z = tip_at_start(scenario, i)
    lengths, radius = scenario.fingers[i].link_lengths, math.sqrt(x * x + y * y)
    errors = [*check_reach(i, lengths, math.sqrt(x * x + y * y + z * z))]
    if not errors and radius < LEAST_RADIUS * sum(lengths):
        limit = f"at least {LEAST_RADIUS * sum(lengths):g} m"
        words = (
            f"fingers.{i} starts with its tip {radius:.3g} m from the vertical axis through its "
            f"base (singular); {limit} is required: move the base"
        )
        errors.append(FieldError(f"fingers.{i}.base", radius, limit, words))
    yield from errors


def _check_chain(scenario: SpatialScenario, i: int) -> Iterator[FieldError]:
    """Checks that a chain has three independent joints and starts within its limits."""
    finger, field = scenario.fingers[i], f"fingers.{i}.joints"
    found = [*check_joints(field, finger.joints, NUM_JOINTS)]
    if not any(finger.attitude):
        words = f"fingers.{i}.attitude has length 0; a quaternion of a rotation has length 1"
        found.append(FieldError(f"fingers.{i}.attitude", 0.0, "not 0, 0, 0, 0", words))
    yield from found or _check_start(scenario, i)


def _check_start(scenario: SpatialScenario, i: int) -> Iterator[FieldError]:
    finger = scenario.fingers[i]
    chain = finger.attitude, finger.joints, finger.tip
    start = chain_start(*chain, tip_at_start(scenario, i), finger.posture)
    if start is None:
        words = (
            f"fingers.{i} cannot reach its contact from fingers.{i}.posture, or passes a "
            "singularity; move the base, the start pose or the posture"
        )
        yield FieldError(f"fingers.{i}.posture", None, "near the start", words)
        return
    yield from check_within_limits(i, finger.joints, start[1])


def check_sampled_only(scenario: SpatialScenario) -> Iterator[FieldError]:
    """Checks that control of spatial hands is sampled."""
    if scenario.controller.control_period == 0.0:
        yield not_computed(
            scenario,
            "controller.control_period",
            "0 s (continuous control)",
            "set it to the time between control updates, for example 0.001 s",
        )
