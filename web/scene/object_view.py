"""The held object, and the outline of where it should be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.scenario import ObjectParameters
from slipgrasp.core.scenario.geometry import ContactFrame, inner_radius, outline
from slipgrasp.recordings.palette import GHOST
from slipgrasp.web.model.sampling import Sample
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.shapes import circle, extrude, lift, polyline, position, turn
from slipgrasp.web.scene.surfaces import Surfaces

HALF_DEPTH = 0.05
"""Half the thickness of the object towards the eye [m]."""
_DASHES = 36
_FACE_WIDTH = 0.006


class PoseFrame:
    """A node that stands where a pose says."""

    def __init__(self, scene: viser.SceneApi, name: str, detail: Detail) -> None:
        self.name = name
        self._frame = scene.add_frame(name, show_axes=False)
        self._follower = Follower(detail, self._draw)

    def update(self, pose: NDArray[np.float64]) -> None:
        """Moves to a pose x, y, theta [m, m, rad]."""
        self._follower.follow(pose)

    def _draw(self, pose: NDArray[np.float64]) -> None:
        self._frame.position = position(pose)
        self._frame.wxyz = turn(float(pose[2]))


class ObjectView:
    """Draws the object as a block, and its desired pose as a dashed outline.

    Args:
        scene: Where the nodes go.
        name: Name of the node that they are below.
        body: The object.
        frames: Anchor, tangent and normal of each contact; their faces are drawn stronger.
        surfaces: Colours.
        detail: How finely it is drawn.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        body: ObjectParameters,
        frames: Sequence[ContactFrame],
        surfaces: Surfaces,
        detail: Detail,
    ) -> None:
        corners = outline(body)
        self.body = PoseFrame(scene, f"{name}/body", detail)
        self.block = scene.add_mesh_simple(
            f"{name}/body/block",
            *extrude(corners, -HALF_DEPTH, HALF_DEPTH),
            color=surfaces.object,
            flat_shading=True,
        )
        edge = surfaces.object_edge
        edges = polyline(corners, HALF_DEPTH + 0.002, closed=True)
        scene.add_line_segments(f"{name}/body/edges", edges, edge, thickness=0.003)
        scene.add_line_segments(f"{name}/body/faces", _faces(frames), edge, thickness=_FACE_WIDTH)
        _add_centre(scene, f"{name}/body/centre", 0.3 * inner_radius(body), surfaces)
        self._desired = PoseFrame(scene, f"{name}/desired", detail)
        scene.add_line_segments(f"{name}/desired/outline", _dashes(corners), GHOST, thickness=0.004)

    def update(self, sample: Sample) -> None:
        """Moves the object and the outline to their poses."""
        self.body.update(sample.object_pose)
        self._desired.update(sample.desired_pose)


def _faces(frames: Sequence[ContactFrame]) -> NDArray[np.float32]:
    """The faces that fingertips touch, as far as they go, just inside the object."""
    ends = [
        np.asarray(frame.anchor)
        + np.array([[frame.slip_minimum], [frame.slip_maximum]]) * frame.tangent
        + 0.5 * _FACE_WIDTH * np.asarray(frame.normal)
        for frame in frames
    ]
    return lift(np.stack(ends), HALF_DEPTH + 0.001)


def _add_centre(scene: viser.SceneApi, name: str, radius: float, surfaces: Surfaces) -> None:
    """The sign of a centre of mass: a disc with two opposite dark quarters."""
    front = HALF_DEPTH + 0.004
    disc = extrude(circle(radius, 32), HALF_DEPTH, front)
    scene.add_mesh_simple(f"{name}/disc", *disc, color=surfaces.lens, flat_shading=True)
    for i, start in enumerate((0.0, np.pi)):
        angles = np.linspace(start, start + 0.5 * np.pi, 12)
        rim = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        quarter = extrude(np.concatenate([np.zeros((1, 2)), rim]), front, front + 0.001)
        scene.add_mesh_simple(
            f"{name}/quarter{i}", *quarter, color=surfaces.joint, flat_shading=True
        )


def _dashes(corners: NDArray[np.float64]) -> NDArray[np.float32]:
    per_side = _DASHES // len(corners)
    steps = np.linspace(0.0, 1.0, 2 * per_side).reshape(-1, 2)
    sides = np.roll(corners, -1, axis=0) - corners
    lines = [c + steps[..., None] * side for c, side in zip(corners, sides, strict=True)]
    return lift(np.concatenate(lines), HALF_DEPTH + 0.006)
