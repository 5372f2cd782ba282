"""Motion within a phase: derivative of the state, and contact forces."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.loop.links import joint_friction_power
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.spatial.curved_faces import SPHERE, coordinate_scale
from slipgrasp.core.kernel.spatial.dynamics import (
    add_joint_friction,
    update_tip_dynamics,
)
from slipgrasp.core.kernel.spatial.kinematics import torques_to_forces, update_kinematics
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.plant import assemble, solve_plant
from slipgrasp.core.kernel.spatial.state import (
    ATTITUDE,
    POSITION,
    SPIN,
    STATE,
    VELOCITY,
    dissipated_at,
    path_at,
    slip_at,
    slip_velocity_at,
    spin_at,
    spin_velocity_at,
    supplied_at,
    turned_at,
    velocity_at,
)
from slipgrasp.core.kernel.spatial.torsion import spatial_soft_phases
from slipgrasp.core.kernel.spatial.ways import way_speed
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, STICK, WORKSPACE

LEAST_SPEED = 3e-9  # below which a slip ends [m/s]
TOLD_SPEED = 1e-9  # lower bound of the divisor for directions, in steps to be rejected [m/s]
SURE_SPEED = 3e-8  # above which the velocity determines the slip direction [m/s]


@compiled
def slip_speed(n: int, state: Record, i: int) -> float:
    """|s'| of contact ``i`` [m/s]."""
    first = state.x[slip_velocity_at(n, i, 0)]
    second = state.x[slip_velocity_at(n, i, 1)]
    return np.sqrt(first * first + second * second)


@compiled
def set_directions(model: Record, discrete: Record, state: Record, gamma: Floats) -> None:
    """Computes the slip direction of every contact; 0 in stick."""
    n = model.num_fingers
    for i in range(n):
        if discrete.phases[i] == STICK:
            gamma[i, 0] = gamma[i, 1] = gamma[i, 2] = 0.0
        elif model.ways == 2 or discrete.frozen[i, 0] != 0:
            gamma[i, 0], gamma[i, 1] = discrete.directions[i, 0], discrete.directions[i, 1]
            gamma[i, 2] = discrete.directions[i, 2]
        elif model.soft == 1:
            scale = 1.0 / max(way_speed(model, state, i, 0), TOLD_SPEED)
            for part in range(3):
                gamma[i, part] = scale * state.x[velocity_at(n, i, part)]
        else:
            scale = 1.0 / max(slip_speed(n, state, i), TOLD_SPEED)
            gamma[i, 0] = scale * state.x[slip_velocity_at(n, i, 0)]
            gamma[i, 1] = scale * state.x[slip_velocity_at(n, i, 1)]


@compiled_apart(types.void, MODEL, DISCRETE, STATE, WORKSPACE)
def spatial_phases(model: Record, discrete: Record, state: Record, work: Record) -> None:
    """Computes accelerations and contact forces, given kinematics and tip forces of the state."""
    set_directions(model, discrete, state, work.gamma)
    if model.soft == 1:
        spatial_soft_phases(model, discrete, state, work)
        return
    assemble(work.kin, work.dynamics, model.truth, discrete.slips, work.gamma, work.system)
    solve_plant(model, state, work)


@compiled_apart(types.void, MODEL, DISCRETE, STATE, WORKSPACE)
def spatial_plant(model: Record, discrete: Record, state: Record, work: Record) -> None:
    """Computes kinematics, accelerations and contact forces of a state under the current torque."""
    work.at_start = 0
    update_kinematics(model.hand, discrete.seeds, state, work.kin)
    update_tip_dynamics(model.hand, model.truth, work.kin, work.dynamics)
    if model.hand.joints_rub == 1:
        add_joint_friction(model.hand, work.kin, work.dynamics)
    torques_to_forces(model.hand, work.kin, discrete.torques, work.tip_forces)
    spatial_phases(model, discrete, state, work)


@compiled
def flow(model: Record, discrete: Record, state: Record, derivative: Record, work: Record) -> None:
    """Computes the derivative of the state in the current phases."""
    spatial_plant(model, discrete, state, work)
    set_derivative(model, state, derivative, work)


@compiled
def set_derivative(model: Record, state: Record, derivative: Record, work: Record) -> None:
    """Computes the derivative of an evaluated state."""
    n, x, rate = model.num_fingers, state.x, derivative.x
    for k in range(3):
        rate[POSITION + k] = x[VELOCITY + k]
        rate[VELOCITY + k] = work.acceleration[k]
        rate[SPIN + k] = work.acceleration[3 + k]
    w, a, b, c = x[ATTITUDE], x[ATTITUDE + 1], x[ATTITUDE + 2], x[ATTITUDE + 3]
    wx, wy, wz = x[SPIN], x[SPIN + 1], x[SPIN + 2]
    rate[ATTITUDE] = -0.5 * (wx * a + wy * b + wz * c)
    rate[ATTITUDE + 1] = 0.5 * (wx * w + wy * c - wz * b)
    rate[ATTITUDE + 2] = 0.5 * (wy * w + wz * a - wx * c)
    rate[ATTITUDE + 3] = 0.5 * (wz * w + wx * b - wy * a)
    supplied = dissipated = 0.0
    for k in range(3):
        supplied += model.load[k] * x[VELOCITY + k] + model.load[3 + k] * x[SPIN + k]
    for i in range(n):
        along = 0.0
        for axis in range(2):
            speed = x[slip_velocity_at(n, i, axis)]
            rate[slip_at(i, axis)] = speed
            rate[slip_velocity_at(n, i, axis)] = work.slip_acceleration[i, axis]
            along += work.gamma[i, axis] * speed
        if model.hand.curved_faces[i] == SPHERE:
            _scale_coordinates(model, state, derivative, i)
        for k in range(3):
            supplied += work.tip_forces[i, k] * work.kin.tip_velocities[i, k]
        if model.soft == 1:
            along = _set_spin_rates(model, state, derivative, work, i)
            rate[path_at(n, i)] = slip_speed(n, state, i)
            dissipated += model.truth.friction[i] * work.forces[i, 2] * along
            if work.gamma[i, 0] == work.gamma[i, 1] == work.gamma[i, 2] == 0.0:
                # A sticking contact may creep.
                dissipated -= work.moments[i] * x[spin_velocity_at(n, i)]
            continue
        # Equal to |s'| here, but without its kink at the end of a slip.
        both = model.ways == 2 and work.gamma[i, 0] != 0.0 and work.gamma[i, 1] != 0.0
        rate[path_at(n, i)] = slip_speed(n, state, i) if both else along
        dissipated += model.truth.friction[i] * work.forces[i, 2] * along
    if model.hand.joints_rub == 1:
        dissipated += joint_friction_power(model.hand, work.kin.rates)
    rate[supplied_at(model)] = supplied
    rate[dissipated_at(model)] = dissipated


@compiled
def _scale_coordinates(model: Record, state: Record, derivative: Record, i: int) -> None:
    """Converts slip velocities of contact ``i`` to the rates of its coordinates on a sphere."""
    first, second = slip_at(i, 0), slip_at(i, 1)
    squared = square(state.x[first]) + square(state.x[second])
    scale = coordinate_scale(model.hand.radii[i], squared)
    derivative.x[first] *= scale
    derivative.x[second] *= scale


@compiled
def _set_spin_rates(
    model: Record, state: Record, derivative: Record, work: Record, i: int
) -> float:
    """Sets the spin rates of contact ``i``; returns its velocity along the slip direction [m/s]."""
    n, x, rate, e = model.num_fingers, state.x, derivative.x, model.hand.eccentricities[i]
    at = spin_velocity_at(n, i)
    spin = x[at] / e if e > 0.0 else 0.0
    rate[at] = work.spin_acceleration[i]
    rate[spin_at(n, i)] = spin
    rate[turned_at(n, i)] = abs(spin)
    along = 0.0
    for part in range(3):
        along += work.gamma[i, part] * x[velocity_at(n, i, part)]
    return along
