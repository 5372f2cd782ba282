"""The view of a run at one instant; the only owner of scene nodes."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import viser

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import (
    PLANAR,
    RAIL,
    SPATIAL,
    SUPPORT,
    HandScenario,
    RailScenario,
    Scenario,
    SupportScenario,
)
from slipgrasp.core.scenario.hand_files.meshes import HandMeshes
from slipgrasp.core.scenario.spatial_geometry import friction_outline
from slipgrasp.scene import parts, skeleton
from slipgrasp.scene.rotations import Values
from slipgrasp.scene.sizes import sizes_of
from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.model.sampling import Sample
from slipgrasp.web.model.surfaces import surfaces_for
from slipgrasp.web.scene.canvas import Canvas
from slipgrasp.web.scene.close_ups import CloseUps, arrays_of, facts_of
from slipgrasp.web.scene.contact_view import ContactView
from slipgrasp.web.scene.detail import Detail
from slipgrasp.web.scene.dragging import Draggable, ObjectDrag
from slipgrasp.web.scene.drawer import HandDrawer
from slipgrasp.web.scene.ghost_view import GhostView
from slipgrasp.web.scene.kept import Kept
from slipgrasp.web.scene.layout import SceneLayout, lay_out
from slipgrasp.web.scene.link_meshes import LinkMeshes
from slipgrasp.web.scene.low_friction_patches import LowFrictionPatches
from slipgrasp.web.scene.marks import MarkSizes, RunFacts, Trail, beliefs_of, sizes_on_hand
from slipgrasp.web.scene.moving_marks import MovingMarks
from slipgrasp.web.scene.node_shape import shape_of
from slipgrasp.web.scene.picking import Picking
from slipgrasp.web.scene.push_view import PushView
from slipgrasp.web.scene.shapes import arc, circle
from slipgrasp.web.scene.slide_view import SlideView


class Stage(Protocol):
    """An object with a scene: a viewer, or a whole server."""

    @property
    def scene(self) -> viser.SceneApi:
        """The scene."""
        ...

    def atomic(self) -> AbstractContextManager[None]:
        """A context whose updates arrive together."""
        ...


class _Look(NamedTuple):
    """Differences between planar and spatial hands.

    If nodes are removed and replaced under the same name at one instant, the updates may reach a
    viewer in the wrong order; so the names differ.

    Attributes:
        root: Name of the node of the hand.
        ghost_root: Name of the node of the ghost.
        drag_axes: Axes of the world along which the object can be dragged; none on a rail.
        glass: Whether the object is transparent.
    """

    root: str
    ghost_root: str
    drag_axes: tuple[int, ...]
    glass: bool


_LOOKS = {
    PLANAR: _Look("/hand", "/ghost", (0, 2), glass=False),
    SPATIAL: _Look("/space", "/pale-space", (0, 1, 2), glass=True),
    SUPPORT: _Look("/support", "/pale-support", (0, 1), glass=False),
    RAIL: _Look("/rail", "/pale-rail", (), glass=False),
}
_FLOOR_MARGIN = 0.6
_GRID_CELLS = 40.0  # size of the grid of a support, in half heights of the body
_RIM_CORNERS = 48


class Scene:
    """Shows runs, one after another; nodes are created once per shape of hand and object.

    Args:
        stage: Server of the nodes.
        drag: Handles dragging of the object; None if it is not possible.
        detail: Level of detail.
        picking: Makes fingers and patches clickable; None without interaction.
        meshes: Meshes of a hand, which replace the bars of its fingers.
    """

    def __init__(
        self,
        stage: Stage,
        drag: ObjectDrag | None = None,
        detail: Detail | None = None,
        picking: Picking | None = None,
        meshes: HandMeshes | None = None,
    ) -> None:
        self._stage, self._drag, self._picking = stage, drag, picking
        self._appearance, self._detail = Appearance(), detail or Detail()
        self._meshes = None if meshes is None else LinkMeshes(meshes)
        self._views, self._ghost = Kept[_Views](), Kept[GhostView]()
        self._low_friction_patches = Kept[LowFrictionPatches]()
        self._run: RunFacts | None = None
        self._close_ups = CloseUps(stage.scene)
        _light(stage.scene)

    def show(
        self,
        result: RunResult,
        ghost: RunResult | None = None,
        appearance: Appearance | None = None,
    ) -> SceneLayout:
        """Sets a run; `update` then shows its instants.

        Args:
            result: The run.
            ghost: A ghost, if both are of one kind of hand; measured data need the object's pose.
            appearance: Display options; unchanged if None.

        Returns:
            The layout for the camera.
        """
        self._appearance = appearance or self._appearance
        layout = lay_out(result, whole_hand=self._appearance.whole_hand)
        full = layout.full._replace(force=layout.full.force / self._appearance.force_scale)
        self._run = RunFacts(full, beliefs_of(result))
        space = result.scenario.space
        pale = ghost if ghost is not None and ghost.scenario.space is space else None
        # Measured data may lack the slips, which only the close-ups draw.
        slipping = pale if pale is not None and _is_known(pale.trace.slip) else None
        with self._stage.atomic():
            views = self._show_hand(result.scenario, pale)
            self._close_ups.show(
                facts_of(result, slipping, layout, self._appearance, self.object_node),
                arrays_of(result, slipping, layout),
            )
        if self._drag is not None and (axes := _LOOKS[space].drag_axes):
            scale = views.push.newtons_per_metre(full)
            self._drag.follow(Draggable(views.hand.block, scale, axes))
        return layout

    def update(self, sample: Sample, ghost: Sample | None = None, *, moving: bool = False) -> None:
        """Shows an instant of the run, and of the ghost.

        Args:
            sample: The instant of the run.
            ghost: The instant of the ghost, if there is one.
            moving: Whether other frames follow immediately, so that invisible changes are omitted.
        """
        if self._views.nodes is None or self._run is None:
            return
        self._detail.begin_frame(moving=moving)
        with self._stage.atomic():
            if self._ghost.nodes is not None and ghost is not None:
                self._ghost.nodes.update(ghost.states)
            self._close_ups.move(sample.time)
            self._views.nodes.update(sample, self._run)
            if self._meshes is not None:
                self._meshes.update(sample.states)
            if self._low_friction_patches.nodes is not None:
                self._low_friction_patches.nodes.update(sample.time)

    @property
    def object_node(self) -> str:
        """The node that moves with the object, after a run is shown."""
        assert self._views.nodes is not None, "no run is shown"
        return self._views.nodes.hand.paths[skeleton.OBJECT]

    @property
    def ghost_node(self) -> str:
        """The parent node of the ghost, after one is shown."""
        assert self._ghost.nodes is not None, "no ghost is shown"
        return self._ghost.nodes.name

    def _show_hand(self, scenario: Scenario, ghost: RunResult | None) -> _Views:
        """The nodes of the hand, its patches and the ghost; created again only if they differ."""
        dark = self._appearance.dark
        can_pick = scenario.space.has_hand or isinstance(scenario, SupportScenario)
        picking = self._picking if can_pick else None
        canvas = Canvas(self._stage.scene, surfaces_for(dark=dark), self._detail, picking)
        has_meshes = self._meshes is not None and self._meshes.show(canvas, scenario)
        shape = (shape_of(scenario), dark, has_meshes)
        if not self._views.fits(shape):
            for nodes in (self._low_friction_patches, self._ghost, self._views):
                nodes.remove()
        views = self._views.renew(
            shape, lambda: _make_views(canvas, scenario, has_meshes=has_meshes)
        )
        for mark in views.marks:
            if isinstance(mark, ContactView):
                mark.show_cone(self._appearance.cones)
        body = views.hand.paths[skeleton.OBJECT]
        self._low_friction_patches.renew(
            scenario.patches, lambda: LowFrictionPatches(canvas, body, scenario)
        )
        self._show_ghost(canvas, ghost)
        return views

    def _show_ghost(self, canvas: Canvas, ghost: RunResult | None) -> None:
        """The nodes of the ghost; they stay hidden until one of another shape is shown."""
        if ghost is None:
            if self._ghost.nodes is not None:
                self._ghost.nodes.show(False)
            return
        scenario = ghost.scenario
        has_hand = scenario.space.has_control and _is_known(ghost.trace.joint_position)
        name = _LOOKS[scenario.space].ghost_root + _suffix(scenario)
        nodes = self._ghost.renew(
            (shape_of(scenario), has_hand),
            lambda: GhostView(canvas, name, scenario, has_hand=has_hand),
        )
        nodes.show(True)


@dataclass(frozen=True, slots=True, eq=False)
class _Views:
    """The nodes of one hand, while its shape does not change."""

    root: viser.FrameHandle
    hand: HandDrawer
    push: PushView
    marks: tuple[MovingMarks, ...]

    def remove(self) -> None:
        """Removes all nodes, also those below the object."""
        self.root.remove()

    def update(self, sample: Sample, run: RunFacts) -> None:
        """Moves hand, object and the marks on them."""
        states = sample.states
        self.hand.update(states)
        self.push.update(states.object_pose[0, :3], sample.external_wrench, run.full)
        for i, mark in enumerate(self.marks):
            mark.update(states, i, run.full, run.believed(sample, i), Trail(sample.trails[i]))


def _is_known(signal: Values) -> bool:
    """Whether a signal of a ghost is known; one that was not measured is NaN in all rows."""
    return bool(np.isfinite(signal[0]).all())


def _suffix(scenario: Scenario) -> str:
    """End of the names of nodes, for the same reason as in `_Look`: empty without chains."""
    if isinstance(scenario, SupportScenario | RailScenario):
        return ""
    kinds = [finger.kind for finger in scenario.fingers]
    return f"-{'-'.join(kinds)}" if "chain" in kinds else ""


def _make_views(canvas: Canvas, scenario: Scenario, *, has_meshes: bool) -> _Views:
    look, contacts = _LOOKS[scenario.space], skeleton.contacts_of(scenario)
    name = look.root + _suffix(scenario)
    root = canvas.add_frame(name)
    own = {skeleton.contact_name(i) for i in range(len(scenario.fingers))}
    frames, entities = skeleton.frames_of(scenario), parts.entities_of(scenario)
    if has_meshes:
        own |= {each.name for each in frames if skeleton.finger_of(each.name) is not None}
    frames = [frame for frame in frames if frame.name not in own]
    entities = [each for each in entities if each.name not in own]
    hand = HandDrawer(canvas, name, frames, entities, glass=look.glass)
    body, sizes = hand.paths[skeleton.OBJECT], sizes_of(scenario)
    inner = sizes.inner_radius
    marks = sizes_on_hand(inner, sizes.front)
    parent = hand.paths[skeleton.ROOTS[scenario.space]]
    push = PushView(canvas, f"{parent}/push", inner, marks)
    if isinstance(scenario, SupportScenario):
        return _Views(root, hand, push, (_add_slide(canvas, parent, scenario, marks),))
    rim = friction_outline(scenario, _RIM_CORNERS)
    views = tuple(
        ContactView(canvas, f"{body}/contact{i}", contact, rim, marks)
        for i, contact in enumerate(contacts)
    )
    if isinstance(scenario, RailScenario):
        place = np.array([scenario.trajectory.start[0], 0.0, sizes.front])
        slide = SlideView(canvas, f"{parent}/slide", place, 0.0, marks, upright=True)
        return _Views(root, hand, push, (*views, slide))
    if look.glass:
        _add_floor(canvas, f"{name}/floor", scenario)
    else:
        _add_centre(canvas, f"{body}/centre", 0.3 * inner, 0.95 * sizes.front)
    return _Views(root, hand, push, views)


def _add_slide(
    canvas: Canvas, plane: str, scenario: SupportScenario, marks: MarkSizes
) -> SlideView:
    """The support as a grid, and the marks of the body on it."""
    height = skeleton.body_height(scenario)
    x, y, _ = scenario.motion.start
    size = np.full(2, _GRID_CELLS * height)
    _add_grid(canvas, f"{plane}/floor", size, (0.1, 0.5), np.array([x, y, -height]))
    place = np.array([x, y, height])
    return SlideView(canvas, f"{plane}/slide", place, 2.0 * height, marks)


def _add_floor(canvas: Canvas, name: str, scenario: HandScenario) -> None:
    """A grid under the mounts, which shows depth."""
    bases = np.array([finger.base for finger in scenario.fingers])
    low, high = bases.min(axis=0), bases.max(axis=0)
    below = 2.9 * sizes_of(scenario).link_radius
    place = np.array([*(0.5 * (low + high))[:2], low[2] - below])
    _add_grid(canvas, name, high - low + 2.0 * _FLOOR_MARGIN, (0.25, 1.0), place)


def _add_grid(
    canvas: Canvas, name: str, size: Values, cells: tuple[float, float], place: Values
) -> None:
    """A horizontal grid with fine and coarse cells [m]."""
    canvas.scene.add_grid(
        name,
        width=float(size[0]),
        height=float(size[1]),
        cell_size=cells[0],
        cell_color=canvas.surfaces.ground,
        cell_thickness=0.6,
        section_size=cells[1],
        section_color=canvas.surfaces.ground,
        section_thickness=1.0,
        shadow_opacity=0.0,
        position=place,
    )


def _add_centre(canvas: Canvas, name: str, radius: float, depth: float) -> None:
    """The symbol of the centre of mass of a planar object: a disc with two dark quarters."""
    canvas.add_frame(name, wxyz=np.array(skeleton.LYING))
    front = depth + 0.002
    canvas.add_slab(f"{name}/disc", circle(radius, 32), (depth, front), canvas.surfaces.lens)
    for i, start in enumerate((0.0, np.pi)):
        rim = arc(radius, start, start + 0.5 * np.pi, 11)
        quarter, depths = np.concatenate([np.zeros((1, 2)), rim]), (front, front + 0.001)
        canvas.add_slab(f"{name}/quarter{i}", quarter, depths, canvas.surfaces.joint)


def _light(scene: viser.SceneApi) -> None:
    """Uniform light from the front, so that colours match the legend."""
    scene.configure_default_lights(enabled=False, cast_shadow=False)
    scene.configure_environment_map(hdri=None)
    scene.add_light_ambient("/light/everywhere", intensity=2.2)
    scene.add_light_directional(
        "/light/front", intensity=1.6, position=(-0.6, -1.0, 1.4), cast_shadow=False
    )
