"""Inputs of a custom law for spatial hands at a tick (`slipgrasp.core.kernel.laws`).

Vectors are in world axes; attitude errors are rotation vectors.
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Record
from slipgrasp.core.kernel.laws.own_law import answer_layout, own_law_layout, show_fingers
from slipgrasp.core.kernel.loop.links import BY_CHAIN, ON_SLIDES
from slipgrasp.core.kernel.loop.motion import desired_motion
from slipgrasp.core.kernel.spatial.chain import coordinate_range
from slipgrasp.core.kernel.spatial.grip import weight_force
from slipgrasp.core.kernel.spatial.kinematics import joint_position
from slipgrasp.core.kernel.spatial.law import desired_turn
from slipgrasp.core.kernel.spatial.state import (
    POSITION,
    VELOCITY,
    slip_at,
    slip_velocity_at,
    spin_at,
    spin_velocity_at,
)
from slipgrasp.core.scenario import MAX_LAW_PARAMETERS, MAX_UNKNOWNS

# Inputs of the law: measured, estimated and nominal values, never the true ones.
SEEN = np.dtype(
    [
        ("time", np.float64),  # [s]
        ("tick", np.int64),  # of sampled control, from 0
        ("period", np.float64),  # [s]
        ("pose", np.float64, (7,)),  # measured: position [m], quaternion w, x, y, z
        ("velocity", np.float64, (6,)),  # of the centre of mass, angular velocity [m/s, rad/s]
        ("desired_pose", np.float64, (7,)),
        ("desired_velocity", np.float64, (6,)),
        ("desired_acceleration", np.float64, (6,)),
        ("error", np.float64, (6,)),  # of position; rotation vector to the desired attitude
        ("error_rate", np.float64, (6,)),
        ("joint_position", np.float64, (MAX_FINGERS, 3)),  # [rad], of slides [m]
        ("joint_velocity", np.float64, (MAX_FINGERS, 3)),  # [rad/s, m/s]
        ("joint_torque", np.float64, (MAX_FINGERS, 3)),  # applied up to this tick [N m, N]
        ("slip", np.float64, (MAX_FINGERS, 2)),  # along both tangents, measured [m]
        ("slip_velocity", np.float64, (MAX_FINGERS, 2)),
        ("believed_phase", np.int64, (MAX_FINGERS,)),
        ("slip_direction", np.float64, (MAX_FINGERS, 2)),  # estimated, 0 in stick
        ("contact_force", np.float64, (MAX_FINGERS, 3)),  # measured: tangents, normal [N]
        ("contact_moment", np.float64, (MAX_FINGERS,)),  # measured, about the normal [N m]
        ("spin", np.float64, (MAX_FINGERS,)),  # about the normal; 0 if hard [rad]
        ("spin_velocity", np.float64, (MAX_FINGERS,)),
        ("eccentricity", np.float64, (MAX_FINGERS,)),  # largest moment / largest force [m]
        ("jacobian", np.float64, (MAX_FINGERS, 3, 3)),
        ("jacobian_inverse", np.float64, (MAX_FINGERS, 3, 3)),
        ("weight_torque", np.float64, (MAX_FINGERS, 3)),  # supports the links, estimated [N m, N]
        ("link_direction", np.float64, (MAX_FINGERS, 2, 3)),  # unit vectors, 0 if no links
        ("contact_arm", np.float64, (MAX_FINGERS, 3)),  # from the centre of mass [m]
        ("contact_tangents", np.float64, (MAX_FINGERS, 2, 3)),  # directions of positive slip
        ("contact_normal", np.float64, (MAX_FINGERS, 3)),  # into the object
        ("friction", np.float64, (MAX_FINGERS,)),  # estimated
        ("object_mass", np.float64),  # estimated [kg]
        ("object_inertias", np.float64, (3,)),  # estimated, about the body axes [kg m^2]
        # Estimated; of slides the first, of chains 0 [kg]
        ("link_masses", np.float64, (MAX_FINGERS, 2)),
        ("link_lengths", np.float64, (MAX_FINGERS, 2)),  # [m]
        ("link_centres", np.float64, (MAX_FINGERS, 2)),  # from the proximal joint [m]
        ("gravity", np.float64),  # [m/s^2]
        ("torque_limit", np.float64),  # of all joints, inf if unlimited [N m]
        ("joint_torque_limit", np.float64, (MAX_FINGERS, 3)),  # inf if unlimited [N m, N]
        ("joint_minimum", np.float64, (MAX_FINGERS, 3)),  # -inf if unlimited [rad, m]
        ("joint_maximum", np.float64, (MAX_FINGERS, 3)),  # inf if unlimited [rad, m]
        ("estimates", np.float64, (MAX_UNKNOWNS,)),
        ("position_gain", np.float64, (6,)),  # K_p
        ("velocity_gain", np.float64, (6,)),  # K_v
        ("grip_force", np.float64),  # [N]
        ("parameters", np.float64, (MAX_LAW_PARAMETERS,)),
    ],
    align=True,
)

OWN_LAW = own_law_layout(SEEN, answer_layout(3))


@compiled
def look(model: Record, run: Record) -> None:
    """Updates the inputs for this tick and initializes the outputs to their previous values.

    Kinematics, errors and the estimated model must be up to date for the measured state.
    """
    n, own, seen = model.num_fingers, run.own, run.own.seen
    seen.time, seen.tick, seen.period = run.now, run.senses.num_ticks - 1, model.law.period
    _show_object(model, run)
    for k in range(6):
        seen.position_gain[k] = model.law.position_gains[k]
        seen.velocity_gain[k] = model.law.velocity_gains[k]
    seen.grip_force = model.law.grip_force
    for k in range(model.num_unknowns):
        seen.estimates[k] = own.answer.estimates[k] = run.discrete.estimates[k]
    believed = run.work.believed
    for i in range(n):
        _show_finger(model, run, i)
        _show_jacobian(model, run.work.kin, seen, i)
        _show_weight(model.hand, believed, run.work.kin, seen, i)
        for joint in range(3):
            own.answer.torque[i, joint] = run.discrete.commanded[i, joint]
    seen.object_mass = believed.object_mass
    for k in range(3):
        seen.object_inertias[k] = believed.inertias[k]
    show_fingers(model, model.hand, believed, seen)
    for i in range(n):
        _show_limits(model.hand, seen, i)
        if model.hand.kinds[i] == BY_CHAIN:
            # Two masses of more links are of no use without their geometry.
            seen.link_masses[i, 0] = seen.link_masses[i, 1] = 0.0


@compiled
def _show_object(model: Record, run: Record) -> None:
    """Sets measured and desired pose and velocity, and the errors."""
    seen, x, piece = run.own.seen, run.senses.measured.x, run.discrete.piece
    for k in range(7):
        seen.pose[k] = x[POSITION + k]
    for k in range(6):
        seen.velocity[k] = x[VELOCITY + k]
        seen.error[k] = run.work.room.error[k]
        seen.error_rate[k] = run.work.room.error_rate[k]
    for k in range(3):
        wanted = desired_motion(model.motion, piece, run.now, k)
        seen.desired_pose[k], seen.desired_velocity[k], seen.desired_acceleration[k] = wanted
    attitude, spin, spin_rate = desired_turn(model, piece, run.now)
    for k in range(4):
        seen.desired_pose[3 + k] = attitude[k]
    for k in range(3):
        seen.desired_velocity[3 + k] = spin[k]
        seen.desired_acceleration[3 + k] = spin_rate[k]


@compiled
def _show_finger(model: Record, run: Record, i: int) -> None:
    """Sets the measurements of finger ``i`` and its contact."""
    n, kin, seen, senses = model.num_fingers, run.work.kin, run.own.seen, run.senses
    x = senses.measured.x
    seen.believed_phase[i] = run.discrete.beliefs[i]
    for axis in range(2):
        seen.slip[i, axis] = x[slip_at(i, axis)]
        seen.slip_velocity[i, axis] = x[slip_velocity_at(n, i, axis)]
        seen.slip_direction[i, axis] = senses.gamma[i, axis]
        for c in range(3):
            seen.contact_tangents[i, axis, c] = kin.frames[i, axis, c]
    for c in range(3):
        seen.joint_position[i, c] = joint_position(model.hand, kin, i, c)
        seen.joint_velocity[i, c] = kin.rates[i, c]
        seen.joint_torque[i, c] = run.discrete.torques[i, c]
        seen.contact_arm[i, c] = kin.arms[i, c]
        seen.contact_normal[i, c] = kin.frames[i, 2, c]
        seen.contact_force[i, c] = senses.forces[i, c]
    seen.contact_moment[i], seen.eccentricity[i] = senses.moments[i], model.hand.eccentricities[i]
    if seen.eccentricity[i] > 0.0:
        seen.spin[i] = x[spin_at(n, i)]
        seen.spin_velocity[i] = x[spin_velocity_at(n, i)] / seen.eccentricity[i]


@compiled
def _show_jacobian(model: Record, kin: Record, seen: Record, i: int) -> None:
    """Sets the Jacobian of fingertip ``i``, its inverse, and the directions of its links."""
    if model.hand.kinds[i] == BY_CHAIN:
        for c in range(3):
            for k in range(3):
                seen.jacobian[i, c, k] = kin.chains[i].jacobian[c, k]
                seen.jacobian_inverse[i, c, k] = kin.chains[i].inverse[c, k]
        return
    if model.hand.kinds[i] == ON_SLIDES:
        for c in range(3):
            for k in range(3):
                seen.jacobian[i, c, k] = seen.jacobian_inverse[i, c, k] = 1.0 if c == k else 0.0
        return
    cosine, sine = kin.yaws[i, 0], kin.yaws[i, 1]
    radius, height = kin.reaches[i, 0], kin.reaches[i, 1]
    c12, s12 = kin.links[i, 1, 0], kin.links[i, 1, 1]
    second = model.hand.link_lengths[i, 1]
    jacobian, inverse = seen.jacobian[i], seen.jacobian_inverse[i]
    jacobian[0, 0], jacobian[1, 0], jacobian[2, 0] = -radius * sine, radius * cosine, 0.0
    jacobian[0, 1], jacobian[1, 1], jacobian[2, 1] = -height * cosine, -height * sine, radius
    jacobian[0, 2], jacobian[1, 2] = -second * s12 * cosine, -second * s12 * sine
    jacobian[2, 2] = second * c12
    inverse[0, 0], inverse[0, 1], inverse[0, 2] = -sine / radius, cosine / radius, 0.0
    for joint in range(2):
        outwards = kin.inverses[i, joint, 0]
        inverse[1 + joint, 0], inverse[1 + joint, 1] = cosine * outwards, sine * outwards
        inverse[1 + joint, 2] = kin.inverses[i, joint, 1]
    for link in range(2):
        along, up = kin.links[i, link, 0], kin.links[i, link, 1]
        direction = seen.link_direction[i, link]
        direction[0], direction[1], direction[2] = cosine * along, sine * along, up


@compiled
def _show_weight(hand: Record, believed: Record, kin: Record, seen: Record, i: int) -> None:
    """Sets the joint torques that support the links of finger ``i``, for its Jacobian."""
    jacobian = seen.jacobian[i]
    x, y, z = weight_force(hand, believed, kin, i)
    for k in range(3):
        seen.weight_torque[i, k] = jacobian[0, k] * x + jacobian[1, k] * y + jacobian[2, k] * z


@compiled
def _show_limits(hand: Record, seen: Record, i: int) -> None:
    """Sets the limits of the joints of finger ``i``."""
    for k in range(3):
        low, high = -np.inf, np.inf
        if hand.kinds[i] == BY_CHAIN:
            low, high = coordinate_range(hand.chains[i], k)
        seen.joint_minimum[i, k], seen.joint_maximum[i, k] = low, high
        seen.joint_torque_limit[i, k] = hand.torque_limits[i, k]
