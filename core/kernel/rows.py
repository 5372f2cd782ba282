"""Writes one row of the trace, in the order of `slipgrasp.core.trace.trace.SIGNALS`."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.controllability import find_controllable
from slipgrasp.core.kernel.dynamics import stored_energy
from slipgrasp.core.kernel.flow import solve_plant, update_command, update_mechanics, update_rates
from slipgrasp.core.kernel.guards import friction_margin, present_friction
from slipgrasp.core.kernel.kinematics import joint_angle
from slipgrasp.core.kernel.law import lyapunov_value, true_value
from slipgrasp.core.kernel.linear import condition
from slipgrasp.core.kernel.model import MODEL
from slipgrasp.core.kernel.records import MAX_FINGERS, MAX_UNKNOWNS, STATE, Floats, Record
from slipgrasp.core.kernel.reduced import forces_to_torques, torques_to_forces
from slipgrasp.core.kernel.workspace import DISCRETE, WORKSPACE
from slipgrasp.core.trace.trace import TraceShape

LARGEST = 1e300
MAX_COLUMNS = TraceShape(MAX_FINGERS, ("",) * MAX_UNKNOWNS).num_columns

# The state of one row with all that belongs to it, and the row itself.
ROW = np.dtype(
    [
        ("time", np.float64),  # [s]
        ("state", STATE),
        ("discrete", DISCRETE),
        ("torques", np.float64, (MAX_FINGERS, 2)),
        ("kinetic_energy", np.float64),  # [J]
        ("potential_energy", np.float64),  # [J]
        ("length", np.int64),
        ("values", np.float64, (MAX_COLUMNS,)),
    ],
    align=True,
)


@compiled_apart(types.int64, MODEL, ROW, WORKSPACE)
def evaluate_row(model: Record, row: Record, work: Record) -> int:
    """Evaluates the closed loop at the state of ``row``, with the torque that acts there.

    Returns:
        1, or 0 where anything is not finite.
    """
    n, discrete = model.num_fingers, row.discrete
    update_mechanics(model, row.state, work)
    regular = update_command(model, discrete, row.time, row.state, work)
    if model.law.period > 0.0:
        for i in range(n):
            for joint in range(2):
                row.torques[i, joint] = discrete.torques[i, joint]
        torques_to_forces(work.kin, n, row.torques, work.tip_forces)
    else:
        if regular == 0:
            return 0
        forces_to_torques(work.kin, n, work.tip_forces, row.torques)
    solve_plant(model, discrete, work)
    for k in range(model.num_unknowns):
        if discrete.clamps[k] != 0:
            # The guard of an estimate that rests on a bound looks at its rate.
            update_rates(model, discrete, row.state, work)
            break
    kinetic, potential = stored_energy(model.hand, model.truth, work.kin, row.state)
    row.kinetic_energy, row.potential_energy = kinetic, potential
    finite = abs(kinetic + potential) < np.inf
    for k in range(model.num_states):
        finite = finite and abs(row.state.x[k]) < np.inf
    for k in range(3 + n):
        finite = finite and abs(work.acceleration[k]) < np.inf
    for i in range(n):
        for axis in range(2):
            finite = finite and abs(row.torques[i, axis]) < np.inf
            finite = finite and abs(work.forces[i, axis]) < np.inf
    return 1 if finite else 0


@compiled_apart(types.void, MODEL, ROW, WORKSPACE)
def fill_row(model: Record, row: Record, work: Record) -> None:
    """Writes the values of an evaluated row, which are finite as what it is made of is."""
    n, state, values = model.num_fingers, row.state.x, row.values
    values[0] = row.time
    at = _put(values, 1, state, 0, 6)
    at = _put(values, at, work.acceleration, 0, 3)
    at = _put(values, at, work.room.error, 0, 3)
    at = _put(values, at, model.load, 0, 3)
    values[at] = find_controllable(model, row.discrete, work)
    at = _put(values, at + 1, work.shares, 0, 3)
    at = _put(values, at, state, 6, 2 * n)
    at = _put(values, at, work.acceleration, 3, n)
    for i in range(n):
        values[at + i] = row.discrete.phases[i]
        values[at + n + i] = row.discrete.beliefs[i]
        values[at + 2 * n + i] = work.forces[i, 0]
        values[at + 3 * n + i] = work.forces[i, 1]
        values[at + 4 * n + i] = friction_margin(model, row.discrete, work, i)
        values[at + 5 * n + i] = present_friction(model, row.discrete, i)
    at += 6 * n
    for i in range(n):
        for joint in range(2):
            values[at + 2 * i + joint] = joint_angle(work.kin, i, joint)
            values[at + 2 * n + 2 * i + joint] = work.kin.joint_velocities[i, joint]
            values[at + 4 * n + 2 * i + joint] = row.torques[i, joint]
    at = _put_controller(model, row.state, work, values, at + 6 * n)
    values[at] = row.kinetic_energy
    values[at + 1] = row.potential_energy
    values[at + 2] = state[model.num_states - 2]
    values[at + 3] = state[model.num_states - 1]
    row.length = at + 4


@compiled
def _put(values: Floats, at: int, source: Floats, start: int, count: int) -> int:
    for k in range(count):
        values[at + k] = source[start + k]
    return at + count


@compiled
def _put_controller(model: Record, state: Record, work: Record, values: Floats, at: int) -> int:
    n, p = model.num_fingers, model.num_unknowns
    for k in range(p):
        values[at + k] = state.x[6 + 2 * n + k]
        values[at + p + k] = true_value(model.truth, model.unknowns, k)
    at += 2 * p
    values[at] = _finite(lyapunov_value(model.law, model.truth, model.unknowns, state, work.room))
    values[at + 1] = work.room.violation
    values[at + 2] = _finite(condition(work.inertia, work.factors, n, work.column))
    values[at + 3] = _finite(
        condition(work.estimated_inertia, work.estimated_factors, n, work.column)
    )
    return at + 4


@compiled
def _finite(value: float) -> float:
    """A value that says how large something is, where a singular matrix makes it infinite."""
    return value if value < LARGEST else LARGEST
