"""Where a hand in space, the lenses above it and the camera go; plain geometry."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import (
    SpatialContact,
    base_corners,
    spatial_contact,
    spatial_joint_points,
)
from slipgrasp.web.model.spatial_sampling import SpatialSampler
from slipgrasp.web.scene.layout import lens_magnification, nice_at_least
from slipgrasp.web.scene.lens_places import box_around, place_lenses
from slipgrasp.web.scene.marks import FullScale
from slipgrasp.web.scene.space.solids import prism_edges, rotation_of
from slipgrasp.web.scene.view_plane import ViewPlane

Points = NDArray[np.float64]

_AZIMUTHS = np.radians(np.arange(-180.0, 180.0, 5.0))
_ELEVATION = math.radians(24.0)
_ASIDE = math.radians(14.0)
_MARGIN_LOW = np.array([0.2, 0.2])
_MARGIN_HIGH = np.array([0.2, 0.08])
_SLIP_SHARE = 0.62
_DISC_SHARE = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class SpatialLayout:
    """Places in the plane of the first look, right and up [m].

    Attributes:
        plane: That plane.
        lens_centres: Middle of the lens of each contact, shape ``(contacts, 2)``.
        lens_radius: Radius of every lens.
        magnification: How much larger than life the lenses show the contacts.
        disc_scale: Radius of a friction disc in a lens per limit of friction [m/N].
        low: Lower left corner of the picture.
        high: Its upper right corner.
        hand_low: Lower left corner of what is seen of the hand, without the lenses above it.
        hand_high: Upper right corner of that.
    """

    plane: ViewPlane
    lens_centres: Points
    lens_radius: float
    magnification: float
    disc_scale: float
    low: Points
    high: Points
    hand_low: Points
    hand_high: Points

    def corners(self, *, lenses: bool) -> tuple[Points, Points]:
        """Lower left and upper right corner of the picture, with the lenses or without [m]."""
        return (self.low, self.high) if lenses else (self.hand_low, self.hand_high)


def contacts_of(scenario: SpatialScenario) -> tuple[SpatialContact, ...]:
    """Anchor, tangents and normal of every contact, in the object's frame."""
    return tuple(spatial_contact(scenario.object, finger) for finger in scenario.fingers)


def lay_out_space(result: RunResult, full: FullScale, *, whole_hand: bool = False) -> SpatialLayout:
    """Room for the object and its fingertips below, and one lens per contact above them.

    Args:
        result: The run, whose motion and largest slip decide places and magnification.
        full: What an arrow of full length stands for.
        whole_hand: Whether there is room for the fingers too, as far as their pedestals.
    """
    scenario, trace = spatial(result), result.trace
    turn = rotation_of(trace.object_pose[0, 3:])
    plane = ViewPlane.seen_from(_best_azimuth(scenario, turn), _ELEVATION)
    corners = plane.project(_corners(scenario, trace.object_pose[0]))
    if whole_hand:
        low, high = _hand_box(result, plane, corners)
    else:
        radius = 0.5 * float(np.hypot(*np.ptp(corners, axis=0)))
        lag = trace.tracking_error[:, :3]
        path = plane.project(trace.object_pose[:, :3] + lag - trace.object_pose[0, :3])
        low, high = box_around(corners, path, plane.project(lag), radius)
    count = len(scenario.fingers)
    places = place_lenses(low, high, count)
    limits = trace.friction_coefficient.max() * full.force
    slip = np.linalg.norm(trace.slip.reshape(len(trace), count, 2), axis=2)
    return SpatialLayout(
        plane=plane,
        lens_centres=places.centres,
        lens_radius=places.radius,
        magnification=lens_magnification(float(slip.max()), _SLIP_SHARE * places.radius),
        disc_scale=_DISC_SHARE * places.radius / nice_at_least(max(float(limits), 1e-3)),
        low=places.low,
        high=places.high,
        hand_low=low,
        hand_high=high,
    )


def _corners(scenario: SpatialScenario, pose: Points) -> Points:
    """Corners of the object in a pose, shape ``(corners, 3)`` [m]."""
    body = prism_edges(np.array(base_corners(scenario.object)), scenario.object.height)
    return pose[:3] + body.reshape(-1, 3) @ rotation_of(pose[3:]).T


def _hand_box(result: RunResult, plane: ViewPlane, corners: Points) -> tuple[Points, Points]:
    """Corners of a box around object, fingers and pedestals at the start, in the plane [m]."""
    start = SpatialSampler(result.trace[:1]).at(0.0)
    joints = [
        plane.project(spatial_joint_points(finger, q))
        for finger, q in zip(spatial(result).fingers, start.joint_positions, strict=True)
    ]
    points = np.concatenate([*joints, corners])
    return points.min(axis=0) - _MARGIN_LOW, points.max(axis=0) + _MARGIN_HIGH


def spatial(result: RunResult) -> SpatialScenario:
    """The scenario of a run in space."""
    assert isinstance(result.scenario, SpatialScenario), "only runs in space come here"
    return result.scenario


def _best_azimuth(scenario: SpatialScenario, turn: Points) -> float:
    """From where one sees most of the contacts' faces, none of them behind its finger."""
    outward = np.array([-np.asarray(contact.normal) for contact in contacts_of(scenario)]) @ turn.T
    eyes = np.stack([np.cos(_AZIMUTHS), np.sin(_AZIMUTHS)], axis=1)
    facing = eyes @ outward[:, :2].T
    # A finger that points at the eye hides its own contact; one at right angles shows none.
    shown = np.where(facing > 0.0, facing * (1.0 - facing**2), 0.0).sum(axis=1)
    # Between equals, the one nearest to the front of hands in the plane.
    front = 1e-6 * (eyes @ np.array([-0.1, -1.0]))
    return float(_AZIMUTHS[int(np.argmax(shown + front))]) + _ASIDE
