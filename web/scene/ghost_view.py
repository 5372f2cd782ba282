"""Another run, drawn pale by its lines: links, object, fingertips, and its slip in the lenses."""

from __future__ import annotations

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.scenario import Scenario
from slipgrasp.scene import parts, skeleton
from slipgrasp.scene.states import States
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.layout import SceneLayout
from slipgrasp.web.scene.marks import sizes_in_lens
from slipgrasp.web.scene.shapes import circle, joined, lift, polyline, position
from slipgrasp.web.scene.surfaces import Surfaces

Points = NDArray[np.float64]


class GhostView:
    """Draws another hand and object by their lines, and its fingertips in the lenses.

    Args:
        scene: Where the nodes go.
        name: Name of the node that they are below.
        scenario: Whose hand and object; they may differ from those that are shown.
        contacts: Contacts of the run that is shown: what the lenses are of.
        layout: Where the lenses are.
        surfaces: Colours.
        detail: How finely it is drawn.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        scenario: Scenario,
        contacts: tuple[skeleton.Contact, ...],
        layout: SceneLayout,
        surfaces: Surfaces,
        detail: Detail,
    ) -> None:
        self._frames, self._own = skeleton.frames_of(scenario), skeleton.contacts_of(scenario)
        sizes = parts.sizes_of(scenario)
        # Behind the edges of the desired pose.
        self._corners = parts.solid(scenario, 1.02 * sizes.half_depth).points
        self._pairs = parts.edges_of(scenario)
        self._root = scene.add_frame(name, show_axes=False)
        self._edges, self._links = (
            scene.add_line_segments(
                f"{name}/{part}", np.zeros((1, 2, 3)), surfaces.pale_edge, thickness=thickness
            )
            for part, thickness in (("edges", 0.006), ("links", 0.012))
        )
        self._balls = [
            scene.add_icosphere(f"{name}/tip{i}", radius=sizes.tip_radius, color=surfaces.pale_edge)
            for i in range(len(self._own))
        ]
        self._lens_root = scene.add_frame(
            f"{name}/lenses",
            show_axes=False,
            wxyz=np.array(layout.board_attitude),
            position=layout.board_place,
        )
        self._rings = {
            i: _PaleSlip(scene, f"{name}/lenses/{i}", layout, i, own, surfaces, detail)
            for i, (own, shown) in enumerate(zip(self._own, contacts, strict=False))
            if np.allclose(own.axes, shown.axes)
        }
        self._follow_edges = Follower(detail, self._draw_edges)
        self._follow_links = Follower(detail, self._draw_links)

    def update(self, states: States, magnification: float) -> None:
        """Shows the only one of some states of the other run.

        Args:
            states: The state.
            magnification: How much larger than life the lenses show it.
        """
        poses = skeleton.world_poses(self._frames, states)
        position, turn = (each[0] for each in poses[skeleton.OBJECT])
        self._follow_edges.follow(position + self._corners @ turn.T)
        links = [f.name for f in self._frames if "/link_" in f.name or f.name.endswith("/tip")]
        points = np.stack([poses[name][0][0] for name in links])
        self._follow_links.follow(points.reshape(len(self._own), -1, 3))
        for i, ring in self._rings.items() if self._lens_root.visible else ():
            ring.update(magnification * states.slip[0, i])

    def pale_slip(self, states: States, index: int) -> float | None:
        """Slip at the contact that a lens shows [m], None if the other run has no such contact."""
        return float(np.linalg.norm(states.slip[0, index])) if index in self._rings else None

    def show(self, *, visible: bool, lenses: bool) -> None:
        """Whether it is drawn, and whether the lenses are."""
        self._root.visible, self._lens_root.visible = visible, lenses

    def remove(self) -> None:
        """Removes every node."""
        self._root.remove()

    def _draw_edges(self, corners: Points) -> None:
        self._edges.points = corners[self._pairs].astype(np.float32)

    def _draw_links(self, chains: Points) -> None:
        self._links.points = np.concatenate([joined(chain) for chain in chains])
        for ball, chain in zip(self._balls, chains, strict=True):
            ball.position = chain[-1]


class _PaleSlip:
    """A pale ring in a lens where a fingertip of the other run is, and a fine line to it.

    A lens is as strong as the slip of the run that is shown allows: the other run's may lead out
    of it, where the words of the lens stand; there it is not drawn.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        layout: SceneLayout,
        index: int,
        contact: skeleton.Contact,
        surfaces: Surfaces,
        detail: Detail,
    ) -> None:
        sizes = sizes_in_lens(layout.lens_radius)
        self._limit = 0.9 * layout.lens_radius
        # Planar lenses have the axes of the object, others those of the face: right is t_y, up t_x.
        flat = contact.dimensions == 2
        self._axes = -contact.axes[:2, :1].T if flat else np.eye(2)[::-1]
        outside = -sizes.tip_radius * contact.axes[:2, 1] if flat else np.zeros(2)
        self._middle, self._depth = layout.lens_centres[index] + outside, sizes.depth - 0.01
        ring = polyline(circle(sizes.tip_radius), 0.0, closed=True)
        self._inside, fine = layout.lens_centres[index] - outside, 0.35 * sizes.trail_width
        self._ring = scene.add_line_segments(
            f"{name}/ring", ring, surfaces.pale_edge, thickness=0.3 * sizes.tip_radius
        )
        self._trail = scene.add_line_segments(
            f"{name}/trail", np.zeros((1, 2, 3)), surfaces.pale_edge, thickness=fine
        )
        self._follower = Follower(detail, self._draw)

    def update(self, slip: Points) -> None:
        """Moves to a magnified slip [m]."""
        self._follower.follow(slip)

    def _draw(self, slip: Points) -> None:
        length = float(np.linalg.norm(slip))
        self._ring.visible = length <= self._limit
        across = slip @ self._axes
        self._ring.position = position(self._middle + across, self._depth)
        end = min(1.0, self._limit / max(length, 1e-9)) * across
        self._trail.points = lift(self._inside + np.array([[0.0 * end, end]]), self._depth)
