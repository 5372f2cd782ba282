"""Selection of the internal (grasp) force where it is free (docs/model.md, Grasp force).

Two sticking fingers have a one-dimensional internal force; its smallest value inside both cones
has a closed form. With more fingers, or if this force violates another limit, a quadratic program
is solved.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Floats, Integers, Record
from slipgrasp.core.kernel.numerics.elementary import hypot
from slipgrasp.core.kernel.numerics.quadratic import largest_violation, solve_quadratic
from slipgrasp.core.kernel.planar.kinematics import to_inertial_frame
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.workspace import WORKSPACE
from slipgrasp.core.kernel.planar.wrench import assemble_rows

# Coefficient of the violation in each inequality if not all limits can be met. The relative
# accuracy of the violation is the square of this.
SLACK = 1e-4


@compiled
def choose_grasp_force(
    forces: Floats, direction: Floats, believed: Record, safety: float, on_cone: Integers
) -> float:
    """Adds the smallest internal force for which the contacts are inside their cones.

    Each cone |F_x| <= (mu / safety) F_n gives two linear bounds on the multiplier of the internal
    force. The smallest multiplier within all bounds is used or, if there is none, the multiplier
    with the smallest violation.

    Args:
        forces: ``(n, 2)`` contact forces without internal force; the result is added here.
        direction: ``(2n,)`` internal force, spanning the one-dimensional null space.
        believed: Estimated masses and friction.
        safety: Factor >= 1 by which the cones are narrowed.
        on_cone: ``(n,)``, nonzero for contacts whose force should be on its cone; not limited here.

    Returns:
        The largest violation of a narrowed cone [N], 0 if all are met.
    """
    low, high = -np.inf, np.inf
    blocked = False
    for line in range(2 * believed.num_fingers):
        if on_cone[line // 2] != 0:
            continue
        slope, offset = _cone_side(forces, direction, believed, safety, line)
        if slope > 0.0:
            high = min(high, offset / slope)
        elif slope < 0.0:
            low = max(low, offset / slope)
        elif offset < 0.0:
            blocked = True
    multiplier, violation = min(max(0.0, low), high), 0.0
    if low > high or blocked:
        multiplier, violation = _least_violation(forces, direction, believed, safety, on_cone)
    for i in range(believed.num_fingers):
        forces[i, 0] += multiplier * direction[2 * i]
        forces[i, 1] += multiplier * direction[2 * i + 1]
    return violation


@compiled
def _cone_side(
    forces: Floats, direction: Floats, believed: Record, safety: float, line: int
) -> tuple[float, float]:
    """One side of a cone as slope * multiplier <= offset."""
    i = line // 2
    sign = 1.0 if line % 2 == 0 else -1.0
    limit = believed.friction[i] / safety
    slope = sign * direction[2 * i] - limit * direction[2 * i + 1]
    return slope, limit * forces[i, 1] - sign * forces[i, 0]


@compiled
def _largest_violation(
    forces: Floats,
    direction: Floats,
    believed: Record,
    safety: float,
    on_cone: Integers,
    multiplier: float,
) -> float:
    largest = -np.inf
    for line in range(2 * believed.num_fingers):
        if on_cone[line // 2] == 0:
            slope, offset = _cone_side(forces, direction, believed, safety, line)
            largest = max(largest, slope * multiplier - offset)
    return largest


@compiled
def _least_violation(
    forces: Floats, direction: Floats, believed: Record, safety: float, on_cone: Integers
) -> tuple[float, float]:
    """Multiplier of the smallest largest violation: at a crossing of two bounds, or 0."""
    lines = 2 * believed.num_fingers
    best = 0.0
    least = _largest_violation(forces, direction, believed, safety, on_cone, 0.0)
    for a in range(lines):
        for b in range(a):
            if on_cone[a // 2] != 0 or on_cone[b // 2] != 0:
                continue
            slope_a, offset_a = _cone_side(forces, direction, believed, safety, a)
            slope_b, offset_b = _cone_side(forces, direction, believed, safety, b)
            if slope_a == slope_b:
                continue
            crossing = (offset_a - offset_b) / (slope_a - slope_b)
            value = _largest_violation(forces, direction, believed, safety, on_cone, crossing)
            if value < least:
                best, least = crossing, value
    return best, least


@compiled_apart(types.int64, MODEL, WORKSPACE)
def minimise_forces(model: Record, work: Record) -> int:
    """Finds the smallest contact forces that produce the desired wrench within all limits.

    The part of F^ determined by the wrench is orthogonal to the internal part, so the smallest F^
    has the smallest internal force. If the limits contradict each other, the largest violation is
    minimized and stored in ``room.violation`` [N].

    Returns:
        1, or 0 if the rows of G are dependent.
    """
    problem, room = work.quadratic, work.room
    _pose_wrench(model, work)
    problem.rows = problem.equalities
    for i in range(model.num_fingers):
        _limit_force(model.law, work, i)
        _limit_torques(model.hand, work, i)
    room.violation = 0.0
    if solve_quadratic(problem) == 0:
        if problem.count < problem.equalities:
            return 0
        _share_violation(problem)
        solve_quadratic(problem)
        problem.columns -= 1
        room.violation = largest_violation(problem)
    for i in range(model.num_fingers):
        room.contact_force[i, 0] = problem.solution[2 * i]
        room.contact_force[i, 1] = problem.solution[2 * i + 1]
    return 1


@compiled
def _pose_wrench(model: Record, work: Record) -> None:
    """Sets the equalities G F^ = (d, 0)."""
    problem, room, columns = work.quadratic, work.room, 2 * model.num_fingers
    rows = assemble_rows(work.kin, work.believed, room.on_cone, room)
    problem.columns, problem.equalities = columns, rows
    for row in range(rows):
        for column in range(columns):
            problem.normals[row, column] = room.basis[column, row]
        problem.bounds[row] = room.right_side[row]


@compiled
def _limit_force(law: Record, work: Record, i: int) -> None:
    """Adds the limits of the normal force and, unless the force should be on it, the cone."""
    if work.room.on_cone[i] == 0:
        cone = work.believed.friction[i] / law.grip_safety
        _require(work.quadratic, i, 1.0, cone, 0.0)
        _require(work.quadratic, i, -1.0, cone, 0.0)
    _require(work.quadratic, i, 0.0, 1.0, law.minimum_normal_force)
    if law.maximum_normal_force < np.inf:
        _require(work.quadratic, i, 0.0, -1.0, -law.maximum_normal_force)


@compiled
def _limit_torques(hand: Record, work: Record, i: int) -> None:
    """Adds |tau| <= limit for both joints, in newtons: divided by the lever arm of the force."""
    for joint in range(2):
        if hand.torque_limits[i, joint] == np.inf:
            continue
        along, across, free = _torque_of_force(work, i, joint)
        lever = hypot(along, across)
        along, across, free = along / lever, across / lever, free / lever
        limit = hand.torque_limits[i, joint] / lever
        _require(work.quadratic, i, along, across, -limit - free)
        _require(work.quadratic, i, -along, -across, free - limit)


@compiled
def _torque_of_force(work: Record, i: int, joint: int) -> tuple[float, float, float]:
    """Torque of a joint per unit of F_x, per unit of F_n, and for the motion of the finger."""
    jx, jy = work.kin.jacobians[i, 0, joint], work.kin.jacobians[i, 1, joint]
    ax, ay = to_inertial_frame(work.kin, i, 1.0, 0.0)
    nx, ny = to_inertial_frame(work.kin, i, 0.0, 1.0)
    free = jx * work.room.believed_force[i, 0] + jy * work.room.believed_force[i, 1]
    return jx * ax + jy * ay, jx * nx + jy * ny, free


@compiled
def _require(problem: Record, i: int, along: float, normal: float, bound: float) -> None:
    """Adds along * F_x + normal * F_n >= bound at contact i."""
    row = problem.rows
    for column in range(problem.columns):
        problem.normals[row, column] = 0.0
    problem.normals[row, 2 * i], problem.normals[row, 2 * i + 1] = along, normal
    problem.bounds[row] = bound
    problem.rows = row + 1


@compiled
def _share_violation(problem: Record) -> None:
    """Adds a variable, at a high cost, for the violation of all inequalities."""
    for row in range(problem.rows):
        problem.normals[row, problem.columns] = SLACK if row >= problem.equalities else 0.0
    problem.columns += 1


@compiled_apart(types.void, MODEL, WORKSPACE)
def keep_limits(model: Record, work: Record) -> None:
    """Solves the quadratic program if the closed form for two fingers violates other limits."""
    law, forces = model.law, work.room.contact_force
    for i in range(model.num_fingers):
        normal = forces[i, 1]
        if not law.minimum_normal_force <= normal <= law.maximum_normal_force:
            minimise_forces(model, work)
            return
        for joint in range(2):
            along, across, free = _torque_of_force(work, i, joint)
            torque = abs(along * forces[i, 0] + across * normal + free)
            if torque > model.hand.torque_limits[i, joint]:
                minimise_forces(model, work)
                return
