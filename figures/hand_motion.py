"""Motion of a hand for animations: the scene in a parallel projection.

The object is the outline of its prism with the edges inside, a friction cone the outline of its rim
and tip. A planar hand is seen from the front. For a spatial hand the viewpoint minimizes occlusion
among fingertips, and of the object by fingers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.scenario import need_hand
from slipgrasp.core.scenario.spatial_geometry import friction_outline
from slipgrasp.scene import parts, rotations, skeleton
from slipgrasp.scene.rotations import Values
from slipgrasp.scene.sizes import sizes_of
from slipgrasp.scene.solids import edges_of, solid
from slipgrasp.scene.states import States, drawable, states_at

_ELEVATION = math.radians(24.0)
_ASIDE = math.radians(8.0)
_IN_FRONT = 0.5  # penalty of a finger in front of the object
_AZIMUTHS = np.radians(np.arange(-180.0, 180.0, 5.0))
_FRONT = np.array([(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)]).T
_CONE_CORNERS = 24
_LEAST_DEPTH = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HandMotion:
    """Points in the image plane over time [m].

    Attributes:
        states: Hand, object and contacts.
        corners: Outline of the object, shape ``(times, corners, 2)``.
        desired: Outline of the object in its desired pose, shape ``(times, corners, 2)``.
        edges: Edges of the object, shape ``(times, edges, 2, 2)``.
        joints: Base, joints and tip of each finger, shape ``(times, fingers, points, 2)``.
        normals: Unit vectors into the object, shape ``(times, contacts, 2)``.
        cones: Outlines of friction cones of unit height, from their tips, ``(times, contacts, k,
            2)``.
        forces: Forces on the object, shape ``(times, contacts, 2)`` [N].
        behind: Fingers that touch the object from behind, shape ``(contacts,)``.
        slip: Slips, or travelled distances of spatial hands, shape ``(times, contacts)`` [m].
    """

    states: States
    corners: Values
    desired: Values
    edges: Values
    joints: Values
    normals: Values
    cones: Values
    forces: Values
    behind: NDArray[np.bool_]
    slip: Values


def motion_of(result: RunResult, times: Values) -> HandMotion:
    """Samples a run at given times, with linear interpolation.

    Args:
        result: The run.
        times: Ascending times within the run, shape ``(times,)`` [s].
    """
    instead = "export CSV, Parquet or NPZ, or draw its figures: slipgrasp figures RUN"
    scenario = need_hand(result.scenario, "an image or animation", instead)
    trace = result.trace
    states, contacts = states_at(trace, times), skeleton.contacts_of(scenario)
    frames = skeleton.frames_of(scenario)
    poses = skeleton.world_poses(frames, states)
    flat = _FRONT
    if scenario.space.num_positions == 3:
        flat = _view(contacts, rotations.matrices(trace.object_pose[0, 3:]))
    axes = np.stack([poses[skeleton.contact_name(i)][1] for i in range(len(contacts))], axis=1)
    pairs = list(enumerate(contacts))
    rim = friction_outline(scenario, _CONE_CORNERS)
    friction = np.moveaxis(states.friction, 1, 0)[..., None, None]
    rims = np.stack([parts.cone_rim(each, rim, friction[i]) for i, each in pairs], axis=1)
    cones = np.concatenate([np.zeros_like(rims[:, :, :1]), rims], axis=2)
    forces = np.stack([parts.force_in(each, i, states) for i, each in pairs], axis=1)
    normals = np.stack([axes[:, i] @ each.inward for i, each in pairs], axis=1)
    corners, desired = (
        _corners(scenario, *poses[name]) @ flat for name in (skeleton.OBJECT, skeleton.DESIRED)
    )
    slips = drawable(trace.slip_of_contacts)
    return HandMotion(
        states=states,
        corners=_outlines(corners),
        desired=_outlines(desired),
        edges=corners[:, edges_of(scenario)],
        joints=_joints(frames, poses, len(contacts)) @ flat,
        normals=normals @ flat,
        cones=_outlines(np.einsum("tcij,tckj->tcki", axes, cones) @ flat),
        forces=np.einsum("tcij,tcj->tci", axes, forces) @ flat,
        behind=normals[0] @ np.cross(flat[:, 0], flat[:, 1]) > _LEAST_DEPTH,
        slip=np.stack([np.interp(times, trace.times, each) for each in slips.T], axis=1),
    )


def _corners(scenario: Scenario, position: Values, turn: Values) -> Values:
    """Corners of the object, ``(times, 2 corners, 3)``: bottom, then top."""
    points = solid(scenario, sizes_of(scenario).half_depth).points
    return position[:, None] + np.einsum("tij,cj->tci", turn, points)


def _joints(
    frames: list[skeleton.Frame], poses: dict[str, tuple[Values, Values]], count: int
) -> Values:
    """Origins of the links and the tip of each finger, ``(times, fingers, points, 3)``.

    If another finger has more links, the first point of a finger is repeated.
    """
    chains = [skeleton.frames_along(frames, i) for i in range(count)]
    most = max(map(len, chains))
    names = [chain[:1] * (most - len(chain)) + chain for chain in chains]
    points = [np.stack([poses[name][0] for name in chain], axis=1) for chain in names]
    return np.stack(points, axis=1)


def _view(contacts: tuple[skeleton.Contact, ...], attitude: Values) -> Values:
    """Right and up directions of the image as columns, ``(3, 2)``.

    Args:
        contacts: Contacts of a spatial hand.
        attitude: Initial rotation matrix of the object.
    """
    anchors = np.array([each.anchor for each in contacts]) @ attitude.T
    normals = np.array([each.axes @ each.inward for each in contacts]) @ attitude.T
    size = float(np.abs(anchors).max())

    def merit(azimuth: float) -> float:
        c, s = math.cos(azimuth), math.sin(azimuth)
        apart = float(np.diff(np.sort(anchors[:, :2] @ [c, s])).min()) / size
        in_front = float((normals[:, :2] @ [-s, c]).max())
        return round(apart - _IN_FRONT * in_front, 6)

    azimuth = float(max(_AZIMUTHS, key=merit)) + _ASIDE
    c, s = math.cos(azimuth), math.sin(azimuth)
    up = (-s * math.sin(_ELEVATION), c * math.sin(_ELEVATION), math.cos(_ELEVATION))
    return np.array([(c, s, 0.0), up]).T


def _outlines(points: Values) -> Values:
    """Convex outlines of sets of points ``(..., points, 2)``, the last corner repeated."""
    flat = points.reshape(-1, *points.shape[-2:])
    return np.stack([_outline(each) for each in flat]).reshape(points.shape)


def _outline(points: Values) -> Values:
    """Convex hulls, counterclockwise (Andrew's monotone chain), padded to the number of points."""
    ordered = sorted(map(tuple, points.tolist()))
    hull: list[tuple[float, ...]] = []
    for run in (ordered, ordered[::-1]):
        start = len(hull)
        for point in run:
            while len(hull) - start >= 2 and _turn(hull[-2], hull[-1], point) <= 0.0:
                hull.pop()
            hull.append(point)
        hull.pop()
    hull = hull or ordered[:1]
    return np.array(hull + hull[-1:] * (len(points) - len(hull)))


def _turn(a: tuple[float, ...], b: tuple[float, ...], c: tuple[float, ...]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
