"""The held object, and the outline of where it should be."""

from __future__ import annotations

import numpy as np
import viser

from core.scenario import ObjectParameters
from web.colours import GHOST, OBJECT, OBJECT_EDGE
from web.sampling import Sample
from web.scene.shapes import circle, extrude, lift, polyline, position, rectangle, turn

__all__ = ["ObjectView"]

_HALF_DEPTH = 0.05
_DASHES_PER_SIDE = 9


class ObjectView:
    """Draws the object as a block and its desired pose as a dashed outline."""

    def __init__(self, scene: viser.SceneApi, name: str, body: ObjectParameters) -> None:
        outline = rectangle(body.half_width, body.face_half_length)
        self._body = scene.add_frame(f"{name}/body", show_axes=False)
        scene.add_mesh_simple(
            f"{name}/body/block",
            *extrude(outline, -_HALF_DEPTH, _HALF_DEPTH),
            color=OBJECT,
            flat_shading=True,
        )
        edges = polyline(outline, _HALF_DEPTH + 0.002, closed=True)
        scene.add_line_segments(f"{name}/body/edges", edges, OBJECT_EDGE, thickness=0.006)
        scene.add_mesh_simple(
            f"{name}/body/centre",
            *extrude(circle(0.012, 24), _HALF_DEPTH, _HALF_DEPTH + 0.004),
            color=OBJECT_EDGE,
        )
        self._desired = scene.add_frame(f"{name}/desired", show_axes=False)
        scene.add_line_segments(f"{name}/desired/outline", _dashes(outline), GHOST, thickness=0.008)

    def update(self, sample: Sample) -> None:
        """Moves the object and the outline to their poses."""
        for frame, (x, y, angle) in (
            (self._body, sample.object_pose),
            (self._desired, sample.desired_pose),
        ):
            frame.position = position(np.array([x, y]))
            frame.wxyz = turn(float(angle))


def _dashes(corners: np.ndarray) -> np.ndarray:
    steps = np.linspace(0.0, 1.0, 2 * _DASHES_PER_SIDE).reshape(-1, 2)
    sides = np.roll(corners, -1, axis=0) - corners
    lines = [c + steps[..., None] * side for c, side in zip(corners, sides, strict=True)]
    return lift(np.concatenate(lines), _HALF_DEPTH + 0.006)
