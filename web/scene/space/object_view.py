"""The object held in space, and the outline of where it should be."""

from __future__ import annotations

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.scenario.spatial import SpatialObject
from slipgrasp.core.scenario.spatial_geometry import base_corners
from slipgrasp.recordings.palette import GHOST
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.space.solids import dashed_edges, prism, prism_edges, triple
from slipgrasp.web.scene.surfaces import Surfaces

_OPACITY = 0.4
_DASHES = 9


class SpatialPoseFrame:
    """A node that stands where a pose (position, quaternion) says."""

    def __init__(self, scene: viser.SceneApi, name: str, detail: Detail) -> None:
        self.name = name
        self._frame = scene.add_frame(name, show_axes=False)
        self._follower = Follower(detail, self._draw)

    def update(self, pose: NDArray[np.float64]) -> None:
        """Moves to a position and unit quaternion (w, x, y, z) [m]."""
        self._follower.follow(pose)

    def _draw(self, pose: NDArray[np.float64]) -> None:
        self._frame.position = triple(pose)
        self._frame.wxyz = pose[3:].copy()


class SpatialObjectView:
    """Draws the object like milky glass, so that one sees the contacts behind it and its cones.

    Args:
        scene: Where the nodes go.
        name: Name of the node that they are below.
        body: The object.
        surfaces: Colours.
        detail: How finely it is drawn.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        body: SpatialObject,
        surfaces: Surfaces,
        detail: Detail,
    ) -> None:
        corners = np.array(base_corners(body))
        edges = prism_edges(corners, body.height)
        self.body = SpatialPoseFrame(scene, f"{name}/body", detail)
        self.block = scene.add_mesh_simple(
            f"{name}/body/block",
            *prism(corners, body.height),
            color=surfaces.object,
            opacity=_OPACITY,
            flat_shading=True,
            side="double",
        )
        scene.add_line_segments(
            f"{name}/body/edges", edges.astype(np.float32), surfaces.object_edge, thickness=0.003
        )
        self._desired = SpatialPoseFrame(scene, f"{name}/desired", detail)
        dashes = dashed_edges(edges, _DASHES).astype(np.float32)
        scene.add_line_segments(f"{name}/desired/outline", dashes, GHOST, thickness=0.004)

    def update(self, object_pose: NDArray[np.float64], desired_pose: NDArray[np.float64]) -> None:
        """Moves the object and the outline to their poses."""
        self.body.update(object_pose)
        self._desired.update(desired_pose)
