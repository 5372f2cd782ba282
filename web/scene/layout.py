"""Where the hand and the lenses above it stand, and what the camera looks at; plain geometry."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import ObjectParameters
from slipgrasp.core.scenario.geometry import joint_points, outline
from slipgrasp.web.model.sampling import Sampler
from slipgrasp.web.scene.lens_places import box_around, place_lenses
from slipgrasp.web.scene.view_plane import FRONT, ViewPlane

_MARGIN_LOW = np.array([0.24, 0.26])
_MARGIN_HIGH = np.array([0.24, 0.1])
_LENS_SHARE = 0.64
_LARGEST_MAGNIFICATION = 200.0


@dataclass(frozen=True, slots=True, eq=False)
class SceneLayout:
    """Places in the model's plane [m].

    Attributes:
        lens_centres: Middle of the lens of each contact, shape ``(contacts, 2)``.
        lens_radius: Radius of every lens.
        magnification: How much larger than life the lenses show the contacts.
        low: Lower left corner of the picture.
        high: Its upper right corner.
        hand_low: Lower left corner of what is seen of the hand, without the lenses above it.
        hand_high: Upper right corner of that.
    """

    lens_centres: NDArray[np.float64]
    lens_radius: float
    magnification: float
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    hand_low: NDArray[np.float64]
    hand_high: NDArray[np.float64]

    @property
    def plane(self) -> ViewPlane:
        """The model's plane in the world."""
        return FRONT

    def corners(self, *, lenses: bool) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lower left and upper right corner of the picture, with the lenses or without [m]."""
        return (self.low, self.high) if lenses else (self.hand_low, self.hand_high)


def lay_out(result: RunResult, *, whole_hand: bool = False) -> SceneLayout:
    """Room for the object and its fingertips below, and one lens per contact above them.

    Args:
        result: The run, whose motion and largest slip decide places and magnification.
        whole_hand: Whether there is room for the fingers too, as far as their mounts.
    """
    fingers = result.scenario.fingers
    low, high = _hand_box(result) if whole_hand else _grasp_box(result)
    places = place_lenses(low, high, len(fingers))
    slip = float(np.abs(result.trace.slip).max())
    return SceneLayout(
        lens_centres=places.centres,
        lens_radius=places.radius,
        magnification=lens_magnification(slip, places.radius),
        low=places.low,
        high=places.high,
        hand_low=low,
        hand_high=high,
    )


def _grasp_box(result: RunResult) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners of a box around the object wherever it should be, and its fingertips [m]."""
    trace, body = result.trace, result.scenario.object
    radius = float(np.hypot(*outline(body).T).max())
    start, lag = trace.object_pose[0], trace.tracking_error[:, :2]
    path = trace.object_pose[:, :2] + lag - start[:2]
    return box_around(_corners(body, start), path, lag, radius)


def _hand_box(result: RunResult) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners of a box around object, fingers and mounts at the start [m]."""
    start = Sampler(result.trace[:1]).at(0.0)
    pairs = zip(result.scenario.fingers, start.joint_positions, strict=True)
    joints = [joint_points(finger, q) for finger, q in pairs]
    points = np.concatenate([*joints, _corners(result.scenario.object, start.object_pose)])
    return points.min(axis=0) - _MARGIN_LOW, points.max(axis=0) + _MARGIN_HIGH


def _corners(body: ObjectParameters, pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Corners of the object in a pose, shape ``(corners, 2)`` [m]."""
    x, y, angle = pose.tolist()
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([x, y]) + outline(body) @ np.array([[cos, sin], [-sin, cos]])


def lens_magnification(largest_slip: float, radius: float) -> float:
    """The round magnification at which the largest slip fills most of the lens's half.

    Args:
        largest_slip: Largest displacement along a face in the run [m].
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
