"""Rows of the trace of a run on a rail, and its accumulators of the metrics."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.friction import present_friction
from slipgrasp.core.kernel.loop.motion import desired_motion
from slipgrasp.core.kernel.loop.rows import (
    finite,
    make_fill_shared,
    place_signals,
    row_layout,
    set_value,
)
from slipgrasp.core.kernel.loop.tally import add_row, add_squared_error, tally_layout
from slipgrasp.core.kernel.numerics.methods import method_of
from slipgrasp.core.kernel.planar.dynamics import stored_energy
from slipgrasp.core.kernel.planar.kinematics import joint_position
from slipgrasp.core.kernel.planar.state import STATE, dissipated_at, supplied_at
from slipgrasp.core.kernel.rail.flow import rail_evaluate
from slipgrasp.core.kernel.rail.guards import friction_margin, speed_at
from slipgrasp.core.kernel.rail.model import FINGER, MODEL, NUM_CONTACTS, RAIL_CONTACT
from slipgrasp.core.kernel.rail.state import (
    DISCRETE,
    MASS,
    POSITION,
    SLIP,
    SPEED,
    WORKSPACE,
)
from slipgrasp.core.scenario.space import RAIL

AT = place_signals(RAIL)
ROW = row_layout(STATE, DISCRETE, [], RAIL)
TALLY = tally_layout(1)


@compiled
def _true_value(truth: Record, _unknowns: int, _k: int) -> float:
    """The mass of the object."""
    return float(truth.object_inertia[0])


_fill_shared = make_fill_shared(AT, _true_value)


@compiled_apart(types.int64, MODEL, ROW, WORKSPACE)
def rail_evaluate_row(model: Record, row: Record, work: Record) -> int:
    """Evaluates the closed loop at the state of ``row``; 0 if a value is not finite."""
    rail_evaluate(model, row.discrete, row.time, row.state, work)
    kinetic, potential = stored_energy(model.hand, model.truth, work.kin, row.state)
    row.kinetic_energy, row.potential_energy = kinetic, potential
    total = abs(kinetic + potential)
    for k in range(model.num_states):
        total += abs(row.state.x[k])
    for i in range(2):
        total += abs(work.acceleration[i]) + abs(work.torques[i])
        total += abs(work.forces[i, 0]) + abs(work.forces[i, 1])
    return 1 if total < np.inf else 0


@compiled_apart(types.void, MODEL, ROW, WORKSPACE)
def rail_fill(model: Record, row: Record, work: Record) -> None:
    """Writes the signals of an evaluated row; those of hands remain 0."""
    x, discrete = row.state.x, row.discrete
    _fill_shared(model, row, x[supplied_at(model)], x[dissipated_at(model)])
    set_value(model, row, AT.object_pose, 0, x[POSITION])
    set_value(model, row, AT.object_velocity, 0, x[SPEED])
    set_value(model, row, AT.object_acceleration, 0, work.acceleration[0])
    set_value(model, row, AT.tracking_error, 0, work.room.error[0])
    set_value(model, row, AT.slip, FINGER, x[SLIP])
    set_value(model, row, AT.slip, RAIL_CONTACT, x[POSITION] - model.motion.start[0])
    for i in range(NUM_CONTACTS):
        set_value(model, row, AT.slip_velocity, i, x[speed_at(i)])
        set_value(model, row, AT.slip_acceleration, i, work.acceleration[1 - i])
        set_value(model, row, AT.phase, i, discrete.phases[i])
        set_value(model, row, AT.tangential_force, i, work.forces[i, 0])
        set_value(model, row, AT.normal_force, i, work.forces[i, 1])
        set_value(model, row, AT.friction_margin, i, friction_margin(model, discrete, work, i))
        set_value(model, row, AT.friction_coefficient, i, present_friction(model, discrete, i))
    for joint in range(2):
        position = joint_position(model.hand, work.kin, 0, joint)
        set_value(model, row, AT.joint_position, joint, position)
        set_value(model, row, AT.joint_velocity, joint, work.kin.joint_velocities[0, joint])
        set_value(model, row, AT.joint_torque, joint, work.torques[joint])
        set_value(model, row, AT.commanded_torque, joint, work.torques[joint])
    if model.num_unknowns > 0:
        set_value(model, row, AT.estimates, 0, x[MASS])
    set_value(model, row, AT.lyapunov_value, 0, finite(work.lyapunov))


@compiled
def _error(model: Record, discrete: Record, t: float, state: Record) -> tuple[float, float]:
    """Tracking error and its rate."""
    position, velocity, _ = desired_motion(model.motion, discrete.piece, t, 0)
    return position - state.x[POSITION], velocity - state.x[SPEED]


@compiled
def add_step(
    model: Record, discrete: Record, step: Record, t: float, h: float, tally: Record
) -> None:
    """Adds an accepted step of size ``h`` from time ``t`` to integrals and slip paths."""
    tally.slip_path[FINGER] += abs(step.end.x[SLIP] - step.start.x[SLIP])
    tally.slip_path[RAIL_CONTACT] += abs(step.end.x[POSITION] - step.start.x[POSITION])
    is_known = tally.steps > 0 and tally.piece == discrete.piece
    tally.steps, tally.piece = tally.steps + 1, discrete.piece
    if not is_known:
        tally.end_error[0], tally.end_rate[0] = _error(model, discrete, t, step.start)
    error, rate = _error(model, discrete, t + h, step.end)
    add_squared_error(tally, 0, h, error, rate)
    method, effort = method_of(model, step), 0.0
    for k in range(method.last):
        effort += method.matrix[method.last, k] * step.efforts[k]
    tally.effort += h * effort


@compiled_apart(types.void, MODEL, ROW, WORKSPACE, TALLY)
def rail_tally(model: Record, row: Record, work: Record, tally: Record) -> None:
    """Adds an evaluated row to the metrics."""
    add_row(model, row, work, tally, 0.0, friction_margin)
