"""The picture of a run in the plane at one instant; the owner of its nodes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.geometry import ContactFrame, contact_frame, inner_radius, outline
from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.model.sampling import Sample
from slipgrasp.web.scene.contact_view import ContactView
from slipgrasp.web.scene.detail import Detail
from slipgrasp.web.scene.disturbance_view import PushView, WetSpots, add_wet_spots
from slipgrasp.web.scene.dragging import Draggable
from slipgrasp.web.scene.ghost_view import GhostView
from slipgrasp.web.scene.hand_view import HandView
from slipgrasp.web.scene.layout import SceneLayout, lay_out
from slipgrasp.web.scene.lens_view import LENS_DEPTH, LensView, spot_ring
from slipgrasp.web.scene.marks import RunFacts, run_facts, sizes_on_hand
from slipgrasp.web.scene.object_view import ObjectView
from slipgrasp.web.scene.shapes import AXES, position
from slipgrasp.web.scene.surfaces import surfaces_for

Stage = viser.ClientHandle | viser.ViserServer

_ROOT = "/hand"
_GHOST_ROOT = "/ghost"
_LEAST_RINGED = 2.0


class PlanarPicture:
    """Shows runs in the plane; the nodes are made once per shape of hand and object.

    Args:
        stage: Where the nodes go: one viewer, whose picture is its own, or a whole server.
    """

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._appearance, self._detail = Appearance(), Detail()
        self._views: _Views | None = None
        self._view_shape: object = None
        self._ghost: GhostView | None = None
        self._ghost_shape: object = None
        self._wet_spots: WetSpots | None = None
        self._wet: object = None
        self._run: RunFacts | None = None

    def show(
        self,
        result: RunResult,
        ghost: RunResult | None,
        appearance: Appearance,
    ) -> SceneLayout:
        """Takes a run; `update` then shows its instants.

        Args:
            result: The run.
            ghost: Another run that is drawn pale behind it.
            appearance: How it is drawn.

        Returns:
            Where everything is, for the camera.
        """
        self._appearance = appearance
        layout = lay_out(result, whole_hand=appearance.whole_hand)
        self._run = run_facts(result, layout, self._appearance.force_scale)
        with self._stage.atomic():
            views = self._views_of(result.scenario, layout)
            views.show_parts(self._appearance)
            views.magnify(layout)
            self._lay_wet_spots(result.scenario, views, layout)
            self._show_ghost(ghost, views, layout)
        return layout

    def update(self, sample: Sample, ghost: Sample | None = None, *, moving: bool = False) -> None:
        """Shows an instant of the run, and one of the run that is drawn pale.

        Args:
            sample: The instant of the run.
            ghost: That of the run that is drawn pale, if there is one.
            moving: Whether others follow at once: then what nobody can see is left out.
        """
        if self._views is None or self._run is None:
            return
        self._detail.begin_frame(moving=moving)
        with self._stage.atomic():
            if self._ghost is not None and ghost is not None:
                self._ghost.update(ghost, self._run.magnification)
            self._views.update(sample, self._run)
            if self._wet_spots is not None:
                self._wet_spots.update(sample.time)
            if self._appearance.lenses:
                self._update_lenses(self._views, sample, self._run, ghost)

    @property
    def draggable(self) -> Draggable | None:
        """What can be dragged; None before the first run."""
        if self._views is None or self._run is None:
            return None
        scale = self._views.push.newtons_per_metre(self._run.full)
        return Draggable(self._views.body.block, scale, AXES)

    def remove(self) -> None:
        """Removes every node."""
        if self._ghost is not None:
            self._ghost.remove()
        if self._views is not None:
            self._views.root.remove()
        self._views = self._ghost = self._view_shape = self._ghost_shape = None
        self._wet_spots = self._wet = None

    def _update_lenses(
        self, views: _Views, sample: Sample, run: RunFacts, ghost: Sample | None
    ) -> None:
        spots = _spots(sample, views.frames)
        for i, lens in enumerate(views.lenses):
            pale = None
            if self._ghost is not None and ghost is not None:
                pale = self._ghost.pale_slip(ghost, i)
            lens.update(sample, run.full, run.believed(sample, i), spots[i], pale)

    def _views_of(self, scenario: Scenario, layout: SceneLayout) -> _Views:
        """The nodes for a hand, made anew only for another shape, other colours or other lenses."""
        places = (layout.lens_radius, layout.lens_centres.tobytes())
        shape = (_shape(scenario), self._appearance.dark, places)
        if self._views is None or self._view_shape != shape:
            self.remove()
            self._views = _make_views(
                self._stage.scene, scenario, layout, self._detail, dark=self._appearance.dark
            )
            self._view_shape = shape
        return self._views

    def _lay_wet_spots(self, scenario: Scenario, views: _Views, layout: SceneLayout) -> None:
        """The nodes of the wet spots, made anew for others or for another magnification."""
        wet = (scenario.patches, layout.magnification)
        if self._wet_spots is not None and self._wet == wet:
            return
        if self._wet_spots is not None:
            self._wet_spots.remove()
        body, lenses = views.body.body.name, views.lens_root.name
        self._wet_spots = add_wet_spots(self._stage.scene, body, lenses, scenario, layout)
        self._wet = wet

    def _show_ghost(self, ghost: RunResult | None, views: _Views, layout: SceneLayout) -> None:
        """The nodes of the pale run; they stay, hidden, until one of another shape comes."""
        if ghost is None:
            if self._ghost is not None:
                self._ghost.show(visible=False, lenses=False)
            return
        shape = _shape(ghost.scenario)
        if self._ghost is None or self._ghost_shape != shape:
            if self._ghost is not None:
                self._ghost.remove()
            self._ghost = GhostView(
                self._stage.scene,
                _GHOST_ROOT,
                ghost.scenario,
                views.frames,
                layout,
                surfaces_for(dark=self._appearance.dark),
                self._detail,
            )
            self._ghost_shape = shape
        self._ghost.show(visible=True, lenses=self._appearance.lenses)


@dataclass(frozen=True, slots=True, eq=False)
class _Views:
    """The nodes of one hand, as long as its shape does not change."""

    root: viser.FrameHandle
    frames: tuple[ContactFrame, ...]
    hand: HandView
    body: ObjectView
    push: PushView
    contacts: tuple[ContactView, ...]
    rings: tuple[viser.LineSegmentsHandle, ...]
    lens_root: viser.FrameHandle
    lenses: tuple[LensView, ...]

    def show_parts(self, appearance: Appearance) -> None:
        """Shows or hides what the user may do without."""
        self.lens_root.visible = appearance.lenses
        for ring in self.rings:
            ring.visible = appearance.lenses
        for view in (*self.contacts, *self.lenses):
            view.show_cone(appearance.cones)

    def magnify(self, layout: SceneLayout) -> None:
        """Sets how much larger than life the lenses show the contacts; rings tell of how little."""
        ring = spot_ring(layout.lens_radius / layout.magnification)
        for lens, spot in zip(self.lenses, self.rings, strict=True):
            lens.magnify(layout.magnification)
            spot.points = ring
            spot.visible = spot.visible and layout.magnification >= _LEAST_RINGED

    def update(self, sample: Sample, run: RunFacts) -> None:
        """Moves hand, object and the marks on them."""
        self.hand.update(sample.joint_positions)
        self.body.update(sample)
        self.push.update(sample, run.full)
        for i, contact in enumerate(self.contacts):
            contact.update(sample, i, run.full, run.believed(sample, i))


def _shape(scenario: Scenario) -> object:
    """What the nodes depend on; the same for runs that differ in masses or gains alone."""
    fingers = tuple(
        (f.link_lengths, f.base, f.face, f.contact_offset, f.elbow) for f in scenario.fingers
    )
    return (fingers, outline(scenario.object).tobytes(), scenario.trajectory.start)


def _make_views(
    scene: viser.SceneApi,
    scenario: Scenario,
    layout: SceneLayout,
    detail: Detail,
    *,
    dark: bool,
) -> _Views:
    surfaces, body = surfaces_for(dark=dark), scenario.object
    frames = tuple(contact_frame(body, finger) for finger in scenario.fingers)
    root = scene.add_frame(_ROOT, show_axes=False)
    held = ObjectView(scene, f"{_ROOT}/object", body, frames, surfaces, detail)
    push = PushView(scene, f"{_ROOT}/object/push", inner_radius(body), detail)
    sizes = sizes_on_hand(inner_radius(body))
    spots = [f"{held.body.name}/contact{i}" for i in range(len(frames))]
    contacts = tuple(
        ContactView(scene, spot, np.asarray(frame.anchor), frame, 1.0, sizes, detail)
        for spot, frame in zip(spots, frames, strict=True)
    )
    rings = tuple(
        scene.add_line_segments(f"{spot}/ring", spot_ring(1.0), surfaces.leader, thickness=0.002)
        for spot in spots
    )
    lens_root = scene.add_frame(
        f"{_ROOT}/lenses", show_axes=False, position=position(np.zeros(2), LENS_DEPTH)
    )
    lenses = tuple(
        LensView(scene, f"{_ROOT}/lenses/{i}", frame, name, layout, i, surfaces, detail)
        for i, (frame, name) in enumerate(zip(frames, scenario.finger_names, strict=True))
    )
    hand = HandView(scene, f"{_ROOT}/fingers", scenario.fingers, surfaces, detail)
    return _Views(root, frames, hand, held, push, contacts, rings, lens_root, lenses)


def _spots(sample: Sample, frames: tuple[ContactFrame, ...]) -> NDArray[np.float64]:
    """Where the anchors of the contacts stand, shape ``(contacts, 2)`` [m]."""
    x, y, angle = sample.object_pose.tolist()
    rotation = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    return np.array([x, y]) + np.array([frame.anchor for frame in frames]) @ rotation.T
