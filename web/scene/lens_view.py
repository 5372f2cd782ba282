"""Lenses: each contact magnified, so that even two millimetres of slip are plain to see.

A lens shows the object frame upright, with the spot that was first touched in its middle:
the face stands still and the fingertip slides along it.
"""

from __future__ import annotations

import math

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.scenario.geometry import ContactFrame
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.web.model.sampling import Sample
from slipgrasp.web.scene.contact_view import ContactView
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.images import SceneImage, add_image_in_plane, lens_background
from slipgrasp.web.scene.layout import SceneLayout, nice_at_least
from slipgrasp.web.scene.lens_frame import LensFrame
from slipgrasp.web.scene.lens_places import LEADER_PLACE
from slipgrasp.web.scene.marks import FullScale, sizes_in_lens
from slipgrasp.web.scene.shapes import circle, distance_to_circle, lift, polyline
from slipgrasp.web.scene.surfaces import Surfaces

Points = NDArray[np.float64]

LENS_DEPTH = 0.12
"""How much nearer to the eye than the hand all lenses are [m], so that no finger covers one."""

_SPOT_SEGMENTS = 36
_BACKGROUND_DEPTH = -0.01
_FACE_WIDTH, _FINE_LINE = 0.03, 0.018


class LensView:
    """Draws the lens of one contact with a fixed set of nodes.

    Args:
        scene: Where the nodes go.
        name: Name of the node that they are below.
        frame: Tangent and normal of the contact.
        finger: What its finger is called.
        layout: Where the lenses go.
        index: Which contact.
        surfaces: Colours.
        detail: How finely it is drawn.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        frame: ContactFrame,
        finger: str,
        layout: SceneLayout,
        index: int,
        surfaces: Surfaces,
        detail: Detail,
    ) -> None:
        self._detail = detail
        self._frame, self._index = frame, index
        self._centre, self._radius = layout.lens_centres[index], layout.lens_radius
        self._sizes = sizes_in_lens(self._radius)
        self._marks = ContactView(
            scene,
            f"{name}/contact",
            self._centre,
            frame,
            layout.magnification,
            self._sizes,
            detail,
            0.97 * self._radius,
        )
        self._add_background(scene, name, surfaces)
        self._surround = LensFrame(scene, name, self._centre, self._radius, finger, surfaces)
        none, fine = np.zeros((1, 2, 3)), _FINE_LINE * self._radius
        self._leader = scene.add_line_segments(
            f"{name}/leader", none, surfaces.leader, thickness=fine
        )
        self._ticks = scene.add_line_segments(
            f"{name}/ticks", none, surfaces.object_edge, thickness=fine
        )
        self._stub = scene.add_line_segments(
            f"{name}/stub", none, surfaces.link, thickness=1.5 * self._sizes.tip_radius
        )
        self._phase: ContactPhase | None = None
        self._follow_spot = Follower(detail, self._draw_leader)
        self._follow_stub = Follower(detail, self._draw_stub)

    def magnify(self, magnification: float) -> None:
        """Sets how much larger than life the lens shows its contact."""
        self._marks.magnification = magnification
        self._follow_spot.forget()
        step = nice_at_least(0.15 * self._radius / magnification)
        count = int(0.9 * self._radius / magnification / step)
        numbers = np.arange(-count, count + 1)[:, None]
        length = np.where(numbers == 0, 0.14, 0.06) * self._radius
        points = self._centre + numbers * step * magnification * self._frame.tangent
        self._ticks.points = lift(
            np.stack([points, points + length * self._frame.normal], axis=1), 0.045
        )
        self._surround.tell_scale(magnification, step)

    def show_cone(self, visible: bool) -> None:
        """Whether the friction cone is drawn."""
        self._marks.show_cone(visible)

    def update(
        self,
        sample: Sample,
        full: FullScale,
        believed: float | None,
        spot: Points,
        pale_slip: float | None,
    ) -> None:
        """Shows an instant.

        Args:
            sample: The instant.
            full: What an arrow of full length stands for.
            believed: The friction coefficient that the controller believes in, None if it
                knows the true one.
            spot: Where the anchor of the contact stands on the hand [m].
            pale_slip: Slip in the run that is drawn pale [m], None without one.
        """
        self._marks.update(sample, self._index, full, believed)
        phase = sample.phases[self._index]
        if phase is not self._phase:
            self._phase = phase
            self._surround.show_phase(phase)
        self._follow_spot.follow(spot)
        self._follow_stub.follow(self._stub_of(sample))
        if self._detail.with_numbers:
            i = self._index
            force = math.hypot(sample.normal_force[i], sample.tangential_force[i])
            self._surround.tell_numbers(float(sample.slip[i]), force, pale_slip)

    def _add_background(self, scene: viser.SceneApi, name: str, surfaces: Surfaces) -> None:
        """The background: a disc, and the half of it that is the object."""
        disc = SceneImage(
            lens_background(self._frame.normal, surfaces.lens, surfaces.object), 2.0 * self._radius
        )
        add_image_in_plane(scene, f"{name}/background", disc, self._centre, _BACKGROUND_DEPTH)
        tangent = np.asarray(self._frame.tangent)
        face = self._centre + 0.985 * self._radius * np.array([[tangent, -tangent]])
        scene.add_line_segments(
            f"{name}/face",
            lift(face, 0.04),
            surfaces.object_edge,
            thickness=_FACE_WIDTH * self._radius,
        )

    def _draw_leader(self, spot: Points) -> None:
        """The line from the ring around the magnified spot to the words below the lens."""
        end = self._centre + np.array([0.0, LEADER_PLACE * self._radius])
        towards = (end - spot) / math.hypot(*(end - spot))
        start = spot + self._radius / self._marks.magnification * towards
        self._leader.points = lift(np.array([[start, end]]), -0.1 - LENS_DEPTH)

    def _draw_stub(self, line: Points) -> None:
        self._stub.points = lift(line, self._sizes.depth - 0.02)

    def _stub_of(self, sample: Sample) -> Points:
        """The end of the last link, seen through the lens."""
        angle = float(sample.joint_positions[self._index].sum())
        back = -np.array([math.cos(angle), math.sin(angle)])
        slip = self._marks.magnification * float(sample.slip[self._index])
        ball = slip * np.asarray(self._frame.tangent) - self._sizes.tip_radius * np.asarray(
            self._frame.normal
        )
        length = distance_to_circle(ball, back, 0.92 * self._radius)
        return self._centre + np.array([[ball, ball + length * back]])


def spot_ring(radius: float) -> NDArray[np.float32]:
    """The ring around the spot that a lens shows, in the axes of the object."""
    return polyline(circle(radius, _SPOT_SEGMENTS), 0.09, closed=True)
