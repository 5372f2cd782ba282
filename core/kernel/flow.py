"""The closed loop inside one phase: the derivative of the state and all it is made of."""

from __future__ import annotations

import numpy as np

from core.kernel.compiler import compiled
from core.kernel.dynamics import (
    CONTACT_DYNAMICS,
    UNIT_DYNAMICS,
    combine_links,
    update_unit_dynamics,
)
from core.kernel.kinematics import KINEMATICS, update_kinematics
from core.kernel.law import (
    LAW_ROOM,
    believe,
    command_forces,
    demand_acceleration,
    pull_back,
    regressor_product,
    torques_to_forces,
    weigh_error,
)
from core.kernel.linear import factor, solve
from core.kernel.model import TRUTH
from core.kernel.records import (
    MAX_COORDINATES,
    MAX_FINGERS,
    MAX_UNKNOWNS,
    Floats,
    Record,
)
from core.kernel.reduced import (
    apply_contact_forces,
    assemble_bias,
    assemble_inertia,
    inertial_force,
)

# What stays fixed between two jumps.
DISCRETE = np.dtype(
    [
        ("phases", np.int64, (MAX_FINGERS,)),  # of the plant
        ("beliefs", np.int64, (MAX_FINGERS,)),  # phases the controller acts on
        ("clamps", np.int64, (MAX_UNKNOWNS,)),  # -1, 1: rests on its lower, upper bound
        ("torques", np.float64, (MAX_FINGERS, 2)),  # held by sampled control [N m]
        ("piece", np.int64),  # of the desired motion
    ],
    align=True,
)

# Intermediate values of one evaluation; the last one evaluated stays readable.
WORKSPACE = np.dtype(
    [
        ("kin", KINEMATICS),
        ("unit", UNIT_DYNAMICS),
        ("dynamics", CONTACT_DYNAMICS),
        ("believed", TRUTH),
        ("believed_dynamics", CONTACT_DYNAMICS),
        ("room", LAW_ROOM),
        ("inertia", np.float64, (MAX_COORDINATES, MAX_COORDINATES)),  # M~
        ("inertia_factors", np.float64, (MAX_COORDINATES, MAX_COORDINATES)),
        ("pivots", np.int64, (MAX_COORDINATES,)),
        ("determinant", np.float64),
        ("estimated_inertia", np.float64, (MAX_COORDINATES, MAX_COORDINATES)),  # M~^
        ("estimated_factors", np.float64, (MAX_COORDINATES, MAX_COORDINATES)),
        ("estimated_pivots", np.int64, (MAX_COORDINATES,)),
        ("estimated_determinant", np.float64),
        ("bias", np.float64, (MAX_COORDINATES,)),  # h~
        ("tip_forces", np.float64, (MAX_FINGERS, 2)),  # u = J_c^-T tau
        ("acceleration", np.float64, (MAX_COORDINATES,)),  # x''
        ("forces", np.float64, (MAX_FINGERS, 2)),  # F = (F_x, F_n)
        ("rates", np.float64, (MAX_UNKNOWNS,)),  # of the estimates, before projection
        ("column", np.float64, (MAX_COORDINATES,)),
    ],
    align=True,
)


@compiled
def update_mechanics(model: Record, state: Floats, work: Record) -> None:
    """Kinematics and true finger dynamics of the state."""
    update_kinematics(model.hand, state, work.kin)
    update_unit_dynamics(model.hand, work.kin, work.unit)
    combine_links(model.truth, work.unit, work.dynamics)


@compiled
def update_belief(model: Record, discrete: Record, t: float, state: Floats, work: Record) -> None:
    """What the controller makes of the state: errors, demand, its model of the hand."""
    n = model.num_fingers
    estimates = state[6 + 2 * n :]
    believe(model.truth, model.unknowns, estimates, work.believed)
    combine_links(work.believed, work.unit, work.believed_dynamics)
    demand_acceleration(
        model.law, model.motion, discrete.piece, t, state, discrete.beliefs, work.room
    )
    assemble_inertia(
        work.kin, work.believed_dynamics, work.believed, discrete.beliefs, work.estimated_inertia
    )
    _copy_square(work.estimated_inertia, work.estimated_factors, 3 + n)
    work.estimated_determinant = factor(work.estimated_factors, work.estimated_pivots, 3 + n)


@compiled
def _copy_square(source: Floats, target: Floats, size: int) -> None:
    for row in range(size):
        for column in range(size):
            target[row, column] = source[row, column]


@compiled
def update_command(model: Record, discrete: Record, work: Record) -> bool:
    """The torque the law commands, as contact-frame forces in ``work.tip_forces``."""
    return command_forces(
        model.law,
        work.kin,
        work.believed,
        work.believed_dynamics,
        model.hand.gravity,
        discrete.beliefs,
        work.room,
        work.tip_forces,
    )


@compiled
def solve_plant(model: Record, discrete: Record, work: Record) -> None:
    """Accelerations and contact forces under the torque in ``work.tip_forces`` (Eq. 17)."""
    n = model.num_fingers
    truth, kin, acceleration = model.truth, work.kin, work.acceleration
    assemble_inertia(kin, work.dynamics, truth, discrete.phases, work.inertia)
    _copy_square(work.inertia, work.inertia_factors, 3 + n)
    work.determinant = factor(work.inertia_factors, work.pivots, 3 + n)
    assemble_bias(kin, work.dynamics, truth, model.hand.gravity, discrete.phases, work.bias)
    apply_contact_forces(kin, truth, discrete.phases, work.tip_forces, acceleration)
    for k in range(3 + n):
        acceleration[k] -= work.bias[k]
    solve(work.inertia_factors, work.pivots, 3 + n, acceleration)
    for i in range(n):
        if discrete.phases[i] == 0:
            acceleration[3 + i] = 0.0
    for i in range(n):
        f0, f1 = inertial_force(kin, work.dynamics, i, acceleration)
        work.forces[i, 0] = work.tip_forces[i, 0] - f0
        work.forces[i, 1] = work.tip_forces[i, 1] - f1


@compiled
def update_rates(model: Record, discrete: Record, state: Floats, work: Record) -> None:
    """Rates of the estimates before projection (Eq. 24 / 28), at the measured x''."""
    n = model.num_fingers
    p = model.num_unknowns
    if p == 0:
        return
    weigh_error(model.law, work.estimated_factors, work.estimated_pivots, work.room)
    sigma = pull_back(model.law, state[6 + 2 * n :], p)
    for k in range(p):
        product = regressor_product(
            work.kin,
            work.unit,
            work.believed_dynamics,
            work.believed,
            model.unknowns,
            model.hand.gravity,
            discrete.beliefs,
            work.acceleration,
            work.room.weighted_error,
            k,
        )
        work.rates[k] = model.law.adaptation_gains[k] * product - sigma * state[6 + 2 * n + k]


@compiled
def flow(
    model: Record,
    discrete: Record,
    t: float,
    state: Floats,
    derivative: Floats,
    work: Record,
) -> None:
    """Derivative of the state within the present phases, continuous or sampled control."""
    n = model.num_fingers
    p = model.num_unknowns
    update_mechanics(model, state, work)
    if model.law.period > 0.0:
        torques_to_forces(work.kin, n, discrete.torques, work.tip_forces)
        for k in range(p):
            work.rates[k] = 0.0
        solve_plant(model, discrete, work)
    else:
        update_belief(model, discrete, t, state, work)
        if not update_command(model, discrete, work):
            work.tip_forces[0, 0] = np.nan
        solve_plant(model, discrete, work)
        update_rates(model, discrete, state, work)
    for k in range(3 + n):
        offset = 0 if k < 3 else 3
        derivative[k + offset] = state[k + offset + (3 if k < 3 else n)]
        derivative[k + offset + (3 if k < 3 else n)] = work.acceleration[k]
    for k in range(p):
        rate = work.rates[k]
        derivative[6 + 2 * n + k] = 0.0 if discrete.clamps[k] != 0 else rate
    supplied, dissipated = _powers(model, discrete, state, work)
    derivative[6 + 2 * n + p] = supplied
    derivative[7 + 2 * n + p] = dissipated


@compiled
def _powers(model: Record, discrete: Record, state: Floats, work: Record) -> tuple[float, float]:
    """Power of the joint torques and power lost to friction [W]."""
    n = model.num_fingers
    supplied = 0.0
    dissipated = 0.0
    for i in range(n):
        frame, velocity = work.kin.frames[i], work.kin.tip_velocities[i]
        supplied += work.tip_forces[i, 0] * (frame[0, 0] * velocity[0] + frame[1, 0] * velocity[1])
        supplied += work.tip_forces[i, 1] * (frame[0, 1] * velocity[0] + frame[1, 1] * velocity[1])
        dissipated += model.truth.friction[i] * work.forces[i, 1] * abs(state[6 + n + i])
    return supplied, dissipated
