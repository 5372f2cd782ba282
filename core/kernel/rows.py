"""Writes one row of the trace, in the order of `core.trace.SIGNALS`."""

from __future__ import annotations

import numpy as np

from core.kernel.compiler import compiled
from core.kernel.dynamics import stored_energy
from core.kernel.flow import (
    flow,
    update_belief,
    update_command,
    update_mechanics,
)
from core.kernel.guards import friction_margin
from core.kernel.law import forces_to_torques, lyapunov_value, true_value
from core.kernel.linear import condition
from core.kernel.records import Floats, Record


@compiled
def write_row(
    model: Record,
    discrete: Record,
    t: float,
    state: Floats,
    derivative: Floats,
    torques: Floats,
    work: Record,
    row: Floats,
) -> bool:
    """Evaluates the state and fills ``row``; False if anything in it is not finite."""
    n = model.num_fingers
    if model.law.period > 0.0:
        update_mechanics(model, state, work)
        update_belief(model, discrete, t, state, work)
        update_command(model, discrete, work)
        for i in range(n):
            for joint in range(2):
                torques[i, joint] = discrete.torques[i, joint]
        flow(model, discrete, t, state, derivative, work)
    else:
        flow(model, discrete, t, state, derivative, work)
        forces_to_torques(work.kin, n, work.tip_forces, torques)
    row[0] = t
    at = _put(row, 1, state[0:6])
    at = _put(row, at, work.acceleration[0:3])
    at = _put(row, at, work.room.error[0:3])
    at = _put(row, at, state[6 : 6 + 2 * n])
    at = _put(row, at, work.acceleration[3 : 3 + n])
    at = _put_contacts(model, discrete, work, row, at)
    for i in range(n):
        at = _put(row, at, work.kin.joint_positions[i])
    for i in range(n):
        at = _put(row, at, work.kin.joint_velocities[i])
    for i in range(n):
        at = _put(row, at, torques[i])
    at = _put_controller(model, state, n, work, row, at)
    kinetic, potential = stored_energy(model.hand, model.truth, work.kin, state)
    row[at] = kinetic
    row[at + 1] = potential
    row[at + 2] = state[model.num_states - 2]
    row[at + 3] = state[model.num_states - 1]
    for value in row:
        if not np.isfinite(value):
            return False
    return True


@compiled
def _put(row: Floats, at: int, values: Floats) -> int:
    for k in range(values.shape[0]):
        row[at + k] = values[k]
    return at + values.shape[0]


@compiled
def _put_contacts(model: Record, discrete: Record, work: Record, row: Floats, at: int) -> int:
    n = model.num_fingers
    for i in range(n):
        row[at + i] = discrete.phases[i]
        row[at + n + i] = discrete.beliefs[i]
        row[at + 2 * n + i] = work.forces[i, 0]
        row[at + 3 * n + i] = work.forces[i, 1]
        row[at + 4 * n + i] = friction_margin(model, work, i)
        row[at + 5 * n + i] = model.truth.friction[i]
    return at + 6 * n


@compiled
def _put_controller(
    model: Record, state: Floats, n: int, work: Record, row: Floats, at: int
) -> int:
    p = model.num_unknowns
    estimates = state[6 + 2 * n : 6 + 2 * n + p]
    at = _put(row, at, estimates)
    for k in range(p):
        row[at + k] = true_value(model.truth, model.unknowns, k)
    at += p
    row[at] = lyapunov_value(model.law, model.truth, model.unknowns, estimates, work.room)
    row[at + 1] = work.room.violation
    row[at + 2] = condition(work.inertia, work.inertia_factors, work.pivots, 3 + n, work.column)
    row[at + 3] = condition(
        work.estimated_inertia, work.estimated_factors, work.estimated_pivots, 3 + n, work.column
    )
    return at + 4
