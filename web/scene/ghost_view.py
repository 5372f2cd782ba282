"""A ghost, drawn with pale lines: object, and unless it is measured data, links and fingertips."""

from __future__ import annotations

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.scenario import Scenario
from slipgrasp.scene import parts, skeleton
from slipgrasp.scene.states import States
from slipgrasp.web.model.surfaces import Surfaces
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.shapes import joined

Points = NDArray[np.float64]


class GhostView:
    """Draws another hand and object with lines.

    Args:
        scene: Scene of the nodes.
        name: Name of the parent node.
        scenario: Its scenario, which may differ from the shown one.
        surfaces: Colours.
        detail: Level of detail.
        has_hand: Whether the fingers are drawn too, for which all joint positions must be known.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        scenario: Scenario,
        surfaces: Surfaces,
        detail: Detail,
        *,
        has_hand: bool,
    ) -> None:
        self._frames = skeleton.frames_of(scenario)
        fingers = len(scenario.fingers) - scenario.space.bare_contacts
        self._count = fingers if has_hand else 0
        sizes = parts.sizes_of(scenario)
        # Behind the edges of the desired pose.
        self._corners = parts.solid(scenario, 1.02 * sizes.half_depth).points
        self._pairs = parts.edges_of(scenario)
        self.name, self._root = name, scene.add_frame(name, show_axes=False)
        self._edges, self._links = (
            scene.add_line_segments(
                f"{name}/{part}", np.zeros((1, 2, 3)), surfaces.pale_edge, thickness=thickness
            )
            for part, thickness in (("edges", 0.006), ("links", 0.012))
        )
        self._balls = [
            scene.add_icosphere(f"{name}/tip{i}", radius=sizes.tip_radius, color=surfaces.pale_edge)
            for i in range(self._count)
        ]
        self._follow_edges = Follower(detail, self._draw_edges)
        self._follow_links = Follower(detail, self._draw_links)

    def update(self, states: States) -> None:
        """Shows a single state of the other run."""
        poses = skeleton.world_poses(self._frames, states)
        position, turn = (each[0] for each in poses[skeleton.OBJECT])
        self._follow_edges.follow(position + self._corners @ turn.T)
        if self._count == 0:
            return
        links = [f.name for f in self._frames if "/link_" in f.name or f.name.endswith("/tip")]
        points = np.stack([poses[name][0][0] for name in links])
        self._follow_links.follow(points.reshape(self._count, -1, 3))

    def show(self, visible: bool) -> None:
        """Whether it is drawn."""
        self._root.visible = visible

    def remove(self) -> None:
        """Removes every node."""
        self._root.remove()

    def _draw_edges(self, corners: Points) -> None:
        self._edges.points = corners[self._pairs].astype(np.float32)

    def _draw_links(self, chains: Points) -> None:
        self._links.points = np.concatenate([joined(chain) for chain in chains])
        for ball, chain in zip(self._balls, chains, strict=True):
            ball.position = chain[-1]
