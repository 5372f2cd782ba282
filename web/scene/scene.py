"""The picture of a run at one instant; the only owner of scene nodes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray

from core.geometry import contact_frame
from core.result import RunResult
from core.scenario import Scenario
from web.sampling import Sample
from web.scene.contact_view import (
    ContactMarks,
    ContactPlacement,
    ContactView,
    FullScale,
    MarkSizes,
    contact_marks,
)
from web.scene.hand_view import HandView
from web.scene.layout import SceneLayout, lay_out, nice_at_least
from web.scene.lens_view import LensView
from web.scene.object_view import ObjectView

__all__ = ["Scene", "Stage"]

Stage = viser.ClientHandle | viser.ViserServer

_ROOT = "/hand"
_LEAST_FULL_FORCE = 1.0
_LEAST_FULL_SPEED = 1e-3

_SIZES_ON_HAND = MarkSizes(
    tip_radius=0.022,
    trail_width=0.018,
    cone_length=0.09,
    force_length=0.09,
    speed_length=0.08,
    shaft_radius=0.005,
    line_width=0.005,
    depth=0.06,
)


class _Views(NamedTuple):
    """The nodes of one hand, as long as its shape does not change."""

    shape: object
    root: viser.FrameHandle
    hand: HandView
    body: ObjectView
    contacts: ContactView
    lenses: LensView


class Scene:
    """Shows runs. The nodes are made once per shape of hand and object, then only moved.

    Args:
        stage: Where the nodes go: one viewer, whose picture is its own, or a whole server.
    """

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._views: _Views | None = None
        self._result: RunResult | None = None
        self._full = FullScale(_LEAST_FULL_FORCE, _LEAST_FULL_SPEED)
        _light(stage.scene)

    def show(self, result: RunResult) -> SceneLayout:
        """Takes a run; `update` then shows its instants.

        Returns:
            Where everything is, for the camera.
        """
        layout = lay_out(result)
        self._result = result
        with self._stage.atomic():
            views = self._views_of(result.scenario, layout)
            views.lenses.magnify(layout.magnification)
        self._full = _full_scale(result)
        return layout

    def update(self, sample: Sample) -> None:
        """Shows an instant of the run."""
        if self._views is None or self._result is None:
            return
        scenario = self._result.scenario
        frames = [contact_frame(scenario.object, finger) for finger in scenario.fingers]
        x, y, angle = sample.object_pose
        rotation = np.array(
            [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
        )
        spots = [np.array([x, y]) + rotation @ frame.anchor for frame in frames]
        places = [ContactPlacement(spot, float(angle), 1.0) for spot in spots]
        lenses = self._views.lenses
        own = self._marks(sample, places, _SIZES_ON_HAND)
        magnified = self._marks(
            sample, [lenses.placement(i) for i in range(len(frames))], lenses.sizes
        )
        with self._stage.atomic():
            self._views.hand.update(sample)
            self._views.body.update(sample)
            self._views.contacts.update(own, sample.phases)
            lenses.update(sample, magnified, spots)

    def remove(self) -> None:
        """Removes every node."""
        if self._views is not None:
            self._views.root.remove()
            self._views = None

    def _views_of(self, scenario: Scenario, layout: SceneLayout) -> _Views:
        """The nodes for a hand, made anew only if its shape has changed."""
        shape = _shape(scenario)
        if self._views is None or self._views.shape != shape:
            self.remove()
            self._views = _make_views(self._stage.scene, shape, scenario, layout)
        return self._views

    def _marks(
        self, sample: Sample, places: list[ContactPlacement], sizes: MarkSizes
    ) -> list[ContactMarks]:
        assert self._result is not None
        scenario, unknowns = self._result.scenario, self._result.trace.shape.unknowns
        return [
            contact_marks(
                sample,
                i,
                contact_frame(scenario.object, finger),
                places[i],
                sizes,
                full=self._full,
                believed_friction=_believed_friction(unknowns, sample.estimates, i),
            )
            for i, finger in enumerate(scenario.fingers)
        ]


def _shape(scenario: Scenario) -> object:
    """What the nodes depend on; the same for runs that differ in masses or gains alone."""
    fingers = tuple(
        (f.link_lengths, f.base, f.face, f.contact_offset, f.elbow) for f in scenario.fingers
    )
    body = scenario.object
    return (fingers, body.half_width, body.face_half_length, scenario.trajectory.start)


def _make_views(
    scene: viser.SceneApi, shape: object, scenario: Scenario, layout: SceneLayout
) -> _Views:
    frames = [contact_frame(scenario.object, finger) for finger in scenario.fingers]
    return _Views(
        shape=shape,
        root=scene.add_frame(_ROOT, show_axes=False),
        hand=HandView(scene, f"{_ROOT}/fingers", scenario),
        body=ObjectView(scene, f"{_ROOT}/object", scenario.object),
        contacts=ContactView(scene, f"{_ROOT}/contacts", len(frames), _SIZES_ON_HAND),
        lenses=LensView(scene, f"{_ROOT}/lenses", frames, scenario.finger_names, layout),
    )


def _full_scale(result: RunResult) -> FullScale:
    """Round numbers, so that arrows of similar runs compare; a short peak may be longer."""
    forces = np.abs(result.trace.normal_force)
    usual = max(float(np.median(forces)), 0.4 * float(forces.max()))
    speed = float(np.abs(result.trace.slip_velocity).max())
    return FullScale(
        nice_at_least(max(usual, _LEAST_FULL_FORCE)), nice_at_least(max(speed, _LEAST_FULL_SPEED))
    )


def _believed_friction(
    unknowns: tuple[str, ...], estimates: NDArray[np.float64], index: int
) -> float | None:
    """What the controller believes the friction of a contact to be, None if it knows it."""
    key = f"fingers.{index}.friction"
    return max(float(estimates[unknowns.index(key)]), 0.0) if key in unknowns else None


def _light(scene: viser.SceneApi) -> None:
    """Even light from the front, so that a colour on the hand is the colour of the legend."""
    scene.configure_default_lights(enabled=False, cast_shadow=False)
    scene.configure_environment_map(hdri=None)
    scene.add_light_ambient("/light/everywhere", intensity=2.2)
    scene.add_light_directional(
        "/light/front", intensity=1.6, position=(-0.6, -1.0, 1.4), cast_shadow=False
    )
