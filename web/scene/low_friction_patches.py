"""Low-friction patches on the object: bands on planar objects, discs on spatial ones."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

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
from slipgrasp.scene.sizes import sizes_of
from slipgrasp.scene.skeleton import LYING
from slipgrasp.web.model.colours import WAVES
from slipgrasp.web.model.selection import PATCH
from slipgrasp.web.scene.picking import Picking
from slipgrasp.web.scene.shapes import circle, extrude, faceted, polyline

Points = NDArray[np.float64]

_WAVE_POINTS = 12
_SHARE = 0.35
_BEHIND_MARKS = 0.97
_WAVES = (0.35, 0.7)  # radii, as fractions of the radius of a disc
_WAVE_LINE = 0.045


class LowFrictionPatches:
    """Shows every patch of a run while it exists.

    Args:
        patches: The patches.
        nodes: Nodes of each patch on its face.
    """

    def __init__(
        self, patches: Sequence[Patch | SpatialPatch], nodes: Sequence[viser.FrameHandle]
    ) -> None:
        self._patches, self._nodes = patches, nodes
        self._visible: list[bool | None] = [None] * len(patches)

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


def add_low_friction_patches(
    scene: viser.SceneApi, object_name: str, scenario: Scenario, picking: Picking | None = None
) -> LowFrictionPatches:
    """Draws every patch on its face.

    Args:
        scene: Scene of the nodes.
        object_name: Name of the node with the pose of the object.
        scenario: Scenario with the patches and faces.
        picking: Makes patches clickable; None without interaction.
    """
    names = [f"{object_name}/wet{k}" for k in range(len(scenario.patches))]
    if isinstance(scenario, SpatialScenario):
        round_spots = zip(names, scenario.patches, strict=True)
        drawn = [_round_spot(scene, name, scenario, patch) for name, patch in round_spots]
    elif isinstance(scenario, FreeScenario):
        drawn = []
    else:
        bands = zip(names, scenario.patches, strict=True)
        drawn = [_band(scene, name, scenario, patch) for name, patch in bands]
    for k, (_, water) in enumerate(drawn):
        if picking is not None and water is not None:
            picking.make_clickable(water, f"{PATCH}.{k}")
    return LowFrictionPatches(scenario.patches, [root for root, _ in drawn])


def _band(
    scene: viser.SceneApi, name: str, scenario: PlanarScenario, patch: Patch
) -> tuple[viser.FrameHandle, viser.MeshHandle]:
    """A patch of a planar object: a band along its face, with waves on it."""
    ends, normal, thickness = spot_on_face(scenario, patch)
    depth = _BEHIND_MARKS * sizes_of(scenario).front
    root = scene.add_frame(name, show_axes=False, wxyz=np.array(LYING))
    corners = np.array([*ends, *(ends[::-1] + thickness * normal)])
    if _turns_right(corners):
        corners = corners[::-1]
    band = extrude(corners, depth - 0.002, depth)
    water = scene.add_mesh_simple(f"{name}/band", *faceted(*band), color=WATER)
    crest = np.array(list(_waves(ends, normal, thickness)))
    scene.add_line_segments(
        f"{name}/waves", polyline(crest, depth + 0.001), WAVES, thickness=0.22 * thickness
    )
    return root, water


def _round_spot(
    scene: viser.SceneApi, name: str, scenario: SpatialScenario, patch: SpatialPatch
) -> tuple[viser.FrameHandle, viser.MeshHandle | None]:
    """A patch of a spatial object, in the upright plane of its face from outside."""
    tip = replace(scenario.fingers[0], face=patch.face, contact_offset=patch.centre)
    contact = spatial_contact(scenario.object, tip)
    columns = np.column_stack([contact.tangent_y, contact.normal, contact.tangent_x])
    root = scene.add_frame(
        name,
        show_axes=False,
        position=np.array(contact.anchor),
        wxyz=np.array(rotations.of_matrix(columns)),
    )
    return root, _draw_water(scene, name, patch.radius, np.array(contact.outline))


def spot_on_face(scenario: PlanarScenario, patch: Patch) -> tuple[Points, Points, float]:
    """A low-friction patch on the object: its ends, inward direction, and thickness.

    Args:
        scenario: The scenario.
        patch: The patch; parts beyond the ends of the face are cut off.
    """
    tip = replace(scenario.fingers[0], face=patch.face, contact_offset=patch.centre)
    frame = contact_frame(scenario.object, tip)
    reach = np.array([-patch.half_length, patch.half_length])
    ends = reach.clip(frame.slip_minimum, frame.slip_maximum)
    points = np.asarray(frame.anchor) + ends[:, None] * frame.tangent
    return points, np.asarray(frame.normal), _SHARE * inner_radius(scenario.object)


def _waves(ends: Points, normal: Points, thickness: float) -> Iterator[Points]:
    """Points of a wave along a face, with the thickness of the band."""
    length = float(np.hypot(*(ends[1] - ends[0])))
    count = max(round(length / (1.5 * thickness)), 1) * _WAVE_POINTS
    for k in range(count + 1):
        height = 0.5 + 0.22 * math.sin(2.0 * math.pi * k / _WAVE_POINTS)
        yield ends[0] + k / count * (ends[1] - ends[0]) + height * thickness * normal


def _turns_right(corners: Sequence[Points] | Points) -> bool:
    """Whether corners are in clockwise order."""
    (x0, y0), (x1, y1), (x2, y2) = np.asarray(corners)[:3]
    return float((x1 - x0) * (y2 - y1) - (y1 - y0) * (x2 - x1)) < 0.0


def _draw_water(
    scene: viser.SceneApi, name: str, radius: float, bounds: Points
) -> viser.MeshHandle | None:
    """A round spot with waves, as far as it lies within a convex outline; None if nowhere.

    Args:
        scene: Scene of the nodes.
        name: Name of the node at its centre, right and up in its face.
        radius: Radius of the disc [m].
        bounds: Corners of the outline in slips from its centre, counterclockwise [m].
    """

    def seen(share: float) -> Points:
        inside = clipped(circle(share * radius), bounds)
        # Seen from outside, the order of the tangents, and so of the corners, is reversed.
        return inside[::-1, ::-1]

    if len(inside := seen(1.0)) < 3:
        return None
    slab = extrude(inside, 0.0005, 0.0015)
    water = scene.add_mesh_simple(f"{name}/water", *faceted(*slab), color=WATER)
    waves = [polyline(ring, 0.002, closed=True) for ring in map(seen, _WAVES) if len(ring) >= 3]
    if waves:
        scene.add_line_segments(
            f"{name}/waves", np.concatenate(waves), WAVES, thickness=_WAVE_LINE * radius
        )
    return water


def clipped(outline: Points, bounds: Points) -> Points:
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
