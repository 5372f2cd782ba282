"""The fingers of a hand in space: round links, joints, and the pedestals that turn them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.scenario.spatial import SpatialFinger
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.shapes import turn
from slipgrasp.web.scene.space.solids import about_z, rounded_bar, triple, turned_profile
from slipgrasp.web.scene.surfaces import Surfaces

Points = NDArray[np.float64]

_RADIUS = 0.055
_PEDESTAL = np.array([[-0.16, 0.0], [-0.16, 0.15], [-0.13, 0.15], [-0.04, 0.075], [0.0, 0.0]])
_UPRIGHT = (2.0**-0.5, 0.0, -(2.0**-0.5), 0.0)
_ACROSS = (2.0**-0.5, 0.0, 0.0, 2.0**-0.5)
_TIP_GAP = 0.03


class SpatialHandView:
    """Draws every finger as two round links above a pedestal, by frames inside frames.

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
        fingers: Sequence[SpatialFinger],
        surfaces: Surfaces,
        detail: Detail,
    ) -> None:
        self._followers: list[Follower] = []
        for i, finger in enumerate(fingers):
            path = f"{name}/{i}"
            yaw = scene.add_frame(path, show_axes=False, position=triple(np.array(finger.base)))
            self._followers.append(Follower(detail, _yawing(yaw)))
            _add_pedestal(scene, f"{path}/pedestal", surfaces)
            origin = np.zeros(3)
            for k, length in enumerate(finger.link_lengths):
                path = f"{path}/link{k}"
                frame = scene.add_frame(path, show_axes=False, position=triple(origin))
                self._followers.append(Follower(detail, _pitching(frame)))
                _add_link(scene, path, length, k, surfaces)
                origin = np.array([length, 0.0, 0.0])

    def update(self, joint_positions: Points) -> None:
        """Turns every joint to its angle, shape ``(fingers, 3)`` [rad]."""
        for follower, angle in zip(self._followers, joint_positions.reshape(-1, 1), strict=True):
            follower.follow(angle)


def _yawing(frame: viser.FrameHandle) -> Callable[[Points], None]:
    def draw(angle: Points) -> None:
        frame.wxyz = about_z(float(angle[0]))

    return draw


def _pitching(frame: viser.FrameHandle) -> Callable[[Points], None]:
    def draw(angle: Points) -> None:
        frame.wxyz = turn(float(angle[0]))

    return draw


def _add_link(scene: viser.SceneApi, name: str, length: float, k: int, surfaces: Surfaces) -> None:
    """A tapered bar along x, and the joint across it that it turns about."""
    radius, end = _RADIUS * 0.82**k, _RADIUS * 0.82 ** (k + 1) * (0.5 if k else 1.0)
    bar = rounded_bar(length - (_TIP_GAP if k else 0.0), radius, end)
    scene.add_mesh_simple(f"{name}/bar", *bar, color=surfaces.link)
    half = 1.25 * radius
    axle = np.array([[-half, 0.0], [-half, 0.72 * radius], [half, 0.72 * radius], [half, 0.0]])
    pin = turned_profile(axle)
    scene.add_mesh_simple(
        f"{name}/axle", *pin, color=surfaces.joint, wxyz=_ACROSS, flat_shading=True
    )


def _add_pedestal(scene: viser.SceneApi, name: str, surfaces: Surfaces) -> None:
    """A round foot below the joint, that shows where the finger turns about the vertical."""
    scene.add_mesh_simple(
        name, *turned_profile(_PEDESTAL), color=surfaces.mount, wxyz=_UPRIGHT, flat_shading=True
    )
