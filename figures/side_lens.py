"""A contact of a planar hand magnified, seen from the side, in the axes of the object.

The fingertip is outside; the friction cone, the contact force and the part of the face that the
fingertip slipped along are inside.
"""

from __future__ import annotations

import math

import numpy as np
from matplotlib.patches import Circle, Patch, Polygon, Wedge

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.figures.hand_motion import HandMotion
from slipgrasp.figures.marks import arrow_outline
from slipgrasp.figures.moving_lens import MovingLens
from slipgrasp.figures.panels import lighter
from slipgrasp.figures.style import paint
from slipgrasp.recordings.palette import CONE, JOINT, LENS, LINK, OBJECT, OBJECT_EDGE, PHASES, Rgb
from slipgrasp.scene.parts import force_in
from slipgrasp.scene.patches import FacePatch
from slipgrasp.scene.rotations import Values, about_z
from slipgrasp.scene.skeleton import Contact
from slipgrasp.scene.states import States, drawable

# In radii of the close-up.
_BALL, _LINK_WIDTH, _TRAIL = 0.09, 0.13, 0.1
_CONE_LENGTH, _FORCE_LENGTH, _SHAFT, _HEAD = 0.58, 0.65, 0.05, 0.15

_WAYS = ContactPhase.SLIP_BACKWARD, ContactPhase.SLIP_FORWARD
_LEAST_FORCE = 1e-9  # [N]


class SideLens(MovingLens):
    """A contact of a planar hand, seen from the side."""

    words_at = -1.3
    background = LENS

    def _water(self, patch: FacePatch, contact: Contact) -> Patch:
        (middle,) = patch.centre
        ends = self.scale * (middle + patch.radius * np.array([-1.0, 1.0]))
        face = ends[:, None] * -contact.axes[:2, 0]
        return Polygon(np.concatenate([face, face[::-1] + _TRAIL * contact.axes[:2, 1]]))

    def _add_parts(
        self, result: RunResult, contact: Contact, index: int, motion: HandMotion
    ) -> None:
        states = motion.states
        self._tangent, self._inward = -contact.axes[:2, 0], contact.axes[:2, 1]
        slips = self.scale * drawable(result.trace.slip[:, index])
        self._farthest = np.minimum.accumulate(slips), np.maximum.accumulate(slips)
        self._spots = self.scale * states.slip[:, index, 0]
        self._friction = states.friction[:, index]
        self._forces = _forces(states, index, contact)
        self._outward = _directions_of_link(motion, index, contact)
        middle = math.degrees(math.atan2(self._inward[1], self._inward[0]))
        inside = Wedge((0.0, 0.0), 1.0, middle - 90, middle + 90, fc=paint(OBJECT), zorder=10.05)
        self.patch(inside)
        self._cone = self.polygon(10.1, fc=paint(lighter(CONE, 0.45)), alpha=0.6, lw=0.0)
        self._trails = [self.polygon(10.2, fc=paint(PHASES[way]), lw=0.0) for way in _WAYS]
        face = self.line(10.25, color=paint(OBJECT_EDGE), linewidth=1.2)
        face.set_data(*np.stack([-self._tangent, self._tangent]).T)
        self._link = self.polygon(10.3, fc=paint(LINK), lw=0.0)
        self._ball = self.patch(Circle((0.0, 0.0), _BALL, ec=paint(JOINT), lw=0.6, zorder=10.4))
        self._force = self.polygon(10.5, lw=0.0)

    def _move(self, frame: int, colour: Rgb) -> None:
        tangent, inward = self._tangent, self._inward
        slip, last = float(self._spots[frame]), max(int(self._rows[frame]) - 1, 0)
        lowest, highest = (float(slips[last]) for slips in self._farthest)
        ends = min(lowest, slip, 0.0), max(highest, slip, 0.0)
        for trail, end in zip(self._trails, ends, strict=True):
            face = np.stack([np.zeros(2), end * tangent])
            trail.set_xy(np.concatenate([face, face[::-1] + _TRAIL * inward]))
        tip = slip * tangent
        ball = tip - _BALL * inward
        sides = [inward + sign * self._friction[frame] * tangent for sign in (1.0, -1.0)]
        reach = _CONE_LENGTH / math.hypot(1.0, self._friction[frame])
        self._cone.set_xy(np.stack([tip, *(tip + reach * side for side in sides)]))
        aside = 0.5 * _LINK_WIDTH * self._outward[frame, ::-1] * [-1.0, 1.0]
        end = ball + 2.0 * self._outward[frame]
        self._link.set_xy(np.stack([ball + aside, end + aside, end - aside, ball - aside]))
        self._ball.set(center=ball, facecolor=paint(colour))
        self._force.set_xy(arrow_outline(tip, _FORCE_LENGTH * self._forces[frame], _SHAFT, _HEAD))
        self._force.set_facecolor(paint(colour))


def _forces(states: States, index: int, contact: Contact) -> Values:
    """Forces on the object in its axes, in the largest of all contacts, ``(times, 2)``."""
    tangential, normal = states.tangential_force[..., 0], states.normal_force
    largest = max(float(np.hypot(tangential, normal).max()), _LEAST_FORCE)
    return force_in(contact, index, states)[:, :2] / largest @ contact.axes[:2, :2].T


def _directions_of_link(motion: HandMotion, index: int, contact: Contact) -> Values:
    """Unit vectors from the fingertip along its last link, in the object's axes, ``(times, 2)``."""
    if contact.on_slides:
        return np.tile(-contact.axes[:2, 1], (len(motion.states.times), 1))
    along = motion.joints[:, index, -2] - motion.joints[:, index, -1]
    turns = about_z(motion.states.object_pose[:, 3:])
    angles = np.arctan2(along[:, 1], along[:, 0]) - turns
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)
