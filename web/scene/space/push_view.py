"""The push on an object in space: an arrow to its centre, and one along the axis of a twist."""

from __future__ import annotations

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.web.model.colours import PUSH, glow
from slipgrasp.web.scene.marks import FullScale, MarkSizes, push_words
from slipgrasp.web.scene.space.solids import triple

_PER_NEWTON_METRE = 10.0
_ROOM = 0.05
"""How far beyond an arrow its words stand [m]."""


class SpatialPushView:
    """Two arrows and how strong they are while the object is pushed.

    That of a moment is along its axis, by the right hand.

    Args:
        scene: Where the nodes go.
        name: Name of the node that they are below.
        sizes: Sizes of the marks.
    """

    def __init__(self, scene: viser.SceneApi, name: str, sizes: MarkSizes) -> None:
        self._length = 2.0 * sizes.force_length
        self._root = scene.add_frame(name, show_axes=False, visible=False)
        shaft = 1.6 * sizes.shaft_radius
        self._arrows = scene.add_arrows(
            f"{name}/arrows",
            np.zeros((2, 2, 3)),
            np.array([glow(PUSH)] * 2, dtype=np.uint8),
            shaft_radius=shaft,
            head_radius=2.6 * shaft,
            head_length=5.0 * shaft,
        )
        self._words = scene.add_label(f"{name}/words", "", anchor="center-center")
        self._shown: tuple[bytes, bool] | None = None

    def newtons_per_metre(self, full: FullScale) -> float:
        """How strong a force is whose arrow is one metre long [N/m]."""
        return full.force / self._length

    def update(
        self, centre: NDArray[np.float64], wrench: NDArray[np.float64], full: FullScale
    ) -> None:
        """Shows a force and a moment [N, N m] on an object at a place [m]."""
        acts = bool(np.any(wrench))
        if self._shown != (wrench.tobytes(), acts):
            self._shown = (wrench.tobytes(), acts)
            self._root.visible = acts
            metres = 1.0 / self.newtons_per_metre(full)
            force, moment = metres * wrench[:3], _PER_NEWTON_METRE * metres * wrench[3:]
            zero = np.zeros(3)
            ends = np.array([[-force, zero], [zero, moment if moment.any() else zero]])
            self._arrows.points = ends.astype(np.float32)
            self._words.text = push_words(*np.linalg.norm(wrench.reshape(2, 3), axis=1).tolist())
            end = -force if force.any() else moment
            self._words.position = triple(end * (1.0 + _ROOM / max(np.linalg.norm(end), 1e-9)))
        if acts:
            self._root.position = triple(centre)
