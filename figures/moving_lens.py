"""A magnified contact at successive times.

The face is fixed and the fingertip moves on it; the rim has the colour of the phase.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, TypeVar

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Polygon

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.scenario import is_there
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.core.words.phrases import length_words
from slipgrasp.figures.hand_motion import HandMotion
from slipgrasp.figures.marks import empty_line
from slipgrasp.figures.panels import lighter
from slipgrasp.figures.style import paint
from slipgrasp.recordings.palette import MUTED, OBJECT, PHASES, WATER, Rgb
from slipgrasp.scene.patches import FacePatch, patches_on
from slipgrasp.scene.rotations import Values
from slipgrasp.scene.skeleton import Contact, contacts_of

AnyPatch = TypeVar("AnyPatch", bound=Patch)
Box = tuple[float, float, float, float]
"""Left, bottom, width and height as fractions of the image."""

_REACH, _EXTENT = 0.62, 1.15  # in radii of the close-up
_LEAST_SLIP = 1e-6  # smallest extent shown at full size [m]


class MovingLens(ABC):
    """Draws one contact at successive times.

    Args:
        hand: The picture of the hand, which gets a line to the fingertip.
        result: A run of a hand.
        contact: Index of the contact.
        motion: Positions at the times to draw.
        box: The place of the close-up.
    """

    words_at = -0.63  # radii above its centre
    background = lighter(OBJECT, 0.4)

    def __init__(
        self, hand: Axes, result: RunResult, contact: int, motion: HandMotion, box: Box
    ) -> None:
        trace, states = result.trace, motion.states
        contacts = contacts_of(result.scenario)
        pads = [each.pad.radius for each in contacts if each.pad is not None]
        extent = float(np.abs(trace.slip).max()) + max(pads, default=0.0)
        self.scale = _REACH / max(extent, _LEAST_SLIP)
        self._slid = motion.slip[:, contact]
        self._phases = states.phases[:, contact]
        self._rows = np.searchsorted(trace.times, states.times, side="right")
        self._name = result.scenario.finger_names[contact]
        self._hand, self._tips = hand, motion.joints[:, contact, -1]
        self._leader = empty_line(hand, 9.0, color=paint(MUTED), linewidth=0.6)
        self.axes = hand.figure.add_axes(box)
        self.axes.set_axis_off()
        self.axes.set_aspect("equal")
        self.axes.set_xlim(-_EXTENT, _EXTENT)
        self.axes.set_ylim(min(-_EXTENT, self.words_at - 0.15), _EXTENT)
        background = paint(self.background)
        self._face = self.axes.add_patch(Circle((0.0, 0.0), 1.0, fc=background, lw=0.0, zorder=10))
        self._times = states.times
        self._patches = [
            (each, self.axes.add_patch(self._water(each, contacts[contact])))
            for each in patches_on(result.scenario, contact)
        ]
        for _, water in self._patches:
            water.set(facecolor=paint(WATER), linewidth=0.0, zorder=10.07)
        self._drawn: list[Artist] = [water for _, water in self._patches]
        self._add_parts(result, contacts[contact], contact, motion)
        for part in self._drawn:
            part.set_clip_path(self._face)
        self._rim = self.axes.add_patch(Circle((0.0, 0.0), 1.0, fill=False, lw=2.0, zorder=10.6))
        self._words = self.axes.text(
            0.0,
            self.words_at,
            "",
            ha="center",
            va="center",
            fontsize=7.0,
            linespacing=1.0,
            zorder=10.7,
        )

    @property
    def artists(self) -> tuple[Artist, ...]:
        """All artists, fixed ones too, from back to front, to cover the fingers."""
        return (self._leader, self._face, *self._drawn, self._rim, self._words)

    def place(self, frame: int) -> None:
        """Shows a frame."""
        phase = ContactPhase(int(self._phases[frame]))
        self._rim.set_edgecolor(paint(PHASES[phase]))
        self._words.set_text(f"{self._name}\n{length_words(abs(float(self._slid[frame])))}")
        in_image = self._hand.transData
        tip = in_image.transform(self._tips[frame])
        ends = in_image.inverted().transform([self._nearest(tip), tip])
        self._leader.set_data(*ends.T)
        for each, water in self._patches:
            water.set_visible(is_there(each.patch, float(self._times[frame])))
        self._move(frame, PHASES[phase])

    def _nearest(self, point: Values) -> Values:
        """The point of its rim nearest to a point of the image [px]."""
        middle, right = self.axes.transData.transform([(0.0, 0.0), (1.0, 0.0)])
        away = point - middle
        return middle + (right[0] - middle[0]) / max(float(np.hypot(*away)), 1.0) * away

    @abstractmethod
    def _water(self, patch: FacePatch, contact: Contact) -> Patch:
        """The outline of a low-friction patch."""

    @abstractmethod
    def _add_parts(
        self, result: RunResult, contact: Contact, index: int, motion: HandMotion
    ) -> None:
        """Adds the parts inside the rim, from back to front."""

    @abstractmethod
    def _move(self, frame: int, colour: Rgb) -> None:
        """Moves the parts for a frame."""

    def line(self, zorder: float, **style: Any) -> Line2D:
        """Adds a line without points."""
        self._drawn.append(drawn := empty_line(self.axes, zorder, **style))
        return drawn

    def polygon(self, zorder: float, **style: Any) -> Polygon:
        """Adds a polygon to be placed later."""
        return self.patch(Polygon(np.zeros((4, 2)), zorder=zorder, **style))

    def patch(self, patch: AnyPatch) -> AnyPatch:
        """Adds a patch."""
        self._drawn.append(self.axes.add_patch(patch))
        return patch
