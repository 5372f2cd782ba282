"""A contact: fingertip, slip trail, force, slip velocity and friction cone.

The marks are in the axes of the contact frame (`slipgrasp.scene.skeleton`), for planar and spatial
hands.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario.hand_files.meshes import Mesh
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import CONE, PHASES
from slipgrasp.scene import rotations
from slipgrasp.scene.pads import Pad
from slipgrasp.scene.parts import PAD_POINTER, PAD_THICKNESS, cone_rim, force_in
from slipgrasp.scene.rotations import Values
from slipgrasp.scene.skeleton import Contact
from slipgrasp.scene.solids import prism
from slipgrasp.scene.states import States
from slipgrasp.web.model.colours import BELIEVED_CONE, CONE_INSIDE
from slipgrasp.web.scene.canvas import Canvas
from slipgrasp.web.scene.layout import FullScale
from slipgrasp.web.scene.marks import MarkSizes, Trail
from slipgrasp.web.scene.moving_marks import ContactMarks, MovingMarks
from slipgrasp.web.scene.shapes import circle, dashed_edges, faceted, fan, joined, two_sided

_HALO = 1.75
_FINEST_FRICTION = 5e-3
_RAYS, _DASHES = 8, 8
_CONE_OPACITY = 0.5
_BESIDE = 3.6
_OUTSIDE = 0.003
_ARC_PIECES = 24  # points of the trail of a planar hand, which only consists of its ends


def contact_marks(
    contact: Contact, i: int, states: States, sizes: MarkSizes, full: FullScale
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


def cone_edge(contact: Contact, friction: float, rim: Values, slant: float) -> Values:
    """Points on the rim of a friction cone, from its tip, shape ``(k, 3)`` [m].

    Args:
        contact: The contact.
        friction: The friction coefficient.
        rim: Tangential directions divided by the friction, shape ``(k, d - 1)``.
        slant: Distance of the rim from the tip for unit directions [m].
    """
    return slant / np.hypot(1.0, friction) * cone_rim(contact, rim, friction)


class ContactView(MovingMarks):
    """Draws the marks of one contact, with its friction cone.

    Args:
        canvas: Adds the nodes.
        name: Name of the node at the initial contact point, with the axes of the contact frame.
        contact: The contact.
        rim: Outline of the admissible friction, divided by its limit, shape ``(k, d - 1)``.
        sizes: Sizes of the marks.
    """

    def __init__(
        self, canvas: Canvas, name: str, contact: Contact, rim: Values, sizes: MarkSizes
    ) -> None:
        self._contact, self._rim = contact, rim
        self._flat = contact.dimensions == 2
        turn = np.array(rotations.of_matrix(contact.axes))
        width = sizes.trail_width * (1.0 if self._flat else 0.6)
        super().__init__(canvas, name, sizes, width, position=contact.anchor, wxyz=turn)
        self._add_halo()
        self._add_cone()
        if contact.pad is not None:
            self._add_pad(contact.pad)
        self._drawn: tuple[int, int | None] | None = None
        self._follow_hand = canvas.follow(self._draw_hand)

    def update(
        self, states: States, i: int, full: FullScale, believed: float | None, trail: Trail
    ) -> None:
        """Shows the contact in a single state, see `MovingMarks`."""
        self._slip = states.slip[0, i]
        super().update(states, i, full, believed, trail)
        if self._contact.pad is not None:
            self._follow_hand.follow(PAD_POINTER * self._contact.pad.hand(states)[0])
        self._open(states.friction[0, i], believed)

    def show_cone(self, visible: bool) -> None:
        """Shows or hides the friction cone."""
        self._cone.visible = visible

    def _marks(self, states: States, i: int, full: FullScale) -> ContactMarks:
        return contact_marks(self._contact, i, states, self._sizes, full)

    def _raised(self, points: NDArray[np.floating], depth: float = 0.0) -> NDArray[np.float32]:
        """Points in front of a planar hand; unchanged for a spatial one, which is transparent."""
        out = self._contact.front * (self._sizes.depth + depth) if self._flat else 0.0
        return (points + np.array([0.0, 0.0, out])).astype(np.float32)

    def _on_face(self, points: Values) -> NDArray[np.float32]:
        """Points in front of a planar hand, and slightly outside the face of a spatial object."""
        return self._raised(points if self._flat else points - _OUTSIDE * self._contact.inward)

    def _draw_tip(self, tip: Values) -> None:
        super()._draw_tip(tip)
        if self._contact.is_curved:
            self._tip.wxyz = self._contact.turned(self._slip)

    def _draw_hand(self, hand: Values) -> None:
        end = -self._contact.across(hand)
        self._hand.points = np.stack([np.zeros(3), end])[None].astype(np.float32)

    def _draw_trail(self, _extent: Values) -> None:
        pieces = _ARC_PIECES if self._flat and self._contact.is_curved else 1
        segments, colours = self._path.divided(pieces)
        path = self._contact.along_face(segments)
        inside = 0.5 * self._sizes.trail_width * self._contact.inward if self._flat else np.zeros(3)
        self._trail.colors = colours
        self._trail.points = self._on_face(path + inside)

    def _draw_arrows(self, arrows: Values) -> None:
        self._arrows.points = self._raised(arrows, 0.3 * self._sizes.depth)

    def _add_halo(self) -> None:
        """A ring around the ball during slip; the ball touches the face from outside."""
        radius = self._sizes.tip_radius
        self._ball.position = centre = self._raised(-radius * self._contact.inward)
        ring = np.pad(circle(_HALO * radius), ((0, 0), (0, 1)))
        self._halo = self._canvas.add_lines(
            f"{self._name}/tip/halo", CONE, 0.4 * radius, joined(ring, closed=True), position=centre
        )

    def _add_pad(self, pad: Pad) -> None:
        """A disc between the face and the ball, with a line that turns with the fingertip."""
        radius, inward = self._sizes.tip_radius, self._contact.inward
        thickness = PAD_THICKNESS * radius
        solid = prism(circle(pad.radius), -0.5 * thickness, 0.5 * thickness)
        self._disc = self._canvas.add_mesh(
            f"{self._name}/tip/pad",
            faceted(solid.points, solid.indices.astype(np.uint32)),
            CONE,
            position=-0.5 * thickness * inward,
        )
        self._hand = self._canvas.add_lines(f"{self._name}/tip/pad-hand", CONE, 0.35 * radius)
        for node in (self._ball, self._halo):
            node.position = -(radius + thickness) * inward

    def _add_cone(self) -> None:
        """The cone that contains the force on the object, around the inward normal."""
        name, canvas = f"{self._name}/tip/cone", self._canvas
        self._cone = canvas.add_frame(name)
        faces = fan(len(self._rim), closed=not self._flat)
        mesh = Mesh(np.zeros((len(self._rim) + 1, 3), np.float32), faces)
        self._inside = canvas.add_mesh(
            f"{name}/inside",
            two_sided(mesh) if self._flat else mesh,
            CONE_INSIDE,
            opacity=None if self._flat else _CONE_OPACITY,
            side="front" if self._flat else "double",
        )
        width = self._sizes.line_width * (1.0 if self._flat else 0.5)
        self._edges = canvas.add_lines(f"{name}/edges", CONE, width)
        self._believed = canvas.add_lines(f"{name}/believed", BELIEVED_CONE, 0.8 * width)

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

    def _rays(self, edge: Values) -> Values:
        """Lines from the tip of a cone to its rim."""
        ends = edge[:: max(len(edge) // _RAYS, 1)]
        return np.stack([np.zeros_like(ends), ends], axis=1)

    def _colour(self, phase: ContactPhase) -> None:
        """Colours all marks by the phase; halo and motion arrow indicate slip."""
        super()._colour(phase)
        if self._contact.pad is not None:
            self._disc.color = PHASES[phase]
        self._halo.colors = np.array(PHASES[phase], dtype=np.uint8)
        self._halo.visible = phase is not ContactPhase.STICK
