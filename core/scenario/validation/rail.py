"""Checks the start pose, the motion and the law of a finger on a rail."""

from __future__ import annotations

import math
from collections.abc import Iterator

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario.rail import RailScenario
from slipgrasp.core.scenario.validation.trajectory import check_moves

_LEAST_SINE = 0.05  # of the second joint at the start


def check_rail(scenario: RailScenario) -> Iterator[FieldError]:
    """Checks reach, the order of motions, and the gains that Theorem 3 needs."""
    yield from _check_reach(scenario)
    yield from check_moves(scenario.trajectory.set_points)
    yield from _check_adaptation(scenario)


def _check_reach(scenario: RailScenario) -> Iterator[FieldError]:
    finger, dx, dy = scenario.finger, *scenario.contact_offset
    first, second = finger.link_lengths
    x = scenario.trajectory.start[0] + dx - finger.base[0]
    y = scenario.object.face_half_length + dy - finger.base[1]
    distance = math.hypot(x, y)
    bend = (distance**2 - first**2 - second**2) / (2.0 * first * second)
    if not abs(bend) < math.sqrt(1.0 - _LEAST_SINE**2):
        low, high = abs(first - second), first + second
        words = (
            f"is {distance:.4g} m from the contact, where the finger is straight, folded or too "
            f"short; place it between {low:g} and {high:g} m from the contact"
        )
        limit = f"{low:g} … {high:g} m from the contact"
        yield FieldError.at("finger.base", distance, limit, words)


def _check_adaptation(scenario: RailScenario) -> Iterator[FieldError]:
    controller = scenario.controller
    if controller.kind != "theorem-3":
        return
    if controller.mass_estimate is None:
        words = (
            "is omitted, but theorem-3 adapts an estimate of the mass; give its initial value, or "
            "use certainty-equivalence"
        )
        yield FieldError.at("controller.mass_estimate", None, "a mass", words)
    for name, least in (("position_gain", 1e-3), ("velocity_gain", 1e-3)):
        value = getattr(controller, name)
        if value < least:
            words = (
                f"is {value:g}, but theorem-3 needs at least {least:g} for its Lyapunov function; "
                "raise it, or use certainty-equivalence"
            )
            yield FieldError.at(f"controller.{name}", value, f"at least {least:g}", words)
