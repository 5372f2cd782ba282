"""A body on a support or a rail: force, velocity and path, in the axes of support or plane."""

from __future__ import annotations

import numpy as np

from slipgrasp.scene.rotations import Values
from slipgrasp.scene.states import States
from slipgrasp.web.scene.canvas import Canvas
from slipgrasp.web.scene.layout import FullScale
from slipgrasp.web.scene.marks import MarkSizes
from slipgrasp.web.scene.moving_marks import ContactMarks, MovingMarks

_LEAST_ARROW = 1e-4  # [m]
_ABOVE = 0.004  # of lines above the support [m]


class SlideView(MovingMarks):
    """Draws the marks of a body on a support or a rail, without a cone: friction lies in the plane.

    Args:
        canvas: Adds the nodes.
        name: Name of the node at the centre of the top of the body at its start.
        place: Position of that node in its parent [m].
        height: Height of the body [m].
        sizes: Sizes of the marks.
        upright: Whether the plane is that of a rail, whose normal force is drawn too.
    """

    def __init__(
        self,
        canvas: Canvas,
        name: str,
        place: Values,
        height: float,
        sizes: MarkSizes,
        *,
        upright: bool = False,
    ) -> None:
        super().__init__(canvas, name, sizes, 0.6 * sizes.trail_width, position=place)
        self._upright, self._down = upright, np.array([0.0, 0.0, _ABOVE - height])

    def _marks(self, states: States, i: int, full: FullScale) -> ContactMarks:
        on_body = states.tangential_force[0, i]
        if self._upright:
            on_body = np.append(on_body, states.normal_force[0, i])
        force = self._sizes.force_length / full.force * _flat(on_body)
        motion = self._sizes.speed_length / full.speed * _flat(states.slip_velocity[0, i])
        return ContactMarks(_flat(states.slip[0, i]), force, np.array([0.0 * motion, motion]))

    def _draw_trail(self, _extent: Values) -> None:
        self._trail.colors = self._path.colours
        self._trail.points = (_flat(self._path.segments) + self._down).astype(np.float32)

    def _draw_arrows(self, arrows: Values) -> None:
        # An arrow without length would be drawn as its head.
        self._arrows.visible = bool(np.abs(arrows).max() > _LEAST_ARROW)
        self._arrows.points = arrows.astype(np.float32)


def _flat(values: Values) -> Values:
    """Vectors in the plane ``(..., 2)``, or along x ``(..., 1)``, with the other numbers 0."""
    rest = np.zeros((*values.shape[:-1], 3 - values.shape[-1]))
    return np.concatenate([values, rest], axis=-1)
