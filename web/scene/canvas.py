"""Nodes of each kind in the scene of a viewer, in the colours and the detail of one view."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.scenario.hand_files.meshes import Mesh
from slipgrasp.recordings.palette import Rgb
from slipgrasp.scene.rotations import Values
from slipgrasp.web.model.colours import glow
from slipgrasp.web.model.surfaces import Surfaces
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.picking import Picking
from slipgrasp.web.scene.shapes import extrude, faceted

HEAD_LENGTH = 5.0
"""Length of the head of an arrow, in radii of its shaft."""


class Canvas(NamedTuple):
    """Adds nodes to a scene.

    Attributes:
        scene: Scene of the nodes.
        surfaces: Colours.
        detail: Level of detail.
        picking: Makes parts clickable; None without interaction.
    """

    scene: viser.SceneApi
    surfaces: Surfaces
    detail: Detail
    picking: Picking | None = None

    def follow(self, draw: Callable[[Values], None]) -> Follower:
        """Calls a function when its coordinates have moved visibly."""
        return Follower(self.detail, draw)

    def add_frame(self, name: str, **options: Any) -> viser.FrameHandle:
        """A frame without axes."""
        return self.scene.add_frame(name, show_axes=False, **options)

    def add_lines(
        self,
        name: str,
        colour: Rgb,
        thickness: float,
        segments: NDArray[np.floating] | None = None,
        **options: Any,
    ) -> viser.LineSegmentsHandle:
        """Line segments ``(k, 2, 3)``, or an empty one to be replaced later."""
        points = np.zeros((1, 2, 3)) if segments is None else segments.astype(np.float32)
        return self.scene.add_line_segments(name, points, colour, thickness=thickness, **options)

    def add_mesh(
        self, name: str, mesh: Mesh, colour: Rgb, *, part: str | None = None, **options: Any
    ) -> viser.MeshHandle:
        """Triangles; clicks on them select a part of the scenario, if one is given."""
        node = self.scene.add_mesh_simple(name, *mesh, color=colour, **options)
        if part is not None and self.picking is not None:
            self.picking.make_clickable(node, part)
        return node

    def add_slab(
        self,
        name: str,
        outline: Values,
        depths: tuple[float, float],
        colour: Rgb,
        part: str | None = None,
    ) -> viser.MeshHandle:
        """A convex outline between two depths of its upright plane [m]."""
        return self.add_mesh(name, faceted(*extrude(outline, *depths)), colour, part=part)

    def add_arrows(
        self, name: str, count: int, shaft_radius: float, colour: Rgb = (0, 0, 0)
    ) -> viser.ArrowsHandle:
        """Arrows with heads in proportion to their shafts, to be placed later."""
        return self.scene.add_arrows(
            name,
            np.zeros((count, 2, 3)),
            np.array([glow(colour)] * count, dtype=np.uint8),
            shaft_radius=shaft_radius,
            head_radius=2.6 * shaft_radius,
            head_length=HEAD_LENGTH * shaft_radius,
        )
