"""Hands of more than two fingers: random ones in random states, and ones that carry their object.

Random states, for point-wise comparisons, are away from singular arms.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping
from tests.references.hand import Phase, State

UNKNOWN_KINDS = ("masses", "friction", "object", "nothing")

_FACES = ("left", "right", "bottom", "top")
_OUTWARD = {"left": (-1.0, 0.0), "right": (1.0, 0.0), "bottom": (0.0, -1.0), "top": (0.0, 1.0)}


def random_scenario(
    rng: np.random.Generator, num_fingers: int, unknown: str, *, polygon: bool = False, **law: Any
) -> Scenario:
    """A hand with one finger per face, everything about it drawn at random.

    Args:
        rng: Source of randomness.
        num_fingers: 2, 3 or 4; up to 6 on a polygon.
        unknown: Which parameters are estimated, one of `UNKNOWN_KINDS`.
        polygon: Whether the object is a polygon of up to eight corners instead of a rectangle.
        law: Entries of the controller that are not left to chance.
    """
    half_width, half_length = rng.uniform(0.05, 0.2, 2)
    pose = rng.uniform([-1.0, -1.0, -0.5], [1.0, 1.0, 0.5])
    outline: dict[str, Any] = {"half_width": half_width, "face_half_length": half_length}
    extent = np.array([half_width, half_length])
    sides = [(f, np.array(_OUTWARD[f]) * extent, np.array(_OUTWARD[f])) for f in _FACES]
    if polygon:
        corners = _random_corners(rng, num_fingers)
        outline, sides = {"corners": corners}, _edges(corners)
    fingers = [_random_finger(rng, side, pose) for side in sides[:num_fingers]]
    mapping: dict[str, Any] = {
        "object": {
            "mass": rng.uniform(0.3, 2.0),
            "inertia": rng.uniform(0.005, 0.05),
            **outline,
        },
        "fingers": fingers,
        "trajectory": {
            "start": pose,
            "acceleration": rng.uniform(-0.5, 0.5, 3),
            "acceleration_time": 1.0,
            "coast_time": 2.0,
        },
        "controller": {
            "kind": "theorem-4" if unknown == "friction" else "theorem-3",
            "control_period": 0.0,
            "position_gain": rng.uniform(20.0, 200.0, 3),
            "velocity_gain": rng.uniform(5.0, 20.0, 3 + num_fingers),
            "lyapunov_weight": rng.uniform(1.0, 50.0, 3 + num_fingers),
            "grasp_force": "minimum" if num_fingers == 2 else rng.choice(["minimum", "none"]),
            "grip_safety": rng.uniform(1.0, 1.5),
            "estimate_norm_bound": 1.0,
            **law,
        },
        "estimates": _random_unknowns(rng, num_fingers, unknown),
        "simulation": {"gravity": rng.uniform(1.0, 15.0)},
    }
    return scenario_from_mapping(_plain(mapping))


def general_gains(rng: np.random.Generator, num_poses: int, num_slips: int) -> dict[str, Any]:
    """K_p for some of the slips, and a full symmetric positive definite Q."""
    factor = rng.normal(size=(2 * (num_poses + num_slips),) * 2)
    matrix = factor @ factor.T + np.eye(len(factor))
    gains = np.where(rng.random(num_slips) < 0.7, rng.uniform(20.0, 200.0, num_slips), 0.0)
    return {
        "controller.slip_position_gain": gains.tolist(),
        "controller.lyapunov_matrix": (0.5 * (matrix + matrix.T)).tolist(),
    }


def random_state(rng: np.random.Generator, scenario: Scenario, phase: Phase) -> State:
    """A moving state near the start pose that fits the phase: sticking contacts do not slip."""
    n = len(scenario.fingers)
    speeds = np.array(phase) * rng.uniform(0.01, 0.5, n)
    return State(
        pose=np.array(scenario.trajectory.start) + rng.uniform(-0.02, 0.02, 3),
        velocity=rng.uniform(-0.5, 0.5, 3),
        slip=rng.uniform(-0.02, 0.02, n),
        slip_velocity=speeds,
    )


def random_estimates(rng: np.random.Generator, scenario: Scenario) -> NDArray[np.float64]:
    """Estimates near the initial ones."""
    initial = np.array([e.initial for e in scenario.estimates])
    return initial * rng.uniform(0.7, 1.3, len(initial))


def carrying_hand(num_fingers: int, unknown: str) -> Scenario:
    """The three fingers of the preset, or a fourth from above, under the paper's own law.

    Two contacts slip at first and stop within 0.25 s, under sampled control too; the object
    is carried to the side and up, and turns. Nothing about hand or motion is symmetric.

    Args:
        num_fingers: 3 or 4.
        unknown: Which parameters are estimated, "masses" or "friction".
    """
    mapping = load_scenario("three-fingers").to_mapping()
    below = mapping["fingers"][2]
    above = {**below, "face": "top", "base": (1.1, 1.73), "elbow": "down"}
    fingers = [*mapping["fingers"], above][:num_fingers]
    mapping["fingers"] = fingers
    mapping["trajectory"] = {
        "start": mapping["trajectory"]["start"],
        "acceleration": (0.02, 0.0256, 0.03),
    }
    mapping["controller"] = {
        "kind": "theorem-4" if unknown == "friction" else "theorem-3",
        "control_period": 0.0,
        "grip_safety": 1.05,
    }
    mapping["estimates"] = [{"parameter": "object.mass", "initial": 0.7}]
    if unknown == "masses":
        mapping["estimates"] += [
            {"parameter": f"fingers.{i}.link_masses.1", "initial": 0.9 * finger["link_masses"][1]}
            for i, finger in enumerate(fingers)
        ]
    else:
        mapping["estimates"] += [
            {"parameter": "object.inertia", "initial": 0.012},
            *({"parameter": f"fingers.{i}.friction", "initial": 0.3} for i in range(num_fingers)),
        ]
        # As fast as the other estimates, that of the inertia would run through zero.
        mapping["controller"]["adaptation_gain"] = (1.28, 0.001, *[1.28] * num_fingers)
    return scenario_from_mapping(mapping)


def _random_corners(rng: np.random.Generator, num_fingers: int) -> NDArray[np.float64]:
    """Corners on an ellipse: convex, whatever the angles."""
    count = int(rng.integers(max(num_fingers, 3), 9))
    angles = 2.0 * np.pi * (np.arange(count) + rng.uniform(-0.2, 0.2, count)) / count
    return np.column_stack((np.cos(angles), np.sin(angles))) * rng.uniform(0.15, 0.25, 2)


def _edges(corners: NDArray[np.float64]) -> list[tuple[str, Any, Any]]:
    """Name, middle and outward normal of every edge."""
    following = np.roll(corners, -1, axis=0)
    along = (following - corners) / np.linalg.norm(following - corners, axis=1)[:, None]
    return [
        (f"edge-{k}", 0.5 * (corners[k] + following[k]), np.array([y, -x]))
        for k, (x, y) in enumerate(along)
    ]


def _random_finger(
    rng: np.random.Generator, side: tuple[str, Any, Any], pose: Any
) -> dict[str, Any]:
    face, middle, outward = side
    lengths = rng.uniform(0.6, 1.2, 2)
    reach = rng.uniform(0.5, 0.85) * lengths.sum()
    angle = pose[2] + np.arctan2(outward[1], outward[0]) + rng.uniform(-0.8, 0.8)
    turn = np.array([[np.cos(pose[2]), -np.sin(pose[2])], [np.sin(pose[2]), np.cos(pose[2])]])
    base = pose[:2] + turn @ middle + reach * np.array([np.cos(angle), np.sin(angle)])
    return {
        "face": face,
        "base": base,
        "elbow": rng.choice(["up", "down"]),
        "friction": rng.uniform(0.1, 0.6),
        "contact_offset": rng.uniform(-0.02, 0.02),
        "link_masses": rng.uniform(0.3, 2.0, 2),
        "link_lengths": lengths,
        "link_centre_fractions": rng.uniform(0.3, 0.7, 2),
        "link_inertia_fractions": rng.uniform(0.05, 0.15, 2),
    }


def _random_unknowns(
    rng: np.random.Generator, num_fingers: int, unknown: str
) -> list[dict[str, Any]]:
    body = ["object.mass", "object.inertia"]
    keys = {
        "masses": [f"fingers.{i}.link_masses.{k}" for i in range(num_fingers) for k in (0, 1)],
        "friction": [f"fingers.{i}.friction" for i in range(num_fingers)],
        "object": [],
        "nothing": [],
    }[unknown]
    keys = [] if unknown == "nothing" else keys + body
    scale = {"mass": 1.0, "inertia": 0.02, "friction": 0.5}
    return [
        {
            "parameter": key,
            "initial": rng.uniform(0.5, 1.5) * scale.get(key.rpartition(".")[2], 1.0),
        }
        for key in keys
    ]


def _plain(value: Any) -> Any:
    """Arrays and NumPy scalars as lists, numbers and strings."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return value
