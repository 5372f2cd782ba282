"""Checks of the links and joints of fingers, in the plane and in space."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario.chain import (
    ChainJoint,
    Floats,
    all_positions,
    margins,
    moving,
    range_of,
)

LEAST_SINE = 1e-3  # of the last joint at the start
_ENDS, _LIMITS = ("minimum", "maximum"), ("at least", "at most")


def check_joints(field: str, joints: Sequence[ChainJoint], count: int) -> Iterator[FieldError]:
    """Checks the number of joints, their masses, axes, couplings and limits.

    Args:
        field: Dotted key of the joints.
        joints: The joints.
        count: Number of independent joints that a chain needs.
    """
    own = moving(joints)
    if len(own) != count:
        words = f"{field} has {len(own)} independent joints; a chain needs {count}"
        if len(own) > count:
            words += (
                ": lock the others when importing the hand (--lock JOINT=POSITION), or couple them "
                f"to these ({field}.{own[-1]}.follows)"
            )
        yield FieldError(field, float(len(own)), f"{count} joints", words)
    if not any(joint.mass > 0.0 for joint in joints):
        words = f"{field} have no mass; set the mass of the last one"
        yield FieldError(field, 0.0, "above 0 kg", words)
    for k, joint in enumerate(joints):
        key, (low, high) = f"{field}.{k}", range_of(joint)
        if not all(map(any, (joint.axis, joint.attitude))):
            words = f"{key} has an axis or an attitude of length 0; give it a direction"
            yield FieldError(key, 0.0, "not 0, 0, 0", words)
        if joint.follows is not None and joint.follows not in own:
            limit = ", ".join(map(str, own))
            words = f"{key}.follows is {joint.follows}, which is not an independent joint: {limit}"
            yield FieldError(f"{key}.follows", joint.follows, limit, words)
        if not low < high:
            words = f"{key}.minimum is {low:g}, which is not below {key}.maximum, {high:g}"
            yield FieldError(f"{key}.minimum", low, f"below {high:g}", words)


def check_within_limits(
    i: int, joints: Sequence[ChainJoint], positions: Floats
) -> Iterator[FieldError]:
    """Checks that finger ``i`` starts within the limits of its joints.

    Args:
        i: The finger.
        joints: Its joints.
        positions: Initial positions of the independent joints [rad, m].
    """
    left, positions = margins(joints, positions), all_positions(joints, positions)
    k = int(left.min(axis=1).argmin())
    if left[k].min() < 0.0:
        side = int(left[k].argmin())
        key, limit = f"fingers.{i}.joints.{k}.{_ENDS[side]}", range_of(joints[k])[side]
        words = (
            f"fingers.{i} starts with joint {k + 1} at {positions[k]:.4g}, beyond {key}, "
            f"{limit:g}; move the base, the start pose or the posture"
        )
        yield FieldError(key, float(positions[k]), f"{_LIMITS[side]} {limit:g}", words)


def check_reach(i: int, lengths: tuple[float, float], distance: float) -> Iterator[FieldError]:
    """Checks that finger ``i`` with two links reaches its contact, not straight or folded.

    Args:
        i: The finger.
        lengths: Lengths of its links [m].
        distance: Distance of its contact from its base [m].
    """
    first, second = lengths
    cosine = (distance**2 - first**2 - second**2) / (2.0 * first * second)
    limit = f"{abs(first - second):g} … {first + second:g} m"
    if abs(cosine) > 1.0:
        words = (
            f"fingers.{i} cannot reach its contact: it is {distance:.4g} m from the base, the "
            f"finger reaches {limit}; move the base or the start pose, or lengthen the links"
        )
        yield FieldError(f"fingers.{i}.base", distance, limit, words)
    elif math.sqrt(1.0 - cosine**2) < LEAST_SINE:
        words = (
            f"fingers.{i} starts straight or folded (singular): its contact is {distance:.4g} m "
            "from the base; move the base or the start pose"
        )
        yield FieldError(f"fingers.{i}.base", distance, f"inside {limit}", words)
