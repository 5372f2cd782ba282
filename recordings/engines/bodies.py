"""A scenario as rigid bodies, joints and contact faces, from which all formats are written.

The z axis points up: x and z are the x and y of a planar hand, whose angles turn about -y.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.scenario import FingerParameters, Scenario
from slipgrasp.core.scenario.geometry import contact_frame
from slipgrasp.core.scenario.held_object import ObjectParameters
from slipgrasp.core.scenario.scenario import need_hand, of_hand
from slipgrasp.core.scenario.spatial import SpatialFinger, SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import spatial_contact
from slipgrasp.scene import rotations

Floats = NDArray[np.float64]

OBJECT = "object"
TIP_RADIUS = 1e-5
"""Radius of the sphere at a fingertip, which rolls only nanometres: our tips are points [m]."""
LEAST_MASS = 1e-9
"""Mass of a body that only connects two joints, for formats without massless bodies [kg]."""

_SLAB = 0.01  # half the thickness of the slab below a face [m]
_THIN = 1e-9  # moment of inertia of a thin rod about its axis, which is zero here [kg m^2]
_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
_MINUS_Y = (0.0, -1.0, 0.0)


class SceneError(SlipgraspError):
    """A scenario that a scene cannot represent."""


class Frame(NamedTuple):
    """Position [m] and attitude: a unit quaternion (w, x, y, z)."""

    place: Floats
    turn: Floats = np.array(rotations.UNTURNED)


class Link(NamedTuple):
    """A rigid body with its frame at its joint.

    Attributes:
        name: Name of the body.
        kind: Kind of its joint: ``hinge``, ``slide`` or ``free``.
        axis: Axis of the joint: a coordinate axis of the frame, or -y.
        joint: Name of the joint.
        place: Position of the joint in the frame of the previous link, or of the world [m].
        mass: Mass [kg], 0 if the body only connects two joints at one place.
        centre: Centre of mass [m].
        inertias: Moments of inertia about the axes through the centre of mass [kg m^2].
    """

    name: str
    kind: str
    axis: tuple[float, float, float] = _X
    joint: str = ""
    place: tuple[float, ...] = (0.0, 0.0, 0.0)
    mass: float = 0.0
    centre: tuple[float, ...] = (0.0, 0.0, 0.0)
    inertias: tuple[float, ...] = (_THIN, _THIN, _THIN)


class Shape(NamedTuple):
    """A sphere at a fingertip, or a box of the object, in the frame of its body.

    Attributes:
        name: Its name.
        frame: Position and attitude.
        sizes: Radius of the sphere, or half the sizes of the box [m].
        friction: Friction coefficient of the fingertip; None for the object.
    """

    name: str
    frame: Frame
    sizes: Floats
    friction: float | None = None


class Chain(NamedTuple):
    """A finger, or the object with its joints to the world, in the start pose.

    Attributes:
        name: Its name.
        links: Its bodies, one for each joint; the last one has the shapes.
        frames: Their frames in the world.
        shapes: The shapes in contact.
        tip: The fingertip in the frame of the last link [m]; None for the object.
    """

    name: str
    links: list[Link]
    frames: list[Frame]
    shapes: list[Shape]
    tip: Floats | None = None


def check_for_scene(scenario: Scenario) -> None:
    """Rejects properties that no scene can represent.

    Raises:
        SceneError: If the scenario has one of them.
    """
    own = need_hand(scenario, "a scene", "export its data: slipgrasp export RUN")
    body, fingers = own.object, own.fingers
    missing = {
        "fingers on chains": any(each.kind == "chain" for each in fingers),
        "static friction": any(
            each.static_friction not in (None, each.friction) for each in fingers
        ),
        "friction or damping of joints": any(
            each.joint_friction or each.joint_damping for each in fingers
        ),
        "soft pads": any(
            isinstance(each, SpatialFinger) and each.pad_radius > 0.0 for each in fingers
        ),
        "round objects": body.is_round,
        "planar objects with corners": isinstance(body, ObjectParameters) and bool(body.corners),
        "friction pyramids": scenario.friction_cone == "pyramid",
        "low-friction patches": bool(scenario.patches),
        "pushes": bool(scenario.pulses),
        "timed changes of more than friction": any(
            _finger_that_changes(change.parameter) is None for change in scenario.changes
        ),
    }
    if found := [name for name, present in missing.items() if present]:
        raise SceneError(f"a scene of another engine cannot have {' and '.join(found)} yet")


def friction_changes(scenario: Scenario) -> list[dict[str, Any]]:
    """Timed changes of the friction of fingertips."""
    changes = sorted(scenario.changes, key=lambda each: each.time)
    fingers = [_finger_that_changes(each.parameter) for each in changes]
    return [
        {"time": each.time, "contact": finger, "friction": each.value}
        for each, finger in zip(changes, fingers, strict=True)
    ]


def _finger_that_changes(parameter: str) -> int | None:
    """Index of the finger whose friction is given by a parameter."""
    parts = parameter.split(".")
    return int(parts[1]) if parts[0] == "fingers" and parts[2:] == ["friction"] else None


def chains_of(scenario: Scenario, angles: Floats, radius: float = TIP_RADIUS) -> list[Chain]:
    """All fingers, then the object.

    Args:
        scenario: The hand and its object.
        angles: Joint positions of the start pose [rad, m].
        radius: Radius of the spheres at the fingertips [m].
    """
    scenario = of_hand(scenario)
    held = _held_object(scenario)
    to_world = rotations.matrices(held.frames[-1].turn)
    rows = np.reshape(angles, (len(scenario.fingers), -1))
    chains = list[Chain]()
    for i, (own, row) in enumerate(zip(scenario.fingers, rows, strict=True)):
        links = links_of(scenario, i)
        frames = _frames(links, row)
        tip = np.array([0.0 if own.kind == "slides" else own.link_lengths[1], 0.0, 0.0])
        # The sphere touches the face exactly at the fingertip.
        inward = rotations.matrices(frames[-1].turn).T @ to_world @ _face(scenario, i)[2]
        sphere = Shape(f"tip{i}", Frame(tip - radius * inward), np.array([radius]), own.friction)
        chains.append(Chain(f"finger{i}", links, frames, [sphere], tip))
    return [*chains, held]


def links_of(scenario: Scenario, i: int) -> list[Link]:
    """Links of finger ``i`` from its base outwards, one for each joint."""
    own = of_hand(scenario).fingers[i]
    spatial = isinstance(own, SpatialFinger)
    if own.kind == "slides":
        axes = (_X, _Y, _Z) if spatial else (_X, _Z)
        links = [Link(f"finger{i}_slide{k}", "slide", axis) for k, axis in enumerate(axes)]
        links[-1] = links[-1]._replace(mass=own.mass)
    else:
        links = [Link(f"finger{i}_base", "hinge", _Z)] if spatial else []
        links += [_bar(own, i, 0), _bar(own, i, 1)]
    links[0] = links[0]._replace(place=tuple(point(own.base)))
    return [link._replace(joint=f"q{i}{k}") for k, link in enumerate(links)]


def _bar(own: FingerParameters | SpatialFinger, i: int, k: int) -> Link:
    """Link ``k`` of a finger, along the x axis of its frame."""
    mass, length = own.link_masses[k], own.link_lengths[k]
    inertia = own.link_inertia_fractions[k] * mass * length**2
    return Link(
        name=f"finger{i}_link{k}",
        kind="hinge",
        axis=_MINUS_Y,
        place=(own.link_lengths[0] if k else 0.0, 0.0, 0.0),
        mass=mass,
        centre=(own.link_centre_fractions[k] * length, 0.0, 0.0),
        inertias=(_THIN, inertia, inertia),
    )


def _held_object(scenario: Scenario) -> Chain:
    """The object: a box, or for spatial hands a slab below every face that a finger touches.

    Engines compute contacts of a sphere with a box in closed form, those with a prism iteratively.
    """
    scenario = of_hand(scenario)
    body, start = scenario.object, scenario.trajectory.start
    if isinstance(scenario, SpatialScenario):
        links = [Link(OBJECT, "free", mass=body.mass, inertias=scenario.object.inertias)]
        faces = {finger.face: finger for finger in scenario.fingers}
        slabs = [_slab(scenario, finger) for finger in faces.values()]
        return Chain("held", links, [Frame(np.array(start[:3]), np.array(start[3:]))], slabs)
    x, y = body.half_sizes
    links = [
        Link("object_slide", "slide", _X, "object_x"),
        Link("object_lift", "slide", _Z, "object_y"),
        Link(OBJECT, "hinge", _MINUS_Y, "object_turn", mass=body.mass),
    ]
    links[-1] = links[-1]._replace(inertias=(scenario.object.inertia,) * 3)
    box = Shape("box", Frame(np.zeros(3)), np.array([x, x, y]))
    return Chain("held", links, _frames(links, start), [box])


def _slab(scenario: SpatialScenario, finger: SpatialFinger) -> Shape:
    face = spatial_contact(scenario.object, finger)
    low, high = np.min(face.outline, axis=0), np.max(face.outline, axis=0)
    axes = np.array([face.tangent_x, face.tangent_y, face.normal])
    place = np.array(face.anchor) + np.array([*(0.5 * (low + high)), _SLAB]) @ axes
    frame = Frame(place, np.array(rotations.of_matrix(axes.T)))
    return Shape(finger.face.replace("-", "_"), frame, np.array([*(0.5 * (high - low)), _SLAB]))


def _face(scenario: Scenario, i: int) -> tuple[Floats, Floats, Floats]:
    """Contact point, tangents and inward normal of a contact, in the object's frame."""
    scenario = of_hand(scenario)
    if isinstance(scenario, SpatialScenario):
        anchor, *tangents, normal = spatial_contact(scenario.object, scenario.fingers[i])[:4]
    else:
        frame = contact_frame(scenario.object, scenario.fingers[i])
        anchor, *tangents, normal = map(point, frame[:3])
    return np.array(anchor), np.array(tangents), np.array(normal)


def contacts_of(scenario: Scenario) -> list[dict[str, Any]]:
    """Initial contact point and tangents of each tip, in the frame of the object.

    The slip of a tip at x, with the object at p and turned by R, is tangents (R' (x - p) - anchor).
    """
    contacts = []
    for i in range(len(scenario.fingers)):
        anchor, tangents = (each.tolist() for each in _face(scenario, i)[:2])
        contacts.append({"site": f"tip{i}", "anchor": anchor, "tangents": tangents})
    return contacts


def _frames(links: Sequence[Link], positions: Iterable[float]) -> list[Frame]:
    """Frames in the world of the links of a chain with given joint positions [rad, m]."""
    frame, frames = Frame(np.zeros(3)), list[Frame]()
    for link, position in zip(links, positions, strict=True):
        axis, turn = np.array(link.axis), frame.turn
        shift = np.array(link.place) + (position * axis if link.kind == "slide" else 0.0)
        if link.kind == "hinge":
            turn = rotations.product(turn, rotations.about(axis, np.array(position)))
        frame = Frame(frame.place + rotations.matrices(frame.turn) @ shift, turn)
        frames.append(frame)
    return frames


def point(ours: Iterable[float]) -> list[float]:
    """A point or a direction of a planar or spatial hand in these axes."""
    values = [float(each) for each in ours]
    return [values[0], 0.0, values[1]] if len(values) == 2 else values


def numbers(values: Iterable[float]) -> str:
    """Numbers in the notation of XML."""
    return " ".join(repr(float(value)) for value in values)
