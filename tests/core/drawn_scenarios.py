"""Random valid scenarios, for property tests and `benchmarks.outcomes`: hands of 2 to 4 fingers.

Drawn by plain seeded numbers: a library for property tests draws others with every module that
happens to be loaded, and takes minutes to shrink what fails.
"""

from __future__ import annotations

from collections.abc import Sequence
from random import Random
from typing import Any, NamedTuple

import numpy as np

from slipgrasp.core.scenario import FingerParameters, ObjectParameters, Scenario
from slipgrasp.core.scenario.geometry import contact_frame
from slipgrasp.core.scenario.loading import scenario_from_mapping

DURATION = 0.3
POSITION = (1.466, 0.366)
FACES = ("left", "right", "bottom", "bottom", "left", "right")
# Where the fingers come from: directions from contact to base, in turns of the x axis [rad].
DIRECTIONS = (-2.8, -0.35, -1.6, -1.6, -2.8, -0.35)
OFFSETS = (0.0, 0.0, -0.025, 0.025, 0.045, 0.045)  # of fingers that share a face [m]
SAMPLED = (0.0005, 0.001, 0.002, 0.005)
LAWS = ("theorem-3", "theorem-4", "certainty-equivalence", "pd-gravity")
SAMPLED_LAWS = ("grip-reflex", "composite")
MOTIONS = ("coast", "set-points", "circle", "rotation", "shake", "table")
UNKNOWNS = ("nothing", "masses", "object", "friction")


class Kind(NamedTuple):
    """What is not left to chance, of which a few hundred draws would miss some."""

    law: str
    sampled: bool
    motion: str
    fingers: int


KINDS = tuple(
    Kind(law, law in SAMPLED_LAWS or (i + n) % 2 == 0, MOTIONS[(i + 2 * n) % len(MOTIONS)], n)
    for n in (2, 3, 4)
    for i, law in enumerate((*LAWS, *SAMPLED_LAWS))
)
"""Every law with every number of fingers; every motion three times, in changing company."""


class AtEnds(Random):
    """Prefers the ends of every range: a third exactly there, a third close to one of them."""

    def uniform(self, a: float, b: float) -> float:
        """A number between two others, both included."""
        within, third = super().uniform(a, b), self.random()
        end, other = self.choice(((a, b), (b, a)))
        if third < 1.0 / 3.0:
            return end
        if third < 2.0 / 3.0:
            return end + (other - end) * 10.0 ** super().uniform(-6.0, -1.0)
        return within


def draw_kind(rng: Random) -> Kind:
    """Any law with any motion and number of fingers."""
    law = rng.choice((*LAWS, *SAMPLED_LAWS))
    sampled = law in SAMPLED_LAWS or rng.choice((False, True))
    return Kind(law, sampled, rng.choice(MOTIONS), rng.choice((2, 3, 4)))


def draw_scenario(kind: Kind, seed: object, source: type[Random] = Random) -> Scenario:
    """A scenario of 0.3 s in which everything else a user may set is drawn at random.

    Bases are placed so that each finger reaches its contact well away from its straight and
    folded poses, so every draw is valid. Friction and gains stay away from tiny positive
    numbers: to hold with friction 1e-67 asks for forces that no tolerance fits, and the
    matrix P grows without bound as K_p falls to zero (K_p = 0 itself is drawn).

    Args:
        kind: What is not left to chance.
        seed: The same seed draws the same scenario.
        source: Where the numbers come from.
    """
    rng = source(f"{kind} {seed}")
    n = kind.fingers
    body, faces = draw_body(rng)
    angle = rng.uniform(-0.2, 0.2)
    fingers = [draw_finger(rng, i, body, faces[i], angle) for i in range(n)]
    period = rng.choice(SAMPLED) if kind.sampled else 0.0
    mapping: dict[str, Any] = {
        "object": body,
        "fingers": fingers,
        "trajectory": _trajectory(rng, kind.motion, (*POSITION, angle)),
        "controller": _controller(rng, kind.law, period),
        "estimates": _estimates(rng, n),
        "pulses": [_pulse(rng) for _ in range(rng.choice((0, 0, 1, 2)))],
        "patches": [_patch(rng, faces) for _ in range(rng.choice((0, 0, 1, 2)))],
        "changes": [_change(rng, fingers, period) for _ in range(rng.choice((0, 1, 2, 3)))],
        "simulation": {
            "duration": DURATION,
            "max_steps": 20_000,
            "gravity": rng.choice((9.81, 9.81, 0.0)),
        },
    }
    if period:
        mapping["sensing"] = rng.choice(({}, _sensing(rng)))
        mapping["actuation"] = {"torque_limit": rng.choice((None, rng.uniform(5.0, 60.0)))}
    return scenario_from_mapping(mapping)


def draw_body(
    rng: Random, *, has_corners: bool | None = None
) -> tuple[dict[str, Any], Sequence[str]]:
    """A rectangle, or a polygon of four or five corners, and the face of each finger.

    Every corner lies beyond that of the rectangle by less than half, and the fifth between
    the two upper ones further out: the polygon is convex, and no face of a finger shorter.

    Args:
        rng: Where the numbers come from.
        has_corners: Whether it is a polygon; a third are if nothing is said.
    """
    x, y = rng.uniform(0.05, 0.2), rng.uniform(0.08, 0.2)
    body: dict[str, Any] = {
        "mass": rng.uniform(0.3, 2.0),
        "inertia": rng.uniform(0.005, 0.05),
    }
    if has_corners is None:
        has_corners = rng.choice((False, False, True))
    if not has_corners:
        return {**body, "half_width": x, "face_half_length": y}, FACES
    signs = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
    corners = [(i * rng.uniform(1.0, 1.4) * x, j * rng.uniform(1.0, 1.4) * y) for i, j in signs]
    if rng.choice((False, True)):
        corners.insert(3, (0.0, 1.6 * y))
    edges = {"left": f"edge-{len(corners) - 1}", "right": "edge-1", "bottom": "edge-0"}
    return {**body, "corners": tuple(corners)}, [edges[face] for face in FACES]


def draw_finger(
    rng: Random, i: int, body: dict[str, Any], face: Any, angle: float
) -> dict[str, Any]:
    """Finger i where it reaches its contact well away from its straight and folded poses."""
    offset = rng.uniform(-0.02, 0.02) + OFFSETS[i]
    touching = FingerParameters(base=(0.0, 0.0), face=face, contact_offset=offset)
    contact = contact_frame(ObjectParameters(**body), touching).anchor
    lengths = rng.uniform(0.7, 1.2), rng.uniform(0.7, 1.2)
    reach = rng.uniform(0.6, 0.85) * sum(lengths)
    towards = DIRECTIONS[i] + rng.uniform(-0.4, 0.4)
    c, s = np.cos(angle), np.sin(angle)
    x = POSITION[0] + c * contact[0] - s * contact[1] + reach * np.cos(towards)
    y = POSITION[1] + s * contact[0] + c * contact[1] + reach * np.sin(towards)
    friction = rng.uniform(0.05, 0.8)
    static = rng.choice((None, rng.uniform(1.0, 1.5)))
    return {
        "face": face,
        "base": (float(x), float(y)),
        "elbow": rng.choice(("up", "down")),
        "friction": friction,
        "static_friction": None if static is None else static * friction,
        "contact_offset": offset,
        "link_masses": (rng.uniform(0.3, 2.0), rng.uniform(0.3, 2.0)),
        "link_lengths": lengths,
        "link_centre_fractions": (rng.uniform(0.3, 0.7), rng.uniform(0.3, 0.7)),
        "link_inertia_fractions": (rng.uniform(0.05, 0.15), rng.uniform(0.05, 0.15)),
    }


def _trajectory(rng: Random, kind: str, start: tuple[float, float, float]) -> dict[str, Any]:
    poses = [tuple(np.add(start, _offset(rng)).tolist()) for _ in range(2)]
    moves = [{"time": 0.02, "duration": 0.1}, {"time": 0.15, "duration": 0.1}]
    ramps = (0.05, 0.1, 1.0) if kind == "coast" else (0.05, 0.1)
    return {
        "kind": kind,
        "start": start,
        "acceleration": tuple(rng.uniform(-0.5, 0.5) for _ in range(3)),
        "acceleration_time": rng.choice(ramps),
        "coast_time": rng.choice((0.0, 0.1)),
        "period": rng.uniform(0.1, 0.5),
        "radius": 0.01,
        "angle": 0.05,
        "amplitude": _offset(rng),
        "set_points": [{**move, "pose": pose} for move, pose in zip(moves, poses, strict=True)],
        "table": [(0.0, *start), (0.1, *poses[0]), (0.25, *poses[1])],
    }


def _offset(rng: Random) -> tuple[float, float, float]:
    """How far an object may be moved from where it starts [m], [m], [rad]."""
    return rng.uniform(-0.01, 0.01), rng.uniform(-0.01, 0.01), rng.uniform(-0.01, 0.01)


def _controller(rng: Random, law: str, period: float) -> dict[str, Any]:
    return {
        "kind": law,
        "latency": rng.choice((0.0, 0.0, 0.0015)) if period else 0.0,
        "control_period": period,
        "recognition_time": rng.choice((0.0002, 0.001, 0.005)),
        "position_gain": rng.choice((0.0, rng.uniform(10.0, 300.0))),
        "velocity_gain": rng.uniform(1.0, 30.0),
        "adaptation_gain": rng.uniform(0.1, 3.0),
        "lyapunov_weight": rng.uniform(0.0, 50.0),
        "grasp_force": rng.choice(("minimum", "minimum", "none")),
        "grip_safety": rng.uniform(1.0, 2.0),
        "estimate_norm_bound": rng.uniform(0.3, 5.0),
    }


def _estimates(rng: Random, n: int) -> list[dict[str, Any]]:
    unknown = rng.choice(UNKNOWNS)
    body = [("object.mass", 1.0, 0.05, 10.0), ("object.inertia", 0.02, 0.002, 0.2)]
    links = [(f"fingers.{i}.link_masses.{k}", 1.0, 0.05, 10.0) for i in range(n) for k in (0, 1)]
    friction = [(f"fingers.{i}.friction", 0.5, 0.05, 2.0) for i in range(n)]
    keys = {
        "nothing": [],
        "masses": [*links, body[0]],
        "object": body,
        "friction": [*friction, *body],
    }[unknown]
    return draw_beliefs(rng, keys)


def draw_beliefs(
    rng: Random, keys: Sequence[tuple[str, float, float, float]]
) -> list[dict[str, Any]]:
    """Estimates of some unknowns, each given by its key, scale and bounds; all bounded or none."""
    bounded = rng.choice((False, True))
    return [
        {"parameter": key, "initial": scale * rng.uniform(0.5, 1.5)}
        | ({"minimum": low, "maximum": high} if bounded else {})
        for key, scale, low, high in keys
    ]


def _pulse(rng: Random) -> dict[str, Any]:
    return {
        "time": rng.uniform(0.0, 0.28),
        "duration": rng.uniform(0.005, 0.1),
        "force": (rng.uniform(-5.0, 5.0), rng.uniform(-5.0, 5.0)),
        "moment": rng.uniform(-0.1, 0.1),
    }


def _patch(rng: Random, faces: Sequence[str]) -> dict[str, Any]:
    return {
        "face": rng.choice(faces),
        "centre": rng.uniform(-0.05, 0.05),
        "half_length": rng.uniform(0.002, 0.05),
        "friction_factor": rng.uniform(0.3, 1.5),
        "start_time": rng.choice((0.0, 0.05)),
        "end_time": rng.choice((None, 0.2)),
    }


def _sensing(rng: Random) -> dict[str, Any]:
    return {
        "position_noise": rng.choice((0.0, 1e-5)),
        "velocity_noise": rng.choice((0.0, 1e-3)),
        "acceleration_noise": rng.choice((0.0, 0.1)),
        "true_accelerations": rng.choice((False, True)),
        "true_phases": rng.choice((False, True)),
    }


def _change(rng: Random, fingers: Sequence[dict[str, Any]], period: float) -> dict[str, Any]:
    """A change that the rest allows: friction stays below its static value, and ticks go on."""
    values = {
        "object.mass": rng.uniform(0.3, 2.0),
        "object.inertia": rng.uniform(0.005, 0.05),
        "controller.velocity_gain": rng.uniform(1.0, 30.0),
        "controller.control_period": rng.choice(SAMPLED if period else (0.0, *SAMPLED)),
    }
    for i, finger in enumerate(fingers):
        values[f"fingers.{i}.friction"] = rng.uniform(0.05, finger["static_friction"] or 0.8)
    key = rng.choice(tuple(values))
    return {"time": rng.uniform(0.01, 0.28), "parameter": key, "value": values[key]}
