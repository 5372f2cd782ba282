"""A law of one's own: what it is shown at a tick, where it answers, and how it is called.

Its machine code is not part of the kernel. It is called through its address, or, where that is 0,
the run pauses until the answer is there (`slipgrasp.core.run.simulation.Simulation.ticks`).
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from slipgrasp.core.kernel.compilation.compiler import INTERPRETED, address_of, compiled
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Record
from slipgrasp.core.kernel.loop.motion import desired_motion
from slipgrasp.core.kernel.planar.kinematics import joint_angle
from slipgrasp.core.kernel.planar.state import estimate_at, slip_at, slip_velocity_at, velocity_at
from slipgrasp.core.scenario import MAX_DIAGNOSTICS, MAX_LAW_PARAMETERS, MAX_UNKNOWNS

NOTHING, ASKED, ANSWERED = range(3)

# What the law is shown: measured, believed and nominal, never the truth.
SEEN = np.dtype(
    [
        ("time", np.float64),  # [s]
        ("tick", np.int64),  # of sampled control, from 0
        ("period", np.float64),  # [s]
        ("pose", np.float64, (3,)),  # as measured [m, m, rad]
        ("velocity", np.float64, (3,)),
        ("desired_pose", np.float64, (3,)),
        ("desired_velocity", np.float64, (3,)),
        ("desired_acceleration", np.float64, (3,)),
        ("joint_position", np.float64, (MAX_FINGERS, 2)),  # [rad]
        ("joint_velocity", np.float64, (MAX_FINGERS, 2)),  # [rad/s]
        ("joint_torque", np.float64, (MAX_FINGERS, 2)),  # that acts until now [N m]
        ("slip", np.float64, (MAX_FINGERS,)),  # as sensed [m]
        ("slip_velocity", np.float64, (MAX_FINGERS,)),
        ("believed_phase", np.int64, (MAX_FINGERS,)),
        ("contact_force", np.float64, (MAX_FINGERS, 2)),  # measured: tangent, normal [N]
        ("jacobian", np.float64, (MAX_FINGERS, 2, 2)),
        ("jacobian_inverse", np.float64, (MAX_FINGERS, 2, 2)),
        ("link_direction", np.float64, (MAX_FINGERS, 2, 2)),  # unit vectors along the links
        ("contact_arm", np.float64, (MAX_FINGERS, 2)),  # from the centre of mass [m]
        ("contact_tangent", np.float64, (MAX_FINGERS, 2)),  # into which slip counts
        ("contact_normal", np.float64, (MAX_FINGERS, 2)),  # into the object
        ("friction", np.float64, (MAX_FINGERS,)),  # as believed
        ("object_mass", np.float64),  # as believed [kg]
        ("object_inertia", np.float64),  # as believed [kg m^2]
        ("link_masses", np.float64, (MAX_FINGERS, 2)),  # as believed [kg]
        ("link_lengths", np.float64, (MAX_FINGERS, 2)),  # [m]
        ("link_centres", np.float64, (MAX_FINGERS, 2)),  # from the proximal joint [m]
        ("gravity", np.float64),  # [m/s^2]
        ("torque_limit", np.float64),  # inf where none [N m]
        ("estimates", np.float64, (MAX_UNKNOWNS,)),
        ("position_gain", np.float64, (3,)),  # K_p
        ("velocity_gain", np.float64, (3,)),  # K_v
        ("grip_force", np.float64),  # [N]
        ("parameters", np.float64, (MAX_LAW_PARAMETERS,)),
    ],
    align=True,
)

# What the law answers with.
ANSWER = np.dtype(
    [
        ("torque", np.float64, (MAX_FINGERS, 2)),  # [N m]
        ("estimates", np.float64, (MAX_UNKNOWNS,)),
        ("diagnostics", np.float64, (MAX_DIAGNOSTICS,)),
    ],
    align=True,
)

# The law in a run.
OWN_LAW = np.dtype(
    [
        ("address", np.int64),  # of its code; 0: the run pauses for its answer
        ("memory", np.int64),  # address of its memory
        ("asked", np.int64),  # NOTHING, ASKED or ANSWERED
        ("first", np.int64),  # 1 where the tick that waits is the first of the run
        ("stretch", np.int64),  # 1 where it begins a stretch
        ("seen", SEEN),
        ("answer", ANSWER),
    ],
    align=True,
)

_PROTOTYPE = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * 3)


@intrinsic
def _call_compiled(_typing: Any, address: Any, seen: Any, memory: Any, answer: Any) -> Any:
    """Calls machine code by its address, with the addresses of two records and a block."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        word = ir.IntType(64)
        pointer = ir.PointerType(ir.FunctionType(word, [word] * 3))
        code, seen_at, memory_at, answer_at = values
        shown, written = (builder.ptrtoint(at, word) for at in (seen_at, answer_at))
        return builder.call(builder.inttoptr(code, pointer), [shown, memory_at, written])

    return types.int64(types.int64, seen, types.int64, answer), generate


def _call_interpreted(address: int, seen: Record, memory: int, answer: Record) -> int:
    status: int = _PROTOTYPE(int(address))(address_of(seen), int(memory), address_of(answer))
    return status


call_law = _call_interpreted if INTERPRETED else _call_compiled


@compiled
def look(model: Record, run: Record) -> None:
    """Shows the law this tick, and lays out its answer: unless it says otherwise, as before."""
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
    _show_model(model, run.work.believed, seen)


@compiled
def _show_finger(model: Record, run: Record, i: int) -> None:
    """What is measured of finger ``i`` and its contact, and follows from that."""
    n, kin, seen, state = model.num_fingers, run.work.kin, run.own.seen, run.senses.measured
    seen.slip[i] = state.x[slip_at(i)]
    seen.slip_velocity[i] = state.x[slip_velocity_at(n, i)]
    seen.believed_phase[i] = run.discrete.beliefs[i]
    for axis in range(2):
        seen.contact_force[i, axis] = run.senses.forces[i, axis]
        seen.joint_position[i, axis] = joint_angle(kin, i, axis)
        seen.joint_velocity[i, axis] = kin.joint_velocities[i, axis]
        seen.joint_torque[i, axis] = run.discrete.torques[i, axis]
        seen.contact_arm[i, axis] = kin.arms[i, axis]
        seen.contact_tangent[i, axis] = kin.tangents[i, axis]
        for other in range(2):
            seen.jacobian[i, axis, other] = kin.jacobians[i, axis, other]
            seen.jacobian_inverse[i, axis, other] = kin.inverses[i, axis, other]
            seen.link_direction[i, axis, other] = kin.links[i, axis, other]
    seen.contact_normal[i, 0] = kin.tangents[i, 1]
    seen.contact_normal[i, 1] = -kin.tangents[i, 0]


@compiled
def _show_model(model: Record, believed: Record, seen: Record) -> None:
    """The hand and the object as the controller believes them to be."""
    seen.object_mass, seen.object_inertia = believed.object_inertia[0], believed.object_inertia[2]
    seen.gravity, seen.torque_limit = model.hand.gravity, model.actuators.torque_limit
    for i in range(model.num_fingers):
        seen.friction[i] = believed.friction[i]
        for link in range(2):
            seen.link_masses[i, link] = believed.link_masses[i, link]
            seen.link_lengths[i, link] = model.nominal.link_lengths[i, link]
            seen.link_centres[i, link] = model.nominal.link_centres[i, link]


@compiled
def ask(own: Record) -> int:
    """Calls the law; 0 unless it failed. An answer from outside is there already."""
    if own.address == 0:
        return 0
    return call_law(own.address, own.seen, own.memory, own.answer)


@compiled
def is_answer_finite(model: Record, answer: Record) -> bool:
    """Whether every number of an answer is finite."""
    total = 0.0
    for i in range(model.num_fingers):
        total += abs(answer.torque[i, 0]) + abs(answer.torque[i, 1])
    for k in range(model.num_unknowns):
        total += abs(answer.estimates[k])
    for k in range(model.num_diagnostics):
        total += abs(answer.diagnostics[k])
    return total < np.inf
