"""Random valid scenarios of soft grasps, for `benchmarks.soft_grasps`: fingers of every kind."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random
from typing import Any

import numpy as np

from slipgrasp.core.scenario.chain import ChainJoint, chain_points
from slipgrasp.core.scenario.loading import scenario_from_mapping
from slipgrasp.core.scenario.pads import PAD_FACTORS
from slipgrasp.core.scenario.spatial import SpatialScenario
from tests.core.drawn_hands_in_space import add_patches_and_more, draw_mapping, touched_point

KINDS = ("links", "slides", "chain", "mixed")
LAWS = ("certainty-equivalence", "composite", "pd-gravity", "grip-reflex", "gripper")
PAD_RADIUS = (1e-3, 0.03)  # [m]
LEAST_SINE = 0.2  # of the axes of a chain, as they move its tip


def draw_soft_grasp(seed: object) -> SpatialScenario:
    """A spatial hand of 0.3 s with pads on some or all fingertips, under a law that knows of them.

    Motion, pushes, changes, patches and all else are those of
    `tests.core.drawn_hands_in_space.draw_hand_in_space`.

    Args:
        seed: The same seed draws the same scenario.
    """
    rng = Random(f"soft grasp {seed}")
    mapping, faces = draw_mapping(rng)
    add_patches_and_more(rng, mapping, faces)
    fingers, start, kind = mapping["fingers"], mapping["trajectory"]["start"], rng.choice(KINDS)
    for finger in fingers:
        own = rng.choice(KINDS[:3]) if kind == "mixed" else kind
        finger |= _pad(rng) | _of_kind(rng, own, finger, mapping["object"], start)
    if not any(finger["pad_radius"] for finger in fingers):
        rng.choice(fingers)["pad_radius"] = rng.uniform(*PAD_RADIUS)
    mapping["estimates"] = list(_known_by_kind(mapping["estimates"], fingers))
    mapping["controller"] |= _law(rng, mapping["controller"])
    mapping["simulation"]["friction"] = "cone"
    scenario = scenario_from_mapping(mapping)
    assert isinstance(scenario, SpatialScenario)
    return scenario


def _pad(rng: Random) -> dict[str, Any]:
    return {
        "pad_radius": rng.choice((0.0, rng.uniform(*PAD_RADIUS), rng.uniform(*PAD_RADIUS))),
        "pad_pressure": rng.choice(tuple(PAD_FACTORS)),
    }


def _of_kind(
    rng: Random, kind: str, finger: dict[str, Any], body: dict[str, Any], start: tuple[float, ...]
) -> dict[str, Any]:
    """What a finger of another kind has in the place of links."""
    if kind == "slides":
        return {"kind": kind, "mass": rng.uniform(0.05, 1.0)}
    if kind == "chain":
        touched, _ = touched_point(body, finger["face"], finger["contact_offset"], start)
        return {"kind": kind, **_chain(rng, touched)}
    return {}


def _chain(rng: Random, touched: np.ndarray) -> dict[str, Any]:
    """Three joints of any axes, none near a singular pose, whose base is where the tip touches."""
    while True:
        joints = [_joint(rng, k) for k in range(3)]
        tip, attitude = _vector(rng, 0.4, 0.8), _attitude(rng)
        posture = tuple(rng.uniform(-1.0, 1.0) for _ in range(3))
        known = [ChainJoint(**joint) for joint in joints]
        points, axes = chain_points(attitude, known, tip, np.array(posture))
        slides = np.array([joint.kind == "prismatic" for joint in known])[:, None]
        columns = np.where(slides, axes, np.cross(axes, points[-1] - points[:-1]))
        sine = np.linalg.det(columns) / np.linalg.norm(columns, axis=1).prod()
        if abs(sine) > LEAST_SINE:
            base = touched - points[-1]
            chain = {"joints": joints, "tip": tip, "attitude": attitude, "posture": posture}
            return {**chain, "base": base.tolist()}


def _joint(rng: Random, k: int) -> dict[str, Any]:
    # The inertia of three rods across each other.
    rods = [rng.uniform(0.001, 0.05) for _ in range(3)]
    total = sum(rods)
    inertia = (total - rods[0], 0.0, 0.0, total - rods[1], 0.0, total - rods[2])
    return {
        "kind": rng.choice(("revolute", "revolute", "prismatic")) if k < 2 else "revolute",
        "place": (0.0, 0.0, 0.0) if k == 0 else _vector(rng, 0.3, 0.8),
        "attitude": _attitude(rng),
        "axis": _vector(rng, 1.0, 1.0),
        "mass": rng.uniform(0.2, 2.0),
        "centre": _vector(rng, 0.0, 0.3),
        "unit_inertia": inertia,
    }


def _vector(rng: Random, least: float, most: float) -> tuple[float, float, float]:
    """A vector of any direction with a length between two others."""
    x, y, z = _unit([rng.gauss(0.0, 1.0) for _ in range(3)])
    length = rng.uniform(least, most)
    return length * x, length * y, length * z


def _attitude(rng: Random) -> tuple[float, float, float, float]:
    w, x, y, z = _unit([rng.gauss(0.0, 1.0) for _ in range(4)])
    return w, x, y, z


def _unit(vector: list[float]) -> list[float]:
    parts: list[float] = (np.array(vector) / np.linalg.norm(vector)).tolist()
    return parts


def _known_by_kind(
    estimates: list[dict[str, Any]], fingers: list[dict[str, Any]]
) -> Iterator[dict[str, Any]]:
    """Estimates of the masses that fingers of these kinds have."""
    for estimate in estimates:
        owner, _, link = estimate["parameter"].partition(".link_masses.")
        kind = fingers[int(owner.partition(".")[2])].get("kind") if link else None
        if kind == "slides" and link == "1":
            continue
        own = {"slides": "mass", "chain": f"joints.{link}.mass"}.get(kind or "")
        yield estimate | ({"parameter": f"{owner}.{own}"} if own else {})


def _law(rng: Random, controller: dict[str, Any]) -> dict[str, Any]:
    """A law that goes with soft fingertips, and what it needs."""
    most = controller["maximum_normal_force"]
    grip = rng.uniform(5.0, 40.0)
    return {
        "kind": rng.choice(LAWS),
        "distribution": "hold",
        "grip_force": grip if most is None else min(grip, most),
        "grip_rate": rng.uniform(5.0, 100.0),
        "jaw_stiffness": rng.uniform(500.0, 1e4),
        "jaw_damping": rng.uniform(10.0, 100.0),
        "force_rate": rng.uniform(50.0, 1e4),
        "force_bandwidth": rng.uniform(5.0, 200.0),
    }
