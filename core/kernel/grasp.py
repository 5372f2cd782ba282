"""Choice of the internal (grasp) force where one can be chosen (docs/model.md, Grasp force)."""

from __future__ import annotations

import numpy as np

from core.kernel.compiler import compiled
from core.kernel.records import Floats, Integers, Record


@compiled
def choose_grasp_force(
    forces: Floats, direction: Floats, believed: Record, safety: float, belief: Integers
) -> float:
    """Adds the least internal force that puts every sticking contact inside its cone.

    Each cone |F_x| <= (mu / safety) F_n is two half-lines of the multiplier of this
    internal force; the least multiplier in their intersection is taken. Where they do not
    meet, the one with the least violation.

    Args:
        forces: ``(n, 2)`` contact forces without internal force; the result is added here.
        direction: ``(2n,)`` internal force, spanning the one-dimensional null space.
        believed: Masses and friction the controller believes in.
        safety: Factor >= 1 by which the cones are narrowed.
        belief: ``(n,)`` phases the controller believes in.

    Returns:
        The largest violation of a narrowed cone [N], 0 if all are met.
    """
    low, high = -np.inf, np.inf
    blocked = False
    for line in range(2 * believed.num_fingers):
        if belief[line // 2] != 0:
            continue
        slope, offset = _cone_side(forces, direction, believed, safety, line)
        if slope > 0.0:
            high = min(high, offset / slope)
        elif slope < 0.0:
            low = max(low, offset / slope)
        elif offset < 0.0:
            blocked = True
    multiplier, violation = min(max(0.0, low), high), 0.0
    if low > high or blocked:
        multiplier, violation = _least_violation(forces, direction, believed, safety, belief)
    for i in range(believed.num_fingers):
        forces[i, 0] += multiplier * direction[2 * i]
        forces[i, 1] += multiplier * direction[2 * i + 1]
    return violation


@compiled
def _cone_side(
    forces: Floats, direction: Floats, believed: Record, safety: float, line: int
) -> tuple[float, float]:
    """One side of a cone as slope * multiplier <= offset."""
    i = line // 2
    sign = 1.0 if line % 2 == 0 else -1.0
    limit = believed.friction[i] / safety
    slope = sign * direction[2 * i] - limit * direction[2 * i + 1]
    return slope, limit * forces[i, 1] - sign * forces[i, 0]


@compiled
def _largest_violation(
    forces: Floats,
    direction: Floats,
    believed: Record,
    safety: float,
    belief: Integers,
    multiplier: float,
) -> float:
    largest = -np.inf
    for line in range(2 * believed.num_fingers):
        if belief[line // 2] == 0:
            slope, offset = _cone_side(forces, direction, believed, safety, line)
            largest = max(largest, slope * multiplier - offset)
    return largest


@compiled
def _least_violation(
    forces: Floats, direction: Floats, believed: Record, safety: float, belief: Integers
) -> tuple[float, float]:
    """Where the largest of the lines is least: a crossing of two of them, or no squeeze at all."""
    lines = 2 * believed.num_fingers
    best = 0.0
    least = _largest_violation(forces, direction, believed, safety, belief, 0.0)
    for a in range(lines):
        for b in range(a):
            if belief[a // 2] != 0 or belief[b // 2] != 0:
                continue
            slope_a, offset_a = _cone_side(forces, direction, believed, safety, a)
            slope_b, offset_b = _cone_side(forces, direction, believed, safety, b)
            if slope_a == slope_b:
                continue
            crossing = (offset_a - offset_b) / (slope_a - slope_b)
            value = _largest_violation(forces, direction, believed, safety, belief, crossing)
            if value < least:
                best, least = crossing, value
    return best, least
