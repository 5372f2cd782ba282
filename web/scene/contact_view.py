"""A contact: fingertip, slip trail, force, slip velocity and friction cone.

The marks are in the axes of the contact frame (`slipgrasp.scene.skeleton`), for planar and spatial
hands.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import CONE, PHASES, Rgb
from slipgrasp.scene.pads import Pad
from slipgrasp.scene.parts import PAD_POINTER, PAD_THICKNESS, force_in
from slipgrasp.scene.skeleton import Contact
from slipgrasp.scene.solids import prism
from slipgrasp.scene.states import States
from slipgrasp.web.model.colours import BELIEVED_CONE, CONE_INSIDE, glow
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.marks import FullScale, MarkSizes, Trail, add_arrows
from slipgrasp.web.scene.shapes import Mesh, circle, dashed_edges, faceted, fan, joined, two_sided

Points = NDArray[np.float64]

_HALO = 1.75
_FINEST_FRICTION = 5e-3
_RAYS, _DASHES = 8, 8
_CONE_OPACITY = 0.5
_BESIDE = 3.6
_OUTSIDE = 0.003
_ARC_PIECES = 24  # points of the trail of a planar hand, which only consists of its ends


class ContactMarks(NamedTuple):
    """Marks of one contact in the axes of its frame [m].

    Attributes:
        tip: Fingertip, relative to the initial contact point.
        force: Arrow of the force on the object, from the fingertip.
        motion: Ends of the arrow of the slip velocity, from the fingertip.
    """

    tip: Points
    force: Points
    motion: Points


def contact_marks(
    contact: Contact,
    i: int,
    states: States,
    sizes: MarkSizes,
    full: FullScale,
) -> ContactMarks:
    """Positions of the marks of a contact in a single state.

    Args:
        contact: The contact.
        i: Index of the contact.
        states: The state.
        sizes: Sizes of the marks.
        full: Quantities with an arrow of full length.
    """
    beside = (
        -_BESIDE * sizes.tip_radius * contact.inward if contact.dimensions == 2 else np.zeros(3)
    )
    velocity = -contact.across(states.slip_velocity[0, i])
    half_speed = 0.5 * sizes.speed_length / full.speed * velocity
    return ContactMarks(
        tip=contact.along_face(states.slip[0, i]),
        force=sizes.force_length / full.force * force_in(contact, i, states)[0],
        motion=np.array([beside - half_speed, beside + half_speed]),
    )


def cone_edge(contact: Contact, friction: float, rim: Points, slant: float) -> Points:
    """Points on the rim of a friction cone, from its tip, shape ``(k, 3)`` [m].

    Args:
        contact: The contact.
        friction: The friction coefficient.
        rim: Tangential directions divided by the friction, shape ``(k, d - 1)``.
        slant: Distance of the rim from the tip for unit directions [m].
    """
    return slant / np.hypot(1.0, friction) * (contact.inward + friction * contact.across(rim))


class ContactView:
    """Draws the marks of one contact with a fixed set of nodes below a common one.

    Args:
        scene: Scene of the nodes.
        name: Name of the node at the initial contact point, with the axes of the contact frame.
        place: Position of that node in its parent [m].
        wxyz: Orientation of that node.
        contact: The contact.
        rim: Outline of the admissible friction, divided by its limit, shape ``(k, d - 1)``.
        sizes: Sizes of the marks.
        detail: Level of detail.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        place: Points,
        wxyz: Points | tuple[float, ...],
        contact: Contact,
        rim: Points,
        sizes: MarkSizes,
        detail: Detail,
    ) -> None:
        self._contact, self._rim, self._sizes = contact, rim, sizes
        self._flat = contact.dimensions == 2
        scene.add_frame(name, show_axes=False, position=place, wxyz=np.array(wxyz))
        self._scene, self._name = scene, name
        self._trail = self._lines("trail", CONE, sizes.trail_width * (1.0 if self._flat else 0.6))
        self._tip = scene.add_frame(f"{name}/tip", show_axes=False)
        self._add_fingertip(f"{name}/tip")
        self._cone = scene.add_frame(f"{name}/tip/cone", show_axes=False)
        self._add_cone(f"{name}/tip/cone")
        if contact.pad is not None:
            self._add_pad(contact.pad)
        self._phase: ContactPhase | None = None
        self._drawn: tuple[int, int | None] | None = None
        self._path: Trail | None = None
        self._follow_tip = Follower(detail, self._draw_tip)
        self._follow_hand = Follower(detail, self._draw_hand)
        self._follow_trail = Follower(detail, self._draw_trail)
        self._follow_arrows = Follower(detail, self._draw_arrows)

    def update(
        self, states: States, i: int, full: FullScale, believed: float | None, trail: Trail
    ) -> None:
        """Shows the contact in a single state.

        Args:
            states: The state.
            i: Index of the contact.
            full: Quantities with an arrow of full length.
            believed: The friction coefficient that the controller assumes, None if it knows the
                true one.
            trail: Path of the fingertip.
        """
        marks = contact_marks(self._contact, i, states, self._sizes, full)
        phase = ContactPhase(int(states.phases[0, i]))
        if phase is not self._phase:
            self._phase = phase
            self._colour(phase)
        self._slip = states.slip[0, i]
        self._follow_tip.follow(marks.tip)
        if self._contact.pad is not None:
            self._follow_hand.follow(PAD_POINTER * self._contact.pad.hand(states)[0])
        self._path = trail
        self._follow_trail.follow(trail.extent)
        force = np.stack([np.zeros(3), marks.force])
        # Without slip, the second arrow is hidden in the first.
        motion = force if phase is ContactPhase.STICK else marks.motion
        self._follow_arrows.follow(np.stack([force, motion]))
        self._open(states.friction[0, i], believed)

    def show_cone(self, visible: bool) -> None:
        """Shows or hides the friction cone."""
        self._cone.visible = visible

    def _raised(self, points: NDArray[np.floating], depth: float = 0.0) -> NDArray[np.float32]:
        """Points in front of a planar hand; unchanged for a spatial one, which is transparent."""
        out = self._contact.front * (self._sizes.depth + depth) if self._flat else 0.0
        return (points + np.array([0.0, 0.0, out])).astype(np.float32)

    def _on_face(self, points: Points) -> NDArray[np.float32]:
        """Points in front of a planar hand, and slightly outside the face of a spatial object."""
        return self._raised(points if self._flat else points - _OUTSIDE * self._contact.inward)

    def _draw_tip(self, tip: Points) -> None:
        self._tip.position = tip
        if self._contact.is_curved:
            self._tip.wxyz = self._contact.turned(self._slip)

    def _draw_hand(self, hand: Points) -> None:
        end = -self._contact.across(hand)
        self._hand.points = np.stack([np.zeros(3), end])[None].astype(np.float32)

    def _draw_trail(self, _extent: Points) -> None:
        assert self._path is not None, "it is drawn by update"
        pieces = _ARC_PIECES if self._flat and self._contact.is_curved else 1
        segments, colours = self._path.divided(pieces)
        path = self._contact.along_face(segments)
        inside = 0.5 * self._sizes.trail_width * self._contact.inward if self._flat else np.zeros(3)
        self._trail.colors = colours
        self._trail.points = self._on_face(path + inside)

    def _draw_arrows(self, arrows: Points) -> None:
        self._arrows.points = self._raised(arrows, 0.3 * self._sizes.depth)

    def _add_fingertip(self, name: str) -> None:
        """A ball that touches the face from outside, with a ring during slip."""
        sizes = self._sizes
        centre = self._raised(-sizes.tip_radius * self._contact.inward)
        self._ball = self._scene.add_icosphere(
            f"{name}/ball", radius=sizes.tip_radius, position=centre
        )
        ring = circle(_HALO * sizes.tip_radius)
        self._halo = self._scene.add_line_segments(
            f"{name}/halo",
            joined(np.column_stack([ring, 0.0 * ring[:, 0]]), closed=True),
            CONE,
            thickness=0.4 * sizes.tip_radius,
            position=centre,
        )
        # The force and the slip velocity, in one node because that is faster to move.
        self._arrows = add_arrows(self._scene, f"{name}/arrows", 2, sizes.shaft_radius)

    def _add_pad(self, pad: Pad) -> None:
        """A disc between the face and the ball, with a line that turns with the fingertip."""
        sizes, inward = self._sizes, self._contact.inward
        thickness = PAD_THICKNESS * sizes.tip_radius
        solid = prism(circle(pad.radius), -0.5 * thickness, 0.5 * thickness)
        self._disc = self._scene.add_mesh_simple(
            f"{self._name}/tip/pad",
            *faceted(solid.points, solid.indices.astype(np.uint32)),
            color=CONE,
            position=-0.5 * thickness * inward,
        )
        self._hand = self._lines("tip/pad-hand", CONE, 0.35 * sizes.tip_radius)
        for node in (self._ball, self._halo):
            node.position = -(sizes.tip_radius + thickness) * inward

    def _add_cone(self, name: str) -> None:
        """The cone that contains the force on the object, around the inward normal."""
        faces = fan(len(self._rim), closed=not self._flat)
        mesh = Mesh(np.zeros((len(self._rim) + 1, 3), np.float32), faces)
        self._inside = self._scene.add_mesh_simple(
            f"{name}/inside",
            *(two_sided(mesh) if self._flat else mesh),
            color=CONE_INSIDE,
            opacity=None if self._flat else _CONE_OPACITY,
            side="front" if self._flat else "double",
        )
        width = self._sizes.line_width * (1.0 if self._flat else 0.5)
        self._edges = self._lines("tip/cone/edges", CONE, width)
        self._believed = self._lines("tip/cone/believed", BELIEVED_CONE, 0.8 * width)

    def _lines(self, part: str, colour: Rgb, thickness: float) -> viser.LineSegmentsHandle:
        name = f"{self._name}/{part}"
        return self._scene.add_line_segments(name, np.zeros((1, 2, 3)), colour, thickness=thickness)

    def _open(self, friction: float, believed: float | None) -> None:
        """Sets the angles of the cones from friction coefficients, with visible precision."""
        now = (
            round(friction / _FINEST_FRICTION),
            None if believed is None else round(believed / _FINEST_FRICTION),
        )
        if now == self._drawn:
            return
        before, self._drawn = self._drawn, now
        length = self._sizes.cone_length
        if before is None or before[0] != now[0]:
            edge = cone_edge(self._contact, friction, self._rim, length)
            inside = np.concatenate([np.zeros((1, 3)), edge])
            raised = self._raised(inside, -0.1 * self._sizes.depth)
            self._inside.vertices = np.concatenate([raised, raised]) if self._flat else raised
            lines = self._rays(edge)
            if not self._flat:
                lines = np.concatenate([lines, joined(edge, closed=True)])
            self._edges.points = self._raised(lines, 0.1 * self._sizes.depth)
        if before is None or (before[1] is None) != (believed is None):
            self._believed.visible = believed is not None
        if believed is not None:
            edge = cone_edge(self._contact, believed, self._rim, 0.85 * length)
            dashes = dashed_edges(self._rays(edge), _DASHES)
            self._believed.points = self._raised(dashes, 0.05 * self._sizes.depth)

    def _rays(self, edge: Points) -> Points:
        """Lines from the tip of a cone to its rim."""
        ends = edge[:: max(len(edge) // _RAYS, 1)]
        return np.stack([np.zeros_like(ends), ends], axis=1)

    def _colour(self, phase: ContactPhase) -> None:
        """Colours all marks by the phase; halo and motion arrow indicate slip."""
        colour = PHASES[phase]
        self._ball.color = colour
        if self._contact.pad is not None:
            self._disc.color = colour
        self._halo.colors = np.array(colour, dtype=np.uint8)
        self._arrows.colors = np.array([glow(colour)] * 2, dtype=np.uint8)
        self._halo.visible = phase is not ContactPhase.STICK
