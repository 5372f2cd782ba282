"""The symbol of the centre of mass of a planar object: a disc with two dark quarters."""

from __future__ import annotations

import math

from matplotlib.axes import Axes
from matplotlib.patches import Circle, Wedge

from slipgrasp.figures.style import paint
from slipgrasp.recordings.palette import JOINT
from slipgrasp.scene.rotations import Values, about_z

_SHARE = 0.22  # of the distance to the nearest face
_STARTS = (0.0, 180.0)  # of the quarters [degrees]
_ORIGIN = (0.0, 0.0)


class CentreMark:
    """The symbol, which moves and turns with the object.

    Args:
        axes: The picture of the hand.
        inner_radius: Distance from the centre of mass to the nearest face [m].
        poses: Poses of the object at the times to draw: position [m] and unit quaternion (w, x, y,
            z), about z alone, shape ``(times, 7)``.
    """

    def __init__(self, axes: Axes, inner_radius: float, poses: Values) -> None:
        self._poses = poses
        dark, radius = paint(JOINT), _SHARE * inner_radius
        self._disc = Circle(_ORIGIN, radius, fc="white", ec=dark, lw=0.8, zorder=1.5)
        self._quarters = [
            Wedge(_ORIGIN, radius, start, start + 90.0, fc=dark, lw=0.0, zorder=1.6)
            for start in _STARTS
        ]
        self.artists = (self._disc, *self._quarters)
        for artist in self.artists:
            axes.add_patch(artist)

    def place(self, frame: int) -> None:
        """Shows a frame."""
        pose = self._poses[frame]
        centre, turn = pose[:2], math.degrees(about_z(pose[3:]))
        self._disc.set(center=centre)
        for quarter, start in zip(self._quarters, _STARTS, strict=True):
            quarter.set(center=centre, theta1=start + turn, theta2=start + turn + 90.0)
