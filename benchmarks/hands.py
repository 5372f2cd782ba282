"""Hands of two to six fingers that hold an object through the paper's motion."""

from __future__ import annotations

from typing import Any

import numpy as np

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import scenario_from_mapping

SPREAD = 0.05  # the outermost fingertips of a face are this far from its middle [m]

# The grasp force exists for two fingers only; without it, friction must replace it.
FRICTION = 2.0


def holding_hand(num_fingers: int, control_period: float = 0.0) -> Scenario:
    """The paper's hand with more fingers on its two faces; all masses are unknown.

    Args:
        num_fingers: 2 to 6, shared between the left and the right face.
        control_period: Time between control updates, 0 = continuous [s].
    """
    left = _fingers_on("left", 0.0, "up", (num_fingers + 1) // 2)
    right = _fingers_on("right", 2.932, "down", num_fingers // 2)
    keys = [f"fingers.{i}.link_masses.{link}" for i in range(num_fingers) for link in (0, 1)]
    unknowns = [{"parameter": key, "initial": 0.8} for key in (*keys, "object.mass")]
    return scenario_from_mapping(
        {
            "fingers": [*left, *right],
            "estimates": unknowns,
            "controller": {
                "kind": "theorem-3",
                "control_period": control_period,
                "grasp_force": "none",
            },
        }
    )


def _fingers_on(face: str, base: float, elbow: str, count: int) -> list[dict[str, Any]]:
    offsets = np.linspace(-SPREAD, SPREAD, count).tolist() if count > 1 else [0.0]
    up = 1.0 if face == "left" else -1.0  # the tangent of the right face points down
    return [
        {
            "face": face,
            "base": [base, up * offset],
            "elbow": elbow,
            "friction": FRICTION,
            "contact_offset": offset,
        }
        for offset in offsets
    ]
