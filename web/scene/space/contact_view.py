"""What happens at a contact in space, drawn on the object: fingertip, way, force, cone."""

from __future__ import annotations

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.scenario.spatial_geometry import SpatialContact
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import CONE, PHASES
from slipgrasp.web.model.colours import CONE_INSIDE, glow
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.marks import FullScale, MarkSizes
from slipgrasp.web.scene.shapes import circle, polyline, position
from slipgrasp.web.scene.space.contact_marks import ContactState, face_attitude, way_segments
from slipgrasp.web.scene.space.solids import about_z, open_cone, triple

Points = NDArray[np.float64]

_HALO = 1.9
_CONE_OPACITY = 0.5
_FINEST_FRICTION = 5e-3
_RAYS = 8


class SpatialContactView:
    """Draws the marks of one contact below a node in its face, which the object carries along.

    Args:
        scene: Where the nodes go.
        name: Name of that node.
        contact: Anchor, tangents and normal in the object's frame.
        outline: What friction cannot leave, in shares of its limit, ``(48, 2)``.
        sizes: Sizes of the marks.
        detail: How finely they are drawn.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        contact: SpatialContact,
        outline: Points,
        sizes: MarkSizes,
        detail: Detail,
    ) -> None:
        self._sizes, self._outline = sizes, outline
        anchor = triple(np.asarray(contact.anchor))
        scene.add_frame(name, show_axes=False, position=anchor, wxyz=face_attitude(contact))
        self._way = scene.add_line_segments(
            f"{name}/way",
            np.zeros((1, 2, 3)),
            PHASES[ContactPhase.SLIP],
            thickness=0.6 * sizes.trail_width,
        )
        self._tip = scene.add_frame(f"{name}/tip", show_axes=False)
        self._add_fingertip(scene, f"{name}/tip")
        self._cone = scene.add_frame(f"{name}/tip/cone", show_axes=False, wxyz=about_z(0.5 * np.pi))
        self._add_cone(scene, f"{name}/tip/cone")
        self._phase: ContactPhase | None = None
        self._opened: int | None = None
        self._slid = np.zeros((1, 2))
        self._follow_tip = Follower(detail, self._draw_tip)
        self._follow_arrows = Follower(detail, self._draw_arrows)

    def update(self, state: ContactState, phase: ContactPhase, full: FullScale) -> None:
        """Shows the contact at an instant.

        Args:
            state: The contact.
            phase: What it does.
            full: What an arrow of full length stands for.
        """
        if phase is not self._phase:
            self._phase = phase
            self._colour(phase)
        self._slid = state.way
        self._follow_tip.follow(state.slip)
        across, up = state.friction.tolist()
        force = self._sizes.force_length / full.force * np.array([across, state.normal, up])
        speed = self._sizes.speed_length / full.speed * state.velocity
        motion = np.array([speed[0], 0.0, speed[1]])
        # Where nothing slips, the second arrow hides in the first.
        ends = np.stack([force, force if phase is ContactPhase.STICK else motion])
        self._follow_arrows.follow(np.stack([np.zeros((2, 3)), ends], axis=1))
        self._open(state.coefficient)

    def show_cone(self, visible: bool) -> None:
        """Whether the friction cone is drawn."""
        self._cone.visible = visible

    def _add_fingertip(self, scene: viser.SceneApi, name: str) -> None:
        """A ball that touches the face from outside, and a ring on the face while it slips."""
        sizes = self._sizes
        self._ball = scene.add_icosphere(
            f"{name}/ball",
            radius=sizes.tip_radius,
            position=position(np.zeros(2), sizes.tip_radius),
        )
        self._halo = scene.add_line_segments(
            f"{name}/halo",
            polyline(circle(_HALO * sizes.tip_radius), 0.003, closed=True),
            CONE,
            thickness=0.45 * sizes.tip_radius,
        )
        self._arrows = scene.add_arrows(
            f"{name}/arrows",
            np.zeros((2, 2, 3)),
            np.zeros((2, 3), dtype=np.uint8),
            shaft_radius=sizes.shaft_radius,
            head_radius=2.6 * sizes.shaft_radius,
            head_length=5.0 * sizes.shaft_radius,
        )

    def _add_cone(self, scene: viser.SceneApi, name: str) -> None:
        """The cone in which the force on the object stays: around the inward normal."""
        inside = open_cone(1.0, self._sizes.cone_length, self._outline)
        self._inside = scene.add_mesh_simple(
            f"{name}/inside", *inside, color=CONE_INSIDE, opacity=_CONE_OPACITY, side="double"
        )
        self._rays = scene.add_line_segments(
            f"{name}/rays", np.zeros((1, 2, 3)), CONE, thickness=0.5 * self._sizes.line_width
        )

    def _open(self, friction: float) -> None:
        """Opens it as wide as a friction coefficient says; as fine as an eye can see."""
        now = round(friction / _FINEST_FRICTION)
        if now == self._opened:
            return
        self._opened, length = now, self._sizes.cone_length
        self._inside.vertices = open_cone(friction, length, self._outline).vertices
        height = length / np.hypot(1.0, friction)
        count = len(self._outline)
        rim = np.column_stack([np.full(count, height), friction * height * self._outline])
        rays = np.stack([np.zeros((_RAYS, 3)), rim[:: count // _RAYS]], axis=1)
        ring = np.stack([rim, np.roll(rim, -1, axis=0)], axis=1)
        self._rays.points = np.concatenate([rays, ring]).astype(np.float32)

    def _colour(self, phase: ContactPhase) -> None:
        """Gives every mark the colour of the phase; ring and motion show that it slips."""
        colour = PHASES[phase]
        self._ball.color = colour
        self._halo.colors = np.array(colour, dtype=np.uint8)
        self._arrows.colors = np.array([glow(colour)] * 2, dtype=np.uint8)
        self._halo.visible = phase is not ContactPhase.STICK

    def _draw_tip(self, slip: Points) -> None:
        self._tip.position = position(slip)
        self._way.points = way_segments(self._slid, 0.002)

    def _draw_arrows(self, arrows: Points) -> None:
        self._arrows.points = arrows.astype(np.float32)
