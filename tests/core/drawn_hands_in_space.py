"""Random valid scenarios in space, for `benchmarks.hands_in_space`: hands of 2 to 4 fingers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from random import Random
from typing import Any

import numpy as np

from slipgrasp.core.scenario.loading import scenario_from_mapping
from slipgrasp.core.scenario.spatial import SpatialFinger, SpatialObject, SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import rotation_matrix, spatial_contact
from tests.core.drawn_scenarios import draw_beliefs

DURATION = 0.3
POSITION = (0.0, 0.0, 0.366)
LAWS = ("theorem-3", "theorem-4", "certainty-equivalence", "composite")
PERIODS = (0.0005, 0.001, 0.002, 0.005)
# The faces of a box that two, three and four fingers touch; three may hold a prism instead.
FACES = {
    2: (("side-3", "side-1"),),
    3: (("side-3", "side-1", "side-1"), ("side-3", "side-1", "bottom")),
    4: (("side-3", "side-1", "side-0", "side-2"), ("side-3", "side-1", "side-0", "bottom")),
    5: (("side-3", "side-1", "side-0", "side-2", "bottom"),),
    6: (("side-3", "side-1", "side-0", "side-2", "bottom", "side-3"),),
}
PRISM = ((-0.5, 0.866), (-0.5, -0.866), (1.0, 0.0))
PRISM_FACES = ("side-0", "side-1", "side-2", "bottom", "side-0", "side-1")


def draw_hand_in_space(
    seed: object, source: type[Random] = Random, *, whole: bool = True
) -> SpatialScenario:
    """A scenario of 0.3 s in which all that a user may set is drawn at random.

    Bases are placed so that each finger reaches its contact well away from its singular poses, so
    every draw is valid. Friction and gains stay away from tiny positive numbers, as in the plane.

    Args:
        seed: The same seed draws the same scenario.
        source: Where the numbers come from.
        whole: Whether there are patches, static friction and PD control, too. They are drawn last:
            without them all else is the same.
    """
    rng = source(f"hand in space {seed}")
    mapping, faces = draw_mapping(rng)
    if whole:
        add_patches_and_more(rng, mapping, faces)
    scenario = scenario_from_mapping(mapping)
    assert isinstance(scenario, SpatialScenario)
    return scenario


def draw_mapping(rng: Random) -> tuple[dict[str, Any], tuple[str, ...]]:
    """A scenario as nested keys, and the faces of its object that fingers touch."""
    n = rng.choice((2, 3, 4))
    body, faces = draw_body(rng, n)
    start = draw_start(rng)
    period = rng.choice(PERIODS)
    mapping: dict[str, Any] = {
        "object": body,
        "fingers": [draw_finger(rng, i, body, faces, start) for i in range(n)],
        "trajectory": _trajectory(rng, start),
        "controller": _controller(rng, period),
        "estimates": _estimates(rng, n),
        "pulses": [_pulse(rng) for _ in range(rng.choice((0, 0, 1, 2)))],
        "changes": [_change(rng, n) for _ in range(rng.choice((0, 1, 2)))],
        "simulation": {
            "duration": DURATION,
            "max_steps": 200_000,
            "gravity": rng.choice((9.81, 9.81, 0.0)),
            "friction": rng.choice(("cone", "pyramid")),
        },
    }
    return mapping, faces


def add_patches_and_more(rng: Random, mapping: dict[str, Any], faces: tuple[str, ...]) -> None:
    """Adds patches, static friction and PD control to a scenario."""
    mapping["patches"] = [_patch(rng, faces) for _ in range(rng.choice((0, 0, 1, 2)))]
    for i, finger in enumerate(mapping["fingers"]):
        finger["static_friction"] = _static_friction(rng, i, mapping)
    if rng.choice((False, False, False, True)):
        mapping["controller"] |= _grip(rng, mapping["controller"]["maximum_normal_force"])


def draw_start(rng: Random) -> tuple[float, ...]:
    """Position and attitude at the start, a little tilted."""
    attitude = np.array([1.0, *(rng.uniform(-0.15, 0.15) for _ in range(3))])
    return (*POSITION, *(attitude / _length(attitude)).tolist())


def draw_body(
    rng: Random, n: int, *, has_corners: bool | None = None
) -> tuple[dict[str, Any], tuple[str, ...]]:
    """A box or a prism, with principal inertias that a body can have; the faces touched.

    Args:
        rng: Where the numbers come from.
        n: Fingers.
        has_corners: Whether it is a prism; half of those for three fingers are if nothing is said.
    """
    size, height = rng.uniform(0.05, 0.15), rng.uniform(0.15, 0.3)
    body: dict[str, Any] = {
        "mass": rng.uniform(0.3, 2.0),
        "inertias": tuple(rng.uniform(0.006, 0.011) for _ in range(3)),
        "height": height,
    }
    if has_corners is None:
        has_corners = n == 3 and rng.choice((False, True))
    if has_corners:
        return {**body, "corners": tuple((2 * size * x, 2 * size * y) for x, y in PRISM)}, (
            PRISM_FACES[:n]
        )
    return {**body, "half_width": size, "half_depth": rng.uniform(0.08, 0.15)}, rng.choice(FACES[n])


def draw_finger(
    rng: Random, i: int, body: dict[str, Any], faces: tuple[str, ...], start: tuple[float, ...]
) -> dict[str, Any]:
    """Finger i where it reaches its contact well away from its singular poses."""
    aside = 0.04 if faces.count(faces[i]) == 2 else 0.0
    is_first = faces.index(faces[i]) == i
    offset = rng.uniform(-0.03, 0.03), rng.uniform(-0.03, 0.03) + (-aside if is_first else aside)
    lengths = rng.uniform(0.7, 1.2), rng.uniform(0.7, 1.2)
    touched, normal = touched_point(body, faces[i], offset, start)
    away = -normal + [rng.uniform(-0.3, 0.3) for _ in range(3)]
    if faces[i] == "bottom":
        # Never right below: the axis of its yaw would go through the tip.
        away[:2] += rng.choice((-0.6, 0.6)), rng.choice((-0.6, 0.6))
    reach = rng.uniform(0.6, 0.85) * sum(lengths)
    base = touched + reach * away / _length(away)
    return {
        "face": faces[i],
        "base": base.tolist(),
        "elbow": rng.choice(("up", "down")),
        "friction": rng.uniform(0.05, 0.8),
        "contact_offset": offset,
        "link_masses": (rng.uniform(0.3, 2.0), rng.uniform(0.3, 2.0)),
        "link_lengths": lengths,
        "link_centre_fractions": (rng.uniform(0.3, 0.7), rng.uniform(0.3, 0.7)),
        "link_inertia_fractions": (rng.uniform(0.05, 0.15), rng.uniform(0.05, 0.15)),
    }


def touched_point(
    body: dict[str, Any], face: str, offset: tuple[float, float], start: tuple[float, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Where a fingertip touches the object at the start [m], and the normal into it."""
    touching = SpatialFinger(base=(0.0, 0.0, 0.0), face=face, contact_offset=offset)
    contact = spatial_contact(SpatialObject(**body), touching)
    R = rotation_matrix((start[3], start[4], start[5], start[6]))
    return np.array(start[:3]) + _turned(R, contact.anchor), _turned(R, contact.normal)


def _grip(rng: Random, most: float | None) -> dict[str, Any]:
    """PD control with a grip within its maximum."""
    grip = rng.uniform(5.0, 40.0)
    return {
        "kind": rng.choice(("pd-gravity", "grip-reflex")),
        "grip_force": grip if most is None else min(grip, most),
        "grip_rate": rng.uniform(5.0, 100.0),
    }


def _static_friction(rng: Random, i: int, mapping: dict[str, Any]) -> float | None:
    """None, or more than the friction of slip ever is."""
    changed = [
        change["value"]
        for change in mapping["changes"]
        if change["parameter"] == f"fingers.{i}.friction"
    ]
    most = max(mapping["fingers"][i]["friction"], *changed, 0.0)
    return rng.choice((None, None, rng.uniform(1.0, 1.5) * most))


def _patch(rng: Random, faces: tuple[str, ...]) -> dict[str, Any]:
    """A spot of other friction where fingertips may slide, for the whole run or a part of it."""
    start = rng.choice((0.0, rng.uniform(0.0, 0.5 * DURATION)))
    return {
        "face": rng.choice(faces),
        "centre": (rng.uniform(-0.03, 0.03), rng.uniform(-0.05, 0.05)),
        "radius": rng.choice((rng.uniform(0.0005, 0.005), rng.uniform(0.005, 0.05))),
        "friction_factor": rng.choice((0.0, rng.uniform(0.2, 1.0), rng.uniform(1.0, 2.0))),
        "start_time": start,
        "end_time": rng.choice((None, start + rng.uniform(0.01, DURATION))),
    }


def _turned(R: Sequence[Sequence[float]], vector: Sequence[float]) -> np.ndarray:
    """``R @ vector``, but rounded alike on every machine: a BLAS is not."""
    x, y, z = vector
    return np.array([a * x + b * y + c * z for a, b, c in R])


def _length(vector: np.ndarray) -> float:
    total = 0.0
    for part in vector.tolist():
        total += part * part
    return math.sqrt(total)


def _trajectory(rng: Random, start: tuple[float, ...]) -> dict[str, Any]:
    poses = [(*np.add(start[:3], _small(rng)).tolist(), *_small(rng)) for _ in range(2)]
    moves = [{"time": 0.02, "duration": 0.1}, {"time": 0.15, "duration": 0.1}]
    return {
        "kind": rng.choice(("coast", "set-points", "shake")),
        "start": start,
        "acceleration": tuple(rng.uniform(-0.5, 0.5) for _ in range(6)),
        "acceleration_time": rng.choice((0.05, 0.1)),
        "coast_time": rng.choice((0.0, 0.1)),
        "period": rng.uniform(0.1, 0.5),
        "amplitude": (*_small(rng), *_small(rng)),
        "set_points": [{**move, "pose": pose} for move, pose in zip(moves, poses, strict=True)],
    }


def _small(rng: Random) -> tuple[float, float, float]:
    """How far an object may be moved, or turned, from where it starts [m], [rad]."""
    return rng.uniform(-0.01, 0.01), rng.uniform(-0.01, 0.01), rng.uniform(-0.01, 0.01)


def _controller(rng: Random, period: float) -> dict[str, Any]:
    return {
        "kind": rng.choice(LAWS),
        "control_period": period,
        "position_gain": rng.choice((0.0, rng.uniform(10.0, 300.0))),
        "velocity_gain": rng.uniform(1.0, 30.0),
        "adaptation_gain": rng.uniform(0.1, 3.0),
        "lyapunov_weight": rng.uniform(0.0, 50.0),
        "grasp_force": rng.choice((*["minimum"] * 7, "none")),
        "distribution": rng.choice(("hold", "hold", "exact", "softened")),
        "grip_safety": rng.uniform(1.0, 2.0),
        "minimum_normal_force": rng.choice((0.0, rng.uniform(0.1, 3.0))),
        "maximum_normal_force": rng.choice((None, None, rng.uniform(10.0, 60.0))),
        "estimate_norm_bound": rng.uniform(0.3, 5.0),
        "slip_stop": rng.choice((0.0, rng.uniform(0.1, 3.0))),
    }


def _estimates(rng: Random, n: int) -> list[dict[str, Any]]:
    inertias = [(f"object.inertias.{k}", 0.01, 0.002, 0.2) for k in range(3)]
    body = [("object.mass", 1.0, 0.05, 10.0), *inertias]
    links = [(f"fingers.{i}.link_masses.{k}", 1.0, 0.05, 10.0) for i in range(n) for k in (0, 1)]
    friction = [(f"fingers.{i}.friction", 0.5, 0.05, 2.0) for i in range(n)]
    keys = rng.choice(([], [*links, body[0]], body, [*friction, *body]))
    return draw_beliefs(rng, keys)


def _pulse(rng: Random) -> dict[str, Any]:
    return {
        "time": rng.uniform(0.0, 0.28),
        "duration": rng.uniform(0.005, 0.1),
        "force": tuple(rng.uniform(-5.0, 5.0) for _ in range(3)),
        "moment": tuple(rng.uniform(-0.1, 0.1) for _ in range(3)),
    }


def _change(rng: Random, n: int) -> dict[str, Any]:
    values = {
        "object.mass": rng.uniform(0.3, 2.0),
        "object.inertias.1": rng.uniform(0.006, 0.011),
        "controller.velocity_gain": rng.uniform(1.0, 30.0),
        "controller.control_period": rng.choice(PERIODS),
        **{f"fingers.{i}.friction": rng.uniform(0.05, 0.8) for i in range(n)},
    }
    key = rng.choice(tuple(values))
    return {"time": rng.uniform(0.01, 0.28), "parameter": key, "value": values[key]}
