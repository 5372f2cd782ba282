"""Lenses of planar hands: each contact magnified, so that two millimetres of slip are visible.

A lens shows the object frame upright, with the point that was first touched in its middle: the
face stands still and the fingertip slides along it.
"""

from __future__ import annotations

import math

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.scene import rotations
from slipgrasp.scene.skeleton import UPRIGHT, Contact
from slipgrasp.scene.states import States
from slipgrasp.web.scene.contact_view import ContactView
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.images import SceneImage, add_image_in_plane, lens_background
from slipgrasp.web.scene.layout import FullScale, SceneLayout, nice_at_least
from slipgrasp.web.scene.lens_frame import LensFrame
from slipgrasp.web.scene.marks import Trail, sizes_in_lens
from slipgrasp.web.scene.shapes import distance_to_circle, lift
from slipgrasp.web.scene.surfaces import Surfaces

Points = NDArray[np.float64]

_BACKGROUND_DEPTH = -0.01
_FACE_WIDTH, _FINE_LINE = 0.03, 0.018


class SectionLens:
    """Draws the lens of one contact with a fixed set of nodes below that of its middle.

    Args:
        scene: Where the nodes go.
        name: Name of that node.
        layout: Where the lenses are.
        index: Which contact.
        finger: What its finger is called.
        contact: The contact.
        rim: What friction cannot leave, in shares of its limit.
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
        self._index, self._radius = index, layout.lens_radius
        self._on_slides = contact.on_slides
        self._tangent, self._normal = -contact.axes[:2, 0], contact.axes[:2, 1]
        self._sizes = sizes_in_lens(self._radius)
        axes = rotations.product(np.array(UPRIGHT), np.array(rotations.of_matrix(contact.axes)))
        self._marks = ContactView(
            scene,
            f"{name}/contact",
            np.zeros(3),
            axes,
            contact.flattened(),
            rim,
            self._sizes,
            detail,
            reach=0.97 * self._radius,
        )
        self._add_background(scene, name, surfaces)
        self.surround = LensFrame(scene, name, self._radius, finger, surfaces, detail)
        none, fine = np.zeros((1, 2, 3)), _FINE_LINE * self._radius
        self._ticks = scene.add_line_segments(
            f"{name}/ticks", none, surfaces.object_edge, thickness=fine
        )
        self._stub = scene.add_line_segments(
            f"{name}/stub", none, surfaces.link, thickness=1.5 * self._sizes.tip_radius
        )
        self._follow_stub = Follower(detail, self._draw_stub)

    def rescale(self, layout: SceneLayout) -> None:
        """Sets how much larger than life the lens shows its contact."""
        magnification = self._marks.magnification = layout.magnification
        step = nice_at_least(0.15 * self._radius / magnification)
        count = int(0.9 * self._radius / magnification / step)
        numbers = np.arange(-count, count + 1)[:, None]
        length = np.where(numbers == 0, 0.14, 0.06) * self._radius
        points = numbers * step * magnification * self._tangent
        self._ticks.points = lift(np.stack([points, points + length * self._normal], axis=1), 0.045)
        self.surround.tell_scale(magnification, step)

    def show_cone(self, visible: bool) -> None:
        """Whether the friction cone is drawn."""
        self._marks.show_cone(visible)

    def update(self, states: States, full: FullScale, believed: float | None, trail: Trail) -> None:
        """Shows the only one of some states.

        Args:
            states: The state.
            full: What an arrow of full length stands for.
            believed: The friction coefficient that the controller assumes, None if it knows the
                true one.
            trail: Where the fingertip has slid.
        """
        self._marks.update(states, self._index, full, believed, trail)
        self._follow_stub.follow(self._stub_of(states))

    def _add_background(self, scene: viser.SceneApi, name: str, surfaces: Surfaces) -> None:
        """The background: a disc, and the half of it that is the object."""
        nx, ny = self._normal.tolist()
        pixels = lens_background((nx, ny), surfaces.lens, surfaces.object)
        disc = SceneImage(pixels, 2.0 * self._radius)
        add_image_in_plane(scene, f"{name}/background", disc, np.zeros(2), _BACKGROUND_DEPTH)
        face = 0.985 * self._radius * np.array([[self._tangent, -self._tangent]])
        scene.add_line_segments(
            f"{name}/face",
            lift(face, 0.04),
            surfaces.object_edge,
            thickness=_FACE_WIDTH * self._radius,
        )

    def _draw_stub(self, line: Points) -> None:
        self._stub.points = lift(line, self._sizes.depth - 0.02)

    def _stub_of(self, states: States) -> Points:
        """The end of the last link, or of the bar of slides, seen through the lens."""
        back = -self._normal
        if not self._on_slides:
            angle = float(states.joint_positions[0, self._index].sum())
            back = -np.array([math.cos(angle), math.sin(angle)])
        slip = self._marks.magnification * float(states.slip[0, self._index, 0])
        ball = slip * self._tangent - self._sizes.tip_radius * self._normal
        length = distance_to_circle(ball, back, 0.92 * self._radius)
        return np.array([[ball, ball + length * back]])
