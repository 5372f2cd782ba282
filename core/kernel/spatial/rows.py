"""Rows of the trace of a hand in space."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Sequence

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Record
from slipgrasp.core.kernel.loop.motion import pass_breaks
from slipgrasp.core.kernel.numerics.dense import invert_dense
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.spatial.dynamics import (
    combine_links,
    stored_energy,
    update_unit_dynamics,
)
from slipgrasp.core.kernel.spatial.flow import set_directions, spatial_plant
from slipgrasp.core.kernel.spatial.inertia import fill_inertia
from slipgrasp.core.kernel.spatial.kinematics import joint_angle
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
    dissipated_at,
    path_at,
    slip_at,
    slip_velocity_at,
    supplied_at,
)
from slipgrasp.core.kernel.spatial.ways import least_margin, present_friction
from slipgrasp.core.kernel.spatial.workspace import (
    DISCRETE,
    MAX_FORCES,
    MAX_ROWS,
    WORKSPACE,
)
from slipgrasp.core.scenario import MAX_DIAGNOSTICS, MAX_UNKNOWNS
from slipgrasp.core.scenario.own_laws import Diagnostic
from slipgrasp.core.scenario.space import SPATIAL
from slipgrasp.core.trace.trace import SIGNALS, Signal, TraceShape


def _shape(n: int, p: int, d: int) -> TraceShape:
    return TraceShape(n, ("",) * p, (Diagnostic("", "", ""),) * d, space=SPATIAL)


def _columns_before(signals: Sequence[Signal]) -> tuple[int, int, int, int]:
    """Columns of signals: a number, and how many more per finger, unknown and diagnostic."""

    def columns(n: int, p: int, d: int) -> int:
        shape = _shape(n, p, d)
        return sum(shape.width(signal) for signal in signals)

    none = columns(0, 0, 0)
    return none, columns(1, 0, 0) - none, columns(0, 1, 0) - none, columns(0, 0, 1) - none


# First column of every signal, by its name, and the end of a row.
_Places = namedtuple("_Places", [signal.name for signal in SIGNALS])
AT = _Places._make(_columns_before(SIGNALS[:index]) for index in range(len(SIGNALS)))
END = _columns_before(SIGNALS)

LARGEST = 1e300
DEPENDENT = 1e-10
MAX_COLUMNS = _shape(MAX_FINGERS, MAX_UNKNOWNS, MAX_DIAGNOSTICS).num_columns

# The state of one row with all that belongs to it, and the row itself.
ROW = np.dtype(
    [
        ("time", np.float64),  # [s]
        ("state", STATE),
        ("discrete", DISCRETE),
        ("kinetic_energy", np.float64),  # [J]
        ("potential_energy", np.float64),  # [J]
        ("length", np.int64),
        ("values", np.float64, (MAX_COLUMNS,)),
        ("vectors", np.float64, (MAX_FORCES, MAX_ROWS)),  # columns of B~ J_c^T
        ("matrix", np.float64, (MAX_COORDINATES, MAX_COORDINATES)),
        ("order", np.int64, (MAX_COORDINATES,)),
    ],
    align=True,
)


@compiled_apart(types.int64, MODEL, ROW, WORKSPACE)
def spatial_evaluate(model: Record, row: Record, work: Record) -> int:
    """Evaluates plant and errors at the state of ``row``; 0 where anything is not finite."""
    n, discrete = model.num_fingers, row.discrete
    pass_breaks(model.motion, discrete, row.time)
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


@compiled
def _finite(value: float) -> float:
    """A value that says how large something is, where a singular matrix makes it infinite."""
    return value if value < LARGEST else LARGEST


@compiled_apart(types.float64, MODEL, ROW)
def spatial_condition(model: Record, row: Record) -> float:
    """Condition in the 1-norm of ``row.matrix``, which is inverted in its place."""
    size = 6 + 2 * model.num_fingers
    largest = _one_norm(row.matrix, size)
    if not invert_dense(row.matrix, size, row.order):
        return LARGEST
    return _finite(largest * _one_norm(row.matrix, size))


@compiled
def _one_norm(matrix: Floats, size: int) -> float:
    """The largest sum of a column."""
    largest = 0.0
    for b in range(size):
        total = 0.0
        for a in range(size):
            total += abs(matrix[a, b])
        largest = max(largest, total)
    return largest


@compiled_apart(types.void, MODEL, ROW, WORKSPACE)
def spatial_fill(model: Record, row: Record, work: Record) -> None:
    """Writes the values of an evaluated row."""
    n, x = model.num_fingers, row.state.x
    _set(model, row, AT.times, 0, row.time)
    for k in range(7):
        _set(model, row, AT.object_pose, k, x[POSITION + k])
    rank = _find_controllable(model, row, work)
    _set(model, row, AT.input_rank, 0, rank)
    for k in range(6):
        _set(model, row, AT.object_velocity, k, x[VELOCITY + k])
        _set(model, row, AT.object_acceleration, k, work.acceleration[k])
        _set(model, row, AT.tracking_error, k, work.room.error[k])
        _set(model, row, AT.external_wrench, k, model.load[k])
    for i in range(n):
        _set_contact(model, row, work, i)
    _set_controller(model, row, work)
    _set(model, row, AT.kinetic_energy, 0, row.kinetic_energy)
    _set(model, row, AT.potential_energy, 0, row.potential_energy)
    _set(model, row, AT.supplied_energy, 0, x[supplied_at(n)])
    _set(model, row, AT.dissipated_energy, 0, x[dissipated_at(n)])
    row.length = column_of(model, END)


@compiled
def column_of(model: Record, place: tuple[int, int, int, int]) -> int:
    """Column at which a signal begins, by its entry in `AT`."""
    n, p, d = model.num_fingers, model.num_unknowns, model.num_diagnostics
    return place[0] + place[1] * n + place[2] * p + place[3] * d


@compiled
def _set(
    model: Record, row: Record, place: tuple[int, int, int, int], k: int, value: float
) -> None:
    """Writes entry ``k`` of a signal."""
    row.values[column_of(model, place) + k] = value


@compiled
def _set_contact(model: Record, row: Record, work: Record, i: int) -> None:
    """What belongs to contact ``i`` and to the joints of its finger."""
    n, discrete, x = model.num_fingers, row.discrete, row.state.x
    for axis in range(2):
        k = 2 * i + axis
        _set(model, row, AT.slip, k, x[slip_at(i, axis)])
        _set(model, row, AT.slip_velocity, k, x[slip_velocity_at(n, i, axis)])
        _set(model, row, AT.slip_acceleration, k, work.slip_acceleration[i, axis])
        _set(model, row, AT.tangential_force, k, work.forces[i, axis])
    _set(model, row, AT.slip_path, i, x[path_at(n, i)])
    _set(model, row, AT.phase, i, discrete.phases[i])
    _set(model, row, AT.believed_phase, i, discrete.beliefs[i])
    _set(model, row, AT.normal_force, i, work.forces[i, 2])
    _set(model, row, AT.friction_margin, i, least_margin(model, discrete, work, i))
    _set(model, row, AT.friction_coefficient, i, present_friction(model, discrete, i))
    for joint in range(3):
        k = 3 * i + joint
        _set(model, row, AT.joint_position, k, joint_angle(work.kin, i, joint))
        _set(model, row, AT.joint_velocity, k, work.kin.rates[i, joint])
        _set(model, row, AT.joint_torque, k, discrete.torques[i, joint])
        _set(model, row, AT.commanded_torque, k, discrete.commanded[i, joint])


@compiled
def _set_controller(model: Record, row: Record, work: Record) -> None:
    truth, unknowns, discrete = model.truth, model.unknowns, row.discrete
    for k in range(model.num_unknowns):
        _set(model, row, AT.estimates, k, discrete.estimates[k])
        _set(model, row, AT.true_parameters, k, true_value(truth, unknowns, k))
    for k in range(model.num_diagnostics):
        _set(model, row, AT.diagnostics, k, discrete.diagnostics[k])
    value = lyapunov_value(model, discrete.estimates, work.room)
    _set(model, row, AT.lyapunov_value, 0, _finite(value))
    _set(model, row, AT.grasp_violation, 0, discrete.violation)
    fill_inertia(work.kin, work.dynamics, truth, discrete.slips, work.system, row.matrix)
    _set(model, row, AT.inertia_condition, 0, spatial_condition(model, row))
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
    _set(model, row, AT.estimated_inertia_condition, 0, spatial_condition(model, row))


@compiled
def _find_controllable(model: Record, row: Record, work: Record) -> int:
    """Rank of B~ = [W; -D] J_c^-T, and the share of each acceleration that torques can produce."""
    n, kin, vectors, discrete = model.num_fingers, work.kin, row.vectors, row.discrete
    lines = 6
    for i in range(n):
        lines += int(discrete.slips[i, 0] + discrete.slips[i, 1])
    at = 6
    for i in range(n):
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
        _set(model, row, AT.controllability, k, 1.0 if rank == lines else share)
    return rank


@compiled
def _keep_independent(vectors: Floats, length: int, count: int, candidate: int) -> int:
    """Moves a vector behind the ``count`` orthonormal ones if it is independent of them."""
    whole, rest = 0.0, 0.0
    for k in range(length):
        whole += square(vectors[candidate, k])
    for _ in range(2):
        for j in range(count):
            part = 0.0
            for k in range(length):
                part += vectors[j, k] * vectors[candidate, k]
            for k in range(length):
                vectors[candidate, k] -= part * vectors[j, k]
    for k in range(length):
        rest += square(vectors[candidate, k])
    if rest <= square(DEPENDENT) * whole:
        return 0
    inverse = 1.0 / np.sqrt(rest)
    for k in range(length):
        vectors[count, k] = inverse * vectors[candidate, k]
    return 1
