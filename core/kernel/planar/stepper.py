"""Step of an explicit Runge-Kutta method, its error, and its interpolant.

Reference: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.4-II.6.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.stages import fill_terms, set_stage, weigh_slopes
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.numerics.linear import Triple
from slipgrasp.core.kernel.numerics.methods import DENSE_ROWS, MAX_SLOPES, method_of
from slipgrasp.core.kernel.planar.flow import flow, forget_mechanics
from slipgrasp.core.kernel.planar.guards import MAX_GUARDS, sample_guards
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.state import (
    ANGLE,
    MAX_STATE,
    STATE,
    X,
    Y,
    slip_at,
    supplied_at,
    velocity_at,
)
from slipgrasp.core.kernel.planar.sticking import moves_object_alone, sticking_acceleration
from slipgrasp.core.kernel.planar.workspace import DISCRETE, WORKSPACE

# Fraction of the tolerance above which a higher order is worth its cost.
QUIET = 0.03

# A step from ``start`` to ``end`` with its slopes.
STEP = np.dtype(
    [
        ("rank", np.int64),  # of its method
        ("start", STATE),
        ("end", STATE),
        ("slopes", STATE, (MAX_SLOPES,)),
        ("stage", STATE),
        ("terms", np.float64, (DENSE_ROWS + 3, MAX_STATE)),  # of the interpolant
        ("prepared", np.int64),  # 1 if the terms belong to this step
        ("samples", np.float64, (MAX_SLOPES, MAX_GUARDS)),  # of guards, at the stages
        # Squared torques at the stages, with continuous control [N^2 m^2].
        ("efforts", np.float64, (MAX_SLOPES,)),
    ],
    align=True,
)


@compiled
def effort_rate(model: Record, work: Record) -> float:
    """Sum of the squared joint torques of the law for the evaluated state [N^2 m^2].

    0 with sampled control, under which torques are constant.
    """
    total, jacobians, forces = 0.0, work.kin.jacobians, work.tip_forces
    if model.law.period == 0.0:
        for i in range(model.num_fingers):
            for joint in range(2):
                torque = jacobians[i, 0, joint] * forces[i, 0]
                total += square(torque + jacobians[i, 1, joint] * forces[i, 1])
    return total


@compiled
def _move_object(model: Record, row: int, h: float, step: Record) -> tuple[Triple, Triple]:
    """Pose and velocity of the object at stage ``row``."""
    start, matrix = step.start.x, method_of(model, step).matrix
    x, y, angle = start[X], start[Y], start[ANGLE]
    vx, vy, omega = start[velocity_at(X)], start[velocity_at(Y)], start[velocity_at(ANGLE)]
    for k in range(row):
        weight, slope = h * matrix[row, k], step.slopes[k].x
        x, y, angle = x + weight * slope[X], y + weight * slope[Y], angle + weight * slope[ANGLE]
        vx = vx + weight * slope[velocity_at(X)]
        vy = vy + weight * slope[velocity_at(Y)]
        omega = omega + weight * slope[velocity_at(ANGLE)]
    return (x, y, angle), (vx, vy, omega)


@compiled
def _take_sticking_stage(
    model: Record, discrete: Record, row: int, h: float, step: Record, work: Record
) -> None:
    """Computes slope ``row`` if all contacts stick under constant torques."""
    pose, velocity = _move_object(model, row, h, step)
    acceleration, power = sticking_acceleration(model, discrete, step.start, pose, velocity, work)
    slope = step.slopes[row].x
    for j in range(slip_at(0), model.num_states):
        slope[j] = 0.0
    for k in range(3):
        slope[k], slope[velocity_at(k)] = velocity[k], acceleration[k]
    slope[supplied_at(model)] = power


@compiled
def _end_sticking(model: Record, h: float, step: Record) -> None:
    """Computes the end of the step if all contacts stick under constant torques."""
    method, start, end = method_of(model, step), step.start.x, step.end.x
    pose, velocity = _move_object(model, method.last, h, step)
    for j in range(slip_at(0), model.num_states):
        end[j] = start[j] + 0.0  # as with a slope of 0, which turns -0.0 into 0.0
    for k in range(3):
        end[k], end[velocity_at(k)] = pose[k], velocity[k]
    supplied = start[supplied_at(model)]
    for k in range(method.last):
        supplied += h * method.matrix[method.last, k] * step.slopes[k].x[supplied_at(model)]
    end[supplied_at(model)] = supplied


@compiled_apart(
    types.void, MODEL, DISCRETE, types.float64, types.float64, STEP, WORKSPACE, unrolled=True
)
def take_step(
    model: Record, discrete: Record, t: float, h: float, step: Record, work: Record
) -> None:
    """Fills ``end`` and ``slopes``; ``work`` is then evaluated at the end of the step."""
    method = method_of(model, step)
    if moves_object_alone(model, discrete):
        forget_mechanics(work)
        for row in range(1, method.last):
            _take_sticking_stage(model, discrete, row, h, step, work)
            sample_guards(model, discrete, work, step.samples, row)
        _end_sticking(model, h, step)
    else:
        for row in range(1, method.last):
            set_stage(model, row, h, step, step.end)
            flow(model, discrete, t + method.nodes[row] * h, step.end, step.slopes[row], work)
            sample_guards(model, discrete, work, step.samples, row)
            if method.matrix[method.last, row] != 0.0:
                step.efforts[row] = effort_rate(model, work)
        set_stage(model, method.last, h, step, step.end)
    flow(model, discrete, t + h, step.end, step.slopes[method.last], work)
    step.efforts[method.last] = effort_rate(model, work)
    step.prepared = 0


@compiled_apart(types.float64, MODEL, types.float64, STEP, unrolled=True)
def step_error(model: Record, h: float, step: Record) -> float:
    """Root mean square error of a step relative to the tolerance; not finite if a value is not.

    Args:
        model: Constants of the run.
        h: Size of the step [s].
        step: The step; overwrites the first terms of its interpolant.
    """
    size, method = model.num_states, method_of(model, step)
    weigh_slopes(method.error, method.last + 1, size, step, step.terms[0])
    weigh_slopes(method.correction, method.last + 1, size, step, step.terms[1])
    relative, absolute = model.numerics.relative_tolerance, model.numerics.absolute_tolerance
    total, correction = 0.0, 0.0
    for j in range(size):
        largest = max(abs(step.start.x[j]), abs(step.end.x[j]))
        scale = 1.0 / (absolute + relative * largest)
        total += square(scale * step.terms[0, j])
        correction += square(scale * step.terms[1, j])
    if total == 0.0:
        return 0.0
    return h * total / np.sqrt((total + 0.01 * correction) * size)


@compiled
def is_quiet(model: Record, h: float, step: Record) -> bool:
    """True if every error of the step is at most the fraction QUIET of its tolerance.

    This implies the same bound for `step_error`, without its divisions. Overwrites the first terms
    of the interpolant.
    """
    method, numerics, errors = method_of(model, step), model.numerics, step.terms[0]
    weigh_slopes(method.error, method.last + 1, model.num_states, step, errors)
    for j in range(model.num_states):
        largest = max(abs(step.start.x[j]), abs(step.end.x[j]))
        allowed = numerics.absolute_tolerance + numerics.relative_tolerance * largest
        if not abs(h * errors[j]) <= QUIET * allowed:
            return False
    return True


@compiled_apart(
    types.void, MODEL, DISCRETE, types.float64, types.float64, STEP, WORKSPACE, unrolled=True
)
def prepare_interpolant(
    model: Record, discrete: Record, t: float, h: float, step: Record, work: Record
) -> None:
    """Fills ``terms`` for `interpolate` once; ``work`` is then evaluated inside the step."""
    if step.prepared == 1:
        return
    step.prepared = 1
    method = method_of(model, step)
    for row in range(method.last + 1, method.num_slopes):
        set_stage(model, row, h, step, step.stage)
        flow(model, discrete, t + method.nodes[row] * h, step.stage, step.slopes[row], work)
    fill_terms(model, h, step)
