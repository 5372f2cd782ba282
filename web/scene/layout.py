"""What the camera looks at, and the scales of arrows and close-ups; plain geometry."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import PLANAR, SPATIAL, Scenario
from slipgrasp.scene import parts, rotations, skeleton
from slipgrasp.scene.states import States, states_of
from slipgrasp.web.scene.boxes import box_around, with_close_ups
from slipgrasp.web.scene.view_plane import FRONT, ViewPlane

Points = NDArray[np.float64]

_AZIMUTHS = np.radians(np.arange(-180.0, 180.0, 5.0))
_ELEVATION, _ASIDE = math.radians(24.0), math.radians(14.0)
_MARGIN_LOW = np.array([0.24, 0.26])
_MARGIN_HIGH = np.array([0.24, 0.1])
_SLIP_SHARES = {PLANAR: 0.64, SPATIAL: 0.4}
"""Of the radius of a close-up, filled by the largest slip of a run."""
_PAD_SHARE = 0.9  # of it, where the pad of a soft fingertip is drawn around the slip
_LEAST_REACH = 2e-5
_MOST_LAG = 4.0  # radii of the object; close-ups do not make way for what is farther off
_POSES, _BOX = 6, np.array(list(itertools.product((0, 1), repeat=3)))
_LEAST_FULL_FORCE = 1.0
_LEAST_FULL_SPEED = 1e-3


class FullScale(NamedTuple):
    """What an arrow of full length stands for: a force [N], a slip velocity [m/s]."""

    force: float
    speed: float


@dataclass(frozen=True, slots=True, eq=False)
class SceneLayout:
    """What is seen at first, and the scales of what is drawn.

    Attributes:
        plane: The plane of the first look; of a planar hand its own. Corners are in it [m].
        full: What an arrow of full length stands for.
        reach: Radius of what a close-up shows of a face [m].
        tick: Length of the scale below a close-up [m].
        limit: A round number above the largest limit of friction [N].
        held: Points around the object wherever it is or should be, in the world, ``(k, 3)`` [m].
        low: Lower left corner of the view.
        high: Its upper right corner.
        hand_low: Lower left corner of what is seen of the hand, without the close-ups above it.
        hand_high: Upper right corner of that.
    """

    plane: ViewPlane
    full: FullScale
    reach: float
    tick: float
    limit: float
    held: Points
    low: Points
    high: Points
    hand_low: Points
    hand_high: Points

    def corners(self, *, lenses: bool) -> tuple[Points, Points]:
        """Lower left and upper right corner of the view, with the close-ups or without [m]."""
        return (self.low, self.high) if lenses else (self.hand_low, self.hand_high)


def lay_out(result: RunResult, *, whole_hand: bool = False) -> SceneLayout:
    """The area of the object and its fingertips below, and space for close-ups above them.

    Args:
        result: The run, whose motion and largest slip decide places and scales.
        whole_hand: Whether the area includes the fingers, as far as their mounts.
    """
    scenario, trace, full = result.scenario, result.trace, full_scale(result)
    count = len(scenario.fingers)
    plane = _first_look(scenario, states_of(trace[:1]))
    hand_low, hand_high = (_hand_box if whole_hand else _grasp_box)(result, plane)
    low, high = with_close_ups(hand_low, hand_high, count)
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
        low=low,
        high=high,
        hand_low=hand_low,
        hand_high=hand_high,
    )


def reach_and_tick(scenario: Scenario, largest_slip: float) -> tuple[float, float]:
    """Radius of what close-ups show, and the round slip of their scale [m].

    Args:
        scenario: The hand.
        largest_slip: Largest displacement along a face [m].
    """
    pads = [each.pad.radius for each in skeleton.contacts_of(scenario) if each.pad is not None]
    share = _PAD_SHARE if pads else _SLIP_SHARES[scenario.space]
    reach = close_up_reach(largest_slip + max(pads, default=0.0), share)
    return reach, nice_at_most(0.5 * reach)


def full_scale(result: RunResult) -> FullScale:
    """What arrows of full length stand for.

    Round numbers, so that arrows of similar runs compare; a short peak may be longer.
    """
    forces = np.abs(result.trace.normal_force)
    usual = max(float(np.median(forces, axis=0).max()), 0.4 * float(forces.max()))
    speed = float(np.abs(result.trace.slip_velocity).max())
    return FullScale(
        nice_at_least(max(usual, _LEAST_FULL_FORCE)), nice_at_least(max(speed, _LEAST_FULL_SPEED))
    )


def _grasp_box(result: RunResult, plane: ViewPlane) -> tuple[Points, Points]:
    """Corners of a box around the object wherever it should be, and its fingertips [m]."""
    poses = _object_poses(result.scenario, states_of(result.trace))
    actual, desired = (
        plane.project(poses[name][0]) for name in (skeleton.OBJECT, skeleton.DESIRED)
    )
    corners = plane.project(_corners(result.scenario, *poses[skeleton.OBJECT]))
    radius = 0.5 * float(np.hypot(*np.ptp(corners, axis=0)))
    return box_around(corners, desired - actual[0], desired - actual, radius)


def _hand_box(result: RunResult, plane: ViewPlane) -> tuple[Points, Points]:
    """Corners of a box around object, fingers and mounts at the start [m]."""
    frames = skeleton.frames_of(result.scenario)
    poses = skeleton.world_poses(frames, states_of(result.trace[:1]))
    joints = [poses[frame.name][0] for frame in frames if frame.name.startswith("finger_")]
    corners = _corners(result.scenario, *poses[skeleton.OBJECT])
    points = plane.project(np.concatenate([*joints, corners]))
    return points.min(axis=0) - _MARGIN_LOW, points.max(axis=0) + _MARGIN_HIGH


def _object_poses(scenario: Scenario, states: States) -> dict[str, tuple[Points, Points]]:
    names = (skeleton.PLANE, skeleton.OBJECT, skeleton.DESIRED)
    frames = [frame for frame in skeleton.frames_of(scenario) if frame.name in names]
    return skeleton.world_poses(frames, states)


def _corners(scenario: Scenario, positions: Points, turns: Points) -> Points:
    """Corners of the object in the first of some poses, shape ``(2 corners, 3)`` [m]."""
    solid = parts.solid(scenario, parts.sizes_of(scenario).half_depth)
    return positions[0] + solid.points @ turns[0].T


def _first_look(scenario: Scenario, start: States) -> ViewPlane:
    """From where one sees most of the contacts' faces, none behind its finger; a plane upright."""
    if skeleton.ROOTS[scenario.space] == skeleton.PLANE:
        return FRONT
    normals = np.array([each.axes @ each.inward for each in skeleton.contacts_of(scenario)])
    outward = -normals @ rotations.matrices(start.object_pose[0, 3:]).T
    eyes = np.stack([np.cos(_AZIMUTHS), np.sin(_AZIMUTHS)], axis=1)
    facing = eyes @ outward[:, :2].T
    # A finger that points at the eye hides its own contact; one at right angles shows none.
    shown = np.where(facing > 0.0, facing * (1.0 - facing**2), 0.0).sum(axis=1)
    # Between equals, the one nearest to the front of planar hands.
    front = 1e-6 * (eyes @ np.array([-0.1, -1.0]))
    return ViewPlane.seen_from(float(_AZIMUTHS[int(np.argmax(shown + front))]) + _ASIDE, _ELEVATION)


def _held_points(result: RunResult) -> Points:
    """Corners of a box around the object at some instants, and where it should be then [m]."""
    trace, scenario = result.trace, result.scenario
    some = trace[np.unique(np.linspace(0, len(trace) - 1, _POSES).astype(int))]
    poses = _object_poses(scenario, states_of(some))
    solid = parts.solid(scenario, parts.sizes_of(scenario).half_depth).points
    low, high = solid.min(axis=0), solid.max(axis=0)
    box = low + _BOX * (high - low)
    farthest = _MOST_LAG * float(np.linalg.norm(box, axis=1).max())
    desired, _ = poses[skeleton.DESIRED]
    points = []
    for name in (skeleton.OBJECT, skeleton.DESIRED):
        places, turns = poses[name]
        near = np.abs(places - desired).max(axis=1) <= farthest
        points.append(places[near, None] + box @ turns[near].swapaxes(1, 2))
    return np.concatenate(points).reshape(-1, 3)


def close_up_reach(largest_slip: float, share: float) -> float:
    """The round radius of what a close-up shows, of which the largest slip fills a share [m].

    Args:
        largest_slip: Largest displacement along a face in the run, with the pad of a soft fingertip
            around it [m].
        share: Of the radius of a close-up.
    """
    return nice_at_least(max(largest_slip / share, _LEAST_REACH))


def nice_at_most(value: float) -> float:
    """The largest round number that is not above a positive value."""
    return max(number for number in _round_numbers(value) if number <= value * (1.0 + 1e-9))


def nice_at_least(value: float) -> float:
    """The smallest round number that is not below a positive value."""
    return min(number for number in _round_numbers(value) if number >= value * (1.0 - 1e-9))


def _round_numbers(value: float) -> list[float]:
    power = 10.0 ** math.floor(math.log10(value))
    return [step * power for step in (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0)]
