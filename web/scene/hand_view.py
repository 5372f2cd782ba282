"""The fingers: links, joints and mounts."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.scenario import FingerParameters
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.shapes import circle, extrude, lift, polyline, position, tapered_bar, turn
from slipgrasp.web.scene.surfaces import Surfaces

_THICKNESS = 0.05
_JOINT_RADIUS = 0.07
_TIP_SHARE = 0.36
_TIP_GAP = 0.035


class LinkShape:
    """Sizes of one link, drawn along x from the joint that it turns about [m].

    Args:
        lengths: Lengths of all links of the finger.
        index: Which link.
    """

    def __init__(self, lengths: Sequence[float], index: int) -> None:
        last = index == len(lengths) - 1
        self.radius = _JOINT_RADIUS * min(1.0, 2.0 * float(np.mean(lengths))) * 0.8**index
        self.end_radius = (_TIP_SHARE if last else 0.72) * self.radius
        self.reach = lengths[index] - (_TIP_GAP * self.radius / _JOINT_RADIUS if last else 0.0)
        self.front = 0.5 * _THICKNESS * 0.9**index

    @property
    def outline(self) -> NDArray[np.float64]:
        """Corners of the bar, shape ``(k, 2)``."""
        return tapered_bar(self.reach, self.radius, self.end_radius)

    @property
    def inset(self) -> NDArray[np.float64]:
        """Corners of the panel set into the bar, clear of both joints, shape ``(k, 2)``."""
        start, end = 1.25 * self.radius, self.reach - 1.25 * self.end_radius
        panel = tapered_bar(
            max(end - start, 0.1 * self.reach), 0.5 * self.radius, 0.5 * self.end_radius
        )
        return panel + np.array([start, 0.0])


class FingerFrames:
    """One frame per link, each inside the one before, so that only its own angle turns it.

    Args:
        scene: Where the nodes go.
        name: Name of the node that they are below.
        fingers: Bases and link lengths.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        fingers: Sequence[FingerParameters],
        detail: Detail,
    ) -> None:
        self._frames: list[viser.FrameHandle] = []
        self.names: list[list[str]] = []
        for i, finger in enumerate(fingers):
            path, origin, names = f"{name}/{i}", np.asarray(finger.base), []
            for k, length in enumerate(finger.link_lengths):
                path = f"{path}/link{k}"
                names.append(path)
                frame = scene.add_frame(path, show_axes=False, position=position(origin))
                self._frames.append(frame)
                origin = np.array([length, 0.0])
            self.names.append(names)
        self._followers = [Follower(detail, _turning(frame)) for frame in self._frames]

    def update(self, joint_positions: NDArray[np.float64]) -> None:
        """Turns every link to its joint angle, shape ``(fingers, joints)`` [rad]."""
        for follower, angle in zip(self._followers, joint_positions.reshape(-1, 1), strict=True):
            follower.follow(angle)


def _turning(frame: viser.FrameHandle) -> Callable[[NDArray[np.float64]], None]:
    """Turns a link to its joint angle."""

    def draw(angle: NDArray[np.float64]) -> None:
        frame.wxyz = turn(float(angle[0]))

    return draw


class HandView:
    """Draws every finger of a hand as tapered bars that turn about round joints.

    Args:
        scene: Where the nodes go.
        name: Name of the node that they are below.
        fingers: Bases and link lengths.
        surfaces: Colours.
        detail: How finely it is drawn.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        fingers: Sequence[FingerParameters],
        surfaces: Surfaces,
        detail: Detail,
    ) -> None:
        self._frames = FingerFrames(scene, name, fingers, detail)
        for i, finger in enumerate(fingers):
            for k, path in enumerate(self._frames.names[i]):
                _add_link(scene, path, LinkShape(finger.link_lengths, k), surfaces)
            _add_mount(scene, f"{name}/{i}/mount", finger, surfaces)

    def update(self, joint_positions: NDArray[np.float64]) -> None:
        """Turns the links to joint angles, shape ``(fingers, joints)`` [rad]."""
        self._frames.update(joint_positions)


def _add_link(scene: viser.SceneApi, name: str, link: LinkShape, surfaces: Surfaces) -> None:
    """A bar with a panel set into it, and the joint that it turns about."""
    front, radius = link.front, link.radius
    for part, outline, back, top, colour in (
        ("bar", link.outline, -front, front, surfaces.link),
        ("inset", link.inset, front, front + 0.002, surfaces.link_inset),
        ("rim", circle(0.82 * radius), front, front + 0.006, surfaces.link_edge),
        ("pin", circle(0.66 * radius), front, front + 0.012, surfaces.joint),
        ("cap", circle(0.24 * radius, 24), front + 0.012, front + 0.018, surfaces.link_inset),
    ):
        scene.add_mesh_simple(
            f"{name}/{part}", *extrude(outline, back, top), color=colour, flat_shading=True
        )
    edges = polyline(link.outline, front + 0.001, closed=True)
    scene.add_line_segments(f"{name}/edges", edges, surfaces.link_edge, thickness=0.09 * radius)


def _add_mount(
    scene: viser.SceneApi, name: str, finger: FingerParameters, surfaces: Surfaces
) -> None:
    """The block that a finger is bolted to, with hatching below."""
    base = np.asarray(finger.base)
    block = np.array([[-0.13, -0.17], [0.13, -0.17], [0.075, 0.03], [-0.075, 0.03]])
    solid = extrude(base + block, -0.045, 0.02)
    scene.add_mesh_simple(f"{name}/block", *solid, color=surfaces.mount, flat_shading=True)
    floor = np.array([[[-0.2, -0.17], [0.2, -0.17]]])
    feet = np.stack([np.linspace(-0.17, 0.17, 8), np.full(8, -0.17)], axis=1)
    hatching = np.stack([feet, feet - 0.035], axis=1)
    lines = lift(base + np.concatenate([floor, hatching]))
    scene.add_line_segments(f"{name}/ground", lines, surfaces.ground, thickness=0.008)
