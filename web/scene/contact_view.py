"""What happens at the contacts: fingertips, slip trails, forces and friction cones.

The same marks are drawn twice: small, on the hand, and magnified in the lenses. A
`ContactPlacement` says where a contact of the object frame stands in either picture.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray

from core.geometry import ContactFrame
from core.types import ContactPhase
from web.colours import BELIEVED_CONE, CONE, PHASES, Rgb, glow
from web.sampling import Sample
from web.scene.shapes import circle, lift, polyline, position

__all__ = [
    "ContactMarks",
    "ContactPlacement",
    "ContactView",
    "FullScale",
    "MarkSizes",
    "contact_marks",
]

Points = NDArray[np.float64]

_HALO = 1.75
_DASHES = 8


class ContactPlacement(NamedTuple):
    """Where the object frame of a contact is drawn.

    Attributes:
        origin: Where the contact's anchor stands in the model's plane [m].
        angle: Angle of the object frame [rad].
        scale: Magnification of lengths.
    """

    origin: Points
    angle: float
    scale: float


class MarkSizes(NamedTuple):
    """Sizes of the marks in one picture [m]; ``depth`` is how near the eye they are drawn."""

    tip_radius: float
    trail_width: float
    cone_length: float
    force_length: float
    speed_length: float
    shaft_radius: float
    line_width: float
    depth: float


class FullScale(NamedTuple):
    """What an arrow of full length stands for: a force [N], a slip velocity [m/s]."""

    force: float
    speed: float


class ContactMarks(NamedTuple):
    """The marks of one contact in the model's plane [m].

    Attributes:
        tip: Where the fingertip touches.
        ball: Centre of the drawn fingertip, just outside the face.
        trail: From the spot first touched to the farthest one backward, and forward,
            shape ``(2, 2, 2)``.
        force_end: Head of the arrow of the force on the object.
        motion: The arrow of the slip velocity beside the fingertip, shape ``(2, 2)``.
        cone_ends: Ends of the two edges of the friction cone.
        believed_cone_ends: The same for the friction that the controller believes in; on the
            tip where the friction is known.
    """

    tip: Points
    ball: Points
    trail: Points
    force_end: Points
    motion: Points
    cone_ends: Points
    believed_cone_ends: Points


def contact_marks(
    sample: Sample,
    index: int,
    frame: ContactFrame,
    placement: ContactPlacement,
    sizes: MarkSizes,
    *,
    full: FullScale,
    believed_friction: float | None,
) -> ContactMarks:
    """Where the marks of one contact stand.

    Args:
        sample: The instant shown.
        index: The contact.
        frame: Its anchor, tangent and normal in the object frame.
        placement: Where the object frame is drawn.
        sizes: Sizes of the marks.
        full: What an arrow of full length stands for.
        believed_friction: Estimate of its friction coefficient, None if it is known.
    """
    cosine, sine = math.cos(placement.angle), math.sin(placement.angle)
    rotation = np.array([[cosine, -sine], [sine, cosine]])
    tangent, normal = rotation @ frame.tangent, rotation @ frame.normal
    tip = placement.origin + placement.scale * sample.slip[index] * tangent
    visited = placement.scale * sample.slip_reach[index][:, None] * tangent
    ball = tip - sizes.tip_radius * normal
    beside = ball - 2.6 * sizes.tip_radius * normal
    speed = sizes.speed_length / full.speed * sample.slip_velocity[index] * tangent
    force = -sample.tangential_force[index] * tangent + sample.normal_force[index] * normal
    believed = np.zeros((2, 2))
    if believed_friction is not None:
        believed = _cone(believed_friction, tangent, normal)
    return ContactMarks(
        tip=tip,
        ball=ball,
        trail=placement.origin + np.stack([np.zeros((2, 2)), visited], axis=1),
        force_end=tip + sizes.force_length / full.force * force,
        motion=np.stack([beside - 0.5 * speed, beside + 0.5 * speed]),
        cone_ends=tip + sizes.cone_length * _cone(sample.friction[index], tangent, normal),
        believed_cone_ends=tip + 0.85 * sizes.cone_length * believed,
    )


def _cone(friction: float, tangent: Points, normal: Points) -> Points:
    """Unit vectors along both edges of a friction cone, shape ``(2, 2)``."""
    edges = np.array([normal + friction * tangent, normal - friction * tangent])
    return edges / math.hypot(1.0, friction)


class ContactView:
    """Draws the marks of all contacts in one picture with a fixed set of nodes."""

    def __init__(self, scene: viser.SceneApi, name: str, count: int, sizes: MarkSizes) -> None:
        self._sizes = sizes
        self._balls = [
            scene.add_icosphere(f"{name}/tip/{i}", radius=sizes.tip_radius) for i in range(count)
        ]
        self._forces = _add_arrows(scene, f"{name}/forces", count, sizes)
        self._motions = [_add_arrows(scene, f"{name}/motion/{i}", 1, sizes) for i in range(count)]
        width = sizes.line_width
        self._cones = _lines(scene, f"{name}/cones", 2 * count, width, CONE)
        self._believed = _lines(
            scene, f"{name}/believed_cones", 2 * _DASHES * count, 0.8 * width, BELIEVED_CONE
        )
        self._trails = _lines(scene, f"{name}/trails", 2 * count, sizes.trail_width, CONE)
        both_ways = [PHASES[ContactPhase.SLIP_BACKWARD], PHASES[ContactPhase.SLIP_FORWARD]]
        self._trails.colors = _per_segment(both_ways * count, 1)
        ring = polyline(circle(_HALO * sizes.tip_radius), 0.0, closed=True)
        self._halos = [
            scene.add_line_segments(
                f"{name}/halo/{i}", ring, CONE, thickness=0.4 * sizes.tip_radius
            )
            for i in range(count)
        ]
        self._phases: tuple[ContactPhase, ...] = ()

    def update(self, marks: Sequence[ContactMarks], phases: Sequence[ContactPhase]) -> None:
        """Moves and colours the marks.

        Args:
            marks: Where they stand, one per contact.
            phases: Phase of each contact.
        """
        depth = self._sizes.depth
        if tuple(phases) != self._phases:
            self._phases = tuple(phases)
            self._colour()
        for i, mark in enumerate(marks):
            self._balls[i].position = self._halos[i].position = position(mark.ball, depth)
            self._motions[i].points = lift(mark.motion[None], depth + 0.02)
        self._forces.points = lift(np.array([[m.tip, m.force_end] for m in marks]), depth + 0.02)
        cones = np.array([[m.tip, end] for m in marks for end in m.cone_ends])
        self._cones.points = lift(cones, depth + 0.006)
        self._believed.points = _dashed(marks, depth + 0.004)
        self._trails.points = lift(np.concatenate([m.trail for m in marks]), depth + 0.002)

    def _colour(self) -> None:
        """Gives every mark the colour of its phase; halo and motion show that it slips."""
        colours = [PHASES[phase] for phase in self._phases]
        self._forces.colors = np.array([glow(colour) for colour in colours], dtype=np.uint8)
        for i, (phase, colour) in enumerate(zip(self._phases, colours, strict=True)):
            self._balls[i].color = colour
            self._motions[i].colors = np.array([glow(colour)], dtype=np.uint8)
            self._halos[i].colors = np.array(colour, dtype=np.uint8)
            slips = phase is not ContactPhase.STICK
            self._motions[i].visible = self._halos[i].visible = slips


def _add_arrows(
    scene: viser.SceneApi, name: str, count: int, sizes: MarkSizes
) -> viser.ArrowsHandle:
    return scene.add_arrows(
        name,
        np.zeros((count, 2, 3)),
        np.zeros((count, 3), dtype=np.uint8),
        shaft_radius=sizes.shaft_radius,
        head_radius=2.6 * sizes.shaft_radius,
        head_length=5.0 * sizes.shaft_radius,
    )


def _lines(
    scene: viser.SceneApi, name: str, count: int, thickness: float, colour: Rgb
) -> viser.LineSegmentsHandle:
    colours = _per_segment([colour], count)
    return scene.add_line_segments(name, np.zeros((count, 2, 3)), colours, thickness=thickness)


def _dashed(marks: Sequence[ContactMarks], depth: float) -> NDArray[np.float32]:
    """Dashes along each edge of the believed cones."""
    steps = np.linspace(0.0, 1.0, 2 * _DASHES).reshape(_DASHES, 2)
    lines = [
        mark.tip + steps[..., None] * (end - mark.tip)
        for mark in marks
        for end in mark.believed_cone_ends
    ]
    return lift(np.concatenate(lines), depth)


def _per_segment(colours: Sequence[Rgb], segments: int) -> NDArray[np.uint8]:
    """Each colour for both ends of as many segments, shape ``(colours * segments, 2, 3)``."""
    own = np.array([glow(colour) for colour in colours], dtype=np.uint8)
    return np.repeat(np.repeat(own, segments, axis=0)[:, None, :], 2, axis=1)
