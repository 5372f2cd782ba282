"""What happens at the contacts: fingertips, slip trails, forces and friction cones."""

from __future__ import annotations

import math

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.scenario.geometry import ContactFrame
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import CONE, PHASES, Rgb
from slipgrasp.web.model.colours import BELIEVED_CONE, CONE_INSIDE, glow
from slipgrasp.web.model.sampling import Sample
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.marks import (
    FullScale,
    MarkSizes,
    cone_edges,
    cone_outline,
    contact_marks,
    dashed,
)
from slipgrasp.web.scene.shapes import circle, distance_to_circle, extrude, lift, polyline, position

_HALO = 1.75
_FINEST_FRICTION = 5e-3


class ContactView:
    """Draws the marks of one contact with a fixed set of nodes below one that stands for it.

    Args:
        scene: Where the nodes go.
        name: Name of the node at the spot touched first, whose axes are the object's.
        anchor: Where that node stands in its parent [m].
        frame: Tangent and normal of the contact in the object frame.
        magnification: How much larger than life slip is drawn.
        sizes: Sizes of the marks.
        detail: How finely they are drawn.
        reach: How far from the spot touched first the arrow of the force may end [m].
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        anchor: NDArray[np.float64],
        frame: ContactFrame,
        magnification: float,
        sizes: MarkSizes,
        detail: Detail,
        reach: float = math.inf,
    ) -> None:
        self._reach = reach
        self.magnification = magnification
        self._frame, self._sizes = frame, sizes
        scene.add_frame(name, show_axes=False, position=position(anchor))
        self._trail = _add_trail(scene, f"{name}/trail", sizes)
        self._tip = scene.add_frame(f"{name}/tip", show_axes=False)
        self._add_fingertip(scene, f"{name}/tip")
        self._arrows = _add_arrows(scene, f"{name}/tip/arrows", sizes)
        self._cone = _ConeView(scene, f"{name}/tip/cone", frame, sizes)
        self._phase: ContactPhase | None = None
        self._follow_tip = Follower(detail, self._draw_tip)
        self._follow_trail = Follower(detail, self._draw_trail)
        self._follow_arrows = Follower(detail, self._draw_arrows)

    def update(self, sample: Sample, index: int, full: FullScale, believed: float | None) -> None:
        """Shows the contact at an instant.

        Args:
            sample: The instant.
            index: Which contact.
            full: What an arrow of full length stands for.
            believed: The friction coefficient that the controller believes in, None if it
                knows the true one.
        """
        marks = contact_marks(sample, index, self._frame, self.magnification, self._sizes, full)
        phase = sample.phases[index]
        if phase is not self._phase:
            self._phase = phase
            self._colour(phase)
        self._follow_tip.follow(marks.tip)
        self._follow_trail.follow(marks.trail)
        force = np.stack([np.zeros(2), self._within(marks.tip, marks.force)])
        # Where nothing slips, the second arrow hides in the first.
        motion = force if phase is ContactPhase.STICK else marks.motion
        self._follow_arrows.follow(np.stack([force, motion]))
        self._cone.update(float(sample.friction[index]), believed)

    def show_cone(self, visible: bool) -> None:
        """Whether the friction cone is drawn."""
        self._cone.show(visible)

    def _within(self, tip: NDArray[np.float64], arrow: NDArray[np.float64]) -> NDArray[np.float64]:
        """An arrow from the fingertip, as much of it as fits into the lens."""
        length = float(np.hypot(*arrow))
        if length == 0.0:
            return arrow
        room = distance_to_circle(tip, arrow / length, self._reach)
        return min(1.0, room / length) * arrow

    def _draw_tip(self, tip: NDArray[np.float64]) -> None:
        self._tip.position = position(tip)

    def _draw_trail(self, trail: NDArray[np.float64]) -> None:
        self._trail.points = lift(trail, self._sizes.depth + 0.002)

    def _draw_arrows(self, arrows: NDArray[np.float64]) -> None:
        self._arrows.points = lift(arrows, self._sizes.depth + 0.02)

    def _add_fingertip(self, scene: viser.SceneApi, name: str) -> None:
        """A ball that touches the face from outside, and a halo while it slips."""
        sizes = self._sizes
        centre = position(-sizes.tip_radius * np.asarray(self._frame.normal), sizes.depth)
        self._ball = scene.add_icosphere(f"{name}/ball", radius=sizes.tip_radius, position=centre)
        self._halo = scene.add_line_segments(
            f"{name}/halo",
            polyline(circle(_HALO * sizes.tip_radius), 0.0, closed=True),
            CONE,
            thickness=0.4 * sizes.tip_radius,
            position=centre,
        )

    def _colour(self, phase: ContactPhase) -> None:
        """Gives every mark the colour of the phase; halo and motion show that it slips."""
        colour = PHASES[phase]
        self._ball.color = colour
        self._halo.colors = np.array(colour, dtype=np.uint8)
        self._arrows.colors = np.array([glow(colour)] * 2, dtype=np.uint8)
        self._halo.visible = phase is not ContactPhase.STICK


class _ConeView:
    """The friction cone at a fingertip: the true one, and the one the controller believes in."""

    def __init__(
        self, scene: viser.SceneApi, name: str, frame: ContactFrame, sizes: MarkSizes
    ) -> None:
        self._frame, self._sizes = frame, sizes
        self._root = scene.add_frame(name, show_axes=False)
        inside = extrude(cone_outline(1.0, frame, sizes.cone_length), 0.0, sizes.depth - 0.006)
        self._inside = scene.add_mesh_simple(
            f"{name}/inside", *inside, color=CONE_INSIDE, flat_shading=True
        )
        self._edges = _lines(scene, f"{name}/edges", sizes.line_width, CONE)
        self._believed = _lines(scene, f"{name}/believed", 0.8 * sizes.line_width, BELIEVED_CONE)
        self._drawn: tuple[int, int | None] | None = None

    def show(self, visible: bool) -> None:
        """Whether it is drawn."""
        self._root.visible = visible

    def update(self, friction: float, believed: float | None) -> None:
        """Opens the cones as wide as friction coefficients say; as fine as an eye can see."""
        now = (
            round(friction / _FINEST_FRICTION),
            None if believed is None else round(believed / _FINEST_FRICTION),
        )
        if now == self._drawn:
            return
        before, self._drawn = self._drawn, now
        length, depth = self._sizes.cone_length, self._sizes.depth
        if before is None or before[0] != now[0]:
            outline = cone_outline(friction, self._frame, length)
            self._inside.vertices = extrude(outline, 0.0, depth - 0.006).vertices
            edges = np.stack([np.zeros((2, 2)), cone_edges(friction, self._frame, length)], axis=1)
            self._edges.points = lift(edges, depth + 0.006)
        if before is None or (before[1] is None) != (believed is None):
            self._believed.visible = believed is not None
        if believed is not None:
            ends = cone_edges(believed, self._frame, 0.85 * length)
            self._believed.points = lift(dashed(ends), depth + 0.004)


def _add_trail(scene: viser.SceneApi, name: str, sizes: MarkSizes) -> viser.LineSegmentsHandle:
    """Both ways from the spot touched first, each in the colour of its direction."""
    ways = (ContactPhase.SLIP_BACKWARD, ContactPhase.SLIP_FORWARD)
    colours = np.array([[glow(PHASES[way])] * 2 for way in ways], dtype=np.uint8)
    return scene.add_line_segments(name, np.zeros((2, 2, 3)), colours, thickness=sizes.trail_width)


def _add_arrows(scene: viser.SceneApi, name: str, sizes: MarkSizes) -> viser.ArrowsHandle:
    """The force and the slip velocity of one fingertip: one node is moved faster than two."""
    return scene.add_arrows(
        name,
        np.zeros((2, 2, 3)),
        np.zeros((2, 3), dtype=np.uint8),
        shaft_radius=sizes.shaft_radius,
        head_radius=2.6 * sizes.shaft_radius,
        head_length=5.0 * sizes.shaft_radius,
    )


def _lines(
    scene: viser.SceneApi, name: str, thickness: float, colour: Rgb
) -> viser.LineSegmentsHandle:
    return scene.add_line_segments(name, np.zeros((1, 2, 3)), colour, thickness=thickness)
