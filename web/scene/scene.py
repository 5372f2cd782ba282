"""The picture of a run at one instant, in the plane or in space; the only owner of scene nodes."""

from __future__ import annotations

import viser

from slipgrasp.core.run.result import RunResult
from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.model.sampling import Sample
from slipgrasp.web.model.spatial_sampling import AnySample, SpatialSample
from slipgrasp.web.scene.dragging import ObjectDrag
from slipgrasp.web.scene.layout import SceneLayout
from slipgrasp.web.scene.planar_picture import PlanarPicture
from slipgrasp.web.scene.space.layout import SpatialLayout
from slipgrasp.web.scene.space.picture import SpatialPicture

Stage = viser.ClientHandle | viser.ViserServer


class Scene:
    """Shows runs, one after another; a pale one beside it only if both are of one kind.

    Args:
        stage: Where the nodes go: one viewer, whose picture is its own, or a whole server.
        drag: Hears how the object is dragged; None where nobody can.
    """

    def __init__(self, stage: Stage, drag: ObjectDrag | None = None) -> None:
        self._drag = drag
        self._plane, self._space = PlanarPicture(stage), SpatialPicture(stage)
        self._appearance = Appearance()
        self._in_space = False
        _light(stage.scene)

    def show(
        self,
        result: RunResult,
        ghost: RunResult | None = None,
        appearance: Appearance | None = None,
    ) -> SceneLayout | SpatialLayout:
        """Takes a run; `update` then shows its instants.

        Args:
            result: The run.
            ghost: Another run that is drawn pale behind it.
            appearance: How it is drawn; as before if None.

        Returns:
            Where everything is, for the camera.
        """
        self._appearance = appearance or self._appearance
        in_space = result.scenario.in_space
        if in_space is not self._in_space:
            self.remove()
        self._in_space = in_space
        picture = self._space if in_space else self._plane
        pale = ghost if ghost is not None and ghost.scenario.in_space is in_space else None
        layout = picture.show(result, pale, self._appearance)
        if self._drag is not None and picture.draggable is not None:
            self._drag.follow(picture.draggable)
        return layout

    def update(
        self, sample: AnySample, ghost: AnySample | None = None, *, moving: bool = False
    ) -> None:
        """Shows an instant of the run, and one of the run that is drawn pale.

        Args:
            sample: The instant of the run.
            ghost: That of the run that is drawn pale, if there is one.
            moving: Whether others follow at once: then what nobody can see is left out.
        """
        if isinstance(sample, SpatialSample):
            pale = ghost if isinstance(ghost, SpatialSample) else None
            self._space.update(sample, pale, moving=moving)
        else:
            self._plane.update(sample, ghost if isinstance(ghost, Sample) else None, moving=moving)

    def remove(self) -> None:
        """Removes every node."""
        self._plane.remove()
        self._space.remove()


def _light(scene: viser.SceneApi) -> None:
    """Even light from the front, so that a colour on the hand is the colour of the legend."""
    scene.configure_default_lights(enabled=False, cast_shadow=False)
    scene.configure_environment_map(hdri=None)
    scene.add_light_ambient("/light/everywhere", intensity=2.2)
    scene.add_light_directional(
        "/light/front", intensity=1.6, position=(-0.6, -1.0, 1.4), cast_shadow=False
    )
