"""Rows of the trace: all signals at one instant (`slipgrasp.core.trace.signals`)."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Record
from slipgrasp.core.kernel.loop.friction import present_friction
from slipgrasp.core.kernel.loop.rows import (
    finite,
    make_fill_shared,
    place_signals,
    row_layout,
    set_value,
)
from slipgrasp.core.kernel.planar.controllability import find_controllable
from slipgrasp.core.kernel.planar.dynamics import stored_energy
from slipgrasp.core.kernel.planar.flow import (
    holds_law,
    solve_plant,
    update_command,
    update_mechanics,
)
from slipgrasp.core.kernel.planar.guards import friction_margin
from slipgrasp.core.kernel.planar.inertia import condition
from slipgrasp.core.kernel.planar.kinematics import joint_position
from slipgrasp.core.kernel.planar.law import lyapunov_value, true_value
from slipgrasp.core.kernel.planar.laws.interface import adapt
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.reduced import forces_to_torques, torques_to_forces
from slipgrasp.core.kernel.planar.state import (
    STATE,
    count_coordinates,
    dissipated_at,
    estimate_at,
    slip_at,
    slip_coordinate,
    slip_velocity_at,
    supplied_at,
    velocity_at,
)
from slipgrasp.core.kernel.planar.workspace import DISCRETE, WORKSPACE
from slipgrasp.core.scenario.space import PLANAR

AT = place_signals(PLANAR)
JOINTS_PER_FINGER = PLANAR.joints_per_finger
ROW = row_layout(STATE, DISCRETE, [("torques", np.float64, (MAX_FINGERS, 2))], PLANAR)

_fill_shared = make_fill_shared(AT, true_value)


@compiled_apart(types.int64, MODEL, ROW, WORKSPACE)
def evaluate_row(model: Record, row: Record, work: Record) -> int:
    """Evaluates the closed loop at the state of ``row``, with the torque applied there.

    Returns:
        1, or 0 if a value is not finite.
    """
    n, discrete = model.num_fingers, row.discrete
    update_mechanics(model, row.state, work)
    if model.law.period > 0.0:
        if not holds_law(model, discrete, row.time, row.state, work):
            update_command(model, discrete, row.time, row.state, work)
        for i in range(n):
            for joint in range(2):
                row.torques[i, joint] = discrete.torques[i, joint]
        torques_to_forces(work.kin, n, row.torques, work.tip_forces)
    else:
        if update_command(model, discrete, row.time, row.state, work) == 0:
            return 0
        forces_to_torques(work.kin, n, work.tip_forces, row.torques)
    solve_plant(model, discrete, work)
    for k in range(model.num_unknowns):
        if discrete.clamps[k] != 0:
            # The guard of an estimate at a bound depends on its rate.
            adapt(model, discrete, row.state, work)
            break
    kinetic, potential = stored_energy(model.hand, model.truth, work.kin, row.state)
    row.kinetic_energy, row.potential_energy = kinetic, potential
    finite = abs(kinetic + potential) < np.inf
    for k in range(model.num_states):
        finite = finite and abs(row.state.x[k]) < np.inf
    for k in range(count_coordinates(n)):
        finite = finite and abs(work.acceleration[k]) < np.inf
    for i in range(n):
        for axis in range(2):
            finite = finite and abs(row.torques[i, axis]) < np.inf
            finite = finite and abs(work.forces[i, axis]) < np.inf
    return 1 if finite else 0


@compiled_apart(types.void, MODEL, ROW, WORKSPACE)
def fill_row(model: Record, row: Record, work: Record) -> None:
    """Writes the signals of an evaluated row; they are finite because its state is."""
    _fill_shared(model, row, row.state.x[supplied_at(model)], row.state.x[dissipated_at(model)])
    _set_object(model, row, work)
    for i in range(model.num_fingers):
        _set_contact(model, row, work, i)
    _set_controller(model, row, work)


@compiled
def _set_object(model: Record, row: Record, work: Record) -> None:
    rank = find_controllable(model, row.discrete, work)
    set_value(model, row, AT.input_rank, 0, rank)
    for k in range(3):
        set_value(model, row, AT.object_pose, k, row.state.x[k])
        set_value(model, row, AT.object_velocity, k, row.state.x[velocity_at(k)])
        set_value(model, row, AT.object_acceleration, k, work.acceleration[k])
        set_value(model, row, AT.tracking_error, k, work.room.error[k])
        set_value(model, row, AT.external_wrench, k, model.load[k])
        set_value(model, row, AT.controllability, k, work.shares[k])


@compiled
def _set_contact(model: Record, row: Record, work: Record, i: int) -> None:
    """Writes the signals of contact ``i`` and of the joints of its finger."""
    n, discrete = model.num_fingers, row.discrete
    set_value(model, row, AT.slip, i, row.state.x[slip_at(i)])
    set_value(model, row, AT.slip_velocity, i, row.state.x[slip_velocity_at(n, i)])
    set_value(model, row, AT.slip_acceleration, i, work.acceleration[slip_coordinate(i)])
    set_value(model, row, AT.phase, i, discrete.phases[i])
    set_value(model, row, AT.believed_phase, i, discrete.beliefs[i])
    set_value(model, row, AT.tangential_force, i, work.forces[i, 0])
    set_value(model, row, AT.normal_force, i, work.forces[i, 1])
    set_value(model, row, AT.friction_margin, i, friction_margin(model, discrete, work, i))
    set_value(model, row, AT.friction_coefficient, i, present_friction(model, discrete, i))
    for joint in range(JOINTS_PER_FINGER):
        k = JOINTS_PER_FINGER * i + joint
        set_value(model, row, AT.joint_position, k, joint_position(model.hand, work.kin, i, joint))
        set_value(model, row, AT.joint_velocity, k, work.kin.joint_velocities[i, joint])
        set_value(model, row, AT.joint_torque, k, row.torques[i, joint])
        commanded = row.torques[i, joint]
        if model.law.period > 0.0:
            commanded = discrete.commanded[i, joint]
        set_value(model, row, AT.commanded_torque, k, commanded)


@compiled
def _set_controller(model: Record, row: Record, work: Record) -> None:
    n, truth, unknowns = model.num_fingers, model.truth, model.unknowns
    for k in range(model.num_unknowns):
        set_value(model, row, AT.estimates, k, row.state.x[estimate_at(n, k)])
    value = lyapunov_value(model.law, truth, unknowns, row.state, work.room)
    set_value(model, row, AT.lyapunov_value, 0, finite(value))
    set_value(model, row, AT.grasp_violation, 0, work.room.violation)
    value = condition(work.inertia, work.factors, n, work.column)
    set_value(model, row, AT.inertia_condition, 0, finite(value))
    value = condition(work.estimated_inertia, work.estimated_factors, n, work.column)
    set_value(model, row, AT.estimated_inertia_condition, 0, finite(value))
