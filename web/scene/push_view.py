"""A push on the object: an arrow to its centre, and an arc about the axis of a moment."""

from __future__ import annotations

import math

import numpy as np

from slipgrasp.scene import rotations
from slipgrasp.scene.rotations import Values
from slipgrasp.web.model.colours import PUSH
from slipgrasp.web.scene.canvas import HEAD_LENGTH, Canvas
from slipgrasp.web.scene.layout import FullScale
from slipgrasp.web.scene.marks import MarkSizes, push_words
from slipgrasp.web.scene.shapes import arc, joined

_ARC = 1.5 * math.pi
_SHORTEST = 1e-3
_LEAST_HEADS = 1.7
"""Smallest length of an arrow, in lengths of its head."""
_MARGIN = 0.6
"""Distance of the text beyond an arrow, in radii of the object."""


class PushView:
    """Shows a force and a moment on the object, with their magnitudes.

    Args:
        canvas: Adds the nodes.
        name: Name of the parent node, with the axes of the model.
        radius: Smallest distance of the object's faces from its centre [m].
        sizes: Sizes of the marks.
    """

    def __init__(self, canvas: Canvas, name: str, radius: float, sizes: MarkSizes) -> None:
        self._radius, self._sizes = radius, sizes
        self._root = canvas.add_frame(name, visible=False)
        shaft = 1.6 * sizes.shaft_radius
        self._head = HEAD_LENGTH * shaft
        self._arrow = canvas.add_arrows(f"{name}/force", 1, shaft, PUSH)
        self._arc = canvas.add_lines(f"{name}/moment", PUSH, 1.3 * shaft)
        # The page writes it over the view (overlay.js): viser's labels are white on a dark page.
        self._words = canvas.scene.add_label(f"{name}/words", "", visible=False)
        self._follow_object = canvas.follow(self._move)
        self._follow_wrench = canvas.follow(self._draw)

    def newtons_per_metre(self, full: FullScale) -> float:
        """Force of an arrow with a length of one metre [N/m]."""
        return full.force / self._sizes.force_length

    def update(self, centre: Values, wrench: Values, full: FullScale) -> None:
        """Shows a force and a moment on an object.

        Args:
            centre: The centre of the object [m].
            wrench: Force and moment [N, N m]: (f_x, f_y, m) of a planar hand, or six numbers.
            full: Quantities with an arrow of full length.
        """
        acts = bool(wrench.any())
        if acts is not self._root.visible:
            self._root.visible = acts
        if acts:
            fx, fy, *rest = wrench.tolist()
            force_and_moment = [fx, fy, 0.0, 0.0, 0.0, *rest] if len(rest) == 1 else [fx, fy, *rest]
            self._follow_object.follow(centre)
            self._follow_wrench.follow(np.array([*force_and_moment, full.force]))

    def _move(self, centre: Values) -> None:
        # In front of a planar hand and its marks.
        self._root.position = centre + np.array([0.0, 0.0, 1.5 * self._sizes.depth])

    def _draw(self, wrench_and_full: Values) -> None:
        force, moment, full = wrench_and_full[:3], wrench_and_full[3:6], wrench_and_full[6]
        arrow = self._sizes.force_length / full * force
        size = float(np.linalg.norm(arrow))
        has_arrow = size > _SHORTEST
        self._arrow.visible = has_arrow
        # It ends at the point of action. A shorter shaft than the head would turn the head around.
        longer = max(_LEAST_HEADS * self._head / size, 1.0) if has_arrow else 1.0
        tail = -longer * arrow if has_arrow else np.array([0.0, self._radius, 0.0])
        self._arrow.points = np.array([[tail, np.zeros(3)]], dtype=np.float32)
        self._arc.visible = bool(moment.any())
        self._arc.points = joined(_twist(0.7 * self._radius, moment))
        self._words.text = push_words(*np.linalg.norm([force, moment], axis=1).tolist())
        length = float(np.linalg.norm(tail))
        self._words.position = (1.0 + _MARGIN * self._radius / length) * tail


def _twist(radius: float, moment: Values) -> Values:
    """An arc about a moment, counterclockwise seen from its tip, with an arrow head."""
    start, end = 0.25 * math.pi, 0.25 * math.pi + _ARC
    way = arc(radius, start, end)
    forward = np.array([-math.sin(end), math.cos(end)])
    outward = np.array([math.cos(end), math.sin(end)])
    back = way[-1] - 0.4 * radius * forward
    head = [back + 0.25 * radius * outward, way[-1], back - 0.25 * radius * outward]
    flat = np.concatenate([way, head])
    axes = rotations.matrices(rotations.from_x_to(moment[None]))[0]
    return flat @ axes[:, 1:].T
