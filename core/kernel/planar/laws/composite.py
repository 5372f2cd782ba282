"""Composite adaptation: tracking error and prediction error together, by least squares.

The contact forces follow from the torques and the fingers' own dynamics, so the equations of
the object and of the slipping contacts,

    sum f_i = m_o (a + g),  sum r_i x f_i = I_o theta'',  F_x + gamma mu F_n = 0,

are linear in the unknowns: Y phi = y. Recursive least squares with forgetting takes them one
row at a time; the tracking term of Eq. 24 is weighed with the covariance of the estimates
instead of a constant gain. Reference: Slotine & Li, Applied Nonlinear Control, 8.7-8.8.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Record
from slipgrasp.core.kernel.planar.kinematics import to_contact_frame
from slipgrasp.core.kernel.planar.laws.theorem_3 import gradient_rates
from slipgrasp.core.kernel.planar.model import (
    FRICTION,
    LINK_MASS,
    MODEL,
    OBJECT_INERTIA,
    OBJECT_MASS,
)
from slipgrasp.core.kernel.planar.reduced import inertial_force, unit_force
from slipgrasp.core.kernel.planar.state import STATE, estimate_at, slip_velocity_at
from slipgrasp.core.kernel.planar.workspace import DISCRETE, WORKSPACE
from slipgrasp.core.scenario import MAX_UNKNOWNS

# What the law remembers from tick to tick, and its intermediate values.
COMPOSITE_MEMORY = np.dtype(
    [
        ("begun", np.int64),
        ("covariance", np.float64, (MAX_UNKNOWNS, MAX_UNKNOWNS)),
        ("estimates", np.float64, (MAX_UNKNOWNS,)),
        ("row", np.float64, (MAX_UNKNOWNS,)),  # of Y
        ("gain", np.float64, (MAX_UNKNOWNS,)),
        ("trust", np.float64),  # in the measured accelerations, 0 to 1
        ("contact_trust", np.float64, (MAX_FINGERS,)),  # in the force of a slipping contact too
        ("directions", np.int64, (MAX_FINGERS,)),  # in which each contact slips, 0 in stick
        ("known", np.int64, (MAX_FINGERS,)),  # 1 once a contact has told its friction by a slip
    ],
    align=True,
)

SURPRISE = 36.0  # squared error over its variance from which what was known no longer counts
LEAST_TRUST = 1e-3
ACTIVE_BAND = 1e-6  # share of its cone within which a force counts as on it


@compiled_apart(types.void, MODEL, STATE, COMPOSITE_MEMORY, types.float64, types.float64)
def _take_row(model: Record, state: Record, memory: Record, error: float, variance: float) -> None:
    """One measurement of Y phi = y; ``error`` is y - Y phi at the estimates in ``state``."""
    law, n, count = model.law, model.num_fingers, model.num_unknowns
    row, covariance = memory.row, memory.covariance
    for k in range(count):
        error -= row[k] * (memory.estimates[k] - state.x[estimate_at(n, k)])
    spread = _multiply_covariance(count, memory)
    if spread == 0.0:
        return
    if error * error > SURPRISE * (variance + spread):
        for k in range(count):
            if row[k] != 0.0:
                covariance[k, k] = max(covariance[k, k], law.prior_variances[k])
        spread = _multiply_covariance(count, memory)
    scale = 1.0 / (variance + spread)
    for j in range(count):
        memory.estimates[j] += scale * memory.gain[j] * error
        for k in range(j + 1):
            # Both halves alike: forgetting would blow up the least difference between them.
            covariance[j, k] -= scale * memory.gain[j] * memory.gain[k]
            covariance[k, j] = covariance[j, k]


@compiled
def _multiply_covariance(count: int, memory: Record) -> float:
    """Writes P Y^T of the present row to ``gain``; returns Y P Y^T."""
    spread = 0.0
    for j in range(count):
        total = 0.0
        for k in range(count):
            total += memory.covariance[j, k] * memory.row[k]
        memory.gain[j] = total
        spread += memory.row[j] * total
    return spread


@compiled_apart(types.void, MODEL, DISCRETE, STATE, WORKSPACE, COMPOSITE_MEMORY)
def learn(model: Record, discrete: Record, state: Record, work: Record, memory: Record) -> None:
    """Writes to ``work.rates`` the rates that bring the estimates to their next values.

    Args:
        model: Constants of the run.
        discrete: Beliefs of the controller.
        state: The estimates are taken from it.
        work: At the measured state, with its acceleration and the torque that acts.
        memory: Covariance of the estimates, updated.
    """
    law, n, count = model.law, model.num_fingers, model.num_unknowns
    if memory.begun == 0:
        memory.begun = 1
        for j in range(count):
            for k in range(count):
                memory.covariance[j, k] = 0.0
            memory.covariance[j, j] = law.prior_variances[j]
    gradient_rates(model, discrete, work)
    for k in range(count):
        memory.estimates[k] = state.x[estimate_at(n, k)]
    if memory.trust > LEAST_TRUST:
        _take_object_rows(model, state, work, memory)
        _take_slip_rows(model, state, work, memory)
    _forget(law, count, memory)
    for j in range(count):
        tracking = 0.0
        for k in range(count):
            tracking += memory.covariance[j, k] * work.rates[k]
        memory.gain[j] = tracking
    for k in range(count):
        learnt = (memory.estimates[k] - state.x[estimate_at(n, k)]) / law.period
        work.rates[k] = learnt + memory.gain[k]
        if _is_probed(model, work, memory, k):
            work.rates[k] += law.probing * state.x[estimate_at(n, k)]


@compiled
def _is_probed(model: Record, work: Record, memory: Record, k: int) -> bool:
    """Whether unknown ``k`` is the friction of a contact that never slipped and bounds the grip."""
    i = model.unknowns.fingers[k]
    if model.unknowns.kinds[k] != FRICTION or memory.known[i] == 1 or memory.directions[i] != 0:
        return False
    along, normal = work.room.contact_force[i, 0], work.room.contact_force[i, 1]
    cone = work.believed.friction[i] / model.law.grip_safety
    return abs(along) > (1.0 - ACTIVE_BAND) * cone * normal


@compiled
def _believed_force(work: Record, i: int) -> tuple[float, float]:
    """Force of fingertip ``i`` on the object that follows from its torque and acceleration."""
    fx, fy = inertial_force(work.kin, work.believed_dynamics, i, work.acceleration)
    return work.tip_forces[i, 0] - fx, work.tip_forces[i, 1] - fy


@compiled
def _take_object_rows(model: Record, state: Record, work: Record, memory: Record) -> None:
    """The equations of the object along x and y, and about its centre."""
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
        model,
        state,
        memory,
        total_x - body[0] * ax,
        scale * (force + _row_noise(model, work, memory, 0)),
    )
    _fill_object_row(model, work, memory, 0.0, 1.0, 0.0)
    _take_row(
        model,
        state,
        memory,
        total_y - body[1] * ay,
        scale * (force + _row_noise(model, work, memory, 1)),
    )
    _fill_object_row(model, work, memory, 0.0, 0.0, 1.0)
    _take_row(
        model,
        state,
        memory,
        moment - body[2] * turn,
        scale * (force * square / n + _row_noise(model, work, memory, 2)),
    )


@compiled
def _row_noise(model: Record, work: Record, memory: Record, row: int) -> float:
    """Variance that noise of the differenced velocities gives a row, through that row of M~."""
    square = 0.0
    for k in range(3 + model.num_fingers):
        if k < 3 or memory.directions[k - 3] != 0:
            square += work.estimated_inertia[row, k] * work.estimated_inertia[row, k]
    return model.law.acceleration_variance * square


@compiled
def _fill_object_row(
    model: Record, work: Record, memory: Record, along_x: float, along_y: float, about: float
) -> None:
    """One row of Y for the object: the weights tell which."""
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
    """Each slipping contact lies on its cone."""
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
        variance = (model.law.force_variance + _row_noise(model, work, memory, 3 + i)) / (
            trust * trust
        )
        _take_row(model, state, memory, -along - slope * normal, variance)
        memory.known[i] = 1


@compiled
def _fill_slip_row(
    model: Record, work: Record, memory: Record, i: int, direction: int, normal: float
) -> None:
    """The row of Y for a slipping contact."""
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


@compiled
def _forget(law: Record, count: int, memory: Record) -> None:
    """Lets the covariance grow, but none of its variances beyond that of the start."""
    covariance = memory.covariance
    for j in range(count):
        for k in range(count):
            covariance[j, k] /= law.forgetting
    for j in range(count):
        most = law.prior_variances[j]
        if covariance[j, j] > most:
            scale = np.sqrt(most / covariance[j, j])
            for k in range(count):
                covariance[j, k] *= scale
                covariance[k, j] *= scale
