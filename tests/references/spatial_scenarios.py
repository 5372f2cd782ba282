"""Scenarios in space: random ones, and what the reference makes of one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario.loading import scenario_from_mapping
from slipgrasp.core.scenario.spatial import SpatialFinger, SpatialObject, SpatialScenario
from tests.references.spatial_cases import around, lift
from tests.references.spatial_composite import Learning
from tests.references.spatial_fingers import Fingers
from tests.references.spatial_law import Desired, Law, Unknowns
from tests.references.spatial_plant import Hand, Parameters, face_frame, rotation_matrix
from tests.references.spatial_run import World

Array = NDArray[np.float64]


def world_of(scenario: SpatialScenario) -> World:
    """Hand, truth, law and lift of a scenario with a desired motion along z."""
    n, start = len(scenario.fingers), np.array(scenario.trajectory.start)
    fingers = scenario.fingers
    truth = Parameters(
        np.array([f.link_masses for f in fingers]),
        scenario.object.mass,
        np.array(scenario.object.inertias),
        np.array([f.friction for f in fingers]),
    )
    attitude = rotation_matrix(start[3:])

    def desired(t: float) -> Desired:
        path = lift(t)
        offset = start[:3] - lift(0.0).position
        return path._replace(position=path.position + offset, rotation=attitude)

    return World(
        hand=hand_of_scenario(scenario),
        truth=truth,
        unknowns=Unknowns(tuple(e.parameter for e in scenario.estimates), truth),
        law=_law(scenario, n),
        learning=_learning(scenario) if scenario.controller.kind == "composite" else None,
        desired=desired,
        position=start[:3],
        estimates=np.array([e.initial for e in scenario.estimates]),
        period=scenario.controller.control_period,
        quaternion=tuple(start[3:] / np.linalg.norm(start[3:])),
    )


def hand_of_scenario(scenario: SpatialScenario) -> Hand:
    """Fingers and contacts, the faces worked out from corners and height anew."""
    fingers, body = scenario.fingers, scenario.object
    lengths = np.array([f.link_lengths for f in fingers])
    contacts = [_contact(body, finger) for finger in fingers]
    return Hand(
        Fingers(
            np.array([f.base for f in fingers]),
            lengths,
            lengths * [f.link_centre_fractions for f in fingers],
            lengths**2 * [f.link_inertia_fractions for f in fingers],
            np.array([-1.0 if f.elbow == "up" else 1.0 for f in fingers]),
        ),
        np.array([anchor for anchor, _ in contacts]),
        np.array([frame for _, frame in contacts]),
        scenario.simulation.gravity,
    )


def _contact(body: SpatialObject, finger: SpatialFinger) -> tuple[Array, Array]:
    """Anchor and frame (t_x, t_y, n) of a contact, body frame."""
    x, y = body.half_width, body.half_depth
    corners = np.array(body.corners or [(-x, -y), (x, -y), (x, y), (-x, y)])
    if finger.face in ("top", "bottom"):
        side = 1.0 if finger.face == "top" else -1.0
        middle, normal = np.array([0.0, 0.0, 0.5 * side * body.height]), np.array([0, 0, -side])
    else:
        k = int(finger.face.split("-")[1])
        edge = corners[(k + 1) % len(corners)] - corners[k]
        middle = np.append(corners[k] + 0.5 * edge, 0.0)
        normal = np.array([-edge[1], edge[0], 0.0]) / np.linalg.norm(edge)
    frame = face_frame(normal)
    return middle + frame[:, :2] @ finger.contact_offset, frame


def _law(scenario: SpatialScenario, n: int) -> Law:
    c, p = scenario.controller, len(scenario.estimates)
    position = np.zeros(6 + 2 * n)
    position[:6], position[6:] = c.position_gain, c.slip_position_gain
    low = [-np.inf if e.minimum is None else e.minimum for e in scenario.estimates]
    high = [np.inf if e.maximum is None else e.maximum for e in scenario.estimates]
    return Law(
        position_gain=position,
        velocity_gain=np.broadcast_to(c.velocity_gain, 6 + 2 * n).astype(float),
        lyapunov_weight=(
            np.array(c.lyapunov_matrix)
            if c.lyapunov_matrix
            else np.broadcast_to(c.lyapunov_weight, 6 + 2 * n).astype(float)
        ),
        adaptation_gain=np.broadcast_to(c.adaptation_gain, p).astype(float),
        grip_safety=c.grip_safety,
        least_force=c.minimum_normal_force,
        distribution=c.distribution,
        friction=scenario.simulation.friction,
        norm_bound=c.estimate_norm_bound if c.kind == "theorem-4" else np.inf,
        minimum=np.array(low),
        maximum=np.array(high),
    )


def _learning(scenario: SpatialScenario) -> Learning:
    c = scenario.controller
    usual = [0.1 if "inertias" in e.parameter else 3.0 for e in scenario.estimates]
    given = usual if c.initial_deviation is None else c.initial_deviation
    deviations = np.broadcast_to(given, len(usual)).astype(float)
    return Learning(deviations, c.force_noise, c.forgetting, c.slip_stop)


def random_spatial_scenario(rng: np.random.Generator, n: int, unknown: str) -> SpatialScenario:
    """A hand around a tilted box or prism, with masses or frictions unknown.

    Args:
        rng: Decides.
        n: Fingers, 2 to 4.
        unknown: "masses" or "friction".
    """
    azimuths = {2: [180.0, 0.0], 3: [180.0, 300.0, 60.0], 4: [180.0, 0.0, 270.0, 90.0]}[n]
    outward = around(np.array(azimuths))
    faces = {2: (3, 1), 3: (0, 1, 2), 4: (3, 1, 0, 2)}[n]
    shape = {"half_width": 0.1, "half_depth": 0.1, "height": 0.3}
    if n == 3:
        corners = 0.2 * around(np.array([120.0, 240.0, 0.0]))[:, :2]
        shape = {"height": 0.3, "corners": corners.tolist()}
    keys = [f"fingers.{i}.friction" for i in range(n)]
    if unknown == "masses":
        keys = [f"fingers.{i}.link_masses.{k}" for i in range(n) for k in range(2)]
    keys += ["object.mass", *(f"object.inertias.{k}" for k in range(3))]
    turn = np.append(1.0, rng.uniform(-0.1, 0.1, 3))
    body = {"mass": rng.uniform(0.5, 2.0), "inertias": rng.uniform(0.009, 0.0145, 3).tolist()}
    mapping = {
        "object": {**body, **shape},
        "fingers": [
            {
                "base": (1.466 * outward[i] + rng.uniform(-0.05, 0.05, 3)).tolist(),
                "face": f"side-{faces[i]}",
                "friction": rng.uniform(0.15, 0.6),
                "link_masses": rng.uniform(0.5, 1.5, 2).tolist(),
                "link_lengths": rng.uniform(0.95, 1.1, 2).tolist(),
                "link_centre_fractions": rng.uniform(0.3, 0.6, 2).tolist(),
                "link_inertia_fractions": rng.uniform(0.05, 0.12, 2).tolist(),
                "contact_offset": rng.uniform(-0.02, 0.02, 2).tolist(),
                "elbow": str(rng.choice(["up", "down"])),
            }
            for i in range(n)
        ],
        "trajectory": {"start": [0.0, 0.0, 0.366, *(turn / np.linalg.norm(turn)).tolist()]},
        "controller": {
            "kind": "theorem-3" if unknown == "masses" else "theorem-4",
            "control_period": 1e-3,
            "estimate_norm_bound": 2.5,
        },
        "estimates": [{"parameter": key, "initial": _first_belief(rng, key)} for key in keys],
    }
    scenario = scenario_from_mapping(mapping)
    assert isinstance(scenario, SpatialScenario)
    return scenario


def _first_belief(rng: np.random.Generator, key: str) -> float:
    return float(rng.uniform(0.5, 1.5)) * (0.01 if "inertias" in key else 1.0)
