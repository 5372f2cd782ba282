"""Dragging the object with the mouse: the farther, the stronger the push."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import viser

from slipgrasp.core.scenario.field_errors import template_keys
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.scenario import DragObject, LetGo

_DIGITS = 2
"""Of the largest part of a force; the others are shown as finely."""
_GENTLE = 0.08
"""Length of the arrow over the way of the mouse. A longer one would mean that a short way of the
mouse is a force that no grasp withstands: the object would be lost at the first try."""


class Draggable(NamedTuple):
    """What of a picture can be dragged.

    Attributes:
        node: The object.
        newtons_per_metre: How strong a push is whose arrow is one metre long [N/m].
        axes: Which of viser's axes are those of the model, in its order.
    """

    node: viser.MeshHandle
    newtons_per_metre: float
    axes: tuple[int, ...]


class ObjectDrag:
    """Shows the force with which the user drags the object.

    Args:
        send: Takes the intents.
    """

    def __init__(self, send: Send) -> None:
        self._send = send
        self._dragged: Draggable | None = None
        self._held_at = np.zeros(3)

    def follow(self, dragged: Draggable) -> None:
        """Listens to the object as it is drawn now."""
        if self._dragged is None or self._dragged.node is not dragged.node:
            dragged.node.on_drag("left")(self._hear)
        self._dragged = dragged

    # What viser calls without `async` may come in another order than the mouse moved.
    async def _hear(self, event: viser.SceneNodeDragEvent[viser.MeshHandle]) -> None:
        if self._dragged is None:
            return
        if event.phase == "start":
            # Later events say where the held point is then: the object may still play on.
            self._held_at = np.array(event.start_position)
        way = np.subtract(event.end_position, self._held_at)[list(self._dragged.axes)]
        force = _force_of(_GENTLE * self._dragged.newtons_per_metre * way)
        self._send(LetGo(force) if event.phase == "end" else DragObject(force))


def _force_of(newtons: np.ndarray) -> tuple[float, ...]:
    """A force in few digits that a push may have; none if a viewer sends what is no number."""
    largest = float(np.abs(newtons).max())
    if not 0.0 < largest < math.inf:
        return (0.0,) * len(newtons)
    bounds = template_keys()["pulses.0.force.0"]
    within = np.clip(newtons, bounds.minimum, bounds.maximum)
    decimals = _DIGITS - 1 - math.floor(math.log10(np.abs(within).max()))
    return tuple(round(each, decimals) for each in within.tolist())
