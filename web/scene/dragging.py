"""Dragging the object with the mouse; the force grows with the distance."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import viser

from slipgrasp.core.scenario.field_errors import template_keys
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.scenario import DragObject, LetGo

_DIGITS = 2
"""Resolution of forces, relative to the largest component."""
_GENTLE = 0.08
"""Ratio of arrow length to mouse distance; with a larger one, short drags would lose the object."""


class Draggable(NamedTuple):
    """The draggable object of a view.

    Attributes:
        node: The object.
        newtons_per_metre: Force of an arrow with a length of one metre [N/m].
        axes: viser's axes in the order of the model.
    """

    node: viser.MeshHandle
    newtons_per_metre: float
    axes: tuple[int, ...]


class ObjectDrag:
    """Shows the force of a drag.

    Args:
        send: Accepts the intents.
    """

    def __init__(self, send: Send) -> None:
        self._send = send
        self._dragged: Draggable | None = None
        self._held_at = np.zeros(3)
        self._newtons_per_metre = 0.0

    def follow(self, dragged: Draggable) -> None:
        """Listens to the current node of the object."""
        if self._dragged is None or self._dragged.node is not dragged.node:
            dragged.node.on_drag("left")(self._hear)
        self._dragged = dragged

    # viser may reorder calls of functions that are not `async`.
    async def _hear(self, event: viser.SceneNodeDragEvent[viser.MeshHandle]) -> None:
        if self._dragged is None:
            return
        if event.phase == "start":
            # Later events contain the current position of the held point: the object may still
            # move.
            self._held_at = np.array(event.start_position)
            # The arrows of the run that the drag causes may have another scale.
            self._newtons_per_metre = self._dragged.newtons_per_metre
        way = np.subtract(event.end_position, self._held_at)[list(self._dragged.axes)]
        force = _force_of(_GENTLE * self._newtons_per_metre * way)
        self._send(LetGo(force) if event.phase == "end" else DragObject(force))


def _force_of(newtons: np.ndarray) -> tuple[float, ...]:
    """Rounds a force to few digits within its limits; zero for invalid numbers."""
    largest = float(np.abs(newtons).max())
    if not 0.0 < largest < math.inf:
        return (0.0,) * len(newtons)
    bounds = template_keys()["pulses.0.force.0"]
    within = np.clip(newtons, bounds.minimum, bounds.maximum)
    decimals = _DIGITS - 1 - math.floor(math.log10(np.abs(within).max()))
    return tuple(round(each, decimals) for each in within.tolist())
