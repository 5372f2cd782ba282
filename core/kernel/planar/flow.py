"""Closed loop within a phase: derivative of the state."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.loop.links import combine_links, joint_friction_power
from slipgrasp.core.kernel.planar.dynamics import (
    add_joint_friction,
    update_unit_dynamics,
)
from slipgrasp.core.kernel.planar.inertia import factor, solve
from slipgrasp.core.kernel.planar.kinematics import (
    mistake_lengths,
    to_contact_frame,
    update_kinematics,
)
from slipgrasp.core.kernel.planar.law import believe, demand_acceleration
from slipgrasp.core.kernel.planar.laws.interface import adapt, command
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.reduced import (
    apply_tip_forces,
    assemble_bias,
    assemble_inertia,
    inertial_force,
    torques_to_forces,
)
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


@compiled_apart(types.void, MODEL, STATE, WORKSPACE)
def update_mechanics(model: Record, state: Record, work: Record) -> None:
    """Computes kinematics and true finger dynamics, unless ``work`` has them for this state."""
    current, moving = work.current, estimate_at(model.num_fingers, 0)
    if current.mechanics == 1 and _agree(current.state.x, state.x, moving):
        return
    for k in range(moving):
        current.state.x[k] = state.x[k]
    current.mechanics, current.factors, current.law = 1, 0, 0
    update_kinematics(model.hand, state, work.kin)
    update_unit_dynamics(model.hand, work.kin, work.unit)
    combine_links(model.truth, work.unit, work.dynamics)
    if model.hand.joints_rub:
        add_joint_friction(model.hand, work.kin, work.dynamics)


@compiled_apart(types.void, MODEL, STATE, WORKSPACE)
def update_seen_mechanics(model: Record, state: Record, work: Record) -> None:
    """Computes kinematics and unit dynamics with the link lengths of the controller's model."""
    update_mechanics(model, state, work)
    if model.law.knows_lengths:
        return
    mistake_lengths(model.nominal, state, work.kin)
    update_unit_dynamics(model.nominal, work.kin, work.unit)
    forget_mechanics(work)


@compiled
def forget_mechanics(work: Record) -> None:
    """Invalidates the mechanics in ``work`` after a change of constants."""
    work.current.mechanics = work.current.factors = work.current.law = 0


@compiled
def _agree(ours: Floats, others: Floats, count: int) -> bool:
    for k in range(count):
        if ours[k] != others[k]:
            return False
    return True


@compiled_apart(types.int64, MODEL, DISCRETE, types.float64, STATE, WORKSPACE)
def update_command(model: Record, discrete: Record, t: float, state: Record, work: Record) -> int:
    """Computes the controller's command for the state and writes it to ``work.tip_forces``.

    Also computes the errors, the demand and the estimated model. The mechanics of the state must
    be up to date.

    Returns:
        1, or 0 if there is no unique solution.
    """
    n = model.num_fingers
    believe(model.law, model.truth, model.unknowns, state, work.believed)
    combine_links(work.believed, work.unit, work.believed_dynamics)
    demand_acceleration(
        model.law, model.motion, discrete.piece, t, state, discrete.beliefs, work.room
    )
    assemble_inertia(
        work.kin, work.believed_dynamics, work.believed, discrete.beliefs, work.estimated_inertia
    )
    factor(work.estimated_inertia, discrete.beliefs, n, work.estimated_factors)
    if model.law.period > 0.0:
        _remember_law(model, discrete, t, state, work.current)
    return command(model, discrete, t, state, work)


@compiled
def _remember_law(
    model: Record, discrete: Record, t: float, state: Record, current: Record
) -> None:
    current.law, current.time, current.piece = 1, t, discrete.piece
    current.added_grip = discrete.added_grip
    for i in range(model.num_fingers):
        current.beliefs[i] = discrete.beliefs[i]
    for k in range(model.num_unknowns):
        at = estimate_at(model.num_fingers, k)
        current.state.x[at] = state.x[at]


@compiled
def holds_law(model: Record, discrete: Record, t: float, state: Record, work: Record) -> bool:
    """True if errors, estimates and grasp force in ``work`` belong to this state."""
    current = work.current
    if current.law == 0 or current.time != t or current.piece != discrete.piece:
        return False
    if current.added_grip != discrete.added_grip:
        return False
    end = estimate_at(model.num_fingers, model.num_unknowns)
    return _agree(current.state.x, state.x, end) and _agree(
        current.beliefs, discrete.beliefs, model.num_fingers
    )


@compiled_apart(types.void, MODEL, DISCRETE, WORKSPACE)
def solve_plant(model: Record, discrete: Record, work: Record) -> None:
    """Accelerations and contact forces under the torque in ``work.tip_forces`` (Eq. 17)."""
    n = model.num_fingers
    truth, kin, acceleration = model.truth, work.kin, work.acceleration
    _update_factors(model, discrete, work)
    apply_tip_forces(kin, truth, discrete.phases, work.tip_forces, acceleration)
    for k in range(count_coordinates(n)):
        acceleration[k] -= work.bias[k]
    for k in range(3):
        acceleration[k] += model.load[k]
    solve(work.factors, n, acceleration)
    for i in range(n):
        fx, fy = inertial_force(kin, work.dynamics, i, acceleration)
        along, normal = to_contact_frame(
            kin, i, work.tip_forces[i, 0] - fx, work.tip_forces[i, 1] - fy
        )
        work.forces[i, 0], work.forces[i, 1] = along, normal


@compiled
def _update_factors(model: Record, discrete: Record, work: Record) -> None:
    """Computes M~, its factors and h~ in the current phases, unless ``work`` contains them."""
    n, kin, truth, current = model.num_fingers, work.kin, model.truth, work.current
    if current.factors == 1 and _agree(current.phases, discrete.phases, n):
        return
    for i in range(n):
        current.phases[i] = discrete.phases[i]
    current.factors = 1
    assemble_inertia(kin, work.dynamics, truth, discrete.phases, work.inertia)
    factor(work.inertia, discrete.phases, n, work.factors)
    assemble_bias(kin, work.dynamics, truth, model.hand.gravity, discrete.phases, work.bias)


@compiled_apart(types.void, MODEL, DISCRETE, types.float64, STATE, STATE, WORKSPACE)
def flow(
    model: Record, discrete: Record, t: float, state: Record, derivative: Record, work: Record
) -> None:
    """Writes the derivative of the state in the current phases, under either kind of control."""
    n = model.num_fingers
    p = model.num_unknowns
    update_mechanics(model, state, work)
    if model.law.period > 0.0:
        torques_to_forces(work.kin, n, discrete.torques, work.tip_forces)
        for k in range(p):
            work.rates[k] = 0.0
        solve_plant(model, discrete, work)
    else:
        if update_command(model, discrete, t, state, work) == 0:
            work.tip_forces[0, 0] = np.nan
        solve_plant(model, discrete, work)
        adapt(model, discrete, state, work)
    for k in range(3):
        derivative.x[k] = state.x[velocity_at(k)]
        derivative.x[velocity_at(k)] = work.acceleration[k]
    for i in range(n):
        derivative.x[slip_at(i)] = state.x[slip_velocity_at(n, i)]
        derivative.x[slip_velocity_at(n, i)] = work.acceleration[slip_coordinate(i)]
    for k in range(p):
        derivative.x[estimate_at(n, k)] = 0.0 if discrete.clamps[k] != 0 else work.rates[k]
    supplied, dissipated = _powers(model, discrete, state, work)
    derivative.x[supplied_at(model)] = supplied
    derivative.x[dissipated_at(model)] = dissipated


@compiled
def _powers(model: Record, discrete: Record, state: Record, work: Record) -> tuple[float, float]:
    """Power of joint torques and pulses, and power lost to friction [W]."""
    n, kin = model.num_fingers, work.kin
    supplied = 0.0
    dissipated = 0.0
    for i in range(n):
        supplied += work.tip_forces[i, 0] * kin.tip_velocities[i, 0]
        supplied += work.tip_forces[i, 1] * kin.tip_velocities[i, 1]
        # Not |s'|: its kink at the end of a slip would require tiny steps.
        speed = discrete.phases[i] * state.x[slip_velocity_at(n, i)]
        dissipated += model.truth.friction[i] * work.forces[i, 1] * speed
    if model.hand.joints_rub:
        dissipated += joint_friction_power(model.hand, kin.joint_velocities)
    for k in range(3):
        supplied += model.load[k] * state.x[velocity_at(k)]
    return supplied, dissipated
