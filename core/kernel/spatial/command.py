"""Commanded torque of the control laws for spatial hands (docs/space.md, The controller).

A model-based law commands tau_i = J_i^T (C_i F^_i + f^_i): the force f^ that the estimated finger
needs for the desired acceleration, and contact forces F^ that produce the desired wrench. With the
distribution "hold", W F^ = d with every contact inside its cone; the laws of the paper also put the
forces of slipping contacts on their cones, G = [W; -D], to control their slip. PD control uses a
fixed grip instead (`slipgrasp.core.kernel.spatial.grip`).
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.links import combine_links
from slipgrasp.core.kernel.loop.status import (
    LARGEST_TILT,
    MODEL_SINGULAR,
    RUNNING,
    TORQUE_NOT_FINITE,
    TURNED_TOO_FAR,
)
from slipgrasp.core.kernel.spatial.dynamics import multiply, update_unit_dynamics
from slipgrasp.core.kernel.spatial.grasp import spatial_grasp
from slipgrasp.core.kernel.spatial.grasp_limits import part_at
from slipgrasp.core.kernel.spatial.grip import fill_wrench, spatial_grip
from slipgrasp.core.kernel.spatial.gripper import spatial_close
from slipgrasp.core.kernel.spatial.kinematics import (
    forces_to_torques,
    moment_at_tip,
    update_kinematics,
)
from slipgrasp.core.kernel.spatial.law import (
    believe,
    brake_slips,
    leave_stuck,
    tilt,
    update_errors,
)
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.plant import assemble, object_bias, own_force, to_world
from slipgrasp.core.kernel.spatial.sensing import SENSES
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, MAX_ASKED, WORKSPACE

WIDER, WIDENINGS = 1.25, 10


@compiled_apart(types.void, MODEL, DISCRETE, types.float64, SENSES, WORKSPACE)
def spatial_believe(
    model: Record, discrete: Record, t: float, senses: Record, work: Record
) -> None:
    """Evaluates the controller's model of the hand at the measured state and estimated phases."""
    room = work.room
    work.at_start = 0
    update_kinematics(model.hand, discrete.seeds, senses.measured, work.kin)
    update_unit_dynamics(model.hand, work.kin, work.unit)
    believe(model, discrete.estimates, work.believed)
    combine_links(work.believed, work.unit, work.believed_dynamics)
    for i in range(model.num_fingers):
        for axis in range(2):
            room.slips[i, axis] = senses.slips[i, axis]
            room.gamma[i, axis] = senses.gamma[i, axis]
    assemble(
        work.kin,
        work.believed_dynamics,
        work.believed,
        room.slips,
        room.gamma,
        work.believed_system,
    )
    update_errors(model, discrete.piece, t, senses.measured, room)
    leave_stuck(model.num_fingers, room.slips, room)
    brake_slips(model, discrete, senses.measured, room)


@compiled_apart(types.int64, MODEL, DISCRETE, types.float64, SENSES, WORKSPACE)
def spatial_command(model: Record, discrete: Record, t: float, senses: Record, work: Record) -> int:
    """Writes the commanded torque to ``discrete.commanded``.

    Returns:
        RUNNING, or the reason why there is no command: the model is singular, the torque is not
        finite, or the object has rotated beyond the range of the law's coordinates.
    """
    law = model.law
    spatial_believe(model, discrete, t, senses, work)
    if not tilt(work.room) < LARGEST_TILT:
        return TURNED_TOO_FAR
    discrete.violation = 0.0
    if law.facts.holds_tips:
        spatial_close(model, discrete, t, senses.measured, work)
    elif not law.facts.uses_friction:
        added = discrete.added_grip if law.facts.reacts_to_slip else 0.0
        spatial_grip(model, work, law.grip_force + added)
    elif work.believed_system.determinant == 0.0:
        return MODEL_SINGULAR
    else:
        _command_forces(model, discrete, senses.measured, work)
    total = 0.0
    for i in range(model.num_fingers):
        for k in range(3):
            total += work.tip_forces[i, k]
    if not abs(total) < np.inf:
        return TORQUE_NOT_FINITE
    forces_to_torques(model.hand, work.kin, work.tip_forces, discrete.commanded)
    return RUNNING


@compiled
def _command_forces(model: Record, discrete: Record, state: Record, work: Record) -> None:
    """Computes tip forces for the desired motion, with contact forces inside their cones."""
    n, force, own = model.num_fingers, work.grasp.force, work.room.own_force
    _ask_wrench(model, state, work)
    num_rows = _fill_rows(model, work)
    _set_limits(model, work)
    violation = spatial_grasp(work.grasp, n, num_rows, model.law.grasp_force)
    discrete.violation = violation
    if violation > 0.0 and model.law.acceleration_variance > 0.0:
        _widen_cones(model, work)
    for i in range(n):
        x, y, z = to_world(work.kin, i, force[3 * i], force[3 * i + 1], force[3 * i + 2])
        work.tip_forces[i, 0] = x + own[i, 0]
        work.tip_forces[i, 1] = y + own[i, 1]
        work.tip_forces[i, 2] = z + own[i, 2]
        if model.soft == 1:
            _give_moment(model, work, i)


@compiled
def _ask_wrench(model: Record, state: Record, work: Record) -> None:
    """Computes d = M_o v_o + h_o of the estimated object, in ``right``, and f^ of every finger."""
    room, believed, right = work.room, work.believed, work.believed_system.right
    object_bias(state, work.believed_system, believed, model.hand.gravity, room.bias)
    x, y, z = multiply(work.believed_system.body, room.demand[3], room.demand[4], room.demand[5])
    for k in range(3):
        right[k] = believed.object_mass * room.demand[k] + room.bias[k]
    right[3], right[4], right[5] = x + room.bias[3], y + room.bias[4], z + room.bias[5]
    for i in range(model.num_fingers):
        fx, fy, fz = own_force(work.kin, work.believed_dynamics, i, room.demand, room.slip_demand)
        room.own_force[i, 0], room.own_force[i, 1], room.own_force[i, 2] = fx, fy, fz


@compiled
def _fill_rows(model: Record, work: Record) -> int:
    """Fills [G | d]: the wrench and, unless the distribution is "hold", the slipping tangents."""
    n, rows, room = model.num_fingers, work.grasp.rows, work.room
    fill_wrench(n, work)
    if model.soft == 1:
        _add_moments(model, work)
    work.grasp.softens, num_rows = model.law.softens, 6
    if model.law.softens == 1:
        _scale_moments(model, work)
    if model.law.holds == 1:
        return num_rows
    for i in range(n):
        for axis in range(2):
            if room.slips[i, axis] == 0.0:
                continue
            for column in range(work.grasp.size):
                rows[num_rows, column] = 0.0
            rows[num_rows, MAX_ASKED] = 0.0
            rows[num_rows, 3 * i + axis] = -1.0
            rows[num_rows, 3 * i + 2] = -work.believed.friction[i] * room.gamma[i, axis]
            num_rows += 1
    return num_rows


@compiled
def _add_moments(model: Record, work: Record) -> None:
    """Adds the moments of soft contacts about their normals as columns of W."""
    n, grasp, kin = model.num_fingers, work.grasp, work.kin
    grasp.soft, grasp.size = 1, 4 * n
    for i in range(n):
        column = part_at(grasp, i, 2)
        for k in range(3):
            grasp.rows[k, column] = 0.0
            grasp.rows[3 + k, column] = -model.hand.eccentricities[i] * kin.frames[i, 2, k]


@compiled
def _give_moment(model: Record, work: Record, i: int) -> None:
    """Adds the tip force for the joint torques that produce the moment of contact ``i``."""
    kin, moment = work.kin, work.grasp.force[part_at(work.grasp, i, 2)]
    normal = kin.frames[i, 2]
    x, y, z = moment_at_tip(model.hand, kin, i, normal[0], normal[1], normal[2])
    moment *= model.hand.eccentricities[i]
    work.tip_forces[i, 0] -= moment * x
    work.tip_forces[i, 1] -= moment * y
    work.tip_forces[i, 2] -= moment * z


@compiled
def _scale_moments(model: Record, work: Record) -> None:
    """Divides the moment rows by the root-mean-square arm of the contacts."""
    n, rows, total = model.num_fingers, work.grasp.rows, 0.0
    for i in range(n):
        for k in range(3):
            total += work.kin.arms[i, k] * work.kin.arms[i, k] / n
    scale = 1.0 / np.sqrt(total)
    for row in range(3, 6):
        for column in range(work.grasp.size):
            rows[row, column] *= scale
        rows[row, MAX_ASKED] *= scale


@compiled
def _set_limits(model: Record, work: Record) -> None:
    law, grasp = model.law, work.grasp
    grasp.least, grasp.most = law.minimum_normal_force, law.maximum_normal_force
    grasp.ways = model.ways
    for i in range(model.num_fingers):
        grasp.cones[i, 1] = -1.0
        for way in range(model.ways):
            free = law.holds == 1 or work.room.slips[i, way] == 0.0
            grasp.cones[i, way] = work.believed.friction[i] / law.grip_safety if free else -1.0


@compiled
def _widen_cones(model: Record, work: Record) -> None:
    """Finds forces inside wider cones; the narrowest candidate with a solution is used.

    If noisy estimates allow no solution inside the cones, the estimates are probably wrong. Forces
    with the smallest violation would hardly press and lose the object.
    """
    for _ in range(WIDENINGS):
        for i in range(model.num_fingers):
            for way in range(model.ways):
                work.grasp.cones[i, way] *= WIDER
        num_rows = _fill_rows(model, work)
        if spatial_grasp(work.grasp, model.num_fingers, num_rows, model.law.grasp_force) == 0.0:
            return
