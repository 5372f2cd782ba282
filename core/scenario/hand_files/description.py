"""Fingers of a hand from its description: joints and links from the base to each fingertip.

Links that are fixed to each other are merged, and joints can be locked or coupled to others, so
that every finger has three independent joints (`slipgrasp.core.scenario.chain`).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import pydantic
from numpy.typing import NDArray

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario.chain import (
    MAX_LINKS,
    NUM_JOINTS,
    ChainJoint,
    about_axis,
    chain_start,
    moving,
    quaternion_of,
    range_of,
)
from slipgrasp.core.scenario.common import without_none
from slipgrasp.core.scenario.field_errors import nearest, shortened, single_error
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import tip_at_start

Floats = NDArray[np.float64]

MOVING = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic"}
UPPER = np.triu_indices(3)
_LARGEST_END, _LARGEST_EFFORT = 100.0, 1e6  # of the allowed limits of a joint [rad, N m]


class Pose(NamedTuple):
    """Pose of a frame relative to another: rotation matrix and position [m]."""

    turn: Floats
    place: Floats

    def after(self, other: Pose) -> Pose:
        """Composes this pose with a pose ``other`` relative to it."""
        return Pose(self.turn @ other.turn, self.place + self.turn @ other.place)


AT_ORIGIN = Pose(np.eye(3), np.zeros(3))


class Body(NamedTuple):
    """Mass [kg], centre of mass [m] and inertia about it [kg m^2] in a given frame."""

    mass: float
    centre: Floats
    inertia: Floats

    def seen_from(self, pose: Pose) -> Body:
        """The body in another frame, given the pose of its own frame in that."""
        turned = pose.turn @ self.inertia @ pose.turn.T
        return Body(self.mass, pose.place + pose.turn @ self.centre, turned)


class Follows(NamedTuple):
    """Coupling to another joint: position = ratio times the leader's position + offset."""

    leader: str
    ratio: float
    offset: float


class Joint(NamedTuple):
    """A joint between two links.

    Attributes:
        name: Its name.
        kind: ``fixed``, one of `MOVING`, or another one that no chain has.
        parent: Name of the link before it.
        child: Name of the link after it.
        pose: Its pose in the frame of the link before it.
        axis: Unit vector about which it turns, or along which it slides.
        minimum: Smallest position; None if unlimited [rad, m].
        maximum: Largest position; None if unlimited [rad, m].
        torque_limit: Largest torque or force; None if unlimited [N m, N].
        follows: The joint that it follows, if any.
    """

    name: str
    kind: str
    parent: str
    child: str
    pose: Pose
    axis: Floats = np.array([0.0, 0.0, 1.0])
    minimum: float | None = None
    maximum: float | None = None
    torque_limit: float | None = None
    follows: Follows | None = None

    def moved(self, position: float) -> Pose:
        """Pose of the link after the joint at a fixed position."""
        if MOVING.get(self.kind) == "prismatic":
            return self.pose.after(Pose(np.eye(3), position * self.axis))
        return self.pose.after(Pose(about_axis(self.axis, np.array(position)), np.zeros(3)))


@dataclass(frozen=True, slots=True)
class ImportedFinger:
    """An imported finger.

    Attributes:
        joints: Its chain.
        tip: Position of the tip in the frame of the last link [m].
        parts: Poses of the links of the file that were merged into each link, by name.
    """

    joints: tuple[ChainJoint, ...]
    tip: tuple[float, float, float]
    parts: tuple[Mapping[str, Pose], ...]


@dataclass(slots=True)
class _Group:
    """Links that move together, in the frame of the first one."""

    joint: Joint
    pose: Pose  # of the joint in the previous group
    parts: dict[str, Pose] = field(default_factory=dict)


class Description:
    """The links and joints of a hand file.

    Args:
        bodies: The links by name, each in its own frame.
        joints: The joints between them.
        locked: Positions of locked joints by name [rad, m].
        coupled: Coupled joints, in addition to those in the file (mimic).

    Raises:
        ScenarioError: If a locked or coupled joint does not exist.
    """

    def __init__(
        self,
        bodies: Mapping[str, Body],
        joints: Sequence[Joint],
        locked: Mapping[str, float] | None = None,
        coupled: Mapping[str, Follows] | None = None,
    ) -> None:
        self._bodies = bodies
        self._locked, coupled = dict(locked or {}), dict(coupled or {})
        self._joints = {
            joint.name: joint._replace(follows=coupled.get(joint.name, joint.follows))
            for joint in joints
        }
        for name in (*self._locked, *coupled):
            self._named(name)
        self._before = {joint.child: joint for joint in self._joints.values()}
        self._after: dict[str, list[Joint]] = {}
        for joint in self._joints.values():
            self._after.setdefault(joint.parent, []).append(joint)

    @property
    def links(self) -> frozenset[str]:
        """Names of all links."""
        return frozenset(self._bodies)

    def finger(self, tip: str) -> ImportedFinger:
        """Returns the chain from the base to a link whose origin is the fingertip.

        Args:
            tip: Name of the link.

        Raises:
            ScenarioError: If the link does not exist, or its chain does not have three independent
                joints.
        """
        groups, end = list[_Group](), AT_ORIGIN
        path = self._path_to(tip)
        on_path = {joint.child for joint in path}
        for joint in path:
            stands = self._standing(joint)
            if stands is None:
                groups.append(_Group(joint, end.after(joint.pose)))
                end = AT_ORIGIN
            else:
                end = end.after(joint.moved(stands))
            if groups:
                groups[-1].parts |= self._fixed_to(joint.child, end, on_path)
        leaders = self._leaders(tip, [group.joint for group in groups])
        joints = tuple(map(self._chain_joint, groups, leaders))
        parts = tuple(group.parts for group in groups)
        return ImportedFinger(joints, _numbers(end.place), parts)

    def base(self) -> dict[str, Pose]:
        """Returns the poses of the links that are fixed to the base, by name; the base is first."""
        fixed = {*MOVING, "fixed"}
        free = {joint.child for joint in self._joints.values() if joint.kind not in fixed}
        root = next((name for name in self._bodies if name not in self._before), None)
        return {} if root is None else self._fixed_to(root, AT_ORIGIN, free)

    def _leaders(self, tip: str, joints: Sequence[Joint]) -> list[tuple[int, float, float] | None]:
        """Coupling of each joint of a chain: index of the leader, ratio, offset; None if none."""
        names = [joint.name for joint in joints]
        own = [joint.name for joint in joints if self._leader(joint)[0] is joint]
        if len(own) != NUM_JOINTS or len(joints) > MAX_LINKS:
            raise refusal(
                tip,
                f"{NUM_JOINTS} joints",
                f"{len(own)} of the {len(joints)} joints of '{tip}' are independent "
                f"({', '.join(own) or 'none'}), but a chain has {NUM_JOINTS} of at most "
                f"{MAX_LINKS}: lock others with --lock JOINT=POSITION, or couple them to these "
                "with --couple JOINT=LEADER,RATIO",
            )
        found: list[tuple[int, float, float] | None] = []
        for joint in joints:
            leader, ratio, offset = self._leader(joint)
            if leader.name not in names:
                raise refusal(
                    joint.name,
                    ", ".join(own),
                    f"joint '{joint.name}' follows '{leader.name}', which does not carry '{tip}'; "
                    f"lock it with --lock {joint.name}=POSITION",
                )
            follows = names.index(leader.name), ratio, offset
            found.append(None if leader is joint else follows)
        return found

    def _named(self, name: str) -> Joint:
        if name not in self._joints:
            names = ", ".join(self._joints)
            near = nearest(name, self._joints)
            raise refusal(name, names, f"there is no joint '{shortened(name)}'{near}")
        return self._joints[name]

    def _leader(self, joint: Joint) -> tuple[Joint, float, float]:
        """Resolves a coupling to the independent joint, or the joint itself; ratio and offset."""
        ratio, offset, first = 1.0, 0.0, joint
        for _ in self._joints:
            if joint.follows is None or joint.name in self._locked:
                return joint, ratio, offset
            offset += ratio * joint.follows.offset
            ratio *= joint.follows.ratio
            joint = self._named(joint.follows.leader)
        raise refusal(first.name, "another joint", f"joint '{first.name}' follows itself")

    def _standing(self, joint: Joint) -> float | None:
        """The position of a locked joint [rad, m]; None if it moves."""
        leader, ratio, offset = self._leader(joint)
        if leader.name in self._locked:
            return ratio * self._locked[leader.name] + offset
        return None if leader.kind in MOVING and joint.kind in MOVING else 0.0

    def _path_to(self, tip: str) -> list[Joint]:
        if tip not in self._bodies:
            near = nearest(tip, self._bodies)
            raise refusal(tip, "a link", f"there is no link '{shortened(tip)}'{near}")
        path: list[Joint] = []
        while tip in self._before and len(path) <= len(self._before):
            path.append(self._before[tip])
            tip = path[-1].parent
        for joint in path:
            if joint.kind not in MOVING and joint.kind != "fixed":
                kinds = ", ".join(MOVING)
                words = f"joint '{joint.name}' is '{joint.kind}', a chain has {kinds}"
                raise refusal(joint.kind, kinds, words)
        return path[::-1]

    def _fixed_to(self, link: str, pose: Pose, path: Collection[str]) -> dict[str, Pose]:
        """A link of a path and the links fixed to it outside the path, in the group's frame."""
        found = {link: pose}
        for joint in self._after.get(link, []):
            stands = self._standing(joint)
            if joint.child not in path and stands is not None:
                found |= self._fixed_to(joint.child, pose.after(joint.moved(stands)), path)
        return found

    def _chain_joint(self, group: _Group, leader: tuple[int, float, float] | None) -> ChainJoint:
        """Joint and link of a group of links that move together."""
        joint = group.joint
        bodies = [self._bodies[name].seen_from(pose) for name, pose in group.parts.items()]
        mass = sum(body.mass for body in bodies)
        centre = np.zeros(3)
        for body in bodies:
            centre = centre + body.mass / max(mass, 1e-300) * body.centre
        inertia = np.zeros((3, 3))
        for body in bodies:
            offset = body.centre - centre
            steiner = offset @ offset * np.eye(3) - np.outer(offset, offset)
            inertia = inertia + body.inertia + body.mass * steiner
        follows, ratio, offset = leader or (None, 1.0, 0.0)
        values = dict[str, Any](
            kind=MOVING[joint.kind],
            place=_numbers(group.pose.place),
            attitude=quaternion_of(group.pose.turn),
            axis=_numbers(joint.axis),
            mass=mass,
            centre=_numbers(centre),
            unit_inertia=tuple((inertia / max(mass, 1e-300))[UPPER].tolist()),
            minimum=_within(joint.minimum, _LARGEST_END),
            maximum=_within(joint.maximum, _LARGEST_END),
            torque_limit=None
            if follows is not None
            else _within(joint.torque_limit, _LARGEST_EFFORT),
            follows=follows,
            ratio=ratio,
            offset=offset,
        )
        try:
            return ChainJoint(**values)
        except pydantic.ValidationError as error:
            first = error.errors()[0]
            words = f"joint '{joint.name}': {first['loc'][0]}: {first['msg']}"
            raise refusal(joint.name, "a joint", words) from None


def with_fingers(
    scenario: SpatialScenario, fingers: Sequence[ImportedFinger], base: Pose
) -> dict[str, Any]:
    """Returns a scenario with imported fingers, as plain values.

    Args:
        scenario: The scenario; its fingers keep their faces and friction.
        fingers: One finger for each of those in the scenario.
        base: Pose of the hand in the world.

    Raises:
        ScenarioError: If the numbers of fingers differ.
    """
    count = len(scenario.fingers)
    if len(fingers) != count:
        raise refusal(
            len(fingers), f"{count}", f"{len(fingers)} fingertips for a scenario of {count} fingers"
        )
    mapping = scenario.to_mapping()
    for i, (given, finger) in enumerate(zip(mapping["fingers"], fingers, strict=True)):
        target = np.add(tip_at_start(scenario, i), scenario.fingers[i].base) - base.place
        given |= finger_mapping(finger, base)
        # Without limits, the initial position is searched within one turn.
        joints = [
            replace(
                joint,
                minimum=-math.pi if joint.minimum is None else joint.minimum,
                maximum=math.pi if joint.maximum is None else joint.maximum,
            )
            for joint in finger.joints
        ]
        chain = given["attitude"], joints, finger.tip
        start = chain_start(*chain, target.tolist(), given["posture"])
        if start is not None:
            given["posture"] = tuple(start[1].tolist())
    return mapping


def finger_mapping(finger: ImportedFinger, base: Pose) -> dict[str, Any]:
    """Returns the plain values of a finger for a hand file.

    Args:
        finger: The finger; its posture is the middle of its limits.
        base: Pose of the hand in the world.
    """
    ranges = [range_of(finger.joints[k]) for k in moving(finger.joints)]
    middles = [0.5 * (low + high) if math.isfinite(high - low) else 0.0 for low, high in ranges]
    return {
        "kind": "chain",
        "base": _numbers(base.place),
        "attitude": quaternion_of(base.turn),
        "tip": finger.tip,
        "joints": [asdict(joint, dict_factory=without_none) for joint in finger.joints],
        "posture": tuple(middles),
    }


def _within(value: float | None, largest: float) -> float | None:
    """A limit; None if it is so large that it means no limit."""
    return value if value is not None and abs(value) <= largest else None


def pose_of(place: Floats, angles: Floats) -> Pose:
    """A pose from a position [m] and the angles roll, pitch, yaw about fixed axes [rad]."""
    turn = np.eye(3)
    for axis, angle in zip(np.eye(3), angles, strict=True):
        turn = about_axis(axis, np.array(angle)) @ turn
    return Pose(turn, np.asarray(place, float))


def _numbers(vector: Floats) -> tuple[float, float, float]:
    x, y, z = (vector + 0.0).tolist()
    return x, y, z


def refusal(value: Any, limit: str, message: str) -> ScenarioError:
    """Creates the error for a hand that cannot be read."""
    return single_error("fingers", value, limit, message)
