"""The links of a hand as meshes, if the dashboard was started with them."""

from __future__ import annotations

from typing import NamedTuple

import viser

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.hand_files.meshes import HandMeshes, Mesh
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.scene import skeleton
from slipgrasp.scene.states import States
from slipgrasp.web.model.selection import finger_part
from slipgrasp.web.model.surfaces import Surfaces
from slipgrasp.web.scene.detail import Detail
from slipgrasp.web.scene.drawer import HandDrawer
from slipgrasp.web.scene.picking import Picking

_GLASS = 0.4
"""Opacity of the last link, which may enclose the mark of its fingertip."""


class _Nodes(NamedTuple):
    """The nodes of a hand whose bases do not change; `of_base` and `of_links` are meshes."""

    root: viser.FrameHandle
    frames: HandDrawer
    of_base: list[viser.MeshHandle]
    of_links: list[viser.MeshHandle]


class LinkMeshes:
    """Draws the links of all scenarios with the fingers of a hand.

    The meshes are sent once; they remain, hidden, while other scenarios are shown.

    Args:
        scene: Scene of the nodes.
        meshes: The meshes.
        detail: Level of detail.
        picking: Makes fingers clickable; None without interaction.
    """

    def __init__(
        self, scene: viser.SceneApi, meshes: HandMeshes, detail: Detail, picking: Picking | None
    ) -> None:
        self._scene, self._meshes, self._detail, self._picking = scene, meshes, detail, picking
        self._nodes: _Nodes | None = None
        self._bases: object = None
        self._surfaces: Surfaces | None = None
        self._count = 0

    def show(self, scenario: Scenario, surfaces: Surfaces) -> bool:
        """Shows the meshes for a scenario with the fingers of the hand, and else hides them.

        Args:
            scenario: The scenario.
            surfaces: Colours.

        Returns:
            Whether they are shown.
        """
        fits = isinstance(scenario, SpatialScenario) and self._meshes.fit(scenario)
        if isinstance(scenario, SpatialScenario) and fits:
            self._place(scenario, surfaces)
        if self._nodes is not None and self._nodes.root.visible != fits:
            self._nodes.root.visible = fits
        return fits

    def update(self, states: States) -> None:
        """Moves the links to a single state, if they are shown."""
        if self._nodes is not None and self._nodes.root.visible:
            self._nodes.frames.update(states)

    def _place(self, scenario: SpatialScenario, surfaces: Surfaces) -> None:
        """The nodes for the bases of a scenario, in some colours."""
        bases = [(finger.base, finger.attitude) for finger in scenario.fingers]
        if self._nodes is None or bases != self._bases:
            if self._nodes is not None:
                self._nodes.root.remove()
            self._nodes, self._bases, self._surfaces = self._add(scenario, surfaces), bases, None
        if surfaces != self._surfaces:
            self._surfaces = surfaces
            for node in self._nodes.of_base:
                node.color = surfaces.mount
            for node in self._nodes.of_links:
                node.color = surfaces.link

    def _add(self, scenario: SpatialScenario, surfaces: Surfaces) -> _Nodes:
        # A new name, because updates of nodes of one name may arrive in the wrong order.
        self._count += 1
        name = f"/links-{self._count}"
        root = self._scene.add_frame(name, show_axes=False)
        frames = [f for f in skeleton.frames_of(scenario) if skeleton.finger_of(f.name) is not None]
        hand = HandDrawer(self._scene, name, frames, (), surfaces, self._detail, glass=False)
        # The base has one pose unless the scenario moved the fingers apart.
        bases = {(finger.base, finger.attitude) for finger in scenario.fingers}
        of_base = [self._meshes.base] if len(bases) == 1 else []
        base = [self._add_mesh(mesh, hand.paths[skeleton.base_frame(0)], None) for mesh in of_base]
        links = list[viser.MeshHandle]()
        for i, finger in enumerate(self._meshes.links):
            for k, mesh in enumerate(finger):
                path, is_last = hand.paths[skeleton.link_frame(i, k)], k == len(finger) - 1
                node = self._add_mesh(mesh, path, _GLASS if is_last else None)
                if self._picking is not None:
                    self._picking.make_clickable(node, finger_part(i))
                links.append(node)
        return _Nodes(root, hand, base, links)

    def _add_mesh(self, mesh: Mesh, path: str, opacity: float | None) -> viser.MeshHandle:
        # From both sides, because files of hands contain triangles in any order.
        return self._scene.add_mesh_simple(f"{path}/mesh", *mesh, opacity=opacity, side="double")
