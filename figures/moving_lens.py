"""Close-up of a contact of a spatial hand in the plane of its face, seen from outside.

The initial contact point is at the centre and t_x points up. The limit of friction around the
fingertip has a constant size: a disc for the cone, a square for the pyramid; the line in it is the
friction on the object. The pad of a soft fingertip is a disc of its size, with a line that turns
with the fingertip.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon
from matplotlib.text import Text
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.spatial_geometry import friction_outline
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.core.words.phrases import length_words
from slipgrasp.figures.hand_motion import HandMotion
from slipgrasp.figures.panels import lighter
from slipgrasp.figures.slip_planes import in_plane
from slipgrasp.figures.style import paint
from slipgrasp.recordings.palette import CONE, JOINT, MARK, MUTED, OBJECT, PHASES
from slipgrasp.scene.skeleton import contacts_of
from slipgrasp.scene.states import States, drawable

Values = NDArray[np.float64]

# Fractions of the radius of the close-up.
_REACH, _LIMIT, _EXTENT = 0.62, 0.34, 1.15

# Positions of the close-ups as fractions of the image.
_LOW, _HIGH, _WIDTH = 0.37, 0.9, 0.2
_LEAST_SLIP = 1e-6  # that corresponds to the size of the close-up [m]


class _Parts(NamedTuple):
    face: Circle
    cross: Line2D
    pad: Circle
    hand: Line2D
    limit: Polygon
    way: Line2D
    friction: Line2D
    tip: Line2D
    rim: Circle
    words: Text


class MovingLens:
    """Draws one contact at successive times.

    Args:
        figure: The figure.
        result: A run of a spatial hand.
        contact: Index of the contact.
        motion: Positions at the times to draw.
    """

    def __init__(self, figure: Figure, result: RunResult, contact: int, motion: HandMotion) -> None:
        trace, states = result.trace, motion.states
        contacts = contacts_of(result.scenario)
        pads = [each.pad.radius for each in contacts if each.pad is not None]
        extent = float(np.abs(trace.slip).max()) + max(pads, default=0.0)
        self._scale = _REACH / max(extent, _LEAST_SLIP)
        pad = contacts[contact].pad
        self._radius = 0.0 if pad is None else self._scale * pad.radius
        self._hands = np.zeros_like(states.slip[:, contact])
        if pad is not None:
            self._hands = self._scale * pad.hand(states)[:, ::-1]
        self._way = self._scale * drawable(in_plane(trace.slip, contact))
        self._spots = self._scale * states.slip[:, contact, ::-1]
        self._slid = motion.slip[:, contact]
        self._share = _share_of_limit(states, contact)
        self._rows = np.searchsorted(trace.times, states.times, side="right")
        self._phases = states.phases[:, contact]
        height = min((_HIGH - _LOW) / len(result.scenario.fingers), _WIDTH)
        bottom = _HIGH - height * (contact + 1)
        self._axes = figure.add_axes((1.0 - _WIDTH, bottom, _WIDTH, height))
        self._axes.set_axis_off()
        self._axes.set_aspect("equal")
        self._axes.set_xlim(-_EXTENT, _EXTENT)
        self._axes.set_ylim(-_EXTENT, _EXTENT)
        self._name = result.scenario.finger_names[contact]
        self._outline = _LIMIT * friction_outline(result.scenario)
        self._parts = self._add_parts()

    def _add_parts(self) -> _Parts:
        """All artists move, from back to front, so that they cover the fingers."""
        face = Circle((0.0, 0.0), 1.0, fc=paint(lighter(OBJECT, 0.4)), lw=0.0, zorder=10.0)
        pad = Circle((0.0, 0.0), self._radius, alpha=0.4, lw=1.0, zorder=10.15)
        limit = Polygon(self._outline, fc=paint(lighter(CONE, 0.75)), ec=paint(CONE), lw=0.8)
        limit.set(alpha=0.7, zorder=10.2)
        rim = Circle((0.0, 0.0), 1.0, fill=False, lw=2.0, zorder=10.6)
        for patch in (face, pad, limit, rim):
            self._axes.add_patch(patch)
        pad.set_visible(self._radius > 0.0)

        def line(zorder: float, **style: Any) -> Line2D:
            (drawn,) = self._axes.plot([], [], zorder=zorder, **style)
            return drawn

        cross = line(10.1, color=paint(lighter(MUTED, 0.4)), linewidth=0.5)
        cross.set_data([-1.0, 1.0, np.nan, 0.0, 0.0], [0.0, 0.0, np.nan, -1.0, 1.0])
        way = line(10.3, color=paint(PHASES[ContactPhase.SLIP]), linewidth=2.0)
        hand = line(10.35, color=paint(JOINT), linewidth=1.2, visible=self._radius > 0.0)
        friction = line(10.4, color=paint(CONE), linewidth=1.8)
        tip = line(10.5, marker="o", markersize=4.5, mec=paint(MARK), mew=0.6)
        words = self._axes.text(
            0.0, -0.63, "", ha="center", va="center", fontsize=7.5, linespacing=0.9, zorder=10.7
        )
        return _Parts(face, cross, pad, hand, limit, way, friction, tip, rim, words)

    @property
    def artists(self) -> tuple[Artist, ...]:
        """The moving artists."""
        return self._parts

    def place(self, frame: int) -> None:
        """Shows one time."""
        parts, spot = self._parts, self._spots[frame]
        colour = paint(PHASES[ContactPhase(int(self._phases[frame]))])
        parts.rim.set_edgecolor(colour)
        parts.tip.set_markerfacecolor(colour)
        parts.tip.set_data(*spot[:, None])
        parts.pad.set(center=spot, facecolor=colour, edgecolor=colour)
        parts.hand.set_data(*np.stack([spot, spot + self._hands[frame]]).T)
        parts.limit.set_xy(spot + self._outline)
        parts.way.set_data(*np.concatenate([self._way[: self._rows[frame]], spot[None]]).T)
        parts.friction.set_data(*np.stack([spot, spot + _LIMIT * self._share[frame]]).T)
        parts.words.set_text(f"{self._name}\n{length_words(float(self._slid[frame]))}")


def _share_of_limit(states: States, contact: int) -> Values:
    """Friction on the object divided by its limit, ``(times, 2)``; 0 without a limit."""
    limit = (states.friction * states.normal_force)[:, contact, None]
    force = -states.tangential_force[:, contact, ::-1]
    return np.divide(force, limit, out=np.zeros_like(force), where=limit > 0.0)
