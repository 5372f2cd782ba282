"""Another run in space, drawn as pale lines: links, object and the ways on its faces."""

from __future__ import annotations

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import base_corners, spatial_joint_points
from slipgrasp.web.model.spatial_sampling import SpatialSample
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.space.layout import contacts_of
from slipgrasp.web.scene.space.object_view import SpatialPoseFrame
from slipgrasp.web.scene.space.solids import prism_edges, triple
from slipgrasp.web.scene.surfaces import Surfaces


class SpatialGhostView:
    """Draws another hand and object by their lines.

    Args:
        scene: Where the nodes go.
        name: Name of the node that they are below.
        scenario: Whose hand and object.
        surfaces: Colours.
        detail: How finely it is drawn.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        scenario: SpatialScenario,
        surfaces: Surfaces,
        detail: Detail,
    ) -> None:
        self._fingers = scenario.fingers
        self._contacts = contacts_of(scenario)
        self._root = scene.add_frame(name, show_axes=False)
        self._body = SpatialPoseFrame(scene, f"{name}/body", detail)
        edges = prism_edges(np.array(base_corners(scenario.object)), scenario.object.height)
        pale = surfaces.pale_edge
        scene.add_line_segments(
            f"{name}/body/edges", edges.astype(np.float32), pale, thickness=0.006
        )
        self._links = scene.add_line_segments(
            f"{name}/links", np.zeros((1, 2, 3)), pale, thickness=0.012
        )
        self._balls = [
            scene.add_icosphere(f"{name}/body/tip{i}", radius=0.012, color=pale)
            for i in range(len(self._fingers))
        ]
        self._follow_links = Follower(detail, self._draw_links)

    def update(self, sample: SpatialSample) -> None:
        """Shows an instant of the other run."""
        self._body.update(sample.object_pose)
        pairs = zip(self._fingers, sample.joint_positions, strict=True)
        points = np.array([spatial_joint_points(finger, q) for finger, q in pairs])
        self._follow_links.follow(np.stack([points[:, :-1], points[:, 1:]], axis=2))
        for ball, contact, slip in zip(self._balls, self._contacts, sample.slip, strict=True):
            tangents = np.array([contact.tangent_x, contact.tangent_y])
            ball.position = triple(np.asarray(contact.anchor) + slip @ tangents)

    def show(self, *, visible: bool) -> None:
        """Whether it is drawn."""
        self._root.visible = visible

    def remove(self) -> None:
        """Removes every node."""
        self._root.remove()

    def _draw_links(self, segments: NDArray[np.float64]) -> None:
        self._links.points = segments.reshape(-1, 2, 3).astype(np.float32)
