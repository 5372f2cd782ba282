"""A ghost, drawn with pale lines: object, and unless it is measured data, links and fingertips."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.scenario import Scenario
from slipgrasp.scene import rotations, skeleton
from slipgrasp.scene.rotations import Values
from slipgrasp.scene.sizes import sizes_of
from slipgrasp.scene.solids import edges_of, solid
from slipgrasp.scene.states import States
from slipgrasp.web.scene.canvas import Canvas
from slipgrasp.web.scene.shapes import joined


class GhostView:
    """Draws another hand and object with lines.

    Args:
        canvas: Adds the nodes.
        name: Name of the parent node.
        scenario: Its scenario, which may differ from the shown one.
        has_hand: Whether the fingers are drawn too, for which all joint positions must be known.
    """

    def __init__(self, canvas: Canvas, name: str, scenario: Scenario, *, has_hand: bool) -> None:
        self._frames = skeleton.frames_of(scenario)
        fingers = len(scenario.fingers) - scenario.space.bare_contacts
        self._count = fingers if has_hand else 0
        self._links_and_tips = [
            name for i in range(self._count) for name in skeleton.frames_along(self._frames, i)
        ]
        sizes, colour = sizes_of(scenario), canvas.surfaces.pale_edge
        # Behind the edges of the desired pose.
        corners = solid(scenario, 1.02 * sizes.half_depth).points
        self._object = next(f for f in self._frames if f.name == skeleton.OBJECT)
        self.name, self._root = name, canvas.add_frame(name)
        # Moved as a whole, since viser draws other points of lines one picture later.
        plane = next((f for f in self._frames if f.name == self._object.parent), None)
        turn = rotations.UNTURNED if plane is None else plane.rotation
        canvas.add_frame(f"{name}/plane", wxyz=np.array(turn))
        edges = corners[edges_of(scenario)]
        self._edges = canvas.add_lines(f"{name}/plane/edges", colour, 0.006, edges)
        self._links = canvas.add_lines(f"{name}/links", colour, 0.012)
        self._balls = [
            canvas.scene.add_icosphere(f"{name}/tip{i}", radius=sizes.tip_radius, color=colour)
            for i in range(self._count)
        ]
        self._follow_object = canvas.follow(self._draw_object)
        self._follow_links = canvas.follow(self._draw_links)

    def update(self, states: States) -> None:
        """Shows a single state of the other run."""
        position, rotation = self._object.position, self._object.rotation
        assert callable(position) and callable(rotation), "objects move"
        self._follow_object.follow(np.concatenate([position(states)[0], rotation(states)[0]]))
        if self._count == 0:
            return
        poses = skeleton.world_poses(self._frames, states)
        points = np.stack([poses[name][0][0] for name in self._links_and_tips])
        self._follow_links.follow(points.reshape(self._count, -1, 3))

    def show(self, visible: bool) -> None:
        """Shows or hides it."""
        self._root.visible = visible

    def remove(self) -> None:
        """Removes every node."""
        self._root.remove()

    def _draw_object(self, pose: Values) -> None:
        self._edges.position, self._edges.wxyz = pose[:3], pose[3:]

    def _draw_links(self, chains: Values) -> None:
        self._links.points = np.concatenate([joined(chain) for chain in chains])
        for ball, chain in zip(self._balls, chains, strict=True):
            ball.position = chain[-1]
