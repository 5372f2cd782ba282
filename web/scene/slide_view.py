"""A body on a support or a rail: force, velocity and path, in the axes of support or plane."""

from __future__ import annotations

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import CONE, PHASES
from slipgrasp.scene.states import States
from slipgrasp.web.model.colours import glow
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.marks import FullScale, MarkSizes, Trail, add_arrows

Points = NDArray[np.float64]

_LEAST_ARROW = 1e-4  # [m]
_ABOVE = 0.004  # of lines above the support [m]


class SlideView:
    """Draws the marks of a body on a support or a rail with a fixed set of nodes.

    Args:
        scene: Scene of the nodes.
        name: Name of the node at the centre of the top of the body at its start.
        place: Position of that node in its parent [m].
        height: Height of the body [m].
        sizes: Sizes of the marks.
        detail: Level of detail.
        upright: Whether the plane is that of a rail, whose normal force is drawn too.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        place: Points,
        height: float,
        sizes: MarkSizes,
        detail: Detail,
        *,
        upright: bool = False,
    ) -> None:
        self._upright, self._sizes = upright, sizes
        self._down = np.array([0.0, 0.0, _ABOVE - height])
        scene.add_frame(name, show_axes=False, position=place)
        self._trail = scene.add_line_segments(
            f"{name}/trail", np.zeros((1, 2, 3)), CONE, thickness=0.6 * sizes.trail_width
        )
        self._top = scene.add_frame(f"{name}/top", show_axes=False)
        self._ball = scene.add_icosphere(f"{name}/top/centre", radius=sizes.tip_radius)
        self._arrows = add_arrows(scene, f"{name}/top/arrows", 2, sizes.shaft_radius)
        self._phase: ContactPhase | None = None
        self._path: Trail | None = None
        self._follow_top = Follower(detail, self._draw_top)
        self._follow_trail = Follower(detail, self._draw_trail)
        self._follow_arrows = Follower(detail, self._draw_arrows)

    def update(
        self, states: States, i: int, full: FullScale, _believed: float | None, trail: Trail
    ) -> None:
        """Shows the body in a single state.

        Args:
            states: The state.
            i: Index of the contact.
            full: Quantities with an arrow of full length.
            trail: Path of the body.
        """
        phase = ContactPhase(int(states.phases[0, i]))
        if phase is not self._phase:
            self._phase, colour = phase, PHASES[phase]
            self._ball.color = colour
            self._arrows.colors = np.array([glow(colour)] * 2, dtype=np.uint8)
        self._path = trail
        self._follow_top.follow(_flat(states.slip[0, i]))
        self._follow_trail.follow(trail.extent)
        on_body = states.tangential_force[0, i]
        if self._upright:
            on_body = np.append(on_body, states.normal_force[0, i])
        force = self._sizes.force_length / full.force * _flat(on_body)
        motion = self._sizes.speed_length / full.speed * _flat(states.slip_velocity[0, i])
        ends = np.stack([force, force if phase is ContactPhase.STICK else motion])
        self._follow_arrows.follow(np.stack([np.zeros_like(ends), ends], axis=1))

    def show_cone(self, _visible: bool) -> None:
        """There is no cone: friction lies in the plane of the support."""

    def _draw_top(self, place: Points) -> None:
        self._top.position = place

    def _draw_trail(self, _extent: Points) -> None:
        assert self._path is not None, "it is drawn by update"
        self._trail.colors = self._path.colours
        self._trail.points = (_flat(self._path.segments) + self._down).astype(np.float32)

    def _draw_arrows(self, arrows: Points) -> None:
        # An arrow without length would be drawn as its head.
        self._arrows.visible = bool(np.abs(arrows).max() > _LEAST_ARROW)
        self._arrows.points = arrows.astype(np.float32)


def _flat(values: Points) -> Points:
    """Vectors in the plane ``(..., 2)``, or along x ``(..., 1)``, with the other numbers 0."""
    rest = np.zeros((*values.shape[:-1], 3 - values.shape[-1]))
    return np.concatenate([values, rest], axis=-1)
