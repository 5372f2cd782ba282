"""The links of a hand as meshes, if the dashboard was started with them."""

from __future__ import annotations

from typing import Any, NamedTuple

import viser

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.hand_files.meshes import HandMeshes, Mesh
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.scene import skeleton
from slipgrasp.scene.states import States
from slipgrasp.web.model.selection import finger_part
from slipgrasp.web.model.surfaces import Surfaces
from slipgrasp.web.scene.canvas import Canvas
from slipgrasp.web.scene.drawer import HandDrawer
from slipgrasp.web.scene.kept import Kept

_GLASS = 0.4
"""Opacity of the last link, which may enclose the mark of its fingertip."""


class _Nodes(NamedTuple):
    """The nodes of a hand whose bases do not change; `of_base` and `of_links` are meshes."""

    root: viser.FrameHandle
    frames: HandDrawer
    of_base: list[viser.MeshHandle]
    of_links: list[viser.MeshHandle]

    def remove(self) -> None:
        """Removes all nodes."""
        self.root.remove()


class LinkMeshes:
    """Draws the links of all scenarios with the fingers of a hand.

    The meshes are sent once; they remain, hidden, while other scenarios are shown.

    Args:
        meshes: The meshes.
    """

    def __init__(self, meshes: HandMeshes) -> None:
        self._meshes = meshes
        self._kept = Kept[_Nodes]()
        self._surfaces: Surfaces | None = None
        self._count = 0

    def show(self, canvas: Canvas, scenario: Scenario) -> bool:
        """Shows the meshes for a scenario with the fingers of the hand, and else hides them.

        Args:
            canvas: Adds the nodes.
            scenario: The scenario.

        Returns:
            Whether they are shown.
        """
        fits = isinstance(scenario, SpatialScenario) and self._meshes.fit(scenario)
        if isinstance(scenario, SpatialScenario) and fits:
            bases = [(finger.base, finger.attitude) for finger in scenario.fingers]
            self._paint(self._kept.renew(bases, lambda: self._add(canvas, scenario)), canvas)
        nodes = self._kept.nodes
        if nodes is not None and nodes.root.visible != fits:
            nodes.root.visible = fits
        return fits

    def update(self, states: States) -> None:
        """Moves the links to a single state, if they are shown."""
        if self._kept.nodes is not None and self._kept.nodes.root.visible:
            self._kept.nodes.frames.update(states)

    def _paint(self, nodes: _Nodes, canvas: Canvas) -> None:
        """Colours the meshes for a light or a dark page."""
        surfaces = canvas.surfaces
        if surfaces != self._surfaces:
            self._surfaces = surfaces
            for node in nodes.of_base:
                node.color = surfaces.mount
            for node in nodes.of_links:
                node.color = surfaces.link

    def _add(self, canvas: Canvas, scenario: SpatialScenario) -> _Nodes:
        # A new name, because updates of nodes of one name may arrive in the wrong order.
        self._count += 1
        name = f"/links-{self._count}"
        root = canvas.add_frame(name)
        frames = [f for f in skeleton.frames_of(scenario) if skeleton.finger_of(f.name) is not None]
        hand = HandDrawer(canvas, name, frames)

        def add(mesh: Mesh, frame: str, **options: Any) -> viser.MeshHandle:
            # From both sides, because files of hands contain triangles in any order.
            node = f"{hand.paths[frame]}/mesh"
            return canvas.add_mesh(node, mesh, side="double", **options)

        # The base has one pose unless the scenario moved the fingers apart.
        bases = {(finger.base, finger.attitude) for finger in scenario.fingers}
        of_base = [self._meshes.base] if len(bases) == 1 else []
        mount, link = canvas.surfaces.mount, canvas.surfaces.link
        base = [add(mesh, skeleton.base_frame(0), colour=mount) for mesh in of_base]
        links = list[viser.MeshHandle]()
        for i, finger in enumerate(self._meshes.links):
            for k, mesh in enumerate(finger):
                opacity = _GLASS if k == len(finger) - 1 else None
                frame = skeleton.link_frame(i, k)
                links.append(add(mesh, frame, colour=link, part=finger_part(i), opacity=opacity))
        return _Nodes(root, hand, base, links)
