"""Linearly implicit steps for creeping slips, whose direction is stiff (docs/space.md).

The direction of a slip relaxes at the rate mu F_n / (m |s'|). Only this part of the Jacobian is
stiff; it has rank 1 per slipping contact, 2 if the contact is soft and its direction includes spin:
J = sum u_c v_c^T, where u_c is the change of the accelerations per rotation of a slip direction,
and v_c the rotation per change of the slip velocity. A W-method does not need the rest of the
Jacobian.
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Record
from slipgrasp.core.kernel.loop.stages import set_stage
from slipgrasp.core.kernel.numerics.dense import factor_dense, solve_dense
from slipgrasp.core.kernel.numerics.rosenbrock import COUPLING, DIAGONAL
from slipgrasp.core.kernel.spatial.flow import flow
from slipgrasp.core.kernel.spatial.guards import sample_guards
from slipgrasp.core.kernel.spatial.model import MAX_COORDINATES
from slipgrasp.core.kernel.spatial.state import (
    count_coordinates,
    normalise,
    rate_at,
    slip_coordinate,
    slip_velocity_at,
    spin_velocity_at,
    stiff_rate_at,
    velocity_at,
)
from slipgrasp.core.kernel.spatial.ways import size_with_spin

TURN = 1e-6  # rotation of a slip direction for the difference quotient of u_c [rad]
MAX_TURNS = 2 * MAX_FINGERS

# Terms of J, and the linear system of a step.
STIFFNESS = np.dtype(
    [
        ("count", np.int64),
        ("contacts", np.int64, (MAX_TURNS,)),
        ("across", np.float64, (MAX_TURNS, 3)),  # v_c, in components of the slip velocity [s/m]
        ("pushes", np.float64, (MAX_TURNS, MAX_COORDINATES + MAX_FINGERS)),  # u_c, spins last
        ("rate", np.float64),  # relaxation rate of the stiffest direction [1/s]
        ("matrix", np.float64, (MAX_TURNS, MAX_TURNS)),
        ("order", np.int64, (MAX_TURNS,)),
        ("right", np.float64, (MAX_TURNS,)),
        ("solution", np.float64, (MAX_TURNS,)),
    ],
    align=True,
)


@compiled
def find_stiffness(model: Record, discrete: Record, step: Record, work: Record) -> None:
    """Fills ``stiffness`` at the start of the step; slope 0 must be available."""
    n, stiff, start, end = model.num_fingers, step.stiffness, step.start.x, step.end.x
    stiff.count, stiff.rate = 0, 0.0
    for i in range(n):
        if discrete.slips[i, 0] == 0.0 or discrete.frozen[i, 0] == 1:
            continue
        if model.soft == 1:
            _find_soft_stiffness(model, discrete, step, work, i)
            continue
        first, second = slip_velocity_at(n, i, 0), slip_velocity_at(n, i, 1)
        for j in range(model.num_states):
            end[j] = start[j]
        end[first] -= TURN * start[second]
        end[second] += TURN * start[first]
        flow(model, discrete, step.end, step.slopes[1], work)
        c, squared = stiff.count, start[first] * start[first] + start[second] * start[second]
        stiff.contacts[c] = i
        stiff.across[c, 0], stiff.across[c, 1] = -start[second] / squared, start[first] / squared
        for k in range(count_coordinates(n)):
            at = rate_at(n, k)
            stiff.pushes[c, k] = (step.slopes[1].x[at] - step.slopes[0].x[at]) / TURN
        stiff.count = c + 1
        stiff.rate = max(stiff.rate, -_turn_by(model, stiff, c, c))


@compiled
def _find_soft_stiffness(
    model: Record, discrete: Record, step: Record, work: Record, i: int
) -> None:
    """Adds the two rotations of the slip direction of soft contact ``i``."""
    n, stiff, start, end = model.num_fingers, step.stiffness, step.start.x, step.end.x
    x, y = start[velocity_at(n, i, 0)], start[velocity_at(n, i, 1)]
    z = start[velocity_at(n, i, 2)]
    speed = size_with_spin(x, y, z)
    for way in across(x / speed, y / speed, z / speed):
        for j in range(model.num_states):
            end[j] = start[j]
        c = stiff.count
        for part in range(3):
            end[velocity_at(n, i, part)] += TURN * speed * way[part]
            stiff.across[c, part] = way[part] / speed
        flow(model, discrete, step.end, step.slopes[1], work)
        stiff.contacts[c], stiff.count = i, c + 1
        for k in range(count_coordinates(n) + n):
            at = stiff_rate_at(n, k)
            stiff.pushes[c, k] = (step.slopes[1].x[at] - step.slopes[0].x[at]) / TURN
        stiff.rate = max(stiff.rate, -_turn_by(model, stiff, c, c))


@compiled
def across(
    x: float, y: float, z: float
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Two unit vectors that are orthogonal to a unit vector and to each other."""
    if z * z < 0.5:
        inverse = 1.0 / np.sqrt(x * x + y * y)
        first = (-y * inverse, x * inverse, 0.0)
    else:
        inverse = 1.0 / np.sqrt(y * y + z * z)
        first = (0.0, -z * inverse, y * inverse)
    return first, (
        y * first[2] - z * first[1],
        z * first[0] - x * first[2],
        x * first[1] - y * first[0],
    )


@compiled
def _turn_by(model: Record, stiff: Record, c: int, other: int) -> float:
    """Rate v_c . u_other at which slip ``c`` turns per rotation of another slip [1/s]."""
    k = slip_coordinate(stiff.contacts[c], 0)
    turn = (
        stiff.across[c, 0] * stiff.pushes[other, k]
        + stiff.across[c, 1] * stiff.pushes[other, k + 1]
    )
    if model.soft == 1:
        k = count_coordinates(model.num_fingers) + stiff.contacts[c]
        turn += stiff.across[c, 2] * stiff.pushes[other, k]
    return turn


@compiled
def turn_rate(model: Record, stiff: Record, c: int) -> float:
    """Rate at which the direction of slip ``c`` relaxes on its own [1/s]."""
    return -_turn_by(model, stiff, c, c)


@compiled
def _turn(model: Record, stiff: Record, c: int, slope: Record) -> float:
    """Product of v_c and a slope."""
    n, i = model.num_fingers, stiff.contacts[c]
    first, second = slope.x[slip_velocity_at(n, i, 0)], slope.x[slip_velocity_at(n, i, 1)]
    turn = stiff.across[c, 0] * first + stiff.across[c, 1] * second
    if model.soft == 1:
        turn += stiff.across[c, 2] * slope.x[spin_velocity_at(n, i)]
    return turn


@compiled
def _push(model: Record, stiff: Record, c: int, factor: float, slope: Record) -> None:
    """Adds a multiple of u_c to a slope."""
    n = model.num_fingers
    for k in range(count_coordinates(n) + model.soft * n):
        slope.x[stiff_rate_at(n, k)] += factor * stiff.pushes[c, k]


@compiled
def implicit_step(model: Record, discrete: Record, h: float, step: Record, work: Record) -> None:
    """Fills ``end`` and ``slopes`` by `ROS34PW2`, with ``stiffness`` of the start."""
    stiff, last = step.stiffness, model.methods[step.rank].last
    for c in range(stiff.count):
        for other in range(stiff.count):
            own = 1.0 if c == other else 0.0
            stiff.matrix[c, other] = own - h * DIAGONAL * _turn_by(model, stiff, c, other)
    factor_dense(stiff.matrix, stiff.count, stiff.order)
    for j in range(model.num_states):
        step.slopes[1].x[j] = step.slopes[0].x[j]
    for row in range(1, last):
        slope = step.slopes[row]
        if row > 1:
            set_normal_stage(model, h, row, step)
            flow(model, discrete, step.end, slope, work)
            sample_guards(model, discrete, step.end, work, step.samples, row)
        for c in range(stiff.count):
            coupled = 0.0
            for k in range(1, row):
                coupled += COUPLING[row, k] * _turn(model, stiff, c, step.slopes[k])
            stiff.right[c] = coupled
        for c in range(stiff.count):
            _push(model, stiff, c, h * stiff.right[c], slope)
        for c in range(stiff.count):
            stiff.right[c] = _turn(model, stiff, c, slope)
        solve_dense(stiff.matrix, stiff.count, stiff.order, stiff.right, stiff.solution)
        for c in range(stiff.count):
            _push(model, stiff, c, h * DIAGONAL * stiff.solution[c], slope)
    set_normal_stage(model, h, last, step)
    flow(model, discrete, step.end, step.slopes[last], work)


@compiled
def set_normal_stage(model: Record, h: float, row: int, step: Record) -> None:
    """Writes the state of stage ``row`` to ``end``, with a normalized attitude."""
    set_stage(model, row, h, step, step.end)
    normalise(step.end)
