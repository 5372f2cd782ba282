"""Lenses of a hand in space: the face of each contact from outside, magnified.

The spot that was first touched is in the middle and the object's z axis points up. The way of the
fingertip is a curve. Around the fingertip lies what friction cannot leave, a disc on the cone and
a square in the pyramid: as large as the largest friction that the contact can give now; the arrow
in it is the friction on the object. While the fingertip slips, that arrow ends on the rim, and
the slip velocity goes on from there.
"""

from __future__ import annotations

import math

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import CONE, PHASES
from slipgrasp.web.model.colours import BELIEVED_CONE, CONE_INSIDE, glow
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.images import SceneImage, add_image_in_plane, round_patch
from slipgrasp.web.scene.layout import nice_at_least
from slipgrasp.web.scene.lens_frame import LensFrame
from slipgrasp.web.scene.lens_places import LEADER_PLACE
from slipgrasp.web.scene.marks import FullScale
from slipgrasp.web.scene.shapes import extrude, lift, polyline, position
from slipgrasp.web.scene.space.contact_marks import ContactState, way_segments
from slipgrasp.web.scene.space.layout import SpatialLayout
from slipgrasp.web.scene.surfaces import Surfaces

Points = NDArray[np.float64]

_SPEED_LENGTH = 0.32
_FINE_LINE = 0.018


class SpatialLensView:
    """Draws the lens of one contact in the upright plane of the lenses.

    Args:
        scene: Where the nodes go.
        name: Name of the node that they are below; the plane of the lenses is its own.
        layout: Where the lenses are.
        index: Which contact.
        finger: What its finger is called.
        outline: What friction cannot leave, in shares of its limit, ``(k, 2)``.
        surfaces: Colours.
        detail: How finely it is drawn.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        layout: SpatialLayout,
        index: int,
        finger: str,
        outline: Points,
        surfaces: Surfaces,
        detail: Detail,
    ) -> None:
        self._detail, self._surfaces, self._outline = detail, surfaces, outline
        self._radius = layout.lens_radius
        self.magnify(layout)
        self._index = index
        middle = layout.lens_centres[index]
        self._scene, self._name = scene, name
        scene.add_frame(name, show_axes=False, position=position(middle))
        patch = SceneImage(round_patch(surfaces.object), 2.0 * self._radius)
        add_image_in_plane(scene, f"{name}/face", patch, np.zeros(2), -0.01)
        self._grid = scene.add_line_segments(
            f"{name}/grid",
            np.zeros((1, 2, 3)),
            surfaces.object_edge,
            thickness=_FINE_LINE * self._radius,
        )
        self._surround = LensFrame(scene, name, np.zeros(2), self._radius, finger, surfaces)
        self._add_marks()
        self._phase: ContactPhase | None = None
        self._slid = np.zeros((1, 2))
        self._follow_tip = Follower(detail, self._draw_tip)
        self._follow_limit = Follower(detail, self._draw_limit)
        self._follow_arrows = Follower(detail, self._draw_arrows)
        self._draw_grid()

    def magnify(self, layout: SpatialLayout) -> None:
        """Sets how much larger than life the lens shows slip, and how large friction."""
        self._magnification, self._limit_scale = layout.magnification, layout.disc_scale

    def rescale(self, layout: SpatialLayout) -> None:
        """The same for a lens that is there already."""
        self.magnify(layout)
        self._draw_grid()
        for follower in (self._follow_tip, self._follow_limit, self._follow_arrows):
            follower.forget()

    def show_cone(self, visible: bool) -> None:
        """Whether the limit of friction is drawn."""
        self._cone.visible = visible

    def update(self, state: ContactState, phase: ContactPhase, full: FullScale) -> None:
        """Shows an instant.

        Args:
            state: The contact.
            phase: What it does.
            full: What an arrow of full length stands for.
        """
        if phase is not self._phase:
            self._phase = phase
            self._colour(phase)
        self._slid = state.way
        self._follow_tip.follow(self._magnification * state.slip)
        believed = 0.0 if state.believed is None else max(state.believed * state.normal, 0.0)
        self._follow_limit.follow(self._limit_scale * np.array([state.limit, believed]))
        friction = self._limit_scale * state.friction
        speed = _SPEED_LENGTH * self._radius / full.speed * state.velocity
        slips = phase is not ContactPhase.STICK
        motion = np.stack([friction, friction + speed]) if slips else np.zeros((2, 2))
        self._follow_arrows.follow(np.stack([np.stack([np.zeros(2), friction]), motion]))
        if self._detail.with_numbers:
            force = math.hypot(*state.friction, state.normal)
            self._surround.tell_numbers(float(np.linalg.norm(state.slip)), force)

    def _add_marks(self) -> None:
        scene, name, radius = self._scene, self._name, self._radius
        self._way = scene.add_line_segments(
            f"{name}/way",
            np.zeros((1, 2, 3)),
            PHASES[ContactPhase.SLIP],
            thickness=0.05 * radius,
        )
        self._tip = scene.add_frame(f"{name}/tip", show_axes=False)
        self._cone = scene.add_frame(f"{name}/tip/cone", show_axes=False)
        inside = extrude(self._outline, 0.011, 0.012)
        self._inside = scene.add_mesh_simple(
            f"{name}/tip/cone/inside", *inside, color=CONE_INSIDE, opacity=0.6, flat_shading=True
        )
        self._edge, self._belief = (
            scene.add_line_segments(
                f"{name}/tip/cone/{part}", np.zeros((1, 2, 3)), colour, thickness=0.014 * radius
            )
            for part, colour in (("edge", CONE), ("belief", BELIEVED_CONE))
        )
        self._ball = scene.add_icosphere(
            f"{name}/tip/ball", radius=0.055 * radius, position=position(np.zeros(2), 0.04)
        )
        shaft = 0.02 * radius
        self._arrows = scene.add_arrows(
            f"{name}/tip/arrows",
            np.zeros((2, 2, 3)),
            np.zeros((2, 3), dtype=np.uint8),
            shaft_radius=shaft,
            head_radius=2.6 * shaft,
            head_length=5.0 * shaft,
        )

    def _draw_grid(self) -> None:
        """A cross through the spot touched first, with ticks at round slips."""
        step = nice_at_least(0.15 * self._radius / self._magnification)
        count = int(0.95 * self._radius / self._magnification / step)
        at = np.linspace(-count, count, 2 * count + 1) * step * self._magnification
        ticks = [np.stack([at, np.full_like(at, s * 0.03 * self._radius)], axis=1) for s in (-1, 1)]
        across = np.stack(ticks, axis=1)
        axis = np.array([[[-0.95, 0.0], [0.95, 0.0]]]) * self._radius
        lines = np.concatenate([axis, axis[..., ::-1], across, across[..., ::-1]])
        self._grid.points = lift(lines, 0.004)
        self._surround.tell_scale(self._magnification, step)

    def _colour(self, phase: ContactPhase) -> None:
        colour = PHASES[phase]
        self._surround.show_phase(phase)
        self._ball.color = colour
        self._arrows.colors = np.array([glow(CONE), glow(colour)], dtype=np.uint8)

    def _draw_tip(self, slip: Points) -> None:
        self._tip.position = position(slip, 0.02)
        self._way.points = way_segments(self._magnification * self._slid, 0.036)

    def _draw_limit(self, sizes: Points) -> None:
        limit, believed = np.minimum(sizes, 2.0 * self._radius).tolist()
        self._inside.scale = (max(limit, 1e-6), 1.0, max(limit, 1e-6))
        self._edge.points = polyline(limit * self._outline, 0.014, closed=True)
        self._belief.visible = believed > 0.0
        self._belief.points = polyline(believed * self._outline, 0.016, closed=True)[::2]

    def _draw_arrows(self, arrows: Points) -> None:
        self._arrows.points = lift(arrows, 0.07)


class Leader:
    """The line from a contact on the hand to its lens.

    Args:
        scene: Where the node goes.
        name: Its name.
        layout: Where the lenses are.
        index: Which contact.
        surfaces: Colours.
        detail: How finely it is drawn.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        layout: SpatialLayout,
        index: int,
        surfaces: Surfaces,
        detail: Detail,
    ) -> None:
        below = layout.lens_centres[index] + np.array([0.0, LEADER_PLACE * layout.lens_radius])
        self._end = layout.plane.place(below)
        self._line = scene.add_line_segments(
            name,
            np.zeros((1, 2, 3)),
            surfaces.leader,
            thickness=_FINE_LINE * layout.lens_radius,
        )
        self._follower = Follower(detail, self._draw)

    def update(self, spot: Points) -> None:
        """Moves its lower end to a point of the world [m]."""
        self._follower.follow(spot)

    def _draw(self, spot: Points) -> None:
        self._line.points = np.array([[spot, self._end]], dtype=np.float32)
