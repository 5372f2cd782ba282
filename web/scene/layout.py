"""Target of the camera, and scales of arrows and close-ups; plain geometry."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import PLANAR, RAIL, SPATIAL, SUPPORT, Scenario
from slipgrasp.scene import rotations, skeleton
from slipgrasp.scene.rotations import Values
from slipgrasp.scene.sizes import sizes_of
from slipgrasp.scene.solids import solid
from slipgrasp.scene.states import States, states_of
from slipgrasp.web.scene.boxes import Box, box_around, with_close_ups
from slipgrasp.web.scene.view_plane import FRONT, ViewPlane

_AZIMUTHS = np.radians(np.arange(-180.0, 180.0, 5.0))
_ELEVATION, _ASIDE = math.radians(24.0), math.radians(14.0)
# Of a body on a support: from the front, a little from the left.
_AZIMUTH, _FROM_ABOVE = math.radians(-80.0), math.radians(42.0)
_MARGIN_LOW = np.array([0.24, 0.26])
_MARGIN_HIGH = np.array([0.24, 0.1])
_SLIP_SHARES = {PLANAR: 0.64, SPATIAL: 0.4, SUPPORT: 0.4, RAIL: 0.4}
"""Fraction of the radius of a close-up for the largest slip of a run."""
_PAD_SHARE = 0.9  # fraction if the pad of a soft fingertip is drawn around the slip
_LEAST_REACH = 2e-5
_MOST_LAG = 4.0  # radii of the object; close-ups do not avoid larger distances
_POSES, _BOX = 6, np.array(list(itertools.product((0, 1), repeat=3)))
_LEAST_FULL_FORCE = 1.0
_LEAST_FULL_SPEED = 1e-3


class FullScale(NamedTuple):
    """Quantities with an arrow of full length: a force [N], a slip velocity [m/s]."""

    force: float
    speed: float


@dataclass(frozen=True, slots=True, eq=False)
class SceneLayout:
    """The initial view, and the scales.

    Attributes:
        plane: The initial view plane, which contains the corners [m]; for a planar hand its plane.
        full: Quantities with an arrow of full length.
        reach: Radius of the visible part of a face in a close-up [m].
        tick: Length of the scale below a close-up [m].
        limit: A round number above the largest friction limit [N].
        held: Points around all actual and desired positions of the object, in the world, ``(k, 3)``
            [m].
        low: Lower left corner of the view.
        high: Its upper right corner.
        beside: Corners of a view with close-ups at the sides of the hand.
        hand: Corners of the visible part of the hand, without close-ups.
    """

    plane: ViewPlane
    full: FullScale
    reach: float
    tick: float
    limit: float
    held: Values
    low: Values
    high: Values
    beside: Box
    hand: Box

    def corners(self, *, lenses: bool) -> Box:
        """Corners of the view, with or without close-ups."""
        return (self.low, self.high) if lenses else self.hand

    def boxes(self, *, lenses: bool) -> tuple[Box, ...]:
        """The view, and with close-ups another for a low window; see `camera.frame_nearest`."""
        first = self.corners(lenses=lenses)
        return (first, self.beside) if lenses else (first,)


def lay_out(result: RunResult, *, whole_hand: bool = False) -> SceneLayout:
    """The area of the object and its fingertips below, and of the close-ups above.

    Args:
        result: The run, whose motion and largest slip determine positions and scales.
        whole_hand: Whether the area includes the fingers with their mounts.
    """
    scenario, trace, full = result.scenario, result.trace, full_scale(result)
    count = len(scenario.fingers)
    plane = _first_look(scenario, states_of(trace[:1]))
    box = _hand_box if whole_hand and scenario.space.has_control else _grasp_box
    hand = box(result, plane)
    whole, beside = with_close_ups(*hand, count) if scenario.space.has_hand else (hand, hand)
    slip = np.linalg.norm(trace.slip.reshape(len(trace), count, -1), axis=2)
    reach, tick = reach_and_tick(scenario, float(slip.max()))
    limit = max(float(trace.friction_coefficient.max() * full.force), 1e-3)
    return SceneLayout(
        plane=plane,
        full=full,
        reach=reach,
        tick=tick,
        limit=nice_at_least(limit),
        held=_held_points(result),
        low=whole[0],
        high=whole[1],
        beside=beside,
        hand=hand,
    )


def reach_and_tick(scenario: Scenario, largest_slip: float) -> tuple[float, float]:
    """Radius of close-ups, and the round slip of their scale [m].

    Args:
        scenario: The hand.
        largest_slip: Largest displacement along a face [m].
    """
    pads = [each.pad.radius for each in skeleton.contacts_of(scenario) if each.pad is not None]
    share = _PAD_SHARE if pads else _SLIP_SHARES[scenario.space]
    reach = close_up_reach(largest_slip + max(pads, default=0.0), share)
    return reach, nice_at_most(0.5 * reach)


def full_scale(result: RunResult) -> FullScale:
    """Quantities with arrows of full length.

    Round numbers, so that arrows of similar runs are comparable; short peaks may be longer.
    """
    trace = result.trace
    has_control = trace.shape.space.has_control
    forces = np.abs(trace.normal_force if has_control else trace.tangential_size)
    usual = max(float(np.median(forces, axis=0).max()), 0.4 * float(forces.max()))
    speed = float(np.abs(result.trace.slip_velocity).max())
    return FullScale(
        nice_at_least(max(usual, _LEAST_FULL_FORCE)), nice_at_least(max(speed, _LEAST_FULL_SPEED))
    )


def _grasp_box(result: RunResult, plane: ViewPlane) -> tuple[Values, Values]:
    """Corners of a box around all desired positions of the object, and its fingertips [m]."""
    poses = skeleton.world_poses(skeleton.body_frames(result.scenario), states_of(result.trace))
    actual, desired = (
        plane.project(poses[name][0]) for name in (skeleton.OBJECT, skeleton.DESIRED)
    )
    corners = plane.project(_corners(result.scenario, *poses[skeleton.OBJECT]))
    radius = 0.5 * float(np.hypot(*np.ptp(corners, axis=0)))
    return box_around(corners, desired - actual[0], desired - actual, radius)


def _hand_box(result: RunResult, plane: ViewPlane) -> tuple[Values, Values]:
    """Corners of a box around object, fingers and mounts at the start [m]."""
    frames = skeleton.frames_of(result.scenario)
    poses = skeleton.world_poses(frames, states_of(result.trace[:1]))
    joints = [poses[frame.name][0] for frame in frames if frame.name.startswith("finger_")]
    corners = _corners(result.scenario, *poses[skeleton.OBJECT])
    points = plane.project(np.concatenate([*joints, corners]))
    return points.min(axis=0) - _MARGIN_LOW, points.max(axis=0) + _MARGIN_HIGH


def _corners(scenario: Scenario, positions: Values, turns: Values) -> Values:
    """Corners of the object in the first of some poses, shape ``(2 corners, 3)`` [m]."""
    points = solid(scenario, sizes_of(scenario).half_depth).points
    return positions[0] + points @ turns[0].T


def _first_look(scenario: Scenario, start: States) -> ViewPlane:
    """The direction from which most contact faces are visible; a planar hand upright."""
    if scenario.space is SUPPORT:
        return ViewPlane.seen_from(_AZIMUTH, _FROM_ABOVE)
    if skeleton.ROOTS[scenario.space] == skeleton.PLANE:
        return FRONT
    normals = np.array([each.axes @ each.inward for each in skeleton.contacts_of(scenario)])
    outward = -normals @ rotations.matrices(start.object_pose[0, 3:]).T
    eyes = np.stack([np.cos(_AZIMUTHS), np.sin(_AZIMUTHS)], axis=1)
    facing = eyes @ outward[:, :2].T
    # A finger that points at the viewer hides its contact; a perpendicular one hides nothing.
    shown = np.where(facing > 0.0, facing * (1.0 - facing**2), 0.0).sum(axis=1)
    # Among equals, the one closest to the front of planar hands.
    front = 1e-6 * (eyes @ np.array([-0.1, -1.0]))
    return ViewPlane.seen_from(float(_AZIMUTHS[int(np.argmax(shown + front))]) + _ASIDE, _ELEVATION)


def _held_points(result: RunResult) -> Values:
    """Corners of a box around the actual and desired object at some instants [m]."""
    trace, scenario = result.trace, result.scenario
    some = trace[np.unique(np.linspace(0, len(trace) - 1, _POSES).astype(int))]
    poses = skeleton.world_poses(skeleton.body_frames(scenario), states_of(some))
    points = solid(scenario, sizes_of(scenario).half_depth).points
    low, high = points.min(axis=0), points.max(axis=0)
    box = low + _BOX * (high - low)
    farthest = _MOST_LAG * float(np.linalg.norm(box, axis=1).max())
    desired, _ = poses[skeleton.DESIRED]
    held = []
    for name in (skeleton.OBJECT, skeleton.DESIRED):
        places, turns = poses[name]
        near = np.abs(places - desired).max(axis=1) <= farthest
        held.append(places[near, None] + box @ turns[near].swapaxes(1, 2))
    return np.concatenate(held).reshape(-1, 3)


def close_up_reach(largest_slip: float, share: float) -> float:
    """The round radius of a close-up, of which the largest slip fills a fraction [m].

    Args:
        largest_slip: Largest displacement along a face in the run, including the pad of a soft
            fingertip [m].
        share: Fraction of the radius.
    """
    return nice_at_least(max(largest_slip / share, _LEAST_REACH))


def nice_at_most(value: float) -> float:
    """The largest round number that does not exceed a positive value."""
    return max(number for number in _round_numbers(value) if number <= value * (1.0 + 1e-9))


def nice_at_least(value: float) -> float:
    """The smallest round number that is not smaller than a positive value."""
    return min(number for number in _round_numbers(value) if number >= value * (1.0 - 1e-9))


def _round_numbers(value: float) -> list[float]:
    power = 10.0 ** math.floor(math.log10(value))
    return [step * power for step in (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0)]
