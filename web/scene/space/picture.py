"""The picture of a run in space at one instant; the owner of its nodes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import SpatialContact, base_corners, friction_outline
from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.model.spatial_sampling import SpatialSample
from slipgrasp.web.scene.detail import Detail
from slipgrasp.web.scene.disturbance_view import WetSpots
from slipgrasp.web.scene.dragging import Draggable
from slipgrasp.web.scene.marks import FullScale, beliefs_of, full_scale, sizes_on_hand
from slipgrasp.web.scene.space.contact_marks import ContactState, in_face
from slipgrasp.web.scene.space.contact_view import SpatialContactView
from slipgrasp.web.scene.space.ghost_view import SpatialGhostView
from slipgrasp.web.scene.space.hand_view import SpatialHandView
from slipgrasp.web.scene.space.layout import SpatialLayout, contacts_of, lay_out_space, spatial
from slipgrasp.web.scene.space.lens_view import Leader, SpatialLensView
from slipgrasp.web.scene.space.object_view import SpatialObjectView
from slipgrasp.web.scene.space.push_view import SpatialPushView
from slipgrasp.web.scene.space.solids import Quaternion, quaternion_of, rotation_of
from slipgrasp.web.scene.space.wet_spots import add_spatial_wet_spots
from slipgrasp.web.scene.surfaces import Surfaces, surfaces_for
from slipgrasp.web.scene.view_plane import ViewPlane

Points = NDArray[np.float64]
Stage = viser.ClientHandle | viser.ViserServer

# Not the names of the picture in the plane: what is taken away and put there anew under one name
# at one instant may reach a viewer in the wrong order.
_ROOT = "/space"
_GHOST_ROOT = "/pale-space"
_FLOOR_MARGIN = 0.6


class SpatialPicture:
    """Shows runs in space; the nodes are made once per shape of hand and object.

    Args:
        stage: Where the nodes go.
    """

    def __init__(self, stage: Stage) -> None:
        self._stage, self._detail = stage, Detail()
        self._appearance = Appearance()
        self._views: _Views | None = None
        self._shape: object = None
        self._wet_spots: WetSpots | None = None
        self._wet: object = None
        self._ghost: SpatialGhostView | None = None
        self._ghost_shape: object = None
        self._full = FullScale(1.0, 1.0)
        self._beliefs: tuple[int | None, ...] = ()

    def show(
        self, result: RunResult, ghost: RunResult | None, appearance: Appearance
    ) -> SpatialLayout:
        """Takes a run; `update` then shows its instants.

        Args:
            result: The run.
            ghost: Another run in space that is drawn pale behind it.
            appearance: How it is drawn.

        Returns:
            Where everything is, for the camera.
        """
        self._appearance = appearance
        full = full_scale(result)
        layout = lay_out_space(result, full, whole_hand=appearance.whole_hand)
        self._full = full._replace(force=full.force / appearance.force_scale)
        self._beliefs = beliefs_of(result)
        with self._stage.atomic():
            views = self._views_of(spatial(result), layout)
            views.show_parts(appearance)
            for lens in views.lenses:
                lens.rescale(layout)
            self._lay_wet_spots(spatial(result), views, layout)
            self._show_ghost(ghost)
        return layout

    def update(
        self, sample: SpatialSample, ghost: SpatialSample | None = None, *, moving: bool = False
    ) -> None:
        """Shows an instant of the run, and one of the run that is drawn pale.

        Args:
            sample: The instant of the run.
            ghost: That of the run that is drawn pale, if there is one.
            moving: Whether others follow at once: then what nobody can see is left out.
        """
        if self._views is None:
            return
        self._detail.begin_frame(moving=moving)
        with self._stage.atomic():
            if self._ghost is not None and ghost is not None:
                self._ghost.update(ghost)
            self._views.update(sample, self._states_of(sample), self._full, self._appearance)
            if self._wet_spots is not None:
                self._wet_spots.update(sample.time)

    @property
    def draggable(self) -> Draggable | None:
        """What can be dragged; None before the first run."""
        if self._views is None:
            return None
        scale = self._views.push.newtons_per_metre(self._full)
        return Draggable(self._views.body.block, scale, (0, 1, 2))

    def remove(self) -> None:
        """Removes every node."""
        if self._ghost is not None:
            self._ghost.remove()
        if self._views is not None:
            self._views.root.remove()
        self._views = self._ghost = self._shape = self._ghost_shape = None
        self._wet_spots = self._wet = None

    def _states_of(self, sample: SpatialSample) -> list[ContactState]:
        return [
            ContactState(
                slip=in_face(sample.slip[i]),
                way=in_face(sample.ways[i]),
                velocity=in_face(sample.slip_velocity[i]),
                friction=-in_face(sample.tangential_force[i]),
                normal=float(sample.normal_force[i]),
                coefficient=float(sample.friction[i]),
                believed=None if place is None else float(sample.estimates[place]),
            )
            for i, place in enumerate(self._beliefs)
        ]

    def _views_of(self, scenario: SpatialScenario, layout: SpatialLayout) -> _Views:
        """The nodes for a hand, made anew only for another shape, other colours or other lenses."""
        places = (layout.lens_radius, layout.lens_centres.tobytes())
        shape = (_shape(scenario), self._appearance.dark, places)
        if self._views is None or self._shape != shape:
            self.remove()
            surfaces = surfaces_for(dark=self._appearance.dark)
            self._views = _make_views(self._stage.scene, scenario, layout, surfaces, self._detail)
            self._shape = shape
        return self._views

    def _lay_wet_spots(
        self, scenario: SpatialScenario, views: _Views, layout: SpatialLayout
    ) -> None:
        """The nodes of the wet spots, made anew for others or for another magnification."""
        wet = (scenario.patches, layout.magnification)
        if self._wet_spots is not None and self._wet == wet:
            return
        if self._wet_spots is not None:
            self._wet_spots.remove()
        body, board = views.body.body.name, f"{views.lens_root.name}/board"
        self._wet_spots = add_spatial_wet_spots(self._stage.scene, body, board, scenario, layout)
        self._wet = wet

    def _show_ghost(self, ghost: RunResult | None) -> None:
        """The nodes of the pale run; they stay, hidden, until one of another shape comes."""
        if ghost is None:
            if self._ghost is not None:
                self._ghost.show(visible=False)
            return
        shape = _shape(spatial(ghost))
        if self._ghost is None or self._ghost_shape != shape:
            if self._ghost is not None:
                self._ghost.remove()
            self._ghost = SpatialGhostView(
                self._stage.scene,
                _GHOST_ROOT,
                spatial(ghost),
                surfaces_for(dark=self._appearance.dark),
                self._detail,
            )
            self._ghost_shape = shape
        self._ghost.show(visible=True)


@dataclass(frozen=True, slots=True, eq=False)
class _Views:
    """The nodes of one hand, as long as its shape does not change."""

    root: viser.FrameHandle
    frames: tuple[SpatialContact, ...]
    hand: SpatialHandView
    body: SpatialObjectView
    push: SpatialPushView
    contacts: tuple[SpatialContactView, ...]
    lens_root: viser.FrameHandle
    lenses: tuple[SpatialLensView, ...]
    leaders: tuple[Leader, ...]

    def show_parts(self, appearance: Appearance) -> None:
        """Shows or hides what the user may do without."""
        self.lens_root.visible = appearance.lenses
        for view in (*self.contacts, *self.lenses):
            view.show_cone(appearance.cones)

    def update(
        self,
        sample: SpatialSample,
        states: list[ContactState],
        full: FullScale,
        appearance: Appearance,
    ) -> None:
        """Moves hand, object and the marks on them."""
        self.hand.update(sample.joint_positions)
        self.body.update(sample.object_pose, sample.desired_pose)
        self.push.update(sample.object_pose[:3], sample.external_wrench, full)
        turn = rotation_of(sample.object_pose[3:])
        for i, (state, phase) in enumerate(zip(states, sample.phases, strict=True)):
            self.contacts[i].update(state, phase, full)
            if appearance.lenses:
                self.lenses[i].update(state, phase, full)
                anchor = np.asarray(self.frames[i].anchor)
                self.leaders[i].update(sample.object_pose[:3] + turn @ anchor)


def _shape(scenario: SpatialScenario) -> object:
    """What the nodes depend on; the same for runs that differ in masses or gains alone."""
    fingers = tuple(
        (f.link_lengths, f.base, f.face, f.contact_offset, f.elbow) for f in scenario.fingers
    )
    body = scenario.object
    start = scenario.trajectory.start
    return (fingers, base_corners(body), body.height, start, scenario.has_pyramid)


def _make_views(
    scene: viser.SceneApi,
    scenario: SpatialScenario,
    layout: SpatialLayout,
    surfaces: Surfaces,
    detail: Detail,
) -> _Views:
    frames = contacts_of(scenario)
    root = scene.add_frame(_ROOT, show_axes=False)
    _add_floor(scene, f"{_ROOT}/floor", scenario, surfaces)
    held = SpatialObjectView(scene, f"{_ROOT}/object", scenario.object, surfaces, detail)
    inner = min(abs(np.dot(contact.anchor, contact.normal)) for contact in frames)
    sizes = sizes_on_hand(inner)
    outline = friction_outline(scenario)
    contacts = tuple(
        SpatialContactView(scene, f"{held.body.name}/contact{i}", contact, outline, sizes, detail)
        for i, contact in enumerate(frames)
    )
    lens_root = scene.add_frame(f"{_ROOT}/lenses", show_axes=False)
    board = f"{_ROOT}/lenses/board"
    scene.add_frame(board, show_axes=False, wxyz=_attitude(layout.plane))
    names = scenario.finger_names
    lenses = tuple(
        SpatialLensView(scene, f"{board}/{i}", layout, i, names[i], outline, surfaces, detail)
        for i in range(len(frames))
    )
    leaders = tuple(
        Leader(scene, f"{_ROOT}/lenses/leader{i}", layout, i, surfaces, detail)
        for i in range(len(frames))
    )
    hand = SpatialHandView(scene, f"{_ROOT}/fingers", scenario.fingers, surfaces, detail)
    push = SpatialPushView(scene, f"{_ROOT}/push", sizes)
    return _Views(root, frames, hand, held, push, contacts, lens_root, lenses, leaders)


def _attitude(plane: ViewPlane) -> Quaternion:
    """What turns the model's upright plane (x, depth away, z) into another one."""
    away = -np.array(plane.towards)
    return quaternion_of(np.column_stack([np.array(plane.right), away, np.array(plane.up)]))


def _add_floor(
    scene: viser.SceneApi, name: str, scenario: SpatialScenario, surfaces: Surfaces
) -> None:
    """A grid under the pedestals, by which one sees what is near and what is far."""
    bases = np.array([finger.base for finger in scenario.fingers])
    low, high = bases.min(axis=0), bases.max(axis=0)
    middle, size = 0.5 * (low + high), high - low + 2.0 * _FLOOR_MARGIN
    scene.add_grid(
        name,
        width=float(size[0]),
        height=float(size[1]),
        cell_size=0.25,
        cell_color=surfaces.ground,
        cell_thickness=0.6,
        section_size=1.0,
        section_color=surfaces.ground,
        section_thickness=1.0,
        shadow_opacity=0.0,
        position=(float(middle[0]), float(middle[1]), float(low[2]) - 0.16),
    )
