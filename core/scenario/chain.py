"""A finger with a chain of joints, and its kinematics (docs/space.md, Chains)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import product
from typing import Annotated, Literal, NamedTuple, Protocol

import numpy as np
from annotated_types import Interval
from numpy.typing import NDArray
from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.field_types import CONFIG, Coordinate
from slipgrasp.core.scenario.parameters import Quantity, changeable

Floats = NDArray[np.float64]
Part = Annotated[float, Interval(ge=-1.0, le=1.0)]
Angle = Annotated[float, Interval(ge=-100.0, le=100.0)]
UnitInertia = Annotated[float, Interval(ge=-100.0, le=100.0)]
Attitude = tuple[Part, Part, Part, Part]

NUM_JOINTS = 3
"""Number of independent joints of a spatial chain."""
NUM_PLANAR_JOINTS = 2
"""Number of joints of a planar chain."""
MAX_LINKS = 6
"""Largest number of joints of a chain, including coupled joints."""

_MOST_STEPS, _LONGEST_STEP, _CONVERGED = 60, 0.3, 1e-12
_LEAST_SINE = 1e-3
_SHARES = (0.5, 0.25, 0.75)  # of the range of a joint


JointKind = Annotated[
    Literal["revolute", "prismatic"],
    Quantity("Type of joint: revolute (about its axis) or prismatic (along its axis)."),
]
Mass = Annotated[
    float,
    Interval(ge=0.0, le=1e3),
    changeable("True mass of the link.", "kg", typical=(0.01, 3.0)),
]
Minimum = Annotated[
    float | None,
    Interval(ge=-100.0, le=100.0),
    Quantity("Smallest position of the joint (prismatic: in m); no limit if omitted.", "rad"),
]
Maximum = Annotated[
    float | None,
    Interval(ge=-100.0, le=100.0),
    Quantity("Largest position of the joint (prismatic: in m); no limit if omitted.", "rad"),
]
TorqueLimit = Annotated[
    float | None,
    Interval(ge=1e-6, le=1e6),
    Quantity(
        "Largest torque of the joint (prismatic: force in N) if actuation.torque_limit is omitted.",
        "N m",
    ),
]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class ChainJoint:
    """A joint of a chain, and the link behind it."""

    kind: JointKind = "revolute"
    place: Annotated[
        tuple[Coordinate, Coordinate, Coordinate],
        Quantity("Position of the joint in the frame of the previous link, or of the base.", "m"),
    ] = (0.0, 0.0, 0.0)
    attitude: Annotated[
        Attitude,
        Quantity("Quaternion (w, x, y, z) of the joint's frame in that of the previous link.", "1"),
    ] = (1.0, 0.0, 0.0, 0.0)
    axis: Annotated[
        tuple[Part, Part, Part], Quantity("Direction of the axis in the joint's frame.", "1")
    ] = (0.0, 0.0, 1.0)
    mass: Mass = 1.0
    centre: Annotated[
        tuple[Coordinate, Coordinate, Coordinate],
        Quantity("Centre of mass of the link in the link's frame.", "m"),
    ] = (0.0, 0.0, 0.0)
    unit_inertia: Annotated[
        tuple[UnitInertia, UnitInertia, UnitInertia, UnitInertia, UnitInertia, UnitInertia],
        Quantity(
            "Inertia of the link about its centre of mass, divided by its mass: xx, xy, xz, yy, "
            "yz, zz.",
            "m²",
        ),
    ] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    minimum: Minimum = None
    maximum: Maximum = None
    torque_limit: TorqueLimit = None
    follows: Annotated[
        int | None,
        Interval(ge=0, le=MAX_LINKS - 1),
        Quantity("Index of the leading joint of a coupled joint; independent if omitted."),
    ] = None
    ratio: Annotated[
        float,
        Interval(ge=-100.0, le=100.0),
        Quantity("Ratio of the motion to that of the leading joint."),
    ] = 1.0
    offset: Annotated[
        Angle,
        Quantity("Position when the leading joint is at 0 (prismatic: in m).", "rad"),
    ] = 0.0


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class PlanarJoint:
    """A joint of a planar chain, about z or along an axis, and the link behind it."""

    kind: JointKind = "revolute"
    place: Annotated[
        tuple[Coordinate, Coordinate],
        Quantity("Position of the joint in the frame of the previous link, or of the base.", "m"),
    ] = (0.0, 0.0)
    attitude: Annotated[
        Angle, Quantity("Angle of the joint's frame in that of the previous link.", "rad")
    ] = 0.0
    axis: Annotated[
        tuple[Part, Part],
        Quantity("prismatic: direction of the axis in the joint's frame.", "1"),
    ] = (1.0, 0.0)
    mass: Mass = 1.0
    centre: Annotated[
        tuple[Coordinate, Coordinate],
        Quantity("Centre of mass of the link in the link's frame.", "m"),
    ] = (0.0, 0.0)
    unit_inertia: Annotated[
        float,
        Interval(ge=0.0, le=100.0),
        Quantity("Inertia of the link about its centre of mass, divided by its mass.", "m²"),
    ] = 0.0
    minimum: Minimum = None
    maximum: Maximum = None
    torque_limit: TorqueLimit = None

    @property
    def spatial(self) -> ChainJoint:
        """Its kinematics in the x-y plane of space."""
        slides = self.kind == "prismatic"
        return ChainJoint(
            kind=self.kind,
            place=(*self.place, 0.0),
            attitude=about_z(self.attitude),
            axis=(*self.axis, 0.0) if slides else (0.0, 0.0, 1.0),
            mass=self.mass,
            minimum=self.minimum,
            maximum=self.maximum,
            torque_limit=self.torque_limit,
        )


class Chain(NamedTuple):
    """A chain of a spatial finger, or of a planar finger in the x-y plane of space.

    Attributes:
        base: Position of its base [m].
        attitude: Quaternion of its base.
        joints: Its joints.
        tip: Position of the tip in the frame of the last link [m].
    """

    base: tuple[float, float, float]
    attitude: Attitude
    joints: tuple[ChainJoint, ...]
    tip: tuple[float, float, float]


class _Finger(Protocol):
    @property
    def kind(self) -> str: ...
    @property
    def chain(self) -> Chain: ...


def sliding_joints(fingers: Sequence[_Finger], count: int) -> tuple[int, ...]:
    """Indices of the prismatic joints among those of all fingers.

    Args:
        fingers: The fingers.
        count: Number of joints of every finger.
    """
    found = list[int]()
    for i, finger in enumerate(fingers):
        slides = [finger.kind == "slides"] * count
        if finger.kind == "chain":
            joints = finger.chain.joints
            slides = [joints[k].kind == "prismatic" for k in moving(joints)]
        found += [count * i + k for k, does in enumerate(slides) if does]
    return tuple(found)


def torque_limits(
    fingers: Sequence[_Finger], limit: float | None, count: int
) -> tuple[tuple[str, float | None], ...]:
    """Key and value of the torque limit of every joint, finger by finger.

    Args:
        fingers: The fingers.
        limit: The limit of all joints, which replaces their own.
        count: Number of joints of every finger.
    """
    found = list[tuple[str, float | None]]()
    for i, finger in enumerate(fingers):
        if limit is not None or finger.kind != "chain":
            found += [("actuation.torque_limit", limit)] * count
            continue
        joints = finger.chain.joints
        found += [
            (f"fingers.{i}.joints.{k}.torque_limit", joints[k].torque_limit) for k in moving(joints)
        ]
    return tuple(found)


def about_z(angle: float) -> Attitude:
    """Quaternion of a rotation about z."""
    return (math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle))


def moving(joints: Sequence[ChainJoint]) -> tuple[int, ...]:
    """Indices of the independent joints."""
    return tuple(k for k, joint in enumerate(joints) if joint.follows is None)


def couplings(joints: Sequence[ChainJoint]) -> tuple[list[list[float]], list[float]]:
    """A and b in q = A c + b: positions of all joints from those of the independent joints."""
    own = moving(joints)
    followed = [k if joint.follows is None else joint.follows for k, joint in enumerate(joints)]
    ratios = [
        [(1.0 if k in own else joint.ratio) if each == followed[k] else 0.0 for each in own]
        for k, joint in enumerate(joints)
    ]
    return ratios, [0.0 if k in own else joint.offset for k, joint in enumerate(joints)]


def all_positions(joints: Sequence[ChainJoint], positions: Floats) -> Floats:
    """Positions of all joints ``(..., joints)`` from those of the independent joints."""
    ratios, offsets = couplings(joints)
    return positions @ np.transpose(ratios) + offsets


def range_of(joint: ChainJoint) -> tuple[float, float]:
    """Smallest and largest position of a joint, infinite if unlimited [rad, m]."""
    low, high = joint.minimum, joint.maximum
    return -math.inf if low is None else low, math.inf if high is None else high


def has_limits(joints: Sequence[ChainJoint]) -> bool:
    """Whether any joint has a limit."""
    return any(math.isfinite(end) for joint in joints for end in range_of(joint))


def margins(joints: Sequence[ChainJoint], positions: Floats) -> Floats:
    """Distances of all joints from both limits, ``(joints, 2)`` [rad, m].

    Args:
        joints: The chain.
        positions: Positions of the independent joints, ``(3,)``.
    """
    lows, highs = np.transpose([range_of(joint) for joint in joints])
    found = all_positions(joints, positions)
    return np.stack([found - lows, highs - found], axis=-1)


def rotation_of(quaternion: Sequence[float]) -> Floats:
    """Returns the rotation matrix of a quaternion (w, x, y, z) of any length."""
    w, x, y, z = np.asarray(quaternion) / math.sqrt(sum(part * part for part in quaternion))
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def quaternion_of(turn: Floats) -> Attitude:
    """Returns the unit quaternion (w, x, y, z), w >= 0, of a rotation matrix."""
    # Of four multiples of the quaternion, the longest loses no digits.
    columns, trace = np.empty((4, 4)), np.trace(turn)
    skew = turn - turn.T
    columns[0, 0] = 1.0 + trace
    columns[0, 1:] = columns[1:, 0] = skew[2, 1], skew[0, 2], skew[1, 0]
    columns[1:, 1:] = turn + turn.T + (1.0 - trace) * np.eye(3)
    longest = columns[np.argmax(np.diag(columns))]
    w, x, y, z = np.clip(longest / np.linalg.norm(longest), -1.0, 1.0).tolist()
    return (w, x, y, z) if w >= 0.0 else (-w, -x, -y, -z)


def about_axis(axis: Floats, angles: Floats) -> Floats:
    """Rotation matrices about a unit vector, shape ``(..., 3, 3)``."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angles = np.asarray(angles)[..., None, None]
    return np.eye(3) + np.sin(angles) * cross + (1.0 - np.cos(angles)) * (cross @ cross)


def chain_points(
    attitude: Attitude,
    joints: Sequence[ChainJoint],
    tip: Sequence[float],
    positions: Floats,
) -> tuple[Floats, Floats]:
    """Origins of the links, position of the tip and axes of the joints, relative to the base.

    Args:
        attitude: Orientation of the base.
        joints: The chain.
        tip: Position of the tip in the frame of the last link [m].
        positions: Positions of the independent joints, on the last axis [rad, m].

    Returns:
        Points ``(..., joints + 1, 3)`` [m], axes ``(..., joints, 3)``, in world axes.
    """
    positions = all_positions(joints, np.asarray(positions))
    turn = np.broadcast_to(rotation_of(attitude), (*positions.shape[:-1], 3, 3))
    point = np.zeros((*positions.shape[:-1], 3))
    points, axes = [], []
    for k, joint in enumerate(joints):
        axis = np.asarray(joint.axis) / np.linalg.norm(joint.axis)
        point = point + turn @ np.asarray(joint.place)
        turn = turn @ rotation_of(joint.attitude)
        axes.append(turn @ axis)
        if joint.kind == "prismatic":
            point = point + axes[-1] * positions[..., k, None]
        else:
            turn = turn @ about_axis(axis, positions[..., k])
        points.append(point)
    points.append(point + turn @ np.asarray(tip))
    return np.stack(points, axis=-2), np.stack(axes, axis=-2)


def chain_positions(
    attitude: Attitude,
    joints: Sequence[ChainJoint],
    tip: Sequence[float],
    target: Sequence[float],
    posture: Sequence[float],
) -> Floats | None:
    """Joint positions that put the tip at a target, by Newton's method from a posture.

    Args:
        attitude: Orientation of the base.
        joints: The chain.
        tip: Position of the tip in the frame of the last link [m].
        target: Target of the tip, relative to the base [m].
        posture: Initial joint positions [rad, m].

    Returns:
        Positions of the independent joints, ``(3,)``; None if the tip cannot reach the target or
        the chain is singular.
    """
    slides = np.array([joint.kind == "prismatic" for joint in joints])
    ratios = np.array(couplings(joints)[0])
    length = max(chain_length(joints, tip), math.hypot(*target))
    positions = np.array(posture, float)
    for _ in range(_MOST_STEPS):
        points, axes = chain_points(attitude, joints, tip, positions)
        arms = points[-1] - points[:-1]
        columns = np.where(slides[:, None], axes, np.cross(axes, arms)).T @ ratios
        sizes = np.linalg.norm(columns, axis=0)
        if not abs(np.linalg.det(columns)) > _LEAST_SINE * sizes.prod():
            return None
        step = np.linalg.solve(columns, np.asarray(target) - points[-1])
        each = ratios @ step
        largest = np.abs(np.where(slides, each / length, each)).max()
        positions += step * min(1.0, _LONGEST_STEP / max(largest, _LONGEST_STEP))
        if largest < _CONVERGED:
            return positions
    return None


def chain_start(
    attitude: Attitude,
    joints: Sequence[ChainJoint],
    tip: Sequence[float],
    target: Sequence[float],
    posture: Sequence[float],
) -> tuple[tuple[float, ...], Floats] | None:
    """Posture from which Newton's method finds the initial joint positions, and these.

    The method starts at the given posture; if it does not converge, or converges outside the joint
    limits, it starts at several postures within the limits.

    Returns:
        Posture and positions of the independent joints, outside the limits if no solution within
        them is found; None if the tip cannot reach its target.
    """
    first = None
    for seed in (tuple(posture), *_postures(joints)):
        found = chain_positions(attitude, joints, tip, target, seed)
        if found is not None:
            first = first or (seed, found)
            if (margins(joints, found) >= 0.0).all():
                return seed, found
    return first


def _postures(joints: Sequence[ChainJoint]) -> Iterator[tuple[float, ...]]:
    """Postures within the limits, the middle first; none if a joint lacks a limit."""
    ranges = [range_of(joints[k]) for k in moving(joints)]
    if np.isfinite(ranges).all():
        for shares in product(_SHARES, repeat=len(ranges)):
            pairs = zip(ranges, shares, strict=True)
            yield tuple(low + share * (high - low) for (low, high), share in pairs)


def chain_length(joints: Sequence[ChainJoint], tip: Sequence[float]) -> float:
    """Length of a straight chain with its slides at 0 [m]."""
    return sum(math.sqrt(sum(x * x for x in step)) for step in (*(j.place for j in joints), tip))
