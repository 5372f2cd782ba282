"""What happens to the object, in the picture: wet spots on its faces, and a push on it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.scenario import Patch, Scenario
from slipgrasp.core.scenario.geometry import contact_frame, inner_radius
from slipgrasp.core.scenario.spatial import SpatialPatch, is_there
from slipgrasp.web.model.colours import PUSH, WATER, WAVES, glow
from slipgrasp.web.model.sampling import Sample
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.images import SceneImage, add_image_in_plane, lettering
from slipgrasp.web.scene.layout import SceneLayout
from slipgrasp.web.scene.marks import FullScale, push_words, sizes_in_lens, sizes_on_hand
from slipgrasp.web.scene.shapes import arc, extrude, lift, polyline, position

Points = NDArray[np.float64]

_WAVE_POINTS = 12
_SHARE = 0.35
_FRONT = 0.058
_FRONT_IN_LENS = 0.043
_PUSH_DEPTH = 0.09
_ARC = 1.5 * math.pi
_SHORTEST_PUSH = 1e-3
_LINE = 0.027
_WHITE = (255, 255, 255)


class WetSpots:
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
            there = is_there(patch, time)
            if there is not self._visible[k]:
                self._visible[k] = there
                for node in self._nodes[k]:
                    node.visible = there

    def remove(self) -> None:
        """Removes every node."""
        for node in (node for nodes in self._nodes for node in nodes):
            node.remove()


def add_wet_spots(
    scene: viser.SceneApi,
    object_name: str,
    lens_name: str,
    scenario: Scenario,
    layout: SceneLayout,
) -> WetSpots:
    """Draws every patch on its face, and in the lenses of the fingertips on that face.

    Args:
        scene: Where the nodes go.
        object_name: Name of the node that moves with the object.
        lens_name: Name of the node of all lenses.
        scenario: Whose patches and faces.
        layout: Where the lenses are, and how they magnify.
    """

    def draw(k: int, patch: Patch) -> Iterator[viser.FrameHandle]:
        name = f"{object_name}/wet{k}"
        yield _add_spot(scene, name, *spot_on_face(scenario, patch), np.zeros(2), _FRONT)
        for i, centre in enumerate(layout.lens_centres):
            spot = spot_in_lens(scenario, patch, i, layout)
            if spot is not None:
                yield _add_spot(scene, f"{lens_name}/{i}/wet{k}", *spot, centre, _FRONT_IN_LENS)

    patches = scenario.patches
    return WetSpots(patches, [list(draw(k, patch)) for k, patch in enumerate(patches)])


class PushView:
    """An arrow to the centre of the object while it is pushed, an arc while it is twisted.

    Args:
        scene: Where the nodes go.
        name: Name of the node that they are below; its axes are those of the plane.
        radius: How near its centre the object's faces come [m].
        detail: How finely it is drawn.
    """

    def __init__(self, scene: viser.SceneApi, name: str, radius: float, detail: Detail) -> None:
        self._radius, self._sizes = radius, sizes_on_hand(radius)
        self._root = scene.add_frame(name, show_axes=False, visible=False)
        shaft = 1.6 * self._sizes.shaft_radius
        self._arrow = scene.add_arrows(
            f"{name}/force",
            np.zeros((1, 2, 3)),
            np.array([glow(PUSH)], dtype=np.uint8),
            shaft_radius=shaft,
            head_radius=2.6 * shaft,
            head_length=5.0 * shaft,
        )
        self._arc = scene.add_line_segments(
            f"{name}/moment", np.zeros((1, 2, 3)), PUSH, thickness=1.3 * shaft
        )
        self._scene, self._name, self._head = scene, name, 5.0 * shaft
        self._follow_object = Follower(detail, self._move)
        self._follow_wrench = Follower(detail, self._draw)

    def newtons_per_metre(self, full: FullScale) -> float:
        """How strong a force is whose arrow is one metre long [N/m]."""
        return full.force / self._sizes.force_length

    def update(self, sample: Sample, full: FullScale) -> None:
        """Shows what acts on the object at an instant.

        Args:
            sample: The instant.
            full: What an arrow of full length stands for.
        """
        wrench = sample.external_wrench
        acts = bool(wrench.any())
        if acts is not self._root.visible:
            self._root.visible = acts
        if acts:
            self._follow_object.follow(sample.object_pose[:2])
            self._follow_wrench.follow(np.array([*wrench, full.force]))

    def _move(self, centre: Points) -> None:
        self._root.position = position(centre)

    def _draw(self, wrench_and_full: Points) -> None:
        force, moment, full = wrench_and_full[:2], float(wrench_and_full[2]), wrench_and_full[3]
        arrow = self._sizes.force_length / full * force
        size = float(np.hypot(*arrow))
        self._arrow.visible = size > _SHORTEST_PUSH
        # It ends where the force acts, and comes from outside the object.
        tail = -arrow if self._arrow.visible else np.array([0.0, self._radius])
        self._arrow.points = lift(np.stack([[tail, np.zeros(2)]]), _PUSH_DEPTH)
        self._arc.visible = moment != 0.0
        self._arc.points = polyline(_twist(0.7 * self._radius, moment), _PUSH_DEPTH)
        words = push_words(float(np.hypot(*force)), moment)
        # Red on white is legible on the object and on any page.
        image = SceneImage(lettering(words, PUSH, _WHITE), _LINE)
        # Beyond the tail, as far as it takes to leave it free; the head may be longer than that.
        length = float(np.hypot(*tail))
        away = tail / max(length, 1e-9)
        room = 0.55 * np.array([image.width, image.height])
        place = (max(length, self._head) + float(np.abs(away) @ room)) * away
        add_image_in_plane(self._scene, f"{self._name}/words", image, place, _PUSH_DEPTH)


def spot_on_face(scenario: Scenario, patch: Patch) -> tuple[Points, Points, float]:
    """A wet spot on the object: its ends, the way into the object, and how thick it is drawn.

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
    scenario: Scenario, patch: Patch, contact: int, layout: SceneLayout
) -> tuple[Points, Points, float] | None:
    """A wet spot in the lens of a contact, seen from its middle; None where it is out of sight."""
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
    place: Points,
    depth: float,
) -> viser.FrameHandle:
    """A band of water along a face, with waves on it, below one node that shows or hides it."""
    root = scene.add_frame(name, show_axes=False, position=position(place))
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


def _twist(radius: float, moment: float) -> Points:
    """An arc about the centre that ends in an arrow's head, the way a moment turns."""
    way = math.copysign(1.0, moment)
    start = 0.25 * math.pi
    round_it = arc(radius, start, start + way * _ARC)
    end = start + way * _ARC
    tip = round_it[-1]
    forward = way * np.array([-math.sin(end), math.cos(end)])
    outward = np.array([math.cos(end), math.sin(end)])
    back = tip - 0.4 * radius * forward
    return np.array(
        [*round_it, back + 0.25 * radius * outward, tip, back - 0.25 * radius * outward]
    )
