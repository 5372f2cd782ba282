"""A fingertip, or a body on a support or a rail: its trail, force and slip velocity."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, NamedTuple

import numpy as np

from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import CONE, PHASES
from slipgrasp.scene.rotations import Values
from slipgrasp.scene.states import States
from slipgrasp.web.model.colours import glow
from slipgrasp.web.scene.canvas import Canvas
from slipgrasp.web.scene.layout import FullScale
from slipgrasp.web.scene.marks import MarkSizes, Trail


class ContactMarks(NamedTuple):
    """Marks of one contact in the axes of its frame [m].

    Attributes:
        tip: Fingertip, relative to the initial contact point.
        force: Arrow of the force on the object, from the fingertip.
        motion: Ends of the arrow of the slip velocity, from the fingertip.
    """

    tip: Values
    force: Values
    motion: Values


class MovingMarks(ABC):
    """Draws the marks of one contact with a fixed set of nodes below a common one.

    Args:
        canvas: Adds the nodes.
        name: Name of the node at the initial contact point, with the axes of the marks.
        sizes: Sizes of the marks.
        trail_width: Width of the trail [m].
        pose: Position and orientation of that node in its parent.
    """

    def __init__(
        self, canvas: Canvas, name: str, sizes: MarkSizes, trail_width: float, **pose: Any
    ) -> None:
        self._canvas, self._name, self._sizes = canvas, name, sizes
        canvas.add_frame(name, **pose)
        self._trail = canvas.add_lines(f"{name}/trail", CONE, trail_width)
        self._tip = canvas.add_frame(f"{name}/tip")
        self._ball = canvas.scene.add_icosphere(f"{name}/tip/ball", radius=sizes.tip_radius)
        # The force and the slip velocity, in one node because that is faster to move.
        self._arrows = canvas.add_arrows(f"{name}/tip/arrows", 2, sizes.shaft_radius)
        self._phase: ContactPhase | None = None
        self._path = Trail(np.zeros((1, 1)))
        self._follow_tip = canvas.follow(self._draw_tip)
        self._follow_trail = canvas.follow(self._draw_trail)
        self._follow_arrows = canvas.follow(self._draw_arrows)

    def update(
        self, states: States, i: int, full: FullScale, _believed: float | None, trail: Trail
    ) -> None:
        """Shows the contact in a single state.

        Args:
            states: The state.
            i: Index of the contact.
            full: Quantities with an arrow of full length.
            _believed: The friction coefficient that the controller assumes, None if it knows the
                true one.
            trail: Path of the fingertip.
        """
        marks = self._marks(states, i, full)
        phase = ContactPhase(int(states.phases[0, i]))
        if phase is not self._phase:
            self._phase = phase
            self._colour(phase)
        self._follow_tip.follow(marks.tip)
        self._path = trail
        self._follow_trail.follow(trail.extent)
        force = np.zeros(3), marks.force
        # Without slip, the second arrow is hidden in the first.
        motion = force if phase is ContactPhase.STICK else marks.motion
        self._follow_arrows.follow(np.stack([*force, *motion]).reshape(2, 2, 3))

    @abstractmethod
    def _marks(self, states: States, i: int, full: FullScale) -> ContactMarks:
        """Positions of the marks in a single state."""

    def _colour(self, phase: ContactPhase) -> None:
        """Colours all marks by the phase."""
        self._ball.color = PHASES[phase]
        self._arrows.colors = np.array([glow(PHASES[phase])] * 2, dtype=np.uint8)

    def _draw_tip(self, tip: Values) -> None:
        self._tip.position = tip

    @abstractmethod
    def _draw_trail(self, _extent: Values) -> None:
        """Draws the path of the latest update."""

    @abstractmethod
    def _draw_arrows(self, arrows: Values) -> None:
        """Draws the arrows of force and slip velocity, ``(2, 2, 3)``."""
