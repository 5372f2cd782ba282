"""Low-friction patches on the object: bands on planar objects, discs on spatial ones."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.scenario import Patch, PlanarScenario, Scenario
from slipgrasp.core.scenario.geometry import contact_frame, inner_radius
from slipgrasp.core.scenario.scenario import FreeScenario, is_there
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import edges_of, spatial_contact
from slipgrasp.core.scenario.world import SpatialPatch
from slipgrasp.recordings.palette import WATER
from slipgrasp.scene import rotations
from slipgrasp.scene.rotations import Values
from slipgrasp.scene.sizes import sizes_of
from slipgrasp.scene.skeleton import LYING
from slipgrasp.web.model.colours import WAVES
from slipgrasp.web.model.selection import PATCH
from slipgrasp.web.scene.canvas import Canvas
from slipgrasp.web.scene.shapes import circle, polyline

_WAVE_POINTS = 12
_SHARE = 0.35
_BEHIND_MARKS = 0.97
_WAVES = (0.35, 0.7)  # radii, as fractions of the radius of a disc
_WAVE_LINE = 0.045


class _Spot(NamedTuple):
    """A patch in an upright plane of the object.

    Attributes:
        position: Origin of the plane in the object's frame [m].
        wxyz: Orientation of the plane.
        outline: Corners, counterclockwise; fewer than three if it lies beside its face.
        depths: Its back and its front [m].
        waves: Segments of the waves on it, each ``(k, 2, 3)``.
        wave_width: Thickness of the waves [m].
    """

    position: Values
    wxyz: tuple[float, ...]
    outline: Values
    depths: tuple[float, float]
    waves: Sequence[NDArray[np.float32]]
    wave_width: float


class LowFrictionPatches:
    """Shows every patch of a run on its face while it exists.

    Args:
        canvas: Adds the nodes.
        object_name: Name of the node with the pose of the object.
        scenario: Scenario with the patches and faces.
    """

    def __init__(self, canvas: Canvas, object_name: str, scenario: Scenario) -> None:
        self._patches = scenario.patches
        self._nodes = list[viser.FrameHandle]()
        self._visible: list[bool | None] = [None] * len(self._patches)
        for k, spot in enumerate(_spots_of(scenario)):
            name = f"{object_name}/wet{k}"
            node = canvas.add_frame(name, position=spot.position, wxyz=np.array(spot.wxyz))
            self._nodes.append(node)
            if len(spot.outline) >= 3:
                part = f"{PATCH}.{k}"
                canvas.add_slab(f"{name}/water", spot.outline, spot.depths, WATER, part)
            if spot.waves:
                crests = np.concatenate(spot.waves)
                canvas.add_lines(f"{name}/waves", WAVES, spot.wave_width, crests)

    def update(self, time: float) -> None:
        """Shows the patches that exist at a time [s]."""
        for k, patch in enumerate(self._patches):
            there = bool(is_there(patch, time))
            if there is not self._visible[k]:
                self._visible[k] = self._nodes[k].visible = there

    def remove(self) -> None:
        """Removes every node."""
        for node in self._nodes:
            node.remove()


def _spots_of(scenario: Scenario) -> list[_Spot]:
    """All patches; none without a hand."""
    if isinstance(scenario, SpatialScenario):
        return [_disc(scenario, patch) for patch in scenario.patches]
    if isinstance(scenario, FreeScenario):
        return []
    return [_band(scenario, patch) for patch in scenario.patches]


def _band(scenario: PlanarScenario, patch: Patch) -> _Spot:
    """A patch of a planar object: a band along its face, cut off at the ends of the face."""
    tip = replace(scenario.fingers[0], face=patch.face, contact_offset=patch.centre)
    frame = contact_frame(scenario.object, tip)
    reach = np.array([-patch.half_length, patch.half_length])
    slips = reach.clip(frame.slip_minimum, frame.slip_maximum)
    ends = np.asarray(frame.anchor) + slips[:, None] * frame.tangent
    normal, thickness = np.asarray(frame.normal), _SHARE * inner_radius(scenario.object)
    front = _BEHIND_MARKS * sizes_of(scenario).front
    crest = polyline(np.array(list(_waves(ends, normal, thickness))), front + 0.001)
    return _Spot(
        position=np.zeros(3),
        wxyz=LYING,
        outline=np.concatenate([ends + thickness * normal, ends[::-1]]),
        depths=(front - 0.002, front),
        waves=[crest],
        wave_width=0.22 * thickness,
    )


def _disc(scenario: SpatialScenario, patch: SpatialPatch) -> _Spot:
    """A patch of a spatial object, in the plane of its face from outside, as far as it is on it."""
    tip = replace(scenario.fingers[0], face=patch.face, contact_offset=patch.centre)
    contact = spatial_contact(scenario.object, tip)
    columns = np.column_stack([contact.tangent_y, contact.normal, contact.tangent_x])

    def on_face(share: float) -> Values:
        inside = clipped(circle(share * patch.radius), np.array(contact.outline))
        # Seen from outside, the order of the tangents, and so of the corners, is reversed.
        return inside[::-1, ::-1]

    rings = [ring for ring in map(on_face, _WAVES) if len(ring) >= 3]
    return _Spot(
        position=np.array(contact.anchor),
        wxyz=rotations.of_matrix(columns),
        outline=on_face(1.0),
        depths=(0.0005, 0.0015),
        waves=[polyline(ring, 0.002, closed=True) for ring in rings],
        wave_width=_WAVE_LINE * patch.radius,
    )


def _waves(ends: Values, normal: Values, thickness: float) -> Iterator[Values]:
    """Points of a wave along a face, with the thickness of the band."""
    length = float(np.hypot(*(ends[1] - ends[0])))
    count = max(round(length / (1.5 * thickness)), 1) * _WAVE_POINTS
    for k in range(count + 1):
        height = 0.5 + 0.22 * math.sin(2.0 * math.pi * k / _WAVE_POINTS)
        yield ends[0] + k / count * (ends[1] - ends[0]) + height * thickness * normal


def clipped(outline: Values, bounds: Values) -> Values:
    """The intersection of two convex outlines (Sutherland and Hodgman 1974).

    Args:
        outline: Corners, counterclockwise, shape ``(k, 2)``.
        bounds: Corners of the other one, counterclockwise.

    Returns:
        Corners, shape ``(m, 2)``; none if they do not overlap.
    """
    for a, b, c in edges_of(tuple(map(tuple, bounds))):
        inside = outline @ (a, b) + c
        kept = []
        for k in range(len(outline)):
            before, now = inside[k - 1], inside[k]
            if (before < 0.0) != (now < 0.0):
                kept.append(
                    outline[k - 1] + before / (before - now) * (outline[k] - outline[k - 1])
                )
            if now >= 0.0:
                kept.append(outline[k])
        outline = np.array(kept).reshape(-1, 2)
    return outline
