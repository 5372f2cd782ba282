"""Composite adaptation from tracking and prediction errors, by least squares.

The torques and the finger dynamics give the contact forces, so the equations of the object and of
the slipping contacts,

    sum f_i = m_o (a + g),  sum r_i x f_i = I_o theta'',  F_x + gamma mu F_n = 0,

are linear in the unknowns: Y phi = y. Recursive least squares with forgetting processes them row
by row. The covariance of the estimates replaces the constant gain in the tracking term of Eq. 24.
Reference: Slotine & Li, Applied Nonlinear Control, 8.7-8.8.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Record
from slipgrasp.core.kernel.laws.least_squares import (
    ACTIVE_BAND,
    LEAST_TRUST,
    begin_rows,
    forget,
    make_take_row,
    memory_layout,
    set_rates,
    weigh_tracking,
)
from slipgrasp.core.kernel.loop.model import FRICTION, LINK_MASS, OBJECT_INERTIA, OBJECT_MASS
from slipgrasp.core.kernel.planar.kinematics import to_contact_frame
from slipgrasp.core.kernel.planar.laws.theorem_3 import gradient_rates
from slipgrasp.core.kernel.planar.model import LAW, MODEL
from slipgrasp.core.kernel.planar.reduced import inertial_force, unit_force
from slipgrasp.core.kernel.planar.state import (
    STATE,
    count_coordinates,
    estimate_at,
    slip_coordinate,
    slip_velocity_at,
)
from slipgrasp.core.kernel.planar.workspace import DISCRETE, WORKSPACE

COMPOSITE_MEMORY = memory_layout(
    [("directions", np.int64, (MAX_FINGERS,))]  # slip direction, 0 in stick
)

_take_row = make_take_row("", LAW, COMPOSITE_MEMORY)


@compiled_apart(types.void, MODEL, DISCRETE, STATE, WORKSPACE, COMPOSITE_MEMORY)
def learn(model: Record, discrete: Record, state: Record, work: Record, memory: Record) -> None:
    """Writes the rates that lead to the next estimates to ``work.rates``.

    Args:
        model: Constants of the run.
        discrete: Discrete state, with the estimated phases.
        state: State, with the current estimates.
        work: Evaluated at the measured state, with acceleration and applied torque.
        memory: Covariance of the estimates; updated.
    """
    law, n, count = model.law, model.num_fingers, model.num_unknowns
    gradient_rates(model, discrete, work)
    for k in range(count):
        memory.initial[k] = state.x[estimate_at(n, k)]
    begin_rows(law, count, memory)
    if memory.trust > LEAST_TRUST:
        _take_object_rows(model, work, memory)
        _take_slip_rows(model, state, work, memory)
    forget(law, count, memory)
    weigh_tracking(count, memory.covariance, work.rates, memory)
    set_rates(model, work, memory, _is_probed)


@compiled
def _is_probed(model: Record, work: Record, memory: Record, k: int) -> bool:
    """True if unknown ``k`` is the friction of a contact that never slipped and limits the grip."""
    i = model.unknowns.fingers[k]
    if model.unknowns.kinds[k] != FRICTION or memory.known[i] == 1 or memory.directions[i] != 0:
        return False
    along, normal = work.room.contact_force[i, 0], work.room.contact_force[i, 1]
    cone = work.believed.friction[i] / model.law.grip_safety
    return abs(along) > (1.0 - ACTIVE_BAND) * cone * normal


@compiled
def _believed_force(work: Record, i: int) -> tuple[float, float]:
    """Force of fingertip ``i`` on the object, computed from its torque and acceleration."""
    fx, fy = inertial_force(work.kin, work.believed_dynamics, i, work.acceleration)
    return work.tip_forces[i, 0] - fx, work.tip_forces[i, 1] - fy


@compiled
def _take_object_rows(model: Record, work: Record, memory: Record) -> None:
    """Processes the equations of the object along x and y, and about its centre."""
    n, kin, body = model.num_fingers, work.kin, work.believed.object_inertia
    total_x, total_y, moment, square = 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        fx, fy = _believed_force(work, i)
        rx, ry = kin.arms[i, 0], kin.arms[i, 1]
        total_x, total_y, moment = total_x + fx, total_y + fy, moment + rx * fy - ry * fx
        square += rx * rx + ry * ry
    scale = 1.0 / (memory.trust * memory.trust)
    force = model.law.force_variance
    ax, ay = work.acceleration[0], work.acceleration[1] + model.hand.gravity
    turn = work.acceleration[2]
    _fill_object_row(model, work, memory, 1.0, 0.0, 0.0)
    _take_row(
        model.law,
        model.num_unknowns,
        memory,
        total_x - body[0] * ax,
        scale * (force + _row_noise(model, work, memory, 0)),
    )
    _fill_object_row(model, work, memory, 0.0, 1.0, 0.0)
    _take_row(
        model.law,
        model.num_unknowns,
        memory,
        total_y - body[1] * ay,
        scale * (force + _row_noise(model, work, memory, 1)),
    )
    _fill_object_row(model, work, memory, 0.0, 0.0, 1.0)
    _take_row(
        model.law,
        model.num_unknowns,
        memory,
        moment - body[2] * turn,
        scale * (force * square / n + _row_noise(model, work, memory, 2)),
    )


@compiled
def _row_noise(model: Record, work: Record, memory: Record, row: int) -> float:
    """Variance of an equation due to noise of the differenced velocities, through its row of M~."""
    square = 0.0
    for k in range(count_coordinates(model.num_fingers)):
        if k < 3 or memory.directions[k - 3] != 0:
            square += work.estimated_inertia[row, k] * work.estimated_inertia[row, k]
    return model.law.acceleration_variance * square


@compiled
def _fill_object_row(
    model: Record, work: Record, memory: Record, along_x: float, along_y: float, about: float
) -> None:
    """Computes a row of Y for the object; the weights select the equation."""
    kin, acceleration, unknowns = work.kin, work.acceleration, model.unknowns
    for k in range(unknowns.count):
        kind, i = unknowns.kinds[k], unknowns.fingers[k]
        memory.row[k] = 0.0
        if kind == OBJECT_MASS:
            lift = acceleration[1] + model.hand.gravity
            memory.row[k] = along_x * acceleration[0] + along_y * lift
        elif kind == OBJECT_INERTIA:
            memory.row[k] = about * acceleration[2]
        elif kind == LINK_MASS:
            fx, fy = unit_force(kin, work.unit, i, unknowns.links[k], acceleration)
            turning = kin.arms[i, 0] * fy - kin.arms[i, 1] * fx
            memory.row[k] = along_x * fx + along_y * fy + about * turning


@compiled
def _take_slip_rows(model: Record, state: Record, work: Record, memory: Record) -> None:
    """Processes the equations of the slipping contacts: each force is on its cone."""
    for i in range(model.num_fingers):
        direction = memory.directions[i]
        trust = memory.trust * memory.contact_trust[i]
        if direction == 0 or trust < LEAST_TRUST:
            continue
        if not direction * state.x[slip_velocity_at(model.num_fingers, i)] > model.law.slip_level:
            continue
        fx, fy = _believed_force(work, i)
        along, normal = to_contact_frame(work.kin, i, fx, fy)
        slope = direction * work.believed.friction[i]
        _fill_slip_row(model, work, memory, i, direction, normal)
        variance = (
            model.law.force_variance + _row_noise(model, work, memory, slip_coordinate(i))
        ) / (trust * trust)
        _take_row(model.law, model.num_unknowns, memory, -along - slope * normal, variance)
        memory.known[i] = 1


@compiled
def _fill_slip_row(
    model: Record, work: Record, memory: Record, i: int, direction: int, normal: float
) -> None:
    """Computes the row of Y for a slipping contact."""
    unknowns = model.unknowns
    for k in range(unknowns.count):
        memory.row[k] = 0.0
        if unknowns.fingers[k] != i:
            continue
        if unknowns.kinds[k] == FRICTION:
            memory.row[k] = direction * normal
        elif unknowns.kinds[k] == LINK_MASS:
            fx, fy = unit_force(work.kin, work.unit, i, unknowns.links[k], work.acceleration)
            own_along, own_normal = to_contact_frame(work.kin, i, fx, fy)
            memory.row[k] = -own_along - direction * work.believed.friction[i] * own_normal
