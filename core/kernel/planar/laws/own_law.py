"""Inputs of a custom law for planar hands at a tick (`slipgrasp.core.kernel.laws`)."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Record
from slipgrasp.core.kernel.laws.own_law import answer_layout, own_law_layout, show_fingers
from slipgrasp.core.kernel.loop.links import BY_CHAIN, BY_LINKS
from slipgrasp.core.kernel.loop.motion import desired_motion
from slipgrasp.core.kernel.planar.kinematics import joint_position
from slipgrasp.core.kernel.planar.laws.pd_gravity import weight_torques
from slipgrasp.core.kernel.planar.state import estimate_at, slip_at, slip_velocity_at, velocity_at
from slipgrasp.core.scenario import MAX_LAW_PARAMETERS, MAX_UNKNOWNS

# Inputs of the law: measured, estimated and nominal values, never the true ones.
SEEN = np.dtype(
    [
        ("time", np.float64),  # [s]
        ("tick", np.int64),  # of sampled control, from 0
        ("period", np.float64),  # [s]
        ("pose", np.float64, (3,)),  # measured [m, m, rad]
        ("velocity", np.float64, (3,)),
        ("desired_pose", np.float64, (3,)),
        ("desired_velocity", np.float64, (3,)),
        ("desired_acceleration", np.float64, (3,)),
        ("joint_position", np.float64, (MAX_FINGERS, 2)),  # [rad], of slides [m]
        ("joint_velocity", np.float64, (MAX_FINGERS, 2)),  # [rad/s, m/s]
        ("joint_torque", np.float64, (MAX_FINGERS, 2)),  # applied up to this tick [N m, N]
        ("slip", np.float64, (MAX_FINGERS,)),  # measured [m]
        ("slip_velocity", np.float64, (MAX_FINGERS,)),
        ("believed_phase", np.int64, (MAX_FINGERS,)),
        ("contact_force", np.float64, (MAX_FINGERS, 2)),  # measured: tangent, normal [N]
        ("jacobian", np.float64, (MAX_FINGERS, 2, 2)),
        ("jacobian_inverse", np.float64, (MAX_FINGERS, 2, 2)),
        ("weight_torque", np.float64, (MAX_FINGERS, 2)),  # that supports the links [N m, N]
        ("link_direction", np.float64, (MAX_FINGERS, 2, 2)),  # unit vectors along the links
        ("contact_arm", np.float64, (MAX_FINGERS, 2)),  # from the centre of mass [m]
        ("contact_tangent", np.float64, (MAX_FINGERS, 2)),  # direction of positive slip
        ("contact_normal", np.float64, (MAX_FINGERS, 2)),  # into the object
        ("friction", np.float64, (MAX_FINGERS,)),  # estimated
        ("object_mass", np.float64),  # estimated [kg]
        ("object_inertia", np.float64),  # estimated [kg m^2]
        ("link_masses", np.float64, (MAX_FINGERS, 2)),  # estimated; of slides the first [kg]
        ("link_lengths", np.float64, (MAX_FINGERS, 2)),  # [m]
        ("link_centres", np.float64, (MAX_FINGERS, 2)),  # from the proximal joint [m]
        ("gravity", np.float64),  # [m/s^2]
        ("torque_limit", np.float64),  # of all joints, inf if unlimited [N m]
        ("joint_torque_limit", np.float64, (MAX_FINGERS, 2)),  # inf if unlimited [N m, N]
        ("joint_minimum", np.float64, (MAX_FINGERS, 2)),  # -inf if unlimited [rad, m]
        ("joint_maximum", np.float64, (MAX_FINGERS, 2)),  # inf if unlimited [rad, m]
        ("estimates", np.float64, (MAX_UNKNOWNS,)),
        ("position_gain", np.float64, (3,)),  # K_p
        ("velocity_gain", np.float64, (3,)),  # K_v
        ("grip_force", np.float64),  # [N]
        ("parameters", np.float64, (MAX_LAW_PARAMETERS,)),
    ],
    align=True,
)

OWN_LAW = own_law_layout(SEEN, answer_layout(2))


@compiled
def look(model: Record, run: Record) -> None:
    """Updates the inputs for this tick and initializes the outputs to their previous values."""
    n, seen, own = model.num_fingers, run.own.seen, run.own
    seen.time, seen.tick, seen.period = run.now, run.senses.num_ticks - 1, model.law.period
    state, motion = run.senses.measured, model.motion
    for k in range(3):
        seen.pose[k], seen.velocity[k] = state.x[k], state.x[velocity_at(k)]
        wanted = desired_motion(motion, run.discrete.piece, run.now, k)
        seen.desired_pose[k], seen.desired_velocity[k], seen.desired_acceleration[k] = wanted
        seen.position_gain[k] = model.law.position_gains[k]
        seen.velocity_gain[k] = model.law.velocity_gains[k]
    seen.grip_force = model.law.grip_force
    for k in range(model.num_unknowns):
        value = run.step.start.x[estimate_at(n, k)]
        seen.estimates[k] = own.answer.estimates[k] = value
    for i in range(n):
        _show_finger(model, run, i)
        for joint in range(2):
            own.answer.torque[i, joint] = run.discrete.commanded[i, joint]
    believed = run.work.believed
    seen.object_mass, seen.object_inertia = believed.object_inertia[0], believed.object_inertia[2]
    show_fingers(model, model.nominal, believed, seen)
    for i in range(n):
        _show_joints(model, run, i)


@compiled
def _show_finger(model: Record, run: Record, i: int) -> None:
    """Sets the measurements of finger ``i`` and its contact, and derived values."""
    n, kin, seen, state = model.num_fingers, run.work.kin, run.own.seen, run.senses.measured
    seen.slip[i] = state.x[slip_at(i)]
    seen.slip_velocity[i] = state.x[slip_velocity_at(n, i)]
    seen.believed_phase[i] = run.discrete.beliefs[i]
    for axis in range(2):
        seen.contact_force[i, axis] = run.senses.forces[i, axis]
        seen.joint_position[i, axis] = joint_position(model.hand, kin, i, axis)
        seen.joint_velocity[i, axis] = kin.joint_velocities[i, axis]
        seen.joint_torque[i, axis] = run.discrete.torques[i, axis]
        seen.contact_arm[i, axis] = kin.arms[i, axis]
        seen.contact_tangent[i, axis] = kin.tangents[i, axis]
        for other in range(2):
            seen.jacobian[i, axis, other] = kin.jacobians[i, axis, other]
            seen.jacobian_inverse[i, axis, other] = kin.inverses[i, axis, other]
            has_links = model.hand.kinds[i] == BY_LINKS
            seen.link_direction[i, axis, other] = kin.links[i, axis, other] if has_links else 0.0
    seen.contact_normal[i, 0] = kin.tangents[i, 1]
    seen.contact_normal[i, 1] = -kin.tangents[i, 0]


@compiled
def _show_joints(model: Record, run: Record, i: int) -> None:
    """Sets the limits of the joints of finger ``i`` and the torques that support its links."""
    hand, seen, work = model.hand, run.own.seen, run.work
    first, second = weight_torques(model.nominal, work.believed, work.kin, i)
    seen.weight_torque[i, 0], seen.weight_torque[i, 1] = first, second
    for joint in range(2):
        seen.joint_torque_limit[i, joint] = hand.torque_limits[i, joint]
        low, high = -np.inf, np.inf
        if hand.kinds[i] == BY_CHAIN:
            low, high = hand.chains[i].limits[joint, 0], hand.chains[i].limits[joint, 1]
        seen.joint_minimum[i, joint], seen.joint_maximum[i, joint] = low, high
