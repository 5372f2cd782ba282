"""Another run, drawn pale behind the one that is shown: what was before, or what else there is."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.geometry import ContactFrame, contact_frame, inner_radius, outline
from slipgrasp.web.model.sampling import Sample
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.hand_view import FingerFrames, LinkShape
from slipgrasp.web.scene.layout import SceneLayout
from slipgrasp.web.scene.lens_view import LENS_DEPTH
from slipgrasp.web.scene.marks import MarkSizes, sizes_in_lens, sizes_on_hand
from slipgrasp.web.scene.object_view import HALF_DEPTH, PoseFrame
from slipgrasp.web.scene.shapes import circle, extrude, lift, polyline, position
from slipgrasp.web.scene.surfaces import Surfaces

_BEHIND = -0.03


class GhostView:
    """Draws another hand and object as flat pale shapes, and its fingertips in the lenses.

    Args:
        scene: Where the nodes go.
        name: Name of the node that they are below.
        scenario: Whose hand and object; they may differ from those that are shown.
        frames: Contacts of the run that is shown: what the lenses are of.
        layout: Where the lenses are.
        surfaces: Colours.
        detail: How finely it is drawn.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        scenario: Scenario,
        frames: Sequence[ContactFrame],
        layout: SceneLayout,
        surfaces: Surfaces,
        detail: Detail,
    ) -> None:
        self._root = scene.add_frame(name, show_axes=False)
        self._fingers = FingerFrames(scene, f"{name}/fingers", scenario.fingers, detail)
        for finger, paths in zip(scenario.fingers, self._fingers.names, strict=True):
            for k, path in enumerate(paths):
                link = LinkShape(finger.link_lengths, k)
                _add_plate(scene, path, link.outline, link.front + 0.002, surfaces)
        body = scenario.object
        self._body = PoseFrame(scene, f"{name}/body", detail)
        _add_plate(scene, f"{name}/body", outline(body), HALF_DEPTH + 0.003, surfaces)
        own = [contact_frame(body, finger) for finger in scenario.fingers]
        sizes = sizes_on_hand(inner_radius(body))
        self._tips = [
            _GhostTip(
                scene, f"{name}/body/tip{i}", np.asarray(f.anchor), f, sizes, surfaces, detail
            )
            for i, f in enumerate(own)
        ]
        self._lens_root = scene.add_frame(
            f"{name}/lenses", show_axes=False, position=position(np.zeros(2), LENS_DEPTH)
        )
        lens_sizes = sizes_in_lens(layout.lens_radius)
        self._magnified = {
            i: _GhostTip(
                scene,
                f"{name}/lenses/{i}",
                layout.lens_centres[i],
                f,
                lens_sizes,
                surfaces,
                detail,
                0.9 * layout.lens_radius,
            )
            for i, (f, shown) in enumerate(zip(own, frames, strict=False))
            if f.tangent == shown.tangent
        }

    def update(self, sample: Sample, magnification: float) -> None:
        """Shows an instant of the other run.

        Args:
            sample: The instant.
            magnification: How much larger than life the lenses show it.
        """
        self._fingers.update(sample.joint_positions)
        self._body.update(sample.object_pose)
        for i, tip in enumerate(self._tips):
            tip.update(float(sample.slip[i]), sample.slip_reach[i])
        for i, tip in self._magnified.items():
            tip.update(magnification * float(sample.slip[i]), magnification * sample.slip_reach[i])

    def pale_slip(self, sample: Sample, index: int) -> float | None:
        """Slip at the contact that a lens shows [m], None if the other run has no such contact."""
        return float(sample.slip[index]) if index in self._magnified else None

    def show(self, *, visible: bool, lenses: bool) -> None:
        """Whether it is drawn, and whether the lenses are."""
        self._root.visible, self._lens_root.visible = visible, lenses

    def remove(self) -> None:
        """Removes every node."""
        self._root.remove()


class _GhostTip:
    """A pale ring where a fingertip of the other run is, and a fine trail behind it.

    A lens is as strong as the slip of the run that is shown allows: the other run's may lead out
    of it, where the words of the lens stand.

    Args:
        scene: Where the nodes go.
        name: Name of the node at the spot touched first, whose axes are the object's.
        anchor: Where that node stands in its parent [m].
        frame: Tangent and normal of the contact in the object frame.
        sizes: Sizes of the marks.
        surfaces: Colours.
        detail: How finely it is drawn.
        room: How far from the spot touched first anything is drawn [m].
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        anchor: np.ndarray,
        frame: ContactFrame,
        sizes: MarkSizes,
        surfaces: Surfaces,
        detail: Detail,
        room: float = math.inf,
    ) -> None:
        self._room = room
        self._tangent, self._normal = np.asarray(frame.tangent), np.asarray(frame.normal)
        self._sizes = sizes
        scene.add_frame(name, show_axes=False, position=position(anchor))
        self._trail = scene.add_line_segments(
            f"{name}/trail",
            np.zeros((1, 2, 3)),
            surfaces.pale_edge,
            thickness=0.35 * sizes.trail_width,
        )
        self._ring = scene.add_line_segments(
            f"{name}/ring",
            polyline(circle(sizes.tip_radius), 0.0, closed=True),
            surfaces.pale_edge,
            thickness=0.3 * sizes.tip_radius,
        )
        self._follower = Follower(detail, self._draw)

    def update(self, slip: float, reach: np.ndarray) -> None:
        """Moves to a slip along the face, having been as far as ``reach`` on either side [m]."""
        self._follower.follow(np.array([slip, *reach]))

    def _draw(self, slip_and_reach: NDArray[np.float64]) -> None:
        slip = float(slip_and_reach[0])
        reach = np.clip(slip_and_reach[1:], -self._room, self._room)
        inside = 1.3 * self._sizes.trail_width * self._normal
        self._trail.points = lift(
            (reach[:, None] * self._tangent + inside)[None], self._sizes.depth + 0.001
        )
        centre = slip * self._tangent - self._sizes.tip_radius * self._normal
        self._ring.visible = abs(slip) <= self._room
        self._ring.position = position(centre, self._sizes.depth - 0.01)


def _add_plate(
    scene: viser.SceneApi, name: str, outline: np.ndarray, front: float, surfaces: Surfaces
) -> None:
    """A flat shape behind everything, and its outline in front of what hides it.

    Seen from near, what lies deeper seems to be shifted: the outline tells the true place.
    """
    plate = extrude(outline, _BEHIND - 0.002, _BEHIND)
    scene.add_mesh_simple(f"{name}/plate", *plate, color=surfaces.pale, flat_shading=True)
    edges = polyline(outline, front, closed=True)
    scene.add_line_segments(f"{name}/rim", edges, surfaces.pale_edge, thickness=0.005)
