"""Checks that the fingers touch existing faces and reach them."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario import PlanarScenario
from slipgrasp.core.scenario.chain import NUM_PLANAR_JOINTS, ChainJoint, has_limits, range_of
from slipgrasp.core.scenario.geometry import contact_frame, planar_tip_at_start, tip_distance
from slipgrasp.core.scenario.planar_chain import planar_chain_start
from slipgrasp.core.scenario.validation.chains import (
    LEAST_SINE,
    check_joints,
    check_reach,
    check_within_limits,
)
from slipgrasp.core.scenario.validation.outline import check_outline


def check_faces(scenario: PlanarScenario) -> Iterator[FieldError]:
    """Checks that every finger touches an existing face."""
    names = scenario.object.face_names
    for i, finger in enumerate(scenario.fingers):
        if finger.face not in names:
            shape = _shape_words(scenario)
            words = (
                f"is '{finger.face}', but the object is {shape} with the faces {', '.join(names)}"
            )
            yield FieldError.at(f"fingers.{i}.face", finger.face, ", ".join(names), words)


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
            key, offset = f"fingers.{i}.contact_offset", finger.contact_offset
            words = f"is {offset:g} m, beyond the end of the face at {half:g} m"
            yield FieldError.at(key, offset, f"-{half:g} … {half:g} m", words)
        if finger.kind == "links":
            yield from check_reach(i, finger.link_lengths, tip_distance(scenario, i))
        elif finger.kind == "chain":
            yield from _check_chain(scenario, i)


def _check_chain(scenario: PlanarScenario, i: int) -> Iterator[FieldError]:
    """Checks that a chain has two joints and starts within its limits."""
    finger, joints = scenario.fingers[i], scenario.fingers[i].chain.joints
    found = [*check_joints(f"fingers.{i}.joints", joints, NUM_PLANAR_JOINTS)]
    if found:
        yield from found
        return
    for k, joint in enumerate(joints):
        yield from _check_turn(f"fingers.{i}.joints.{k}", joint)
    start = planar_chain_start(finger, planar_tip_at_start(scenario, i))
    if start is None or start.sine < LEAST_SINE:
        words = (
            f"fingers.{i} cannot reach its contact, or is singular there; move the base, the start "
            "pose or the joints"
        )
        yield FieldError(f"fingers.{i}.base", None, "within reach", words)
        return
    yield from check_within_limits(i, joints, np.array(start.positions))


def _check_turn(key: str, joint: ChainJoint) -> Iterator[FieldError]:
    """Checks that the limits of a revolute joint define its angle, which is known up to a turn."""
    low, high = range_of(joint)
    if joint.kind == "revolute" and has_limits([joint]) and not high - low < 2.0 * math.pi:
        words = (
            f"{key} turns in the plane and has limits {low:g} and {high:g}, but both have to be "
            "given, less than one turn apart, or none"
        )
        yield FieldError(f"{key}.maximum", high, "less than 2 pi above the minimum", words)
