"""Random planar scenarios whose fingers are chains of two joints."""

from __future__ import annotations

import math
from random import Random
from typing import Any

import numpy as np

from slipgrasp.core.scenario import FingerParameters, PlanarScenario
from slipgrasp.core.scenario.chain import Chain, PlanarJoint, chain_points
from slipgrasp.core.scenario.geometry import planar_tip_at_start
from slipgrasp.core.scenario.loading import scenario_from_mapping

KINDS = ("revolute", "prismatic")
LEAST_SINE = 0.5  # of the start
SHORTEST, LONGEST = 0.3, 1.5  # distance of the tip from a joint that turns it [m]


def draw_chain(rng: Random, sampled: bool = True) -> tuple[dict[str, Any], tuple[float, float]]:
    """A chain well away from its singularities, and its joint positions there [rad, m].

    Args:
        rng: Where the numbers come from.
        sampled: Whether control is sampled, so that its torques may be limited.
    """
    while True:
        joints = _draw_joint(rng), _draw_joint(rng)
        chain = {
            "kind": "chain",
            "joints": joints,
            "tip": (rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)),
            "attitude": rng.uniform(-3.0, 3.0),
            "posture": (rng.uniform(-3.0, 3.0), rng.uniform(-3.0, 3.0)),
        }
        positions = tuple(q + rng.uniform(-0.2, 0.2) for q in chain["posture"])
        if _is_regular(chain, positions) and _is_regular(chain, chain["posture"]):
            break
    for joint, q in zip(joints, positions, strict=True):
        if rng.choice((False, False, True)):
            joint["minimum"], joint["maximum"] = q - rng.uniform(0.01, 1), q + rng.uniform(0.01, 1)
        limit = rng.choice((None, rng.uniform(5.0, 60.0)))
        joint["torque_limit"] = limit if sampled else None
    return chain, (positions[0], positions[1])


def with_chains(
    scenario: PlanarScenario, seed: object, share: float = 0.7, *, free: bool = False
) -> PlanarScenario:
    """The same scenario with some of its fingers replaced by random chains.

    Args:
        scenario: A planar hand.
        seed: The same seed draws the same chains.
        share: Probability of a chain.
        free: Whether its joints have no limits.
    """
    rng, mapping = Random(f"chains {seed}"), scenario.to_mapping()
    period = "controller.control_period"
    sampled = scenario.controller.control_period > 0.0
    sampled = sampled and all(change.parameter != period for change in scenario.changes)
    for i, finger in enumerate(mapping["fingers"]):
        if finger["kind"] != "links" or rng.random() > share:
            continue
        chain, positions = draw_chain(rng, sampled)
        for joint in chain["joints"] if free else ():
            joint["minimum"] = joint["maximum"] = joint["torque_limit"] = None
        touched = np.add(planar_tip_at_start(scenario, i), scenario.fingers[i].base)
        finger |= chain
        finger["base"] = tuple((touched - tip_of(chain, positions)[-1]).tolist())
        for part in (*mapping.get("estimates", ()), *mapping.get("changes", ())):
            own = f"fingers.{i}.link_masses."
            if part["parameter"].startswith(own):
                part["parameter"] = f"fingers.{i}.joints.{part['parameter'][-1]}.mass"
    return scenario_from_mapping(mapping)


def tip_of(chain: dict[str, Any], positions: tuple[float, ...]) -> np.ndarray:
    """Origins of the links and position of the tip, from the base, ``(3, 2)`` [m]."""
    known = _known(chain)
    points, _ = chain_points(known.attitude, known.joints, known.tip, np.array(positions))
    return points[:, :2]


def _known(chain: dict[str, Any]) -> Chain:
    joints = tuple(PlanarJoint(**joint) for joint in chain["joints"])
    own = {**chain, "joints": joints}
    return FingerParameters(base=(0.0, 0.0), face="left", **own).chain


def _draw_joint(rng: Random) -> dict[str, Any]:
    angle = rng.uniform(-3.0, 3.0)
    return {
        "kind": rng.choice(KINDS),
        "place": (rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)),
        "attitude": rng.uniform(-3.0, 3.0),
        "axis": (0.7 * math.cos(angle), 0.7 * math.sin(angle)),
        "mass": rng.uniform(0.1, 2.0),
        "centre": (rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5)),
        "unit_inertia": rng.uniform(0.01, 0.2),
    }


def _is_regular(chain: dict[str, Any], positions: tuple[float, ...]) -> bool:
    """Whether both joints move the tip, in different directions."""
    known = _known(chain)
    points, axes = chain_points(known.attitude, known.joints, known.tip, np.array(positions))
    arms = points[-1] - points[:-1]
    turns = [joint.kind == "revolute" for joint in known.joints]
    columns = np.where(np.array(turns)[:, None], np.cross(axes, arms), axes)[:, :2]
    sizes = np.linalg.norm(columns, axis=1)
    if any(turn and not SHORTEST < s < LONGEST for turn, s in zip(turns, sizes, strict=True)):
        return False
    return bool(abs(np.linalg.det(columns)) > LEAST_SINE * sizes.prod())
