"""Low-friction patches on the object and in the lenses: bands of planar hands, round spots else."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.scenario import Patch, PlanarScenario, Scenario
from slipgrasp.core.scenario.geometry import contact_frame, inner_radius
from slipgrasp.core.scenario.scenario import is_there
from slipgrasp.core.scenario.spatial import SpatialPatch, SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import edges_of, spatial_contact
from slipgrasp.scene import parts, rotations
from slipgrasp.scene.skeleton import LYING
from slipgrasp.web.model.colours import WATER, WAVES
from slipgrasp.web.scene.layout import SceneLayout
from slipgrasp.web.scene.marks import sizes_in_lens
from slipgrasp.web.scene.shapes import circle, extrude, polyline, position

Points = NDArray[np.float64]

_WAVE_POINTS = 12
_SHARE = 0.35
_BEHIND_MARKS = 0.97
_FRONT_IN_LENS = 0.043
_WAVES = (0.35, 0.7)  # radii, as shares of that of a round spot
_WAVE_LINE = 0.045
_SIGHT = 0.97  # of a lens


class LowFrictionPatches:
    """Shows every patch of a run while it is there.

    Args:
        patches: The patches.
        nodes: What draws each of them, on its face and in lenses.
    """

    def __init__(
        self,
        patches: Sequence[Patch | SpatialPatch],
        nodes: Sequence[Sequence[viser.FrameHandle]],
    ) -> None:
        self._patches, self._nodes = patches, nodes
        self._visible: list[bool | None] = [None] * len(patches)

    def update(self, time: float) -> None:
        """Shows those that are there at a time [s]."""
        for k, patch in enumerate(self._patches):
            there = bool(is_there(patch, time))
            if there is not self._visible[k]:
                self._visible[k] = there
                for node in self._nodes[k]:
                    node.visible = there

    def remove(self) -> None:
        """Removes every node."""
        for node in (node for nodes in self._nodes for node in nodes):
            node.remove()


def add_low_friction_patches(
    scene: viser.SceneApi,
    object_name: str,
    lenses: Sequence[str],
    scenario: Scenario,
    layout: SceneLayout,
) -> LowFrictionPatches:
    """Draws every patch on its face, and in the lenses of the fingertips on that face.

    Args:
        scene: Where the nodes go.
        object_name: Name of the node that moves with the object, with its axes.
        lenses: Names of the nodes in the middle of the lenses.
        scenario: Whose patches and faces.
        layout: How the lenses magnify.
    """
    if isinstance(scenario, SpatialScenario):
        nodes = [
            list(_round_spot(scene, f"{object_name}/wet{k}", lenses, scenario, patch, layout))
            for k, patch in enumerate(scenario.patches)
        ]
        return LowFrictionPatches(scenario.patches, nodes)
    nodes = [
        list(_band(scene, f"{object_name}/wet{k}", lenses, scenario, patch, layout))
        for k, patch in enumerate(scenario.patches)
    ]
    return LowFrictionPatches(scenario.patches, nodes)


def _band(
    scene: viser.SceneApi,
    name: str,
    lenses: Sequence[str],
    scenario: PlanarScenario,
    patch: Patch,
    layout: SceneLayout,
) -> Iterator[viser.FrameHandle]:
    """The nodes of a patch of a planar object."""
    depth = _BEHIND_MARKS * parts.sizes_of(scenario).front
    yield _add_spot(scene, name, *spot_on_face(scenario, patch), depth, LYING)
    for i, lens in enumerate(lenses):
        spot = spot_in_lens(scenario, patch, i, layout)
        if spot is not None:
            own = f"{lens}/{name.rpartition('/')[2]}"
            yield _add_spot(scene, own, *spot, _FRONT_IN_LENS, rotations.UNTURNED)


def _round_spot(
    scene: viser.SceneApi,
    name: str,
    lenses: Sequence[str],
    scenario: SpatialScenario,
    patch: SpatialPatch,
    layout: SceneLayout,
) -> Iterator[viser.FrameHandle]:
    """The nodes of a patch of a spatial object, in the upright plane of its face from outside."""
    tip = replace(scenario.fingers[0], face=patch.face, contact_offset=patch.centre)
    contact = spatial_contact(scenario.object, tip)
    columns = np.column_stack([contact.tangent_y, contact.normal, contact.tangent_x])
    yield scene.add_frame(
        name,
        show_axes=False,
        position=np.array(contact.anchor),
        wxyz=np.array(rotations.of_matrix(columns)),
    )
    _draw_water(scene, name, patch.radius, 1.0, np.array(contact.outline))
    for lens, finger in zip(lenses, scenario.fingers, strict=True):
        if finger.face != patch.face:
            continue
        own = f"{lens}/{name.rpartition('/')[2]}"
        away = np.subtract(patch.centre, finger.contact_offset)
        place = position(layout.magnification * away[::-1])
        yield scene.add_frame(own, show_axes=False, position=place)
        seen = circle(_SIGHT * layout.lens_radius) / layout.magnification - away
        _draw_water(scene, own, patch.radius, layout.magnification, seen)


def spot_on_face(scenario: PlanarScenario, patch: Patch) -> tuple[Points, Points, float]:
    """A low-friction patch on the object: its ends, the way into the object, and its thickness.

    Args:
        scenario: Whose object.
        patch: The spot; what lies beyond the ends of the face is cut off.
    """
    tip = replace(scenario.fingers[0], face=patch.face, contact_offset=patch.centre)
    frame = contact_frame(scenario.object, tip)
    reach = np.array([-patch.half_length, patch.half_length])
    ends = reach.clip(frame.slip_minimum, frame.slip_maximum)
    points = np.asarray(frame.anchor) + ends[:, None] * frame.tangent
    return points, np.asarray(frame.normal), _SHARE * inner_radius(scenario.object)


def spot_in_lens(
    scenario: PlanarScenario, patch: Patch, contact: int, layout: SceneLayout
) -> tuple[Points, Points, float] | None:
    """A low-friction patch in the close-up of a contact; None where it is out of sight."""
    finger = scenario.fingers[contact]
    if finger.face != patch.face:
        return None
    frame, radius = contact_frame(scenario.object, finger), layout.lens_radius
    middle = patch.centre - finger.contact_offset
    reach = np.array([middle - patch.half_length, middle + patch.half_length])
    on_face = reach.clip(frame.slip_minimum, frame.slip_maximum)
    ends = (layout.magnification * on_face).clip(-0.97 * radius, 0.97 * radius)
    if ends[1] <= ends[0]:
        return None
    thickness = 1.2 * sizes_in_lens(radius).tip_radius
    return ends[:, None] * np.asarray(frame.tangent), np.asarray(frame.normal), thickness


def _add_spot(
    scene: viser.SceneApi,
    name: str,
    ends: Points,
    normal: Points,
    thickness: float,
    depth: float,
    wxyz: tuple[float, ...],
) -> viser.FrameHandle:
    """A band of water along a face, with waves on it, below one node that shows or hides it."""
    root = scene.add_frame(name, show_axes=False, wxyz=np.array(wxyz))
    corners = np.array([*ends, *(ends[::-1] + thickness * normal)])
    if _turns_right(corners):
        corners = corners[::-1]
    band = extrude(corners, depth - 0.002, depth)
    scene.add_mesh_simple(f"{name}/band", *band, color=WATER, flat_shading=True)
    crest = np.array(list(_waves(ends, normal, thickness)))
    scene.add_line_segments(
        f"{name}/waves", polyline(crest, depth + 0.001), WAVES, thickness=0.22 * thickness
    )
    return root


def _waves(ends: Points, normal: Points, thickness: float) -> Iterator[Points]:
    """Points of a wave along a face, as long as the band is thick."""
    length = float(np.hypot(*(ends[1] - ends[0])))
    count = max(round(length / (1.5 * thickness)), 1) * _WAVE_POINTS
    for k in range(count + 1):
        height = 0.5 + 0.22 * math.sin(2.0 * math.pi * k / _WAVE_POINTS)
        yield ends[0] + k / count * (ends[1] - ends[0]) + height * thickness * normal


def _turns_right(corners: Sequence[Points] | Points) -> bool:
    """Whether corners are given clockwise."""
    (x0, y0), (x1, y1), (x2, y2) = np.asarray(corners)[:3]
    return float((x1 - x0) * (y2 - y1) - (y1 - y0) * (x2 - x1)) < 0.0


def _draw_water(
    scene: viser.SceneApi, name: str, radius: float, scale: float, bounds: Points
) -> None:
    """A round spot with waves, of which what lies within a convex outline is seen.

    Args:
        scene: Where the nodes go.
        name: Name of the node in its middle, right and up in its face.
        radius: Of the spot [m].
        scale: How much larger it is drawn.
        bounds: Corners of the outline in slips from its middle, counterclockwise [m].
    """

    def seen(share: float) -> Points:
        inside = clipped(circle(share * radius), bounds)
        # Seen from outside, the order of the tangents, and so of the corners, is the other one.
        return scale * inside[::-1, ::-1]

    if len(water := seen(1.0)) < 3:
        return
    slab = extrude(water, 0.0005, 0.0015)
    scene.add_mesh_simple(f"{name}/water", *slab, color=WATER, flat_shading=True)
    waves = [polyline(ring, 0.002, closed=True) for ring in map(seen, _WAVES) if len(ring) >= 3]
    if waves:
        scene.add_line_segments(
            f"{name}/waves",
            np.concatenate(waves),
            WAVES,
            thickness=_WAVE_LINE * scale * radius,
        )


def clipped(outline: Points, bounds: Points) -> Points:
    """The part of a convex outline within another one (Sutherland and Hodgman 1974).

    Args:
        outline: Corners, counterclockwise, shape ``(k, 2)``.
        bounds: Corners of the other one, counterclockwise.

    Returns:
        Corners, shape ``(m, 2)``; none where they do not overlap.
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
