"""Random valid scenarios for property tests: hands of 2 to 4 fingers around one object."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from hypothesis import strategies as st

from core.geometry import contact_frame
from core.loading import scenario_from_mapping
from core.scenario import FingerParameters, ObjectParameters, Scenario

__all__ = ["KINDS", "Kind", "scenarios"]

DURATION = 0.3
POSITION = (1.466, 0.366)
FACES = ("left", "right", "bottom", "bottom")
# Where the fingers come from: directions from contact to base, in turns of the x axis [rad].
DIRECTIONS = (-2.8, -0.35, -1.6, -1.6)
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


def _between(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high)


@st.composite
def scenarios(draw: st.DrawFn, kind: Kind) -> Scenario:
    """A scenario of 0.3 s in which everything else a user may set is drawn at random.

    Bases are placed so that each finger reaches its contact well away from its straight and
    folded poses, so every draw is valid. Friction and gains stay away from tiny positive
    numbers: to hold with friction 1e-67 asks for forces that no tolerance fits, and the
    matrix P grows without bound as K_p falls to zero (K_p = 0 itself is drawn).
    """
    n = kind.fingers
    body, faces = draw(_bodies())
    angle = draw(_between(-0.2, 0.2))
    fingers = [_finger(draw, i, body, faces[i], angle) for i in range(n)]
    period = draw(st.sampled_from(SAMPLED)) if kind.sampled else 0.0
    mapping: dict[str, Any] = {
        "object": body,
        "fingers": fingers,
        "trajectory": _trajectory(draw, kind.motion, (*POSITION, angle)),
        "controller": _controller(draw, kind.law, period),
        "estimates": _estimates(draw, n),
        "pulses": draw(_seldom(_pulses())),
        "patches": draw(_seldom(_patches(faces))),
        "changes": draw(st.lists(_change(fingers, period), max_size=3)),
        "simulation": {
            "duration": DURATION,
            "max_steps": 20_000,
            "gravity": draw(st.sampled_from((9.81, 9.81, 0.0))),
        },
    }
    if period:
        mapping["sensing"] = draw(st.one_of(st.just({}), _sensing()))
        limit = st.one_of(st.none(), _between(5.0, 60.0))
        mapping["actuation"] = {"torque_limit": draw(limit)}
    return scenario_from_mapping(mapping)


def _seldom(item: st.SearchStrategy[Any]) -> st.SearchStrategy[list[Any]]:
    """None in half of the draws, otherwise one or two."""
    return st.one_of(st.just([]), st.lists(item, min_size=1, max_size=2))


@st.composite
def _bodies(draw: st.DrawFn) -> tuple[dict[str, Any], list[str]]:
    """A rectangle, or a polygon of four or five corners, and the face of each finger.

    Every corner lies beyond that of the rectangle by less than half, and the fifth between
    the two upper ones further out: the polygon is convex, and no face of a finger shorter.
    """
    x, y = draw(_between(0.05, 0.2)), draw(_between(0.08, 0.2))
    body: dict[str, Any] = {
        "mass": draw(_between(0.3, 2.0)),
        "inertia": draw(_between(0.005, 0.05)),
    }
    if not draw(st.sampled_from((False, False, True))):
        return {**body, "half_width": x, "face_half_length": y}, list(FACES)
    signs = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
    out = _between(1.0, 1.4)
    corners = [(i * draw(out) * x, j * draw(out) * y) for i, j in signs]
    if draw(st.booleans()):
        corners.insert(3, (0.0, 1.6 * y))
    edges = {"left": f"edge-{len(corners) - 1}", "right": "edge-1", "bottom": "edge-0"}
    return {**body, "corners": tuple(corners)}, [edges[face] for face in FACES]


def _finger(
    draw: st.DrawFn, i: int, body: dict[str, Any], face: Any, angle: float
) -> dict[str, Any]:
    offset = draw(_between(-0.02, 0.02)) + (0.0, 0.0, -0.025, 0.025)[i]
    touching = FingerParameters(base=(0.0, 0.0), face=face, contact_offset=offset)
    contact = contact_frame(ObjectParameters(**body), touching).anchor
    lengths = draw(_between(0.7, 1.2)), draw(_between(0.7, 1.2))
    reach = draw(_between(0.6, 0.85)) * sum(lengths)
    towards = DIRECTIONS[i] + draw(_between(-0.4, 0.4))
    c, s = np.cos(angle), np.sin(angle)
    x = POSITION[0] + c * contact[0] - s * contact[1] + reach * np.cos(towards)
    y = POSITION[1] + s * contact[0] + c * contact[1] + reach * np.sin(towards)
    friction = draw(_between(0.05, 0.8))
    static = draw(st.one_of(st.none(), _between(1.0, 1.5)))
    return {
        "face": face,
        "base": (float(x), float(y)),
        "elbow": draw(st.sampled_from(("up", "down"))),
        "friction": friction,
        "static_friction": None if static is None else static * friction,
        "contact_offset": offset,
        "link_masses": (draw(_between(0.3, 2.0)), draw(_between(0.3, 2.0))),
        "link_lengths": lengths,
        "link_centre_fractions": (draw(_between(0.3, 0.7)), draw(_between(0.3, 0.7))),
        "link_inertia_fractions": (draw(_between(0.05, 0.15)), draw(_between(0.05, 0.15))),
    }


def _trajectory(draw: st.DrawFn, kind: str, start: tuple[float, float, float]) -> dict[str, Any]:
    # Where it may move to, from where it starts.
    offsets = st.tuples(*[_between(-0.01, 0.01)] * 3)
    poses = [tuple(np.add(start, draw(offsets)).tolist()) for _ in range(2)]
    moves = [{"time": 0.02, "duration": 0.1}, {"time": 0.15, "duration": 0.1}]
    ramps = (0.05, 0.1, 1.0) if kind == "coast" else (0.05, 0.1)
    return {
        "kind": kind,
        "start": start,
        "acceleration": tuple(draw(_between(-0.5, 0.5)) for _ in range(3)),
        "acceleration_time": draw(st.sampled_from(ramps)),
        "coast_time": draw(st.sampled_from((0.0, 0.1))),
        "period": draw(_between(0.1, 0.5)),
        "radius": 0.01,
        "angle": 0.05,
        "amplitude": draw(offsets),
        "set_points": [{**move, "pose": pose} for move, pose in zip(moves, poses, strict=True)],
        "table": [(0.0, *start), (0.1, *poses[0]), (0.25, *poses[1])],
    }


def _controller(draw: st.DrawFn, law: str, period: float) -> dict[str, Any]:
    return {
        "kind": law,
        "latency": draw(st.sampled_from((0.0, 0.0, 0.0015))) if period else 0.0,
        "control_period": period,
        "recognition_time": draw(st.sampled_from((0.0002, 0.001, 0.005))),
        "position_gain": draw(st.one_of(st.just(0.0), _between(10.0, 300.0))),
        "velocity_gain": draw(_between(1.0, 30.0)),
        "adaptation_gain": draw(_between(0.1, 3.0)),
        "lyapunov_weight": draw(_between(0.0, 50.0)),
        "grasp_force": draw(st.sampled_from(("minimum", "minimum", "none"))),
        "grip_safety": draw(_between(1.0, 2.0)),
        "estimate_norm_bound": draw(_between(0.3, 5.0)),
    }


def _estimates(draw: st.DrawFn, n: int) -> list[dict[str, Any]]:
    unknown = draw(st.sampled_from(UNKNOWNS))
    body = [("object.mass", 1.0, 0.05, 10.0), ("object.inertia", 0.02, 0.002, 0.2)]
    links = [(f"fingers.{i}.link_masses.{k}", 1.0, 0.05, 10.0) for i in range(n) for k in (0, 1)]
    friction = [(f"fingers.{i}.friction", 0.5, 0.05, 2.0) for i in range(n)]
    keys = {
        "nothing": [],
        "masses": [*links, body[0]],
        "object": body,
        "friction": [*friction, *body],
    }[unknown]
    bounded = draw(st.booleans())
    return [
        {"parameter": key, "initial": scale * draw(_between(0.5, 1.5))}
        | ({"minimum": low, "maximum": high} if bounded else {})
        for key, scale, low, high in keys
    ]


def _pulses() -> st.SearchStrategy[dict[str, Any]]:
    return st.fixed_dictionaries(
        {
            "time": _between(0.0, 0.28),
            "duration": _between(0.005, 0.1),
            "force": st.tuples(_between(-5.0, 5.0), _between(-5.0, 5.0)),
            "moment": _between(-0.1, 0.1),
        }
    )


def _patches(faces: list[str]) -> st.SearchStrategy[dict[str, Any]]:
    return st.fixed_dictionaries(
        {
            "face": st.sampled_from(faces),
            "centre": _between(-0.05, 0.05),
            "half_length": _between(0.002, 0.05),
            "friction_factor": _between(0.3, 1.5),
            "start_time": st.sampled_from((0.0, 0.05)),
            "end_time": st.sampled_from((None, 0.2)),
        }
    )


def _sensing() -> st.SearchStrategy[dict[str, Any]]:
    return st.fixed_dictionaries(
        {
            "position_noise": st.sampled_from((0.0, 1e-5)),
            "velocity_noise": st.sampled_from((0.0, 1e-3)),
            "acceleration_noise": st.sampled_from((0.0, 0.1)),
            "true_accelerations": st.booleans(),
            "true_phases": st.booleans(),
        }
    )


def _change(fingers: list[dict[str, Any]], period: float) -> st.SearchStrategy[dict[str, Any]]:
    """A change that the rest allows: friction stays below its static value, and ticks go on."""
    numbers = {
        "object.mass": (0.3, 2.0),
        "object.inertia": (0.005, 0.05),
        "controller.velocity_gain": (1.0, 30.0),
        **{
            f"fingers.{i}.friction": (0.05, finger["static_friction"] or 0.8)
            for i, finger in enumerate(fingers)
        },
    }
    kinds = [
        st.fixed_dictionaries({"parameter": st.just(key), "value": _between(low, high)})
        for key, (low, high) in numbers.items()
    ]
    kinds.append(
        st.fixed_dictionaries(
            {
                "parameter": st.just("controller.control_period"),
                "value": st.sampled_from(SAMPLED if period else (0.0, *SAMPLED)),
            }
        )
    )
    timed = st.one_of(kinds)
    return st.tuples(_between(0.01, 0.28), timed).map(lambda pair: {"time": pair[0], **pair[1]})
