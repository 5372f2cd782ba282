"""Wet spots on the faces of an object in space: round, on the object and in the lenses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.scenario.spatial import SpatialPatch, SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import edges_of, spatial_contact
from slipgrasp.web.model.colours import WATER, WAVES
from slipgrasp.web.scene.disturbance_view import WetSpots
from slipgrasp.web.scene.shapes import circle, extrude, polyline, position
from slipgrasp.web.scene.space.contact_marks import face_attitude, in_face
from slipgrasp.web.scene.space.layout import SpatialLayout
from slipgrasp.web.scene.space.solids import triple

Points = NDArray[np.float64]

_WAVES = (0.35, 0.7)  # radii, as shares of that of the spot
_WAVE_LINE = 0.045
_SIGHT = 0.97  # of a lens


def add_spatial_wet_spots(
    scene: viser.SceneApi,
    object_name: str,
    lens_name: str,
    scenario: SpatialScenario,
    layout: SpatialLayout,
) -> WetSpots:
    """Draws every patch on its face, and in the lenses of the fingertips on that face.

    Args:
        scene: Where the nodes go.
        object_name: Name of the node that moves with the object.
        lens_name: Name of the node of all lenses, in whose plane they lie.
        scenario: Whose patches and faces.
        layout: Where the lenses are, and how they magnify.
    """

    def draw(k: int, patch: SpatialPatch) -> Iterator[viser.FrameHandle]:
        contact = spatial_contact(
            scenario.object,
            replace(scenario.fingers[0], face=patch.face, contact_offset=patch.centre),
        )
        root = scene.add_frame(
            f"{object_name}/wet{k}",
            show_axes=False,
            position=triple(np.asarray(contact.anchor)),
            wxyz=face_attitude(contact),
        )
        _draw_water(scene, f"{object_name}/wet{k}", patch.radius, 1.0, np.array(contact.outline))
        yield root
        for i, finger in enumerate(scenario.fingers):
            if finger.face != patch.face:
                continue
            name = f"{lens_name}/{i}/wet{k}"
            away = np.subtract(patch.centre, finger.contact_offset)
            yield scene.add_frame(
                name, show_axes=False, position=position(layout.magnification * in_face(away))
            )
            seen = circle(_SIGHT * layout.lens_radius) / layout.magnification - away
            _draw_water(scene, name, patch.radius, layout.magnification, seen)

    patches = scenario.patches
    return WetSpots(patches, [list(draw(k, patch)) for k, patch in enumerate(patches)])


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
        return scale * in_face(inside)[::-1]

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
