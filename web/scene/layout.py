"""Where the hand and the lenses above it stand, and what the camera looks at; plain geometry."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import PLANAR, SPATIAL, Scenario
from slipgrasp.scene import parts, rotations, skeleton
from slipgrasp.scene.states import States, states_of
from slipgrasp.web.scene.lens_places import box_around, place_lenses
from slipgrasp.web.scene.view_plane import FRONT, ViewPlane

Points = NDArray[np.float64]

_AZIMUTHS = np.radians(np.arange(-180.0, 180.0, 5.0))
_ELEVATION, _ASIDE = math.radians(24.0), math.radians(14.0)
_MARGIN_LOW = np.array([0.24, 0.26])
_MARGIN_HIGH = np.array([0.24, 0.1])
_LENS_SHARE = 0.64
_SLIP_SHARES = {PLANAR: 1.0, SPATIAL: 0.62}  # of the lens
_PAD_SHARE = 1.4  # of the lens, where the pad of a soft fingertip is drawn around it
_DISC_SHARE = 0.5
_LARGEST_MAGNIFICATION = 200.0
_LENS_DEPTH = 0.12
"""How much nearer to the eye than a planar hand lenses are [m], so that no finger covers one."""
_LEAST_FULL_FORCE = 1.0
_LEAST_FULL_SPEED = 1e-3


class FullScale(NamedTuple):
    """What an arrow of full length stands for: a force [N], a slip velocity [m/s]."""

    force: float
    speed: float


@dataclass(frozen=True, slots=True, eq=False)
class SceneLayout:
    """Places in the plane of the first look, right and up [m].

    Attributes:
        plane: That plane; of a planar hand its own.
        lens_centres: Middle of the lens of each contact, shape ``(contacts, 2)``.
        lens_radius: Radius of every lens.
        magnification: How much larger than life the lenses show the contacts.
        full: What an arrow of full length stands for.
        disc_scale: Radius of the disc of friction in a lens per limit of friction [m/N].
        low: Lower left corner of the picture.
        high: Its upper right corner.
        hand_low: Lower left corner of what is seen of the hand, without the lenses above it.
        hand_high: Upper right corner of that.
    """

    plane: ViewPlane
    lens_centres: Points
    lens_radius: float
    magnification: float
    full: FullScale
    disc_scale: float
    low: Points
    high: Points
    hand_low: Points
    hand_high: Points

    @property
    def board_attitude(self) -> tuple[float, float, float, float]:
        """What turns the viewer's upright plane (x, depth away, z) into that of the lenses."""
        away = -np.array(self.plane.towards)
        return rotations.of_matrix(np.column_stack([self.plane.right, away, self.plane.up]))

    @property
    def board_place(self) -> tuple[float, float, float]:
        """The origin of the plane of the lenses; in front of a planar hand [m]."""
        return self.plane.place((0.0, 0.0), _LENS_DEPTH if self.plane == FRONT else 0.0)

    def corners(self, *, lenses: bool) -> tuple[Points, Points]:
        """Lower left and upper right corner of the picture, with the lenses or without [m]."""
        return (self.low, self.high) if lenses else (self.hand_low, self.hand_high)


def lay_out(result: RunResult, *, whole_hand: bool = False) -> SceneLayout:
    """The area of the object and its fingertips below, and one lens per contact above them.

    Args:
        result: The run, whose motion and largest slip decide places and magnification.
        whole_hand: Whether the area includes the fingers, as far as their mounts.
    """
    scenario, trace, full = result.scenario, result.trace, full_scale(result)
    count = len(scenario.fingers)
    plane = _first_look(scenario, states_of(trace[:1]))
    low, high = (_hand_box if whole_hand else _grasp_box)(result, plane)
    places = place_lenses(low, high, count)
    slip = np.linalg.norm(trace.slip.reshape(len(trace), count, -1), axis=2)
    pads = [each.pad.radius for each in skeleton.contacts_of(scenario) if each.pad is not None]
    radius = _PAD_SHARE if pads else _SLIP_SHARES[scenario.space]
    radius *= places.radius
    limit = max(float(trace.friction_coefficient.max() * full.force), 1e-3)
    return SceneLayout(
        plane=plane,
        lens_centres=places.centres,
        lens_radius=places.radius,
        magnification=lens_magnification(float(slip.max()) + max(pads, default=0.0), radius),
        full=full,
        disc_scale=_DISC_SHARE * places.radius / nice_at_least(limit),
        low=places.low,
        high=places.high,
        hand_low=low,
        hand_high=high,
    )


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


def lens_magnification(largest_slip: float, radius: float) -> float:
    """The round magnification at which the largest slip fills most of the lens's half.

    Args:
        largest_slip: Largest displacement along a face in the run, with the pad of a soft fingertip
            around it [m].
        radius: Radius of the lens [m].
    """
    wanted = _LENS_SHARE * radius / max(largest_slip, 1e-9)
    return min(nice_at_most(wanted), _LARGEST_MAGNIFICATION)


def nice_at_most(value: float) -> float:
    """The largest round number that is not above a positive value."""
    return max(number for number in _round_numbers(value) if number <= value * (1.0 + 1e-9))


def nice_at_least(value: float) -> float:
    """The smallest round number that is not below a positive value."""
    return min(number for number in _round_numbers(value) if number >= value * (1.0 - 1e-9))


def _round_numbers(value: float) -> list[float]:
    power = 10.0 ** math.floor(math.log10(value))
    return [step * power for step in (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0)]
