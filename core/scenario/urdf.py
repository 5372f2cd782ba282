"""Fingers of a hand from its URDF description: what lies between the base and each fingertip.

Links that are fixed to each other become one, with their masses added, and joints can be locked, so
that every finger becomes a chain of three joints (`slipgrasp.core.scenario.chain`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario.chain import (
    NUM_JOINTS,
    ChainJoint,
    about_axis,
    chain_positions,
    quaternion_of,
)
from slipgrasp.core.scenario.field_errors import nearest, shortened, single_error
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import tip_at_start

Floats = NDArray[np.float64]

MOVING = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic"}
_UPPER = np.triu_indices(3)
_SHARES = (0.5, 0.25, 0.75)  # of the range of a joint, at which the start is looked for


class Pose(NamedTuple):
    """A frame in another: rotation matrix and position [m]."""

    turn: Floats
    place: Floats

    def after(self, other: Pose) -> Pose:
        """The pose of a frame that has the pose ``other`` in this one."""
        return Pose(self.turn @ other.turn, self.place + self.turn @ other.place)


AT_ORIGIN = Pose(np.eye(3), np.zeros(3))


class _Body(NamedTuple):
    """Mass [kg], centre of mass [m] and inertia about it [kg m^2] in some frame."""

    mass: float
    centre: Floats
    inertia: Floats

    def seen_from(self, pose: Pose) -> _Body:
        turned = pose.turn @ self.inertia @ pose.turn.T
        return _Body(self.mass, pose.place + pose.turn @ self.centre, turned)


class _Joint(NamedTuple):
    name: str
    kind: str
    parent: str
    child: str
    pose: Pose
    axis: Floats
    limits: tuple[float, float]
    mimics: bool

    def moved(self, position: float) -> Pose:
        """Pose of the link after the joint where that stands still."""
        if MOVING.get(self.kind) == "prismatic":
            return self.pose.after(Pose(np.eye(3), position * self.axis))
        return self.pose.after(Pose(about_axis(self.axis, np.array(position)), np.zeros(3)))


@dataclass(frozen=True, slots=True)
class ImportedFinger:
    """A finger that was read.

    Attributes:
        joints: Its chain.
        tip: In the frame of the last link [m].
        limits: Range of each joint [rad, m].
        links: Names of the links that move with it.
    """

    joints: tuple[ChainJoint, ...]
    tip: tuple[float, float, float]
    limits: tuple[tuple[float, float], ...]
    links: frozenset[str]


@dataclass(slots=True)
class _Group:
    """Links that move together, in the frame of the first of them."""

    joint: _Joint | None
    pose: Pose  # of its joint in the group before
    bodies: list[_Body] = field(default_factory=list)


class Description:
    """A hand as its URDF file describes it.

    Args:
        text: The file.
        locked: Positions of joints that are taken for fixed, by name [rad, m].

    Raises:
        ScenarioError: If it is no description of links and joints.
    """

    def __init__(self, text: str, locked: Mapping[str, float] | None = None) -> None:
        if "<!" in text.replace("<!--", ""):
            raise _refusal("a document type", "none", "a URDF file has no document type; remove it")
        try:
            root = ElementTree.fromstring(text)
            self._bodies = {each.get("name", ""): _body_of(each) for each in root.findall("link")}
            joints = [_joint_of(each) for each in root.findall("joint")]
        except (ElementTree.ParseError, ValueError, AttributeError) as error:
            raise _refusal("the file", "URDF", f"it cannot be read as URDF: {error}") from None
        self._before = {joint.child: joint for joint in joints}
        self._after: dict[str, list[_Joint]] = {}
        for joint in joints:
            self._after.setdefault(joint.parent, []).append(joint)
        self._locked = dict(locked or {})
        names = [joint.name for joint in joints]
        for name in self._locked:
            if name not in names:
                raise _refusal(name, ", ".join(names), f"there is no joint '{name}'")

    @property
    def links(self) -> frozenset[str]:
        """Names of all links."""
        return frozenset(self._bodies)

    def finger(self, tip: str) -> ImportedFinger:
        """The chain from the base to a link whose origin is the fingertip.

        Args:
            tip: Name of the link.

        Raises:
            ScenarioError: If there is no such link, or its chain has not three moving joints.
        """
        groups, links, end = [_Group(None, AT_ORIGIN)], set[str](), AT_ORIGIN
        for joint in self._path_to(tip):
            if self._moves(joint):
                groups.append(_Group(joint, end.after(joint.pose)))
                end = AT_ORIGIN
            else:
                end = end.after(joint.moved(self._locked.get(joint.name, 0.0)))
            if len(groups) > 1:
                found = list(self._fixed_to(joint.child, end, tip))
                links |= {name for name, _ in found}
                groups[-1].bodies += [body for _, body in found]
        moving = groups[1:]
        if len(moving) != NUM_JOINTS:
            names = ", ".join(group.joint.name for group in moving if group.joint) or "none"
            raise _refusal(
                tip,
                f"{NUM_JOINTS} joints",
                f"'{tip}' has {len(moving)} moving joints ({names}), a chain has {NUM_JOINTS}; "
                "lock the others with --lock JOINT=POSITION",
            )
        joints, limits = zip(*map(_chain_joint, moving), strict=True)
        return ImportedFinger(joints, _numbers(end.place), limits, frozenset(links))

    def _moves(self, joint: _Joint) -> bool:
        return joint.kind in MOVING and joint.name not in self._locked

    def _path_to(self, tip: str) -> list[_Joint]:
        if tip not in self._bodies:
            near = nearest(tip, self._bodies)
            raise _refusal(tip, "a link", f"there is no link '{shortened(tip)}'{near}")
        path: list[_Joint] = []
        while tip in self._before and len(path) <= len(self._before):
            path.append(self._before[tip])
            tip = path[-1].parent
        for joint in path:
            if joint.mimics and joint.name not in self._locked:
                raise _refusal(
                    joint.name,
                    "independent joints",
                    f"joint '{joint.name}' follows another one (mimic), which a chain cannot; "
                    f"lock it with --lock {joint.name}=POSITION",
                )
            if joint.kind not in MOVING and joint.kind != "fixed":
                kinds = ", ".join(MOVING)
                words = f"joint '{joint.name}' is '{joint.kind}', a chain has {kinds}"
                raise _refusal(joint.kind, kinds, words)
        return path[::-1]

    def _fixed_to(self, link: str, pose: Pose, tip: str) -> Iterator[tuple[str, _Body]]:
        """A link of a path, and what is fixed to it beside the path; each in the group's frame."""
        yield link, self._bodies[link].seen_from(pose)
        path = {joint.child for joint in self._path_to(tip)}
        for joint in self._after.get(link, []):
            if joint.child not in path and not self._moves(joint):
                moved = joint.moved(self._locked.get(joint.name, 0.0))
                yield from self._fixed_to(joint.child, pose.after(moved), tip)


def with_fingers(
    scenario: SpatialScenario, fingers: Sequence[ImportedFinger], base: Pose
) -> dict[str, Any]:
    """A scenario whose fingers are built as imported, as plain values.

    Args:
        scenario: Its fingers keep their faces and friction.
        fingers: One for each of them.
        base: Pose of the hand in the world.

    Raises:
        ScenarioError: If there are more or fewer.
    """
    count = len(scenario.fingers)
    if len(fingers) != count:
        raise _refusal(
            len(fingers), f"{count}", f"{len(fingers)} fingertips for a scenario of {count} fingers"
        )
    mapping = scenario.to_mapping()
    place, attitude = _numbers(base.place), quaternion_of(base.turn)
    for i, (given, finger) in enumerate(zip(mapping["fingers"], fingers, strict=True)):
        target = np.add(tip_at_start(scenario, i), scenario.fingers[i].base) - base.place
        given |= {
            "kind": "chain",
            "base": place,
            "attitude": attitude,
            "tip": finger.tip,
            "joints": [_joint_mapping(joint) for joint in finger.joints],
            "posture": _posture(finger, attitude, target),
        }
    return mapping


def _posture(
    finger: ImportedFinger, attitude: tuple[float, float, float, float], target: Floats
) -> tuple[float, ...]:
    """Joint positions at the start, looked for from some within their ranges; else the middle."""
    middle = None
    for shares in product(_SHARES, repeat=len(finger.joints)):
        pairs = zip(finger.limits, shares, strict=True)
        seed = tuple(low + share * (high - low) for (low, high), share in pairs)
        middle = middle or seed
        found = chain_positions(attitude, finger.joints, finger.tip, target.tolist(), seed)
        if found is not None:
            inside = [low <= q <= high for q, (low, high) in zip(found, finger.limits, strict=True)]
            if all(inside):
                return tuple(found.tolist())
    assert middle is not None
    return middle


def _joint_mapping(joint: ChainJoint) -> dict[str, Any]:
    return {name: getattr(joint, name) for name in ChainJoint.__dataclass_fields__}


def _chain_joint(group: _Group) -> tuple[ChainJoint, tuple[float, float]]:
    """Joint and link of links that move together."""
    joint = group.joint
    assert joint is not None
    mass = sum(body.mass for body in group.bodies)
    centre = np.zeros(3)
    for body in group.bodies:
        centre = centre + body.mass / max(mass, 1e-300) * body.centre
    inertia = np.zeros((3, 3))
    for body in group.bodies:
        offset = body.centre - centre
        steiner = offset @ offset * np.eye(3) - np.outer(offset, offset)
        inertia = inertia + body.inertia + body.mass * steiner
    chained = ChainJoint(
        kind=MOVING[joint.kind],  # pyright: ignore[reportArgumentType]
        place=_numbers(group.pose.place),
        attitude=quaternion_of(group.pose.turn),
        axis=_numbers(joint.axis),
        mass=mass,
        centre=_numbers(centre),
        unit_inertia=tuple((inertia / max(mass, 1e-300))[_UPPER].tolist()),
    )
    return chained, joint.limits


def _body_of(link: ElementTree.Element) -> _Body:
    inertial = link.find("inertial")
    if inertial is None:
        return _Body(0.0, np.zeros(3), np.zeros((3, 3)))
    mass = float(inertial.find("mass").get("value"))  # pyright: ignore
    given, inertia = inertial.find("inertia"), np.zeros((3, 3))
    if given is not None:
        for (a, b), name in zip(zip(*_UPPER, strict=True), _ENTRIES, strict=True):
            inertia[a, b] = inertia[b, a] = float(given.get(name, "0"))
    return _Body(mass, np.zeros(3), inertia).seen_from(_pose_of(inertial))


_ENTRIES = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def _joint_of(joint: ElementTree.Element) -> _Joint:
    axis, limit = joint.find("axis"), joint.find("limit")
    direction = np.array([1.0, 0.0, 0.0]) if axis is None else _vector(axis.get("xyz", "1 0 0"))
    low, high = -np.pi, np.pi
    if limit is not None and joint.get("type") != "continuous":
        low, high = float(limit.get("lower", "0")), float(limit.get("upper", "0"))
    return _Joint(
        joint.get("name", ""),
        joint.get("type", ""),
        joint.find("parent").get("link"),  # pyright: ignore
        joint.find("child").get("link"),  # pyright: ignore
        _pose_of(joint),
        direction / np.linalg.norm(direction),
        (low, high),
        joint.find("mimic") is not None,
    )


def _pose_of(element: ElementTree.Element) -> Pose:
    origin = element.find("origin")
    if origin is None:
        return AT_ORIGIN
    return pose_of(_vector(origin.get("xyz", "0 0 0")), _vector(origin.get("rpy", "0 0 0")))


def pose_of(place: Floats, angles: Floats) -> Pose:
    """A pose from a position [m] and the angles roll, pitch, yaw about fixed axes [rad]."""
    turn = np.eye(3)
    for axis, angle in zip(np.eye(3), angles, strict=True):
        turn = about_axis(axis, np.array(angle)) @ turn
    return Pose(turn, np.asarray(place, float))


def _vector(text: str) -> Floats:
    numbers = np.array([float(part) for part in text.split()])
    if numbers.shape != (3,) or not np.isfinite(numbers).all():
        raise ValueError(f"'{shortened(text)}' is not three numbers")
    return numbers


def _numbers(vector: Floats) -> tuple[float, float, float]:
    x, y, z = (vector + 0.0).tolist()
    return x, y, z


def _refusal(value: Any, limit: str, message: str) -> ScenarioError:
    return single_error("fingers", value, limit, message)
