"""Rows of the trace of a spatial hand."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.loop.friction import present_friction
from slipgrasp.core.kernel.loop.links import combine_links
from slipgrasp.core.kernel.loop.motion import pass_breaks
from slipgrasp.core.kernel.loop.rows import (
    LARGEST,
    finite,
    make_fill_shared,
    place_signals,
    remove_parts,
    row_layout,
    set_value,
)
from slipgrasp.core.kernel.numerics.dense import invert_dense
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.spatial.dynamics import (
    stored_energy,
    update_unit_dynamics,
)
from slipgrasp.core.kernel.spatial.flow import set_directions, spatial_plant
from slipgrasp.core.kernel.spatial.inertia import fill_inertia
from slipgrasp.core.kernel.spatial.kinematics import joint_position
from slipgrasp.core.kernel.spatial.law import (
    believe,
    leave_stuck,
    lyapunov_value,
    true_value,
    update_errors,
)
from slipgrasp.core.kernel.spatial.model import MAX_COORDINATES, MODEL
from slipgrasp.core.kernel.spatial.plant import assemble
from slipgrasp.core.kernel.spatial.state import (
    POSITION,
    STATE,
    VELOCITY,
    count_coordinates,
    dissipated_at,
    path_at,
    slip_at,
    slip_velocity_at,
    spin_at,
    spin_velocity_at,
    supplied_at,
)
from slipgrasp.core.kernel.spatial.torsion import respond_to_tip_force
from slipgrasp.core.kernel.spatial.torsion_modes import spatial_find_modes
from slipgrasp.core.kernel.spatial.torsion_phases import assemble_phases
from slipgrasp.core.kernel.spatial.ways import least_margin
from slipgrasp.core.kernel.spatial.workspace import (
    DISCRETE,
    MAX_FORCES,
    MAX_ROWS,
    WORKSPACE,
)
from slipgrasp.core.scenario.space import SPATIAL

AT = place_signals(SPATIAL)
ROW = row_layout(
    STATE,
    DISCRETE,
    [
        ("vectors", np.float64, (MAX_FORCES, MAX_ROWS)),  # columns of B~ J_c^T
        ("matrix", np.float64, (MAX_COORDINATES, MAX_COORDINATES)),
        ("order", np.int64, (MAX_COORDINATES,)),
    ],
    SPATIAL,
)

_fill_shared = make_fill_shared(AT, true_value)


@compiled_apart(types.int64, MODEL, ROW, WORKSPACE)
def spatial_evaluate(model: Record, row: Record, work: Record) -> int:
    """Evaluates plant and errors at the state of ``row``; 0 if a value is not finite."""
    n, discrete = model.num_fingers, row.discrete
    pass_breaks(model.motion, discrete, row.time)
    if work.at_start == 0:
        spatial_plant(model, discrete, row.state, work)
    update_errors(model, discrete.piece, row.time, row.state, work.room)
    leave_stuck(n, discrete.slips, work.room)
    kinetic, potential = stored_energy(model.hand, model.truth, work.kin, row.state)
    row.kinetic_energy, row.potential_energy = kinetic, potential
    total = kinetic + potential
    for k in range(model.num_states):
        total += abs(row.state.x[k])
    for k in range(6):
        total += abs(work.acceleration[k])
    for i in range(n):
        total += abs(work.slip_acceleration[i, 0]) + abs(work.slip_acceleration[i, 1])
        for k in range(3):
            total += abs(work.forces[i, k]) + abs(discrete.torques[i, k])
    for k in range(model.num_unknowns):
        total += abs(discrete.estimates[k])
    return 1 if abs(total) < np.inf else 0


@compiled_apart(types.float64, MODEL, ROW)
def spatial_condition(model: Record, row: Record) -> float:
    """Condition number in the 1-norm of ``row.matrix``, which is inverted in place."""
    size = count_coordinates(model.num_fingers)
    largest = _one_norm(row.matrix, size)
    if not invert_dense(row.matrix, size, row.order):
        return LARGEST
    return finite(largest * _one_norm(row.matrix, size))


@compiled
def _one_norm(matrix: Floats, size: int) -> float:
    """1-norm: the largest absolute column sum."""
    largest = 0.0
    for b in range(size):
        total = 0.0
        for a in range(size):
            total += abs(matrix[a, b])
        largest = max(largest, total)
    return largest


@compiled_apart(types.void, MODEL, ROW, WORKSPACE)
def spatial_fill(model: Record, row: Record, work: Record) -> None:
    """Writes the signals of an evaluated row."""
    n, x = model.num_fingers, row.state.x
    _fill_shared(model, row, x[supplied_at(model)], x[dissipated_at(model)])
    for k in range(7):
        set_value(model, row, AT.object_pose, k, x[POSITION + k])
    if model.soft == 1:
        _assemble(model, row, work)
    rank = _find_controllable(model, row, work)
    set_value(model, row, AT.input_rank, 0, rank)
    for k in range(6):
        set_value(model, row, AT.object_velocity, k, x[VELOCITY + k])
        set_value(model, row, AT.object_acceleration, k, work.acceleration[k])
        set_value(model, row, AT.tracking_error, k, work.room.error[k])
        set_value(model, row, AT.external_wrench, k, model.load[k])
    for i in range(n):
        _set_contact(model, row, work, i)
    if model.soft == 1:
        _set_pads(model, row, work)
    _set_controller(model, row, work)


@compiled
def _set_contact(model: Record, row: Record, work: Record, i: int) -> None:
    """Writes the signals of contact ``i`` and of the joints of its finger."""
    n, discrete, x = model.num_fingers, row.discrete, row.state.x
    for axis in range(2):
        k = 2 * i + axis
        set_value(model, row, AT.slip, k, x[slip_at(i, axis)])
        set_value(model, row, AT.slip_velocity, k, x[slip_velocity_at(n, i, axis)])
        set_value(model, row, AT.slip_acceleration, k, work.slip_acceleration[i, axis])
        set_value(model, row, AT.tangential_force, k, work.forces[i, axis])
    set_value(model, row, AT.slip_path, i, x[path_at(n, i)])
    set_value(model, row, AT.phase, i, discrete.phases[i])
    set_value(model, row, AT.believed_phase, i, discrete.beliefs[i])
    set_value(model, row, AT.normal_force, i, work.forces[i, 2])
    set_value(model, row, AT.friction_margin, i, least_margin(model, discrete, work, i))
    set_value(model, row, AT.friction_coefficient, i, present_friction(model, discrete, i))
    for joint in range(3):
        k = 3 * i + joint
        set_value(model, row, AT.joint_position, k, joint_position(model.hand, work.kin, i, joint))
        set_value(model, row, AT.joint_velocity, k, work.kin.rates[i, joint])
        set_value(model, row, AT.joint_torque, k, discrete.torques[i, joint])
        set_value(model, row, AT.commanded_torque, k, discrete.commanded[i, joint])


@compiled
def _set_pads(model: Record, row: Record, work: Record) -> None:
    """Appends spins and moments of all contacts to the columns of hard fingertips."""
    n, x, first = model.num_fingers, row.state.x, row.length
    for i in range(n):
        e = model.hand.eccentricities[i]
        row.values[first + i] = x[spin_at(n, i)]
        row.values[first + n + i] = x[spin_velocity_at(n, i)] / e if e > 0.0 else 0.0
        row.values[first + 2 * n + i] = e * work.moments[i]
    row.length = first + 3 * n


@compiled
def _assemble(model: Record, row: Record, work: Record) -> None:
    """Assembles the reduced form of hard fingertips, without changing the determinant."""
    system, discrete, determinant = work.system, row.discrete, work.system.determinant
    assemble(work.kin, work.dynamics, model.truth, discrete.slips, work.gamma, system)
    system.determinant = determinant


@compiled
def _set_controller(model: Record, row: Record, work: Record) -> None:
    truth, discrete = model.truth, row.discrete
    for k in range(model.num_unknowns):
        set_value(model, row, AT.estimates, k, discrete.estimates[k])
    value = lyapunov_value(model, discrete.estimates, work.room)
    set_value(model, row, AT.lyapunov_value, 0, finite(value))
    set_value(model, row, AT.grasp_violation, 0, discrete.violation)
    fill_inertia(work.kin, work.dynamics, truth, discrete.slips, work.system, row.matrix)
    set_value(model, row, AT.inertia_condition, 0, spatial_condition(model, row))
    update_unit_dynamics(model.hand, work.kin, work.unit)
    believe(model, discrete.estimates, work.believed)
    combine_links(work.believed, work.unit, work.believed_dynamics)
    room = work.room
    set_directions(model, discrete, row.state, room.gamma)
    assemble(
        work.kin,
        work.believed_dynamics,
        work.believed,
        discrete.slips,
        room.gamma,
        work.believed_system,
    )
    fill_inertia(
        work.kin,
        work.believed_dynamics,
        work.believed,
        discrete.slips,
        work.believed_system,
        row.matrix,
    )
    set_value(model, row, AT.estimated_inertia_condition, 0, spatial_condition(model, row))


@compiled
def _find_controllable(model: Record, row: Record, work: Record) -> int:
    """Rank of B~ = [W; -D] J_c^-T; writes the controllable fraction of each acceleration."""
    n, kin, vectors, discrete = model.num_fingers, work.kin, row.vectors, row.discrete
    lines = 6
    for i in range(n):
        lines += int(discrete.slips[i, 0] + discrete.slips[i, 1])
    if model.soft == 1:
        _fill_soft_columns(model, row, work)
    at = 6
    for i in range(n if model.soft == 0 else 0):
        rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
        for k in range(3):
            vector = vectors[3 * i + k]
            for line in range(lines):
                vector[line] = 0.0
            x, y, z = (
                (1.0 if k == 0 else 0.0),
                (1.0 if k == 1 else 0.0),
                (1.0 if k == 2 else 0.0),
            )
            vector[0], vector[1], vector[2] = x, y, z
            vector[3], vector[4], vector[5] = ry * z - rz * y, rz * x - rx * z, rx * y - ry * x
            line = at
            for axis in range(2):
                if discrete.slips[i, axis] != 0.0:
                    vector[line] = work.system.normals[i, axis, k]
                    line += 1
        at += int(discrete.slips[i, 0] + discrete.slips[i, 1])
    rank = 0
    for candidate in range(3 * n):
        rank += _keep_independent(vectors, lines, rank, candidate)
        if rank == lines:
            break
    for k in range(6):
        share = 0.0
        for j in range(rank):
            share += square(vectors[j, k])
        set_value(model, row, AT.controllability, k, 1.0 if rank == lines else share)
    return rank


@compiled
def _fill_soft_columns(model: Record, row: Record, work: Record) -> None:
    """Computes these columns for soft fingertips: M~ times the acceleration per tip force."""
    n, vectors, discrete = model.num_fingers, row.vectors, row.discrete
    truth, system, size = model.truth, work.system, count_coordinates(model.num_fingers)
    fill_inertia(work.kin, work.dynamics, truth, discrete.slips, system, row.matrix)
    assemble_phases(model, discrete, work.gamma, work)
    spatial_find_modes(model, discrete, work)
    for column in range(3 * n):
        respond_to_tip_force(model, discrete, work, column // 3, column % 3)
        line = 0
        for a in range(size):
            if a >= 6 and discrete.slips[(a - 6) // 2, a % 2] == 0.0:
                continue
            total = 0.0
            for b in range(size):
                total += row.matrix[a, b] * work.torsion.responding[b]
            vectors[column, line] = total
            line += 1


@compiled
def _keep_independent(vectors: Floats, length: int, count: int, candidate: int) -> int:
    """Makes a vector orthogonal to ``count`` orthonormal ones; appends it if independent."""
    rest = remove_parts(vectors, length, count, candidate)
    if rest == 0.0:
        return 0
    inverse = 1.0 / np.sqrt(rest)
    for k in range(length):
        vectors[count, k] = inverse * vectors[candidate, k]
    return 1
