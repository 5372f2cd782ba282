"""Random valid scenarios for property tests: hands of 2 to 4 fingers around one object."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st

from core.loading import scenario_from_mapping
from core.scenario import Scenario

__all__ = ["scenarios"]

DURATION = 0.3
POSITION = (1.466, 0.366)
FACES = ("left", "right", "bottom", "bottom")
# Where the fingers come from: directions from contact to base, in turns of the x axis [rad].
DIRECTIONS = (-2.8, -0.35, -1.6, -1.6)
PERIODS = (0.0, 0.0, 0.0005, 0.001, 0.002, 0.005)
UNKNOWNS = ("nothing", "masses", "object", "friction")


def _between(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high)


@st.composite
def scenarios(draw: st.DrawFn) -> Scenario:
    """A scenario of 0.3 s in which everything a user may set is drawn at random.

    Bases are placed so that each finger reaches its contact well away from its straight and
    folded poses, so every draw is valid. Friction and gains stay away from tiny positive
    numbers: to hold with friction 1e-67 asks for forces that no tolerance fits, and the
    matrix P grows without bound as K_p falls to zero (K_p = 0 itself is drawn).
    """
    n = draw(st.sampled_from((2, 2, 2, 3, 4)))
    half_width, half_length = draw(_between(0.05, 0.2)), draw(_between(0.08, 0.2))
    angle = draw(_between(-0.2, 0.2))
    body = (half_width, half_length, angle)
    period = draw(st.sampled_from(PERIODS))
    mapping: dict[str, Any] = {
        "object": {
            "mass": draw(_between(0.3, 2.0)),
            "inertia": draw(_between(0.005, 0.05)),
            "half_width": half_width,
            "face_half_length": half_length,
        },
        "fingers": [_finger(draw, i, body) for i in range(n)],
        "trajectory": {
            "start": (*POSITION, angle),
            "acceleration": tuple(draw(_between(-0.5, 0.5)) for _ in range(3)),
            "acceleration_time": draw(st.sampled_from((0.05, 0.1, 1.0))),
            "coast_time": draw(st.sampled_from((0.0, 0.1))),
        },
        "controller": _controller(draw, n, period),
        "estimates": _estimates(draw, n),
        "changes": draw(st.lists(_change(n), max_size=3)),
        "simulation": {
            "duration": DURATION,
            "max_steps": 20_000,
            "gravity": draw(st.sampled_from((9.81, 9.81, 0.0))),
        },
    }
    return scenario_from_mapping(mapping)


def _finger(draw: st.DrawFn, i: int, body: tuple[float, float, float]) -> dict[str, Any]:
    half_width, half_length, angle = body
    offset = draw(_between(-0.02, 0.02)) + (0.0, 0.0, -0.025, 0.025)[i]
    contact = {
        "left": (-half_width, offset),
        "right": (half_width, -offset),
        "bottom": (-offset, -half_length),
    }[FACES[i]]
    lengths = draw(_between(0.7, 1.2)), draw(_between(0.7, 1.2))
    reach = draw(_between(0.6, 0.85)) * sum(lengths)
    towards = DIRECTIONS[i] + draw(_between(-0.4, 0.4))
    c, s = np.cos(angle), np.sin(angle)
    x = POSITION[0] + c * contact[0] - s * contact[1] + reach * np.cos(towards)
    y = POSITION[1] + s * contact[0] + c * contact[1] + reach * np.sin(towards)
    return {
        "face": FACES[i],
        "base": (float(x), float(y)),
        "elbow": draw(st.sampled_from(("up", "down"))),
        "friction": draw(_between(0.05, 0.8)),
        "contact_offset": offset,
        "link_masses": (draw(_between(0.3, 2.0)), draw(_between(0.3, 2.0))),
        "link_lengths": lengths,
        "link_centre_fractions": (draw(_between(0.3, 0.7)), draw(_between(0.3, 0.7))),
        "link_inertia_fractions": (draw(_between(0.05, 0.15)), draw(_between(0.05, 0.15))),
    }


def _controller(draw: st.DrawFn, n: int, period: float) -> dict[str, Any]:
    return {
        "kind": draw(st.sampled_from(("theorem-3", "theorem-4"))),
        "control_period": period,
        "recognition_time": draw(st.sampled_from((0.0002, 0.001, 0.005))),
        "position_gain": draw(st.one_of(st.just(0.0), _between(10.0, 300.0))),
        "velocity_gain": draw(_between(1.0, 30.0)),
        "adaptation_gain": draw(_between(0.1, 3.0)),
        "lyapunov_weight": draw(_between(0.0, 50.0)),
        "grasp_force": draw(st.sampled_from(("minimum", "minimum", "none"))) if n == 2 else "none",
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


def _change(n: int) -> st.SearchStrategy[dict[str, Any]]:
    numbers = {
        "object.mass": (0.3, 2.0),
        "object.inertia": (0.005, 0.05),
        "controller.velocity_gain": (1.0, 30.0),
        **{f"fingers.{i}.friction": (0.05, 0.8) for i in range(n)},
    }
    kinds = [
        st.fixed_dictionaries({"parameter": st.just(key), "value": _between(low, high)})
        for key, (low, high) in numbers.items()
    ]
    kinds.append(
        st.fixed_dictionaries(
            {
                "parameter": st.just("controller.control_period"),
                "value": st.sampled_from(PERIODS),
            }
        )
    )
    timed = st.one_of(kinds)
    return st.tuples(_between(0.01, 0.28), timed).map(lambda pair: {"time": pair[0], **pair[1]})
