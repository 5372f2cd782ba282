"""Where the hand, the lenses above it and the camera go; plain geometry."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import ObjectParameters
from slipgrasp.core.scenario.geometry import joint_points, outline
from slipgrasp.web.model.sampling import Sampler
from slipgrasp.web.scene.view_plane import FRONT, ViewPlane

_MARGIN_LOW = np.array([0.24, 0.26])
_MARGIN_HIGH = np.array([0.24, 0.1])
_LARGEST_LENS = 0.6
_LENS_WIDTH = 0.44
_LENS_SHARE = 0.64
_LARGEST_MAGNIFICATION = 200.0


@dataclass(frozen=True, slots=True, eq=False)
class SceneLayout:
    """Places in the model's plane [m].

    Attributes:
        lens_centres: Middle of the lens of each contact, shape ``(contacts, 2)``.
        lens_radius: Radius of every lens.
        magnification: How much larger than life the lenses show the contacts.
        low: Lower left corner of everything drawn.
        high: Upper right corner of everything drawn.
        hand_high: Upper right corner of the hand, without the lenses above it.
    """

    lens_centres: NDArray[np.float64]
    lens_radius: float
    magnification: float
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    hand_high: NDArray[np.float64]

    @property
    def plane(self) -> ViewPlane:
        """The model's plane in the world."""
        return FRONT

    def corners(self, *, lenses: bool) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lower left and upper right corner of the picture, with the lenses or without [m]."""
        return self.low, self.high if lenses else self.hand_high


def lay_out(result: RunResult) -> SceneLayout:
    """Room for the hand below and one lens per contact above it.

    Args:
        result: The run whose first pose and largest slip decide places and magnification.
    """
    fingers = result.scenario.fingers
    start = Sampler(result.trace[:1]).at(0.0)
    joints = [joint_points(f, q) for f, q in zip(fingers, start.joint_positions, strict=True)]
    points = np.concatenate([*joints, _corners(result.scenario.object, start.object_pose)])
    low = points.min(axis=0) - _MARGIN_LOW
    high = points.max(axis=0) + _MARGIN_HIGH
    width = high[0] - low[0]
    radius = min(_LENS_WIDTH * width / len(fingers), _LARGEST_LENS)
    middle = low[0] + width * (np.arange(len(fingers)) + 0.5) / len(fingers)
    height = high[1] + 0.08 + radius
    slip = float(np.abs(result.trace.slip).max())
    return SceneLayout(
        lens_centres=np.stack([middle, np.full(len(fingers), height)], axis=1),
        lens_radius=radius,
        magnification=lens_magnification(slip, radius),
        low=low,
        high=np.array([high[0], height + radius + 0.24]),
        hand_high=high,
    )


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
    return min(max(nice_at_most(wanted), 1.0), _LARGEST_MAGNIFICATION)


def nice_at_most(value: float) -> float:
    """The largest round number that is not above a positive value."""
    return max(number for number in _round_numbers(value) if number <= value * (1.0 + 1e-9))


def nice_at_least(value: float) -> float:
    """The smallest round number that is not below a positive value."""
    return min(number for number in _round_numbers(value) if number >= value * (1.0 - 1e-9))


def _round_numbers(value: float) -> list[float]:
    power = 10.0 ** math.floor(math.log10(value))
    return [step * power for step in (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0)]
