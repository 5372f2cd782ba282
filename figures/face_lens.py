"""A contact of a spatial hand magnified, seen from outside: t_y to the right, t_x upwards.

The limit curve of friction is centred at the fingertip and has a constant size; the line in it is
the friction on the object. The pad of a soft fingertip is a disc of its size, with a line that
turns with the fingertip.
"""

from __future__ import annotations

import numpy as np
from matplotlib.patches import Circle, Patch

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.spatial_geometry import friction_outline
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.figures.hand_motion import HandMotion
from slipgrasp.figures.moving_lens import MovingLens
from slipgrasp.figures.panels import lighter
from slipgrasp.figures.slip_planes import in_plane, share_of_limit
from slipgrasp.figures.style import paint
from slipgrasp.recordings.palette import CONE, JOINT, MARK, MUTED, PHASES, Rgb
from slipgrasp.scene.patches import FacePatch
from slipgrasp.scene.skeleton import Contact
from slipgrasp.scene.states import drawable

_LIMIT = 0.34  # radius of the limit curve in that of the close-up


class FaceLens(MovingLens):
    """A contact of a spatial hand, seen from outside."""

    def _water(self, patch: FacePatch, contact: Contact) -> Patch:
        up, right = patch.centre
        return Circle((self.scale * right, self.scale * up), self.scale * patch.radius)

    def _add_parts(
        self, result: RunResult, contact: Contact, index: int, motion: HandMotion
    ) -> None:
        states = motion.states
        self._way = self.scale * drawable(in_plane(result.trace.slip, index))
        self._spots = self.scale * states.slip[:, index, ::-1]
        self._share = share_of_limit(states, index, 0.0)
        radius, self._hands = 0.0, np.zeros_like(self._spots)
        if contact.pad is not None:
            radius = self.scale * contact.pad.radius
            self._hands = self.scale * contact.pad.hand(states)[:, ::-1]
        self._outline = _LIMIT * friction_outline(result.scenario)
        has_pad = radius > 0.0
        cross = self.line(10.1, color=paint(lighter(MUTED, 0.4)), linewidth=0.5)
        cross.set_data([-1.0, 1.0, np.nan, 0.0, 0.0], [0.0, 0.0, np.nan, -1.0, 1.0])
        pad = Circle((0.0, 0.0), radius, alpha=0.4, lw=1.0, zorder=10.15, visible=has_pad)
        self._pad = self.patch(pad)
        self._pointer = self.line(10.35, color=paint(JOINT), linewidth=1.2, visible=has_pad)
        self._limit = self.polygon(10.2, fc=paint(lighter(CONE, 0.75)), ec=paint(CONE), lw=0.8)
        self._limit.set_alpha(0.7)
        self._trail = self.line(10.3, color=paint(PHASES[ContactPhase.SLIP]), linewidth=2.0)
        self._friction = self.line(10.4, color=paint(CONE), linewidth=1.8)
        self._tip = self.line(10.5, marker="o", markersize=4.5, mec=paint(MARK), mew=0.6)

    def _move(self, frame: int, colour: Rgb) -> None:
        spot = self._spots[frame]
        self._tip.set_markerfacecolor(paint(colour))
        self._tip.set_data(*spot[:, None])
        self._pad.set(center=spot, facecolor=paint(colour), edgecolor=paint(colour))
        self._pointer.set_data(*np.stack([spot, spot + self._hands[frame]]).T)
        self._limit.set_xy(spot + self._outline)
        self._trail.set_data(*np.concatenate([self._way[: self._rows[frame]], spot[None]]).T)
        self._friction.set_data(*np.stack([spot, spot + _LIMIT * self._share[frame]]).T)
