"""Lenses of spatial hands: the face of each contact from outside, magnified.

The point that was first touched is in the middle; t_y points to the right and t_x up, so that the
slip (s_x, s_y) stands at (right, up) = (s_y, s_x). The path of the fingertip is a curve. Around the
fingertip lies what friction cannot leave, a disc on the cone and a square in the pyramid: as large
as the largest friction that the contact can give now; the arrow in it is the friction on the
object. While the fingertip slips, that arrow ends on the rim, and the slip velocity continues it.

Of a soft fingertip the pad is a disc as large as it is, in the colour of its phase. The dark line
in it turns with the fingertip, the pale one shows how it lay at the start; friction is as large as
the limit surface allows beside the moment.
"""

from __future__ import annotations

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import CONE, PHASES
from slipgrasp.scene.skeleton import Contact
from slipgrasp.scene.states import States
from slipgrasp.web.model.colours import BELIEVED_CONE, CONE_INSIDE, glow
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.images import SceneImage, add_image_in_plane, round_patch
from slipgrasp.web.scene.layout import FullScale, SceneLayout, nice_at_least
from slipgrasp.web.scene.lens_frame import LensFrame
from slipgrasp.web.scene.marks import Trail
from slipgrasp.web.scene.shapes import circle, extrude, lift, polyline, position
from slipgrasp.web.scene.surfaces import Surfaces

Points = NDArray[np.float64]

_SPEED_LENGTH = 0.32
_FINE_LINE = 0.018
_PAD_CORNERS, _PAD_OPACITY = 48, 0.35


class FaceLens:
    """Draws the lens of one contact with a fixed set of nodes below that of its middle.

    Args:
        scene: Where the nodes go.
        name: Name of that node, in the upright plane of the lenses.
        layout: Where the lenses are.
        index: Which contact.
        finger: What its finger is called.
        contact: The contact.
        rim: What friction cannot leave, in shares of its limit, ``(k, 2)``.
        surfaces: Colours.
        detail: How finely it is drawn.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        layout: SceneLayout,
        index: int,
        finger: str,
        contact: Contact,
        rim: Points,
        surfaces: Surfaces,
        detail: Detail,
    ) -> None:
        self._index, self._outline, self._radius = index, rim, layout.lens_radius
        self._pad = contact.pad
        self._scene, self._name, self._surfaces = scene, name, surfaces
        patch = SceneImage(round_patch(surfaces.object), 2.0 * self._radius)
        add_image_in_plane(scene, f"{name}/face", patch, np.zeros(2), -0.01)
        self._grid = self._lines("grid", surfaces.object_edge, _FINE_LINE)
        turns = self._pad is not None
        self.surround = LensFrame(scene, name, self._radius, finger, surfaces, detail, turns=turns)
        self._add_marks()
        self._phase: ContactPhase | None = None
        self._path: Trail | None = None
        self._follow_tip = Follower(detail, self._draw_tip)
        self._follow_hand = Follower(detail, self._draw_hand)
        self._follow_limit = Follower(detail, self._draw_limit)
        self._follow_arrows = Follower(detail, self._draw_arrows)

    def rescale(self, layout: SceneLayout) -> None:
        """Sets how much larger than life the lens shows slip, and how large friction."""
        self._magnification, self._limit_scale = layout.magnification, layout.disc_scale
        self._draw_grid()
        if self._pad is not None:
            self._draw_pad(self._magnification * self._pad.radius)
        followers = self._follow_tip, self._follow_hand, self._follow_limit, self._follow_arrows
        for follower in followers:
            follower.forget()

    def show_cone(self, visible: bool) -> None:
        """Whether the limit of friction is drawn."""
        self._cone.visible = visible

    def update(self, states: States, full: FullScale, believed: float | None, trail: Trail) -> None:
        """Shows the only one of some states.

        Args:
            states: The state.
            full: What an arrow of full length stands for.
            believed: The friction coefficient that the controller assumes, None if it knows the
                true one.
            trail: Where the fingertip has slid.
        """
        i = self._index
        phase = ContactPhase(int(states.phases[0, i]))
        if phase is not self._phase:
            self._phase = phase
            self._colour(phase)
        self._path = trail
        self._follow_tip.follow(self._magnification * states.slip[0, i, ::-1])
        normal = max(float(states.normal_force[0, i]), 0.0)
        limits = np.array([float(states.friction[0, i]), believed or 0.0])
        limit = normal * limits.clip(0.0)
        if self._pad is not None:
            self._follow_hand.follow(self._magnification * self._pad.hand(states)[0, ::-1])
            limit = self._pad.left_by_moment(limit[None], states)[0]
        self._follow_limit.follow(self._limit_scale * limit)
        friction = -self._limit_scale * states.tangential_force[0, i, ::-1]
        speed = _SPEED_LENGTH * self._radius / full.speed * states.slip_velocity[0, i, ::-1]
        slips = phase is not ContactPhase.STICK
        motion = np.stack([friction, friction + speed]) if slips else np.zeros((2, 2))
        self._follow_arrows.follow(np.stack([np.stack([np.zeros(2), friction]), motion]))

    def _lines(
        self, part: str, colour: tuple[int, int, int], width: float
    ) -> viser.LineSegmentsHandle:
        return self._scene.add_line_segments(
            f"{self._name}/{part}", np.zeros((1, 2, 3)), colour, thickness=width * self._radius
        )

    def _add_marks(self) -> None:
        scene, name, radius = self._scene, self._name, self._radius
        self._way = self._lines("way", PHASES[ContactPhase.SLIP], 0.05)
        self._tip = scene.add_frame(f"{name}/tip", show_axes=False)
        if self._pad is not None:
            self._add_pad()
        self._cone = scene.add_frame(f"{name}/tip/cone", show_axes=False)
        inside = extrude(self._outline, 0.011, 0.012)
        self._inside = scene.add_mesh_simple(
            f"{name}/tip/cone/inside", *inside, color=CONE_INSIDE, opacity=0.6, flat_shading=True
        )
        self._edge = self._lines("tip/cone/edge", CONE, 0.014)
        self._belief = self._lines("tip/cone/belief", BELIEVED_CONE, 0.014)
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

    def _add_pad(self) -> None:
        disc = extrude(circle(1.0, _PAD_CORNERS), 0.006, 0.007)
        self._disc = self._scene.add_mesh_simple(
            f"{self._name}/tip/pad", *disc, color=CONE, opacity=_PAD_OPACITY, flat_shading=True
        )
        self._pad_edge = self._lines("tip/pad-edge", CONE, 0.025)
        self._start_hand = self._lines("tip/pad-start", self._surfaces.object_edge, 0.02)
        self._hand = self._lines("tip/pad-hand", self._surfaces.joint, 0.045)

    def _draw_pad(self, radius: float) -> None:
        self._disc.scale = (radius, 1.0, radius)
        self._pad_edge.points = polyline(circle(radius, _PAD_CORNERS), 0.008, closed=True)
        self._start_hand.points = lift(np.array([[[0.0, 0.0], [0.0, radius]]]), 0.018)

    def _draw_hand(self, hand: Points) -> None:
        self._hand.points = lift(np.stack([np.zeros(2), hand])[None], 0.03)

    def _draw_grid(self) -> None:
        """A cross through the point touched first, with ticks at round slips."""
        step = nice_at_least(0.15 * self._radius / self._magnification)
        count = int(0.95 * self._radius / self._magnification / step)
        at = np.linspace(-count, count, 2 * count + 1) * step * self._magnification
        ticks = [np.stack([at, np.full_like(at, s * 0.03 * self._radius)], axis=1) for s in (-1, 1)]
        across = np.stack(ticks, axis=1)
        axis = np.array([[[-0.95, 0.0], [0.95, 0.0]]]) * self._radius
        lines = np.concatenate([axis, axis[..., ::-1], across, across[..., ::-1]])
        self._grid.points = lift(lines, 0.004)
        self.surround.tell_scale(self._magnification, step)

    def _colour(self, phase: ContactPhase) -> None:
        colour = PHASES[phase]
        self._ball.color = colour
        if self._pad is not None:
            self._disc.color = colour
            self._pad_edge.colors = np.array(colour, dtype=np.uint8)
        self._arrows.colors = np.array([glow(CONE), glow(colour)], dtype=np.uint8)

    def _draw_tip(self, slip: Points) -> None:
        assert self._path is not None, "it is drawn by update"
        self._tip.position = position(slip, 0.02)
        path = self._magnification * self._path.segments[..., ::-1]
        self._way.points = lift(path, 0.036)

    def _draw_limit(self, sizes: Points) -> None:
        limit, believed = np.minimum(sizes, 2.0 * self._radius).tolist()
        self._inside.scale = (max(limit, 1e-6), 1.0, max(limit, 1e-6))
        self._edge.points = polyline(limit * self._outline, 0.014, closed=True)
        self._belief.visible = believed > 0.0
        self._belief.points = polyline(believed * self._outline, 0.016, closed=True)[::2]

    def _draw_arrows(self, arrows: Points) -> None:
        self._arrows.points = lift(arrows, 0.07)
