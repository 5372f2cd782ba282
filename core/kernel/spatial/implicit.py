"""Linearly implicit steps for slips that creep: their direction is stiff (docs/space.md).

The direction of a slip relaxes at the rate mu F_n / (m |s'|). Of the Jacobian only this is stiff,
with one rank per slipping contact: J = sum u_i v_i^T, where u_i is the change of the accelerations
per turn of slip i, and v_i its turn per change of the slip velocity. A W-method does without the
rest of the Jacobian.
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
from slipgrasp.core.kernel.spatial.selection import normalise
from slipgrasp.core.kernel.spatial.state import (
    count_coordinates,
    rate_at,
    slip_coordinate,
    slip_velocity_at,
)

TURN = 1e-6  # of a slip, by which u_i is found [rad]

# J, of one slip after the other, and what a step solves.
STIFFNESS = np.dtype(
    [
        ("count", np.int64),
        ("contacts", np.int64, (MAX_FINGERS,)),
        ("across", np.float64, (MAX_FINGERS, 2)),  # v_i, in the rows of the slip velocity [s/m]
        ("pushes", np.float64, (MAX_FINGERS, MAX_COORDINATES)),  # u_i, of object and slips
        ("rate", np.float64),  # at which the stiffest direction relaxes [1/s]
        ("matrix", np.float64, (MAX_FINGERS, MAX_FINGERS)),
        ("order", np.int64, (MAX_FINGERS,)),
        ("right", np.float64, (MAX_FINGERS,)),
        ("solution", np.float64, (MAX_FINGERS,)),
    ],
    align=True,
)


@compiled
def find_stiffness(model: Record, discrete: Record, step: Record, work: Record) -> None:
    """Fills ``stiffness`` at the start of the step, of which slope 0 is at hand."""
    n, stiff, start, end = model.num_fingers, step.stiffness, step.start.x, step.end.x
    stiff.count, stiff.rate = 0, 0.0
    for i in range(n):
        if discrete.slips[i, 0] == 0.0 or discrete.frozen[i, 0] == 1:
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
        stiff.rate = max(stiff.rate, -_turn_by(stiff, c, c))


@compiled
def _turn_by(stiff: Record, c: int, other: int) -> float:
    """V_c . u_other: at which rate slip ``c`` turns per turn of the other [1/s]."""
    k = slip_coordinate(stiff.contacts[c], 0)
    return (
        stiff.across[c, 0] * stiff.pushes[other, k]
        + stiff.across[c, 1] * stiff.pushes[other, k + 1]
    )


@compiled
def _turn(n: int, stiff: Record, c: int, slope: Record) -> float:
    """V_c . slope."""
    i = stiff.contacts[c]
    first, second = slope.x[slip_velocity_at(n, i, 0)], slope.x[slip_velocity_at(n, i, 1)]
    return stiff.across[c, 0] * first + stiff.across[c, 1] * second


@compiled
def _push(n: int, stiff: Record, c: int, factor: float, slope: Record) -> None:
    """Adds a multiple of u_c to a slope."""
    for k in range(count_coordinates(n)):
        slope.x[rate_at(n, k)] += factor * stiff.pushes[c, k]


@compiled
def implicit_step(model: Record, discrete: Record, h: float, step: Record, work: Record) -> None:
    """Fills ``end`` and ``slopes`` by `ROS34PW2`; ``stiffness`` is that of the start."""
    n, stiff, last = model.num_fingers, step.stiffness, model.methods[step.rank].last
    for c in range(stiff.count):
        for other in range(stiff.count):
            own = 1.0 if c == other else 0.0
            stiff.matrix[c, other] = own - h * DIAGONAL * _turn_by(stiff, c, other)
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
                coupled += COUPLING[row, k] * _turn(n, stiff, c, step.slopes[k])
            stiff.right[c] = coupled
        for c in range(stiff.count):
            _push(n, stiff, c, h * stiff.right[c], slope)
        for c in range(stiff.count):
            stiff.right[c] = _turn(n, stiff, c, slope)
        solve_dense(stiff.matrix, stiff.count, stiff.order, stiff.right, stiff.solution)
        for c in range(stiff.count):
            _push(n, stiff, c, h * DIAGONAL * stiff.solution[c], slope)
    set_normal_stage(model, h, last, step)
    flow(model, discrete, step.end, step.slopes[last], work)


@compiled
def set_normal_stage(model: Record, h: float, row: int, step: Record) -> None:
    """Writes the state at which slope ``row`` of a method is taken to ``end``."""
    set_stage(model, row, h, step, step.end)
    normalise(step.end)
