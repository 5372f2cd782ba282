"""Entities of a hand, its object and its contacts, in the frames of `skeleton`."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario import HandScenario, RailScenario, Scenario, SupportScenario
from slipgrasp.core.scenario.chain import Chain, ChainJoint, rotation_of
from slipgrasp.core.scenario.scenario import of_hand
from slipgrasp.core.scenario.spatial_geometry import friction_outline
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.scene import rotations, skeleton
from slipgrasp.scene.pads import Pad
from slipgrasp.scene.primitives import Arrow, Ball, Cone, Entity, Lines, Rod, Role, Shape
from slipgrasp.scene.rotations import Values
from slipgrasp.scene.sizes import Sizes, sizes_of
from slipgrasp.scene.skeleton import Contact, Moving
from slipgrasp.scene.solids import edges_of, solid
from slipgrasp.scene.states import States

LONGEST_ARROW = 100.0
"""Length limit of arrows, as a multiple of `Sizes.mark`, so that a diverging run can be drawn."""

_TAPER = 0.7
_ARC_PIECES = 24
PAD_THICKNESS = 0.25
"""Thickness of the disc of a soft fingertip, in radii of its ball."""
PAD_POINTER = 1.35
"""Length of the pad's pointer, in radii of the pad, so that it is visible from all sides."""


def entities_of(scenario: Scenario) -> list[Entity]:
    """All entities of a hand, its object and its contacts."""
    sizes = sizes_of(scenario)
    body, edges = solid(scenario, sizes.half_depth), edges_of(scenario)
    # Slightly deeper than the object, so that its front edges hide the object's.
    wanted = solid(scenario, max(sizes.half_depth, sizes.front))
    lines = Lines(Role.OBJECT_EDGE, body.points, edges, sizes.thickness)
    desired = Lines(Role.DESIRED, wanted.points, edges, sizes.thickness, dashed=True)
    entities = [
        Entity(skeleton.OBJECT, skeleton.OBJECT, (body, lines)),
        Entity(skeleton.DESIRED, skeleton.DESIRED, (desired,)),
    ]
    if isinstance(scenario, SupportScenario):
        name = skeleton.contact_name(0)
        return [entities[0], Entity(name, name, tuple(_friction(scenario, sizes)))]
    for i, contact in enumerate(skeleton.contacts_of(scenario)):
        chain = skeleton.chain_of(skeleton.mechanism_of(scenario, i))
        if contact.on_slides:
            entities += _slides(i, of_hand(scenario), sizes, contact)
        elif chain is not None:
            entities += _chain(i, of_hand(scenario), chain, sizes)
        else:
            entities += _finger(i, scenario, sizes, contact.inward)
        name = skeleton.contact_name(i)
        entities.append(Entity(name, name, tuple(_contact(scenario, contact, i, sizes))))
    if isinstance(scenario, RailScenario):
        entities += _rail(scenario, sizes)
    return entities


def force_in(contact: Contact, i: int, states: States) -> Values:
    """The force of a fingertip on the object, in the contact frame, shape ``(n, 3)`` [N]."""
    normal = states.normal_force[:, i, None] * contact.inward
    return contact.across(states.tangential_force[:, i]) + normal


def cone_rim(contact: Contact, rim: Values, friction: float | Values) -> Values:
    """Directions on the surface of a friction cone: unit normal part, tangential mu.

    Args:
        contact: The contact.
        rim: Tangential directions divided by mu F_n, shape ``(k, d - 1)``.
        friction: The friction coefficient, or several, shape ``(n, 1, 1)``.

    Returns:
        Vectors of the contact frame, shape ``(k, 3)``, or ``(n, k, 3)``.
    """
    return contact.inward + friction * contact.across(rim)


def _finger(
    i: int, scenario: HandScenario | RailScenario, sizes: Sizes, up: Values
) -> Iterator[Entity]:
    """The mount, and every link with the axle of its joint; the last one ends at the tip."""
    radius, lengths = sizes.link_radius, skeleton.mechanism_of(scenario, i).link_lengths
    wide, narrow = 2.7 * radius, 1.3 * radius
    foot = Rod(Role.MOUNT, -2.9 * radius * up, -2.4 * radius * up, (wide, wide))
    neck = Rod(Role.MOUNT, foot.end, -0.7 * radius * up, (wide, narrow))
    yield Entity(f"finger_{i}/mount", skeleton.base_frame(i), (foot, neck))
    axle = skeleton.JOINT_AXES[scenario.space][-1]
    for k, length in enumerate(lengths):
        end, reach = _TAPER * radius, length
        if k == len(lengths) - 1:
            end = min(end, 0.95 * sizes.tip_radius)
            reach = max(length - sizes.tip_radius, 0.5 * length)
        along = np.array([reach, 0.0, 0.0])
        link = Rod(Role.LINK, 0.0 * along, along, (radius, end), rounded=True)
        name = skeleton.link_frame(i, k)
        yield Entity(name, name, (link, _axle(axle, radius)))
        radius = end


def _chain(i: int, scenario: HandScenario, chain: Chain, sizes: Sizes) -> Iterator[Entity]:
    """A bar along every link to the next joint or the tip, and the axle or rail of its joint."""
    radius = sizes.link_radius
    positions = skeleton.chain_at_start(scenario, i)
    for k, joint in enumerate(chain.joints):
        if joint.kind == "prismatic":
            name = skeleton.link_frame(i, k - 1) if k else skeleton.base_frame(i)
            rail = _rail_of(joint, float(positions[k]), radius)
            yield Entity(f"finger_{i}/rail_{k}", name, (rail,))
        is_last = k == len(chain.joints) - 1
        along = np.array(chain.tip if is_last else chain.joints[k + 1].place)
        length = float(np.linalg.norm(along))
        axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
        shapes = [_axle(axis, radius)]
        end = min(_TAPER * radius, 0.95 * sizes.tip_radius) if is_last else _TAPER * radius
        if length > 0.0:
            reach = max(length - sizes.tip_radius, 0.5 * length) if is_last else length
            bar = Rod(Role.LINK, 0.0 * along, reach / length * along, (radius, end), rounded=True)
            shapes.append(bar)
        name = skeleton.link_frame(i, k)
        yield Entity(name, name, tuple(shapes))
        radius = end if length > 0.0 else radius


def _axle(axis: Values, radius: float) -> Rod:
    """The axle of a joint in a link with a radius [m]."""
    thick = 0.7 * radius
    return Rod(Role.JOINT, -1.2 * radius * axis, 1.2 * radius * axis, (thick, thick))


def _rail_of(joint: ChainJoint, position: float, radius: float) -> Rod:
    """The rail of a prismatic joint."""
    axis = rotation_of(joint.attitude) @ joint.axis / np.linalg.norm(joint.axis)
    return _rail_along(axis, np.array(joint.place), position, radius)


def _rail_along(axis: Values, zero: Values, position: float, radius: float) -> Rod:
    """A rail from the zero of a slide to a position, and beyond both."""
    low, high = min(0.0, position) - 4.0 * radius, max(0.0, position) + 4.0 * radius
    return Rod(Role.MOUNT, zero + low * axis, zero + high * axis, (0.5 * radius, 0.5 * radius))


def _slides(i: int, scenario: HandScenario, sizes: Sizes, contact: Contact) -> Iterator[Entity]:
    """A rail along x, its carriage, and the bar from there to the tip."""
    radius, tip = sizes.link_radius, skeleton.tip_at_start(scenario, i)
    along, place = np.array([1.0, 0.0, 0.0]), np.array([tip[0], 0.0, 0.0])
    rail = _rail_along(along, 0.0 * along, tip[0], radius)
    yield Entity(f"finger_{i}/rail", skeleton.base_frame(i), (rail,))
    width = 1.3 * radius
    carriage = Rod(Role.JOINT, -width * along, width * along, (width, width))
    name = skeleton.link_frame(i, 1)
    yield Entity(name, name, (carriage,))
    outward = -contact.axes @ contact.inward
    ball = sizes.tip_radius * outward
    # Long enough to be visible if the rail is at the height of the tip.
    end = place - tip if np.linalg.norm(place - tip) > 2.0 * sizes.tip_radius else 4.0 * ball
    bar = Rod(Role.LINK, ball, end, (min(radius, 0.9 * sizes.tip_radius), radius), rounded=True)
    yield Entity(f"finger_{i}/bar", skeleton.tip_frame(i), (bar,))


def _contact(scenario: Scenario, contact: Contact, i: int, sizes: Sizes) -> Iterator[Shape]:
    """Fingertip, force on the object, friction cone, and line from the initial contact point."""
    phase = partial(_phase, i)
    front = np.array([0.0, 0.0, sizes.front])
    if contact.dimensions == 2:
        front *= contact.front
    pad = contact.pad
    thickness = 0.0 if pad is None else PAD_THICKNESS * sizes.tip_radius
    yield Ball(phase, -(sizes.tip_radius + thickness) * contact.inward, sizes.tip_radius)
    if pad is not None:
        outer = -thickness * contact.inward
        yield Rod(phase, outer, 0.0 * outer, (pad.radius, pad.radius))
        hand = partial(_pad_hand, contact, pad)
        yield Lines(Role.JOINT, hand, np.array([[0, 1]]), 0.6 * sizes.thickness)
    yield _force_arrow(
        i, front, lambda states: _arrow(force_in(contact, i, states), sizes), sizes.mark
    )
    if scenario.friction_cone == "cone":
        yield Cone(Role.CONE, lambda states: np.arctan(states.friction[:, i]), sizes.mark)
    else:
        yield _cone_lines(scenario, contact, i, sizes, front)
    first = partial(_first_touch, contact, i, front)
    count = _ARC_PIECES if contact.is_curved else 1
    pieces = np.column_stack([np.arange(count), np.arange(1, count + 1)])
    yield Lines(partial(_trail_phase, i), first, pieces, 2.0 * sizes.thickness)


def _arrow(forces: Values, sizes: Sizes) -> Values:
    """Arrows of forces ``(n, 3)`` with a common scale, limited in length."""
    longest = LONGEST_ARROW * sizes.mark
    with np.errstate(over="ignore"):
        length = sizes.per_newton * np.linalg.norm(forces, axis=1, keepdims=True)
    largest = np.maximum(np.abs(forces).max(axis=1, keepdims=True), 1e-300)
    unit = forces / largest
    unit = unit / np.maximum(np.linalg.norm(unit, axis=1, keepdims=True), 1e-300)
    return np.minimum(length, longest) * unit


def _friction(scenario: SupportScenario, sizes: Sizes) -> Iterator[Shape]:
    """The friction force on a body on a support, and the line from its initial position."""

    def force(states: States) -> Values:
        return _arrow(np.pad(states.tangential_force[:, 0], ((0, 0), (0, 1))), sizes)

    down = np.array([0.0, 0.0, -2.0 * sizes.half_depth])
    yield _force_arrow(0, np.zeros(3), force, sizes.mark)
    yield _slide_path(0, down, sizes)


def _force_arrow(i: int, tail: Values, force: Moving, mark: float) -> Arrow:
    """The force on the object at a contact, in the colour of its phase."""
    return Arrow(partial(_phase, i), tail, force, 0.1 * mark, 0.3 * mark, 0.25 * mark)


def _slide_path(i: int, start: Values, sizes: Sizes) -> Lines:
    """The line from the initial position of a sliding body to the present one."""

    def line(states: States) -> Values:
        slips = states.slip[:, i]
        slid = np.pad(slips, ((0, 0), (0, 3 - slips.shape[1])))
        return start - np.stack([slid, 0.0 * slid], axis=1)

    return Lines(partial(_trail_phase, i), line, np.array([[0, 1]]), 2.0 * sizes.thickness)


def _rail(scenario: RailScenario, sizes: Sizes) -> Iterator[Entity]:
    """The rail, its force on the object, and the line from the initial position of the object."""
    ends, body = rail_ends(scenario), scenario.object
    radius = 0.5 * sizes.link_radius
    start, end = (np.array([x, -radius, 0.0]) for x in ends)
    yield Entity("rail", skeleton.PLANE, (Rod(Role.MOUNT, start, end, (radius, radius)),))

    def force(states: States) -> Values:
        normal = states.normal_force[:, 1, None]
        both = np.hstack([states.tangential_force[:, 1], normal, 0.0 * normal])
        return _arrow(both, sizes)

    front, mark = np.array([0.0, 0.0, sizes.front]), min(sizes.mark, body.half_width)
    name = skeleton.contact_name(1)
    marks = _force_arrow(1, front, force, mark), _slide_path(1, front, sizes)
    yield Entity(name, name, marks)


def rail_ends(scenario: RailScenario) -> tuple[float, float]:
    """Ends of the rail as it is drawn, which have no effect: beyond the desired motion [m]."""
    motion = scenario.trajectory
    places = [motion.start[0], *(point.pose[0] for point in motion.set_points)]
    beyond = 4.0 * scenario.object.half_width
    return min(places) - beyond, max(places) + beyond


def _cone_lines(scenario: Scenario, contact: Contact, i: int, sizes: Sizes, front: Values) -> Lines:
    """Edges of a planar cone or of a pyramid, with their ends connected."""
    # Every other point of the outline of a square is a corner.
    rim = friction_outline(scenario, 8)
    is_flat = rim.shape[1] == 1
    rim = rim if is_flat else rim[1::2]

    def points(states: States) -> Values:
        ends = cone_rim(contact, rim, states.friction[:, i, None, None])
        ends = sizes.mark * ends / np.linalg.norm(ends, axis=2, keepdims=True)
        return front + np.concatenate([np.zeros((len(ends), 1, 3)), ends], axis=1)

    index = np.arange(1, len(rim) + 1)
    edges = np.column_stack([np.zeros(len(rim), int), index])
    around = edges[:0] if is_flat else np.column_stack([index, np.roll(index, -1)])
    return Lines(Role.CONE, points, np.concatenate([edges, around]), sizes.thickness)


def _pad_hand(contact: Contact, pad: Pad, states: States) -> Values:
    """The pointer of a pad, from its centre beyond its edge, ``(n, 2, 3)``."""
    end = -PAD_POINTER * contact.across(pad.hand(states))
    return np.stack([np.zeros_like(end), end], axis=1)


def _first_touch(contact: Contact, i: int, front: Values, states: States) -> Values:
    """The line from the initial contact point on the face to the current one, ``(n, k, 3)``.

    On a curved face along its arc, in the current contact frame.
    """
    slips = states.slip[:, i]
    if not contact.is_curved:
        first = contact.across(slips)
        return front + np.stack([first, np.zeros_like(first)], axis=1)
    shares = np.linspace(0.0, 1.0, _ARC_PIECES + 1)[:, None]
    arc = contact.along_face(shares * slips[:, None])
    turns = rotations.matrices(contact.turned(slips))
    return front + (arc - arc[:, -1:]) @ turns


def _phase(i: int, states: States) -> NDArray[np.int8]:
    return states.phases[:, i]


def _trail_phase(i: int, states: States) -> NDArray[np.int8]:
    """The slip phase in the direction from the initial contact point to the current one."""
    slip = states.slip[:, i]
    if slip.shape[1] == 1:
        return np.sign(slip[:, 0]).astype(np.int8)
    return np.full(len(slip), ContactPhase.SLIP, np.int8)
