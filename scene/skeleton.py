"""The frames of a hand, its object and its contacts: a tree below `world`.

    planar:   world → plane → object → contact_i
                            → desired
                            → finger_i/base → finger_i/link_0 → finger_i/link_1 → finger_i/tip
    spatial:  world → object, desired and fingers, with finger_i/yaw between base and link_0
    slides:   finger_i/base → finger_i/link_0 → finger_i/link_1 → finger_i/tip
    chain:    finger_i/base → finger_i/link_0 → finger_i/link_1 → finger_i/link_2 → … → finger_i/tip
    support:  world → plane → object, desired, contact_0
    rail:     as planar, with contact_1 of the rail below the centre of the object

`world` has z up. `plane` is the model's plane (docs/model.md), vertical in the world: its x and y
are x and z of the world, its z points to the viewer. A link lies along x of its frame; planar
joints turn about z, spatial ones about z (yaw) and -y. For slides, link_0 is their zero and link_1
the carriage on the first slide, along x; nothing turns. `contact_i` is at fingertip i. The
tangential force is along its first d - 1 axes (d = 2 planar, 3 spatial), positive slip opposite to
them; axis d is the normal into the object. The plane of a support is inclined, with z along its
normal; there contact_0 is at the top of the body and does not turn.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from slipgrasp.core.scenario import (
    PLANAR,
    RAIL,
    SPATIAL,
    SUPPORT,
    FingerParameters,
    HandScenario,
    RailScenario,
    Scenario,
    SupportScenario,
)
from slipgrasp.core.scenario.chain import Chain, all_positions, chain_start
from slipgrasp.core.scenario.curved_faces import slide, turned_by
from slipgrasp.core.scenario.geometry import contact_frame, inner_radius, planar_tip_at_start
from slipgrasp.core.scenario.planar_chain import planar_chain_start
from slipgrasp.core.scenario.rail import RailFinger
from slipgrasp.core.scenario.spatial import SpatialFinger, SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import spatial_contact
from slipgrasp.core.scenario.spatial_geometry import tip_at_start as spatial_tip_at_start
from slipgrasp.scene import rotations
from slipgrasp.scene.pads import Pad, pad_of
from slipgrasp.scene.rotations import Values
from slipgrasp.scene.states import States

Moving = Callable[[States], Values]
"""A quantity of every state, shape ``(n, ...)``."""

WORLD, PLANE, OBJECT, DESIRED = "world", "plane", "object", "desired"

_ORIGIN = (0.0, 0.0, 0.0)
_AXES = np.eye(3)
UPRIGHT = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
"""Rotates the plane of a planar hand to vertical in the world."""
LYING = (math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0)
"""The inverse rotation."""
_Z, _MINUS_Y = np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])


ROOTS = {PLANAR: PLANE, SPATIAL: WORLD, SUPPORT: PLANE, RAIL: PLANE}
"""The root frame of a hand, a support or a rail."""
JOINT_AXES = {PLANAR: (_Z, _Z), RAIL: (_Z, _Z), SPATIAL: (_Z, _MINUS_Y, _MINUS_Y)}
"""The axes of the joints of a finger, each in the preceding frame."""


class Frame(NamedTuple):
    """Pose of a frame in its parent: position [m], unit quaternion (w, x, y, z); may move."""

    name: str
    parent: str
    position: tuple[float, ...] | Moving = _ORIGIN
    rotation: tuple[float, ...] | Moving = rotations.UNTURNED


class Contact(NamedTuple):
    """A contact of a fingertip with the object.

    Attributes:
        anchor: Contact point at zero slip, in the object's frame, shape ``(3,)`` [m].
        axes: Axes of the contact frame in the object's frame, as columns, ``(3, 3)``.
        dimensions: d: the frame's axis d - 1 (from 0) points into the object.
        on_slides: Whether its finger is on slides, which do not rotate.
        curvatures: Curvatures of the face along its d - 1 tangents [1/m].
        pad: Pad of a soft fingertip; None for a hard one.
    """

    anchor: Values
    axes: Values
    dimensions: int
    on_slides: bool = False
    curvatures: tuple[float, ...] = (0.0, 0.0)
    pad: Pad | None = None

    @property
    def inward(self) -> Values:
        """Unit vector into the object, in the contact frame."""
        return _AXES[self.dimensions - 1]

    def across(self, tangential: Values) -> Values:
        """Components of a tangential force ``(..., d - 1)`` as vectors of the contact frame."""
        return tangential @ _AXES[: self.dimensions - 1]

    @property
    def front(self) -> float:
        """1 if the z axis of a planar contact frame points to the viewer, else -1."""
        return float(self.axes[2, 2])

    @property
    def is_curved(self) -> bool:
        """Whether the contact frame turns when the fingertip slips."""
        return any(self.curvatures)

    def along_face(self, slips: Values) -> Values:
        """Points of the face after slips ``(..., d - 1)``, in the contact frame at zero slip."""
        if not self.is_curved:
            return -self.across(slips)
        tangents = -_AXES[: self.dimensions - 1]
        axes = np.vstack([tangents, self.inward])
        return slide(np.zeros(3), axes, self.curvatures, slips)[0]

    def turned(self, slips: Values) -> Values:
        """Rotation of the contact frame after slips, from zero slip: unit quaternions."""
        turns = np.cross(-_AXES[: self.dimensions - 1], self.inward)
        return rotations.from_vectors(turned_by(self.curvatures, slips) @ turns)


def base_frame(finger: int) -> str:
    """Name of the frame at the first joint of a finger."""
    return f"finger_{finger}/base"


def link_frame(finger: int, link: int) -> str:
    """Name of the frame at the start of a link, x along it."""
    return f"finger_{finger}/link_{link}"


def tip_frame(finger: int) -> str:
    """Name of the frame at the end of a finger, x along its last link."""
    return f"finger_{finger}/tip"


def finger_of(frame: str) -> int | None:
    """The finger that a frame belongs to; None if it belongs to none."""
    kind, _, index = frame.partition("/")[0].partition("_")
    return int(index) if kind == "finger" else None


def frames_along(frames: list[Frame], finger: int) -> list[str]:
    """Names of the frames at the links and at the tip of a finger, in order."""
    own = [frame.name for frame in frames if finger_of(frame.name) == finger]
    return [name for name in own if "/link_" in name or name == tip_frame(finger)]


def contact_name(contact: int) -> str:
    """Name of the frame on the face that a fingertip touches."""
    return f"contact_{contact}"


def contacts_of(scenario: Scenario) -> tuple[Contact, ...]:
    """The contacts of fingertips, one for each finger; none on a support."""
    if isinstance(scenario, SupportScenario):
        return ()
    if isinstance(scenario, RailScenario):
        return (_rail_contact(scenario),)
    return tuple(_contact(scenario, i) for i in range(len(scenario.fingers)))


def frames_of(scenario: Scenario) -> list[Frame]:
    """All frames of a hand and its object, parents first."""
    root, frames = ROOTS[scenario.space], body_frames(scenario)
    if isinstance(scenario, SupportScenario):
        return [*frames, Frame(contact_name(0), root, partial(_on_top, body_height(scenario)))]
    for i, contact in enumerate(contacts_of(scenario)):
        frames += _finger(scenario, root, i)
        place, turn = partial(_touched, contact, i), rotations.of_matrix(contact.axes)
        moving = partial(_following, contact, i, np.array(turn)) if contact.is_curved else turn
        frames.append(Frame(contact_name(i), OBJECT, place, moving))
    if isinstance(scenario, RailScenario):
        below = (0.0, -scenario.object.face_half_length, 0.0)
        frames.append(Frame(contact_name(1), OBJECT, below))
    return frames


def body_frames(scenario: Scenario) -> list[Frame]:
    """The frames of the actual and the desired object, and the plane of their motion."""
    root = ROOTS[scenario.space]
    turn = _inclined(scenario) if isinstance(scenario, SupportScenario) else UPRIGHT
    frames = [Frame(PLANE, WORLD, _ORIGIN, turn)] if root == PLANE else []
    raised = np.array(_ORIGIN)
    if isinstance(scenario, RailScenario):
        raised[1] = scenario.object.face_half_length

    def body(name: str, pose: Moving) -> Frame:
        return Frame(name, root, lambda s: pose(s)[:, :3] + raised, lambda s: pose(s)[:, 3:])

    actual, desired = attrgetter("object_pose"), attrgetter("desired_pose")
    return [*frames, body(OBJECT, actual), body(DESIRED, desired)]


def world_poses(frames: list[Frame], states: States) -> dict[str, tuple[Values, Values]]:
    """Positions ``(n, 3)`` and rotation matrices ``(n, 3, 3)`` of all frames in the tree's root.

    Args:
        frames: A tree, parents first.
        states: The instants.
    """
    n = len(states.times)
    poses = {frames[0].parent: (np.zeros((n, 3)), np.tile(np.eye(3), (n, 1, 1)))}
    for frame in frames:
        position, turn = (
            each(states) if callable(each) else np.tile(each, (n, 1))
            for each in (frame.position, frame.rotation)
        )
        origin, axes = poses[frame.parent]
        moved = origin + np.einsum("nij,nj->ni", axes, position)
        poses[frame.name] = moved, axes @ rotations.matrices(turn)
    return poses


def body_height(scenario: SupportScenario) -> float:
    """Half the drawn height of a body on a support; does not affect its motion [m]."""
    return inner_radius(scenario.object)


def _inclined(scenario: SupportScenario) -> tuple[float, ...]:
    """Rotation of the plane of a support, which rises along x."""
    half = 0.5 * scenario.support.incline
    return (math.cos(half), 0.0, -math.sin(half), 0.0)


def _on_top(height: float, states: States) -> Values:
    """Centre of the top of the body."""
    return states.object_pose[:, :3] + [0.0, 0.0, height]


def _rail_contact(scenario: RailScenario) -> Contact:
    """The contact of the fingertip; its frame has z into the plane, so that it is right-handed."""
    sine, cosine = math.sin(scenario.finger.angle), math.cos(scenario.finger.angle)
    axes = np.column_stack([(sine, cosine, 0.0), (cosine, -sine, 0.0), -_Z])
    return Contact(np.array([*scenario.contact_offset, 0.0]), axes, 2)


def _contact(scenario: HandScenario, i: int) -> Contact:
    if isinstance(scenario, SpatialScenario):
        told = spatial_contact(scenario.object, scenario.fingers[i])
        axes = (np.negative(told.tangent_x), np.negative(told.tangent_y), told.normal)
        anchor, on_slides = np.array(told.anchor), i in scenario.slides
        frame, pad = np.column_stack(axes), pad_of(scenario, i)
        return Contact(anchor, frame, 3, on_slides, told.curvatures, pad)
    flat = contact_frame(scenario.object, scenario.fingers[i])
    (tx, ty), (nx, ny) = flat.tangent, flat.normal
    axes = np.column_stack([(-tx, -ty, 0.0), (nx, ny, 0.0), _Z])
    anchor, on_slides = np.array([*flat.anchor, 0.0]), i in scenario.slides
    return Contact(anchor, axes, 2, on_slides, (flat.curvature,))


def _touched(contact: Contact, i: int, states: States) -> Values:
    """Position of the fingertip in the object's frame."""
    return contact.anchor + contact.along_face(states.slip[:, i]) @ contact.axes.T


def _following(contact: Contact, i: int, turn: Values, states: States) -> Values:
    """Rotation of the contact frame, following a curved face, in the object's frame."""
    return rotations.product(turn, contact.turned(states.slip[:, i]))


def mechanism_of(
    scenario: HandScenario | RailScenario, i: int
) -> FingerParameters | SpatialFinger | RailFinger:
    """Finger i; on a rail its only finger, for any i."""
    return scenario.finger if isinstance(scenario, RailScenario) else scenario.fingers[i]


def chain_of(finger: FingerParameters | SpatialFinger | RailFinger) -> Chain | None:
    """A finger's joint chain; None if it has none."""
    if isinstance(finger, RailFinger) or finger.kind != "chain":
        return None
    return finger.chain


def _finger(scenario: HandScenario | RailScenario, root: str, i: int) -> Iterator[Frame]:
    """Base, joints and tip of a finger of any kind."""
    finger = mechanism_of(scenario, i)
    if (chain := chain_of(finger)) is not None:
        yield from _chain(chain, root, i)
        return
    base = (*finger.base, 0.0)[:3]
    yield Frame(base_frame(i), root, base)
    if finger.kind == "slides":
        yield Frame(link_frame(i, 0), base_frame(i))
        yield Frame(link_frame(i, 1), link_frame(i, 0), partial(_slid, i, _AXES[0]))
        yield Frame(tip_frame(i), link_frame(i, 1), partial(_slid, i, 1.0 - _AXES[0]))
        return
    links = len(finger.link_lengths)
    axes = JOINT_AXES[scenario.space]
    at_base = len(axes) - links
    reach = [0.0] * at_base + [0.0, *finger.link_lengths[:-1]]
    names = [f"finger_{i}/yaw"] * at_base + [link_frame(i, k) for k in range(links)]
    parent = base_frame(i)
    for joint, (name, x, axis) in enumerate(zip(names, reach, axes, strict=True)):
        yield Frame(name, parent, (x, 0.0, 0.0), partial(_turned, i, joint, axis))
        parent = name
    yield Frame(tip_frame(i), parent, (finger.link_lengths[-1], 0.0, 0.0))


def _chain(chain: Chain, root: str, i: int) -> Iterator[Frame]:
    """Base, links and tip of a chain; each link turns about, or moves along, its joint axis."""
    parent = base_frame(i)
    yield Frame(parent, root, chain.base, tuple(_unit(chain.attitude).tolist()))
    for k, joint in enumerate(chain.joints):
        turn, axis, name = _unit(joint.attitude), _unit(joint.axis), link_frame(i, k)
        position = partial(_joint_position, i, chain, k)
        if joint.kind == "prismatic":
            along = rotations.matrices(turn) @ axis
            place = partial(_shifted, position, np.array(joint.place), along)
            yield Frame(name, parent, place, tuple(turn.tolist()))
        else:
            yield Frame(name, parent, joint.place, partial(_swung, position, turn, axis))
        parent = name
    yield Frame(tip_frame(i), parent, chain.tip)


def _unit(vector: tuple[float, ...]) -> Values:
    return np.array(vector) / np.linalg.norm(vector)


def _joint_position(finger: int, chain: Chain, joint: int, states: States) -> Values:
    """Positions of a joint of a chain, independent or coupled, shape ``(n,)`` [rad, m]."""
    return all_positions(chain.joints, states.joint_positions[:, finger])[:, joint]


def _shifted(position: Moving, place: Values, along: Values, states: States) -> Values:
    return place + position(states)[:, None] * along


def _swung(position: Moving, turn: Values, axis: Values, states: States) -> Values:
    return rotations.product(turn, rotations.about(axis, position(states)))


def tip_at_start(scenario: HandScenario, i: int) -> Values:
    """Initial position of fingertip i, relative to the base of its finger, shape ``(3,)`` [m]."""
    if isinstance(scenario, SpatialScenario):
        return np.array(spatial_tip_at_start(scenario, i))
    return np.array([*planar_tip_at_start(scenario, i), 0.0])


def chain_at_start(scenario: HandScenario, i: int) -> Values:
    """Initial positions of all joints of finger i, a chain [rad, m]."""
    finger, (x, y, z) = scenario.fingers[i], tip_at_start(scenario, i).tolist()
    if isinstance(finger, SpatialFinger):
        _, attitude, joints, tip = finger.chain
        found = chain_start(attitude, joints, tip, (x, y, z), finger.posture)
        positions = None if found is None else found[1]
    else:
        start = planar_chain_start(finger, (x, y))
        positions = None if start is None else start.positions
    assert positions is not None, "validated scenarios reach their contacts"
    return all_positions(finger.chain.joints, np.array(positions))


def _slid(finger: int, along: Values, states: States) -> Values:
    """Positions of the slides along some of the axes."""
    slides = states.joint_positions[:, finger]
    positions = np.zeros_like(slides, shape=(len(slides), 3))
    positions[:, : slides.shape[1]] = slides
    return positions * along


def _turned(finger: int, joint: int, axis: Values, states: States) -> Values:
    return rotations.about(axis, states.joint_positions[:, finger, joint])
