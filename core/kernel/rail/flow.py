"""Motion of object and fingertip on a rail, and the control laws.

With the force F of the fingertip on the object, the tip acceleration e x'' - t s'' gives
F = J^-T tau - f_0 - Lambda (e x'' - t s''). The object has m x'' = e·F - F_r and N_r = m g - w·F.
Slip adds (t + sigma mu n)·F = 0 at the fingertip and F_r = d mu_r N_r at the rail, with the signs
sigma and d of s' and x'.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.motion import desired_motion
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.planar.dynamics import joint_space, seen_at_tip
from slipgrasp.core.kernel.planar.kinematics import stored_finger, update_kinematics
from slipgrasp.core.kernel.planar.state import STATE, dissipated_at, supplied_at
from slipgrasp.core.kernel.rail.model import (
    ADAPTIVE,
    FEEDBACK,
    FINGER,
    MODEL,
    RAIL_CONTACT,
)
from slipgrasp.core.kernel.rail.state import (
    DISCRETE,
    MASS,
    POSITION,
    SLIP,
    SLIP_SPEED,
    SPEED,
    WORKSPACE,
)

LEAST_COSINE = 1e-9  # below which a force along the rail does not press on the face
# Adaptation fades, because a switch at the limit of the force could chatter.
FADING = 0.1  # [N]


@compiled
def update_mechanics(model: Record, state: Record, work: Record) -> None:
    """Kinematics of the finger, and its inertia and bias force at the tip."""
    update_kinematics(model.hand, state, work.kin)
    finger = stored_finger(work.kin, 0)
    m11, m12, m22, h1, h2 = joint_space(model.hand, model.truth.link_masses, 0, finger)
    xx, xy, yy, fx, fy = seen_at_tip(
        finger, m11, m12, m22, h1, h2, work.kin.bias[0, 0], work.kin.bias[0, 1]
    )
    work.inertia[0], work.inertia[1], work.inertia[2] = xx, xy, yy
    work.bias[0], work.bias[1] = fx, fy


@compiled
def _between(work: Record, ax: float, ay: float, bx: float, by: float) -> float:
    """Product a·Lambda b."""
    inertia = work.inertia
    return ax * (inertia[0] * bx + inertia[1] * by) + ay * (inertia[1] * bx + inertia[2] * by)


@compiled
def assumed_mass(model: Record, state: Record) -> float:
    """Mass that the law assumes [kg]."""
    return state.x[MASS] if model.num_unknowns > 0 else model.truth.object_inertia[0]


@compiled
def _command(model: Record, discrete: Record, t: float, state: Record, work: Record) -> float:
    """Computes the torques of the law; returns 1, or less down to 0 where its force is limited.

    The force along the rail is that of the desired acceleration, with the friction of a motion in
    the desired direction.
    """
    law, mu, gravity = model.law, model.truth.friction[RAIL_CONTACT], model.hand.gravity
    position, velocity, acceleration = desired_motion(model.motion, discrete.piece, t, 0)
    error, rate = position - state.x[POSITION], velocity - state.x[SPEED]
    work.room.error[0] = error
    mass = assumed_mass(model, state)
    feedback = law.position_gains[0] * error + law.velocity_gains[0] * rate
    if law.kind == FEEDBACK:
        demand, along = 0.0, mass * feedback
    else:
        demand = acceleration + feedback
        direction = law.directions[discrete.piece]
        # e + d mu_r w, times the commanded force, accelerates the object.
        braked = law.grip_force * (model.cosine - direction * mu * model.sine)
        along = mass * (demand + direction * mu * gravity) - braked
    normal, tracks = law.grip_force, 1.0
    lacking = law.minimum_normal_force - (normal + along * model.cosine)
    if model.cosine > LEAST_COSINE and lacking > 0.0:
        along = (law.minimum_normal_force - normal) / model.cosine
        tracks = max(0.0, 1.0 - lacking / FADING)
    fx, fy = normal * model.cosine + along, -normal * model.sine
    work.tip_force[0] = work.bias[0] + work.inertia[0] * demand + fx
    work.tip_force[1] = work.bias[1] + work.inertia[1] * demand + fy
    jacobian = work.kin.jacobians
    for joint in range(2):
        work.torques[joint] = (
            jacobian[0, 0, joint] * work.tip_force[0] + jacobian[0, 1, joint] * work.tip_force[1]
        )
    return tracks


@compiled
def _adapt(
    model: Record, discrete: Record, t: float, state: Record, work: Record, tracks: float
) -> None:
    """Rate of the estimate of the mass (Eq. 46-47), and V of Eq. 44.

    The estimate changes while the fingertip sticks and the object slides in the desired direction,
    times ``tracks``, 1 without a limit of the force; elsewhere the mass is not the only cause of an
    error.
    """
    law, mu = model.law, model.truth.friction[RAIL_CONTACT]
    work.rate = work.lyapunov = 0.0
    if law.kind != ADAPTIVE:
        return
    _, velocity, _ = desired_motion(model.motion, discrete.piece, t, 0)
    error, rate = work.room.error[0], velocity - state.x[SPEED]
    p11, p12, p22 = law.lyapunov_11[0], law.lyapunov_12[0], law.lyapunov_22[0]
    missing = model.truth.object_inertia[0] - state.x[MASS]
    work.lyapunov = p11 * square(error) + 2.0 * p12 * error * rate + p22 * square(rate)
    work.lyapunov += square(missing) / law.adaptation_gain
    direction = law.directions[discrete.piece]
    slides = discrete.phases[RAIL_CONTACT] != 0 and discrete.phases[RAIL_CONTACT] == direction
    if not (slides and discrete.phases[FINGER] == 0):
        return
    inertia = state.x[MASS] + _between(work, 1.0, direction * mu, 1.0, 0.0)
    weighted = p12 * error + p22 * rate
    regressor = work.acceleration[0] + direction * mu * model.hand.gravity
    work.rate = tracks * law.adaptation_gain * weighted * regressor / inertia


@compiled_apart(types.void, MODEL, DISCRETE, WORKSPACE)
def rail_plant(model: Record, discrete: Record, work: Record) -> None:
    """Solves the equations of motion for the phases and the torque."""
    cosine, sine, truth = model.cosine, model.sine, model.truth
    mass = truth.object_inertia[0]
    weight = mass * model.hand.gravity
    finger, rail = discrete.phases[FINGER], discrete.phases[RAIL_CONTACT]
    gx, gy = work.tip_force[0] - work.bias[0], work.tip_force[1] - work.bias[1]
    # a·F = m x'' + d mu_r m g with a = e + d mu_r w, and b·F = 0 with b = t + sigma mu n.
    ay = rail * truth.friction[RAIL_CONTACT]
    slope = finger * truth.friction[FINGER]
    bx, by = sine + slope * cosine, cosine - slope * sine
    a_e, a_t = mass + _between(work, 1.0, ay, 1.0, 0.0), _between(work, 1.0, ay, sine, cosine)
    b_e, b_t = _between(work, bx, by, 1.0, 0.0), _between(work, bx, by, sine, cosine)
    push, pull = gx + ay * gy - ay * weight, bx * gx + by * gy
    ax = slip = 0.0
    work.determinant = 1.0
    if rail != 0 and finger != 0:
        work.determinant = a_e * b_t - a_t * b_e
        ax = (push * b_t - pull * a_t) / work.determinant
        slip = (push * b_e - pull * a_e) / work.determinant
    elif rail != 0:
        work.determinant = a_e
        ax = push / a_e
    elif finger != 0:
        work.determinant = b_t
        slip = -pull / b_t
    work.acceleration[0], work.acceleration[1] = ax, slip
    tx, ty = ax - sine * slip, -cosine * slip
    fx = gx - work.inertia[0] * tx - work.inertia[1] * ty
    fy = gy - work.inertia[1] * tx - work.inertia[2] * ty
    work.forces[FINGER, 0], work.forces[FINGER, 1] = (
        fx * sine + fy * cosine,
        fx * cosine - fy * sine,
    )
    work.forces[RAIL_CONTACT, 1] = weight - fy
    work.forces[RAIL_CONTACT, 0] = -ay * (weight - fy) if rail != 0 else -fx
    if finger != 0:
        work.forces[FINGER, 0] = -slope * work.forces[FINGER, 1]


@compiled_apart(types.void, MODEL, DISCRETE, types.float64, STATE, WORKSPACE)
def rail_evaluate(model: Record, discrete: Record, t: float, state: Record, work: Record) -> None:
    """Evaluates the closed loop: torques, accelerations, forces, rate of the estimate."""
    update_mechanics(model, state, work)
    tracks = _command(model, discrete, t, state, work)
    rail_plant(model, discrete, work)
    _adapt(model, discrete, t, state, work, tracks)


@compiled
def flow(
    model: Record, discrete: Record, t: float, state: Record, slope: Record, work: Record
) -> None:
    """Derivative of the state."""
    rail_evaluate(model, discrete, t, state, work)
    x, forces = state.x, work.forces
    for k in range(model.num_states):
        slope.x[k] = 0.0
    slope.x[POSITION], slope.x[SPEED] = x[SPEED], work.acceleration[0]
    slope.x[SLIP], slope.x[SLIP_SPEED] = x[SLIP_SPEED], work.acceleration[1]
    if model.num_unknowns > 0:
        slope.x[MASS] = work.rate
    velocity = work.kin.tip_velocities
    slope.x[supplied_at(model)] = (
        work.tip_force[0] * velocity[0, 0] + work.tip_force[1] * velocity[0, 1]
    )
    slope.x[dissipated_at(model)] = (
        -forces[FINGER, 0] * x[SLIP_SPEED] - forces[RAIL_CONTACT, 0] * x[SPEED]
    )


@compiled
def effort_rate(work: Record) -> float:
    """Sum of the squared joint torques of the evaluated state [N^2 m^2]."""
    return square(work.torques[0]) + square(work.torques[1])
