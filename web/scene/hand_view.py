"""The fingers: links, joints and mounts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import viser

from core.geometry import joint_points
from core.scenario import FingerParameters, Scenario
from web.colours import GROUND, JOINT, LINK, MOUNT
from web.sampling import Sample
from web.scene.shapes import circle, extrude, lift, position, tapered_bar, turn

__all__ = ["HandView"]

_THICKNESS = 0.05
_JOINT_RADIUS = 0.055
_TIP_SHARE = 0.36
_TIP_GAP = 0.035


class HandView:
    """Draws every finger of a hand as tapered bars that turn about round joints."""

    def __init__(self, scene: viser.SceneApi, name: str, scenario: Scenario) -> None:
        self._fingers = scenario.fingers
        self._links = [
            [
                _add_link(scene, f"{name}/{i}/link/{k}", finger.link_lengths, k)
                for k in range(len(finger.link_lengths))
            ]
            for i, finger in enumerate(scenario.fingers)
        ]
        for i, finger in enumerate(scenario.fingers):
            _add_mount(scene, f"{name}/{i}/mount", finger)

    def update(self, sample: Sample) -> None:
        """Turns the links to the joint angles of an instant."""
        for finger, links, positions in zip(
            self._fingers, self._links, sample.joint_positions, strict=True
        ):
            points = joint_points(finger, positions)
            angles = np.cumsum(positions)
            for link, start, angle in zip(links, points, angles, strict=False):
                link.position = position(start)
                link.wxyz = turn(float(angle))


def _add_link(
    scene: viser.SceneApi, name: str, lengths: Sequence[float], index: int
) -> viser.FrameHandle:
    """One link along x with the joint that it turns about, in a frame of its own."""
    frame = scene.add_frame(name, show_axes=False)
    last = index == len(lengths) - 1
    radius = _JOINT_RADIUS * min(1.0, 2.0 * float(np.mean(lengths))) * 0.8**index
    end = _TIP_SHARE * radius if last else 0.72 * radius
    reach = lengths[index] - (_TIP_GAP * radius / _JOINT_RADIUS if last else 0.0)
    layer = 0.5 * _THICKNESS * 0.9**index
    bar = extrude(tapered_bar(reach, radius, end), -layer, layer)
    pin = extrude(circle(0.62 * radius), layer, layer + 0.012)
    cap = extrude(circle(0.22 * radius, 24), layer + 0.012, layer + 0.018)
    scene.add_mesh_simple(f"{name}/bar", *bar, color=LINK, flat_shading=True)
    scene.add_mesh_simple(f"{name}/pin", *pin, color=JOINT, flat_shading=True)
    scene.add_mesh_simple(f"{name}/cap", *cap, color=LINK, flat_shading=True)
    return frame


def _add_mount(scene: viser.SceneApi, name: str, finger: FingerParameters) -> None:
    """The block that a finger is bolted to, with hatching below."""
    base = np.asarray(finger.base)
    block = np.array([[-0.13, -0.17], [0.13, -0.17], [0.075, 0.03], [-0.075, 0.03]])
    solid = extrude(base + block, -0.045, 0.02)
    scene.add_mesh_simple(f"{name}/block", *solid, color=MOUNT, flat_shading=True)
    floor = np.array([[[-0.2, -0.17], [0.2, -0.17]]])
    feet = np.stack([np.linspace(-0.17, 0.17, 8), np.full(8, -0.17)], axis=1)
    hatching = np.stack([feet, feet - 0.035], axis=1)
    lines = lift(base + np.concatenate([floor, hatching]))
    scene.add_line_segments(f"{name}/ground", lines, GROUND, thickness=0.008)
