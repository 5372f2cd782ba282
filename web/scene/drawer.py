"""The scene as nodes of a viewer: nested frames with primitives.

Each node is created once; afterwards only changed positions and colours are sent.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
import viser

from slipgrasp.recordings.palette import GHOST, Rgb
from slipgrasp.scene import rotations, skeleton
from slipgrasp.scene.primitives import Entity, Lines, Rod, Role, Shape, Triangles
from slipgrasp.scene.skeleton import Frame, Moving
from slipgrasp.scene.states import States
from slipgrasp.server.viewer.server import release_arrays
from slipgrasp.web.model.selection import OBJECT, finger_part
from slipgrasp.web.model.surfaces import Surfaces
from slipgrasp.web.scene.canvas import Canvas
from slipgrasp.web.scene.shapes import dashed_edges, faceted, rounded_bar, turned_profile

_GLASS = 0.4
_DASHES = 36


class HandDrawer:
    """Draws frames and their entities.

    Args:
        canvas: Adds the nodes.
        root: Name of the root node.
        frames: All frames, parents first.
        entities: Entities in the frames; contacts are drawn by `ContactView`.
        glass: Whether the object is transparent.

    Attributes:
        paths: Names of the nodes of all frames.
        block: The object.
    """

    def __init__(
        self,
        canvas: Canvas,
        root: str,
        frames: Sequence[Frame],
        entities: Sequence[Entity] = (),
        *,
        glass: bool = False,
    ) -> None:
        self._canvas, self._glass = canvas, glass
        self._moving: list[tuple[Moving, viser.FrameHandle, str, int]] = []
        self.paths = {frames[0].parent: root}
        for frame in frames:
            self._add_frame(frame)
        count = Counter[str]()
        for entity in entities:
            frame = entity.frame
            for shape in entity.shapes:
                self._add(shape, f"{self.paths[frame]}/part{count[frame]}", frame)
                count[frame] += 1
        self._drawn = np.full((len(self._moving), 4), np.inf)

    def update(self, states: States) -> None:
        """Moves the frames to a single state, if they have moved visibly."""
        now = np.zeros_like(states.object_pose, shape=self._drawn.shape)
        for row, (moving, _, _, width) in zip(now, self._moving, strict=True):
            row[:width] = moving(states)[0]
        # Together, because a comparison for each takes longer than computing the positions.
        far = self._canvas.detail.is_far(now, self._drawn)
        for k in np.flatnonzero(far).tolist():
            _, node, key, width = self._moving[k]
            setattr(node, key, now[k, :width])
        self._drawn = np.where(far[:, None], now, self._drawn)

    def _add_frame(self, frame: Frame) -> None:
        path = self.paths[frame.name] = f"{self.paths[frame.parent]}/{frame.name.replace('/', '-')}"
        node = self._canvas.add_frame(path)
        if callable(frame.position):
            self._moving.append((frame.position, node, "position", 3))
        else:
            node.position = np.array(frame.position)
        if callable(frame.rotation):
            self._moving.append((frame.rotation, node, "wxyz", 4))
        else:
            node.wxyz = np.array(frame.rotation)

    def _add(self, shape: Shape, name: str, frame: str) -> None:
        assert isinstance(shape.paint, Role), "contacts are drawn by ContactView"
        colour = colour_of(shape.paint, self._canvas.surfaces)
        if isinstance(shape, Triangles):
            self.block = self._canvas.add_mesh(
                name,
                faceted(shape.points, shape.indices.astype(np.uint32)),
                colour,
                part=OBJECT,
                opacity=_GLASS if self._glass else None,
                side="double" if self._glass else "front",
            )
        elif isinstance(shape, Lines):
            assert not callable(shape.points), "contacts are drawn by ContactView"
            edges = shape.points[shape.indices]
            # A prism has three edges for each corner of its base.
            count = max(3 * _DASHES // len(edges), 2)
            points = dashed_edges(edges, count) if shape.dashed else edges
            self._canvas.add_lines(name, colour, shape.thickness, points)
        else:
            assert isinstance(shape, Rod), f"no drawing of {type(shape).__name__} in {frame}"
            self._add_rod(shape, name, colour, skeleton.finger_of(frame))

    def _add_rod(self, rod: Rod, name: str, colour: Rgb, finger: int | None) -> None:
        along = rod.end - rod.start
        length, (first, last) = float(np.linalg.norm(along)), rod.radii
        ends = np.array([[0.0, 0.0], [0.0, first], [length, last], [length, 0.0]])
        bar = rounded_bar(length, first, last) if rod.rounded else faceted(*turned_profile(ends))
        node = self._canvas.add_mesh(
            name,
            bar,
            colour,
            part=None if finger is None else finger_part(finger),
            position=rod.start,
            wxyz=rotations.from_x_to(along[None])[0],
        )
        release_arrays(node)  # A chain has many rods, which keep their shape.


def colour_of(role: Role, surfaces: Surfaces) -> Rgb:
    """Colour of a primitive: the surface with the name of its role, except `Role.DESIRED`."""
    return GHOST if role is Role.DESIRED else getattr(surfaces, role.name.lower())
