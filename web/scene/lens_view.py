"""Lenses: each contact magnified, so that even two millimetres of slip are plain to see.

A lens shows the object frame upright, with the spot that was first touched in its middle:
the face stands still and the fingertip slides along it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import viser
from numpy.typing import NDArray

from core.geometry import ContactFrame
from core.types import ContactPhase
from web.colours import LENS, LINK, MUTED, OBJECT, OBJECT_EDGE, PHASES
from web.sampling import Sample
from web.scene.contact_view import ContactMarks, ContactPlacement, ContactView, MarkSizes
from web.scene.layout import SceneLayout, nice_at_least
from web.scene.shapes import circle, extrude, half_disc, lift, polyline, position

__all__ = ["LensView"]

Points = NDArray[np.float64]

_RIM_SEGMENTS = 72
_SPOT_SEGMENTS = 36
_PHASE_WORDS = {
    ContactPhase.STICK: "sticks",
    ContactPhase.SLIP_FORWARD: "SLIPS",
    ContactPhase.SLIP_BACKWARD: "SLIPS",
}


class LensView:
    """Draws one lens per contact with a fixed set of nodes.

    Args:
        scene: Where the nodes go.
        frames: Anchor, tangent and normal of each contact.
        names: What the fingers are called.
        layout: Where the lenses go.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        frames: Sequence[ContactFrame],
        names: Sequence[str],
        layout: SceneLayout,
    ) -> None:
        self._frames, self._names = frames, names
        self._centres, self._radius = layout.lens_centres, layout.lens_radius
        self._magnification = layout.magnification
        self.sizes = _sizes(self._radius)
        self._marks = ContactView(scene, f"{name}/marks", len(frames), self.sizes)
        for i, frame in enumerate(frames):
            self._add_glass(scene, f"{name}/{i}", self._centres[i], frame)
        none = np.zeros((1, 2, 3))
        self._rims = [
            scene.add_line_segments(
                f"{name}/{i}/rim",
                polyline(centre + circle(self._radius, _RIM_SEGMENTS), 0.05, closed=True),
                MUTED,
                thickness=0.034 * self._radius,
            )
            for i, centre in enumerate(self._centres)
        ]
        self._leaders = scene.add_line_segments(f"{name}/leaders", none, MUTED, thickness=0.005)
        self._ticks = scene.add_line_segments(f"{name}/ticks", none, OBJECT_EDGE, thickness=0.006)
        self._stubs = scene.add_line_segments(
            f"{name}/stubs", none, LINK, thickness=1.5 * self.sizes.tip_radius
        )
        normals = np.array([frame.normal for frame in frames])
        aside = -np.abs([frame.tangent for frame in frames])
        above = np.tile((0.0, 1.14), (len(frames), 1))
        self._titles = self._add_labels(scene, f"{name}/titles", 1.1, above)
        self._slips = self._add_labels(scene, f"{name}/slips", 1.35, -0.44 * normals + 0.42 * aside)
        self._loads = self._add_labels(scene, f"{name}/loads", 1.0, 0.4 * normals + 0.66 * aside)

    def placement(self, index: int) -> ContactPlacement:
        """Where a contact stands in its lens."""
        return ContactPlacement(self._centres[index], 0.0, self._magnification)

    def magnify(self, magnification: float) -> None:
        """Sets how much larger than life the lenses show the contacts."""
        self._magnification = magnification
        self._ticks.points = np.concatenate([self._scale(i) for i in range(len(self._frames))])

    def update(
        self, sample: Sample, marks: Sequence[ContactMarks], spots: Sequence[Points]
    ) -> None:
        """Shows an instant.

        Args:
            sample: The instant.
            marks: The marks of each contact, placed in its lens.
            spots: Where the anchor of each contact stands on the hand [m].
        """
        self._marks.update(marks, sample.phases)
        for rim, phase in zip(self._rims, sample.phases, strict=True):
            rim.colors = np.array(PHASES[phase], dtype=np.uint8)
        self._update_leaders(spots)
        self._stubs.points = np.stack([self._stub(i, sample, m) for i, m in enumerate(marks)])
        for i in range(len(marks)):
            self._update_words(i, sample)

    def _add_glass(
        self, scene: viser.SceneApi, name: str, centre: Points, frame: ContactFrame
    ) -> None:
        """The background of a lens: a disc, and the half of it that is the object."""
        disc = extrude(centre + circle(self._radius, _RIM_SEGMENTS), -0.01, 0.0)
        inside = extrude(centre + half_disc(self._radius, frame.normal), 0.0, 0.03)
        scene.add_mesh_simple(f"{name}/disc", *disc, color=LENS, flat_shading=True)
        scene.add_mesh_simple(f"{name}/object", *inside, color=OBJECT, flat_shading=True)
        tangent = np.array(frame.tangent)
        face = centre + self._radius * np.array([[tangent, -tangent]])
        scene.add_line_segments(f"{name}/face", lift(face, 0.04), OBJECT_EDGE, thickness=0.01)

    def _add_labels(
        self, scene: viser.SceneApi, name: str, size: float, offsets: Points
    ) -> list[viser.LabelHandle]:
        """One label per lens, off its centre by shares of its radius."""
        return [
            scene.add_label(
                f"{name}/{i}",
                "",
                position=position(place, 0.15),
                font_screen_scale=size,
                anchor="center-center",
            )
            for i, place in enumerate(self._centres + self._radius * offsets)
        ]

    def _update_leaders(self, spots: Sequence[Points]) -> None:
        """Rings around the spots that are magnified, joined to their lenses."""
        leaders = []
        spot_radius = self._radius / self._magnification
        for centre, spot in zip(self._centres, spots, strict=True):
            ring = spot + circle(spot_radius, _SPOT_SEGMENTS)
            leaders.append(polyline(ring, 0.09, closed=True))
            towards = (centre - spot) / math.hypot(*(centre - spot))
            ends = np.array([spot + spot_radius * towards, centre - self._radius * towards])
            leaders.append(polyline(ends, -0.1))
        self._leaders.points = np.concatenate(leaders)

    def _scale(self, index: int) -> NDArray[np.float32]:
        """Ticks along the face, one per round number of millimetres."""
        frame = self._frames[index]
        step = nice_at_least(0.15 * self._radius / self._magnification)
        count = int(0.9 * self._radius / self._magnification / step)
        numbers = np.arange(-count, count + 1)[:, None]
        length = np.where(numbers == 0, 0.14, 0.06) * self._radius
        points = self._centres[index] + numbers * step * self._magnification * frame.tangent
        return lift(np.stack([points, points + length * frame.normal], axis=1), 0.045)

    def _stub(self, index: int, sample: Sample, mark: ContactMarks) -> NDArray[np.float32]:
        """The end of the last link, seen through the lens."""
        angle = float(sample.joint_positions[index].sum())
        back = -np.array([math.cos(angle), math.sin(angle)])
        start = mark.ball - self._centres[index]
        length = _distance_to_rim(start, back, 0.92 * self._radius)
        return lift(np.stack([mark.ball, mark.ball + length * back]), self.sizes.depth - 0.02)

    def _update_words(self, index: int, sample: Sample) -> None:
        name, word = self._names[index].capitalize(), _PHASE_WORDS[sample.phases[index]]
        self._titles[index].text = f"{name} fingertip {word} (×{self._magnification:g})"
        self._slips[index].text = f"slip {1e3 * abs(float(sample.slip[index])):.1f} mm"
        force = math.hypot(sample.normal_force[index], sample.tangential_force[index])
        self._loads[index].text = f"force {force:.1f} N"


def _sizes(radius: float) -> MarkSizes:
    return MarkSizes(
        tip_radius=0.085 * radius,
        trail_width=0.13 * radius,
        cone_length=0.8 * radius,
        force_length=0.65 * radius,
        speed_length=0.5 * radius,
        shaft_radius=0.02 * radius,
        line_width=0.014 * radius,
        depth=0.07,
    )


def _distance_to_rim(start: Points, direction: Points, radius: float) -> float:
    """How far a ray from inside a circle about the origin goes until it meets the circle."""
    along = float(start @ direction)
    return -along + math.sqrt(max(along**2 - float(start @ start) + radius**2, 0.0))
