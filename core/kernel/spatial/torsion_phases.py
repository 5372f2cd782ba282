"""Reduced equations of a hand with soft fingertips in given phases (docs/space.md).

The equations are solved for the motion of the object. With H_i = [I, -S(r_i)] and the tip inertia
Lambda_i, a sticking contact adds H^T Lambda H to

    Sigma nu' = load - h_o + sum H^T (u - f_0 - Lambda b) + sum m F_tau / e,

m = e (H^T k - [0; n]), k = J^-T J_omega^T n. Friction of a slipping contact is proportional to F_n:
the wrench on the object is w F_n and the tip force q F_n, with w = [c; r x c + e mu gamma_tau n],
q = c + e mu gamma_tau k and c = n + mu (gamma_x t_x + gamma_y t_y). With d = n . Lambda^-1 q,

    F_n = n . (Lambda^-1 (u - f_0) - b - H nu') / d.
"""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.numerics.dense import factor_dense, solve_dense
from slipgrasp.core.kernel.spatial.contact_problem import inverse_of, times
from slipgrasp.core.kernel.spatial.dynamics import multiply, world_inertia
from slipgrasp.core.kernel.spatial.kinematics import moment_at_tip
from slipgrasp.core.kernel.spatial.plant import (
    object_bias,
    set_body_inertia,
    tip_inertia_columns,
    to_contact_frame,
)
from slipgrasp.core.kernel.spatial.torsion_equations import move_tip, spin_bias
from slipgrasp.core.kernel.spatial.torsion_layout import NORMAL
from slipgrasp.core.kernel.spatial.workspace import STICK


@compiled
def prepare_pads(model: Record, state: Record, work: Record) -> None:
    """Computes the terms independent of phases: inertia of the object, turning of fingertips."""
    kin, torsion = work.kin, work.torsion
    world_inertia(kin, model.truth.inertias, work.system.body)
    entries = inverse_of(work.system.body)
    for k in range(6):
        torsion.turn_inverse[k] = entries[k]
    for i in range(model.num_fingers):
        e, k = model.hand.eccentricities[i], (0.0, 0.0, 0.0)
        nx, ny, nz = kin.frames[i, 2, 0], kin.frames[i, 2, 1], kin.frames[i, 2, 2]
        torsion.gyration[i] = 0.0
        if e > 0.0:
            k = moment_at_tip(model.hand, kin, i, nx, ny, nz)
            torsion.gyration[i] = spin_bias(model, state, work, i)
        rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
        x, y, z = k
        turns = (ry * z - rz * y - nx, rz * x - rx * z - ny, rx * y - ry * x - nz)
        for c in range(3):
            torsion.turning[i, c] = k[c]
            torsion.twists[i, c], torsion.twists[i, 3 + c] = e * k[c], e * turns[c]


@compiled
def assemble_phases(model: Record, discrete: Record, gamma: Floats, work: Record) -> float:
    """Factors Sigma of the current phases.

    Args:
        model: Constants of the run.
        discrete: Phases.
        gamma: Slip directions; zero for slip without friction.
        work: Workspace after `prepare_pads`.

    Returns:
        The determinant of Sigma over that of the object's inertia, positive while regular.
    """
    truth, sigma = model.truth, work.torsion.sigma
    set_body_inertia(truth.object_mass, work.system.body, sigma)
    regular = 1.0
    for k in range(3):
        regular /= truth.object_mass * truth.inertias[k]
    for i in range(model.num_fingers):
        if discrete.phases[i] == STICK:
            tip_inertia_columns(work.kin, work.dynamics.inertia[i], sigma, i)
        else:
            regular *= _add_slip(model, gamma, work, i)
    return regular * factor_dense(sigma, 6, work.torsion.sigma_order)


@compiled
def _add_slip(model: Record, gamma: Floats, work: Record, i: int) -> float:
    """Adds a slipping contact to Sigma; returns the ratio of d to its value without friction."""
    kin, torsion, frame = work.kin, work.torsion, work.kin.frames[i]
    mu = model.truth.friction[i]
    first, second = mu * gamma[i, 0], mu * gamma[i, 1]
    third = model.hand.eccentricities[i] * mu * gamma[i, 2]
    nx, ny, nz = frame[2, 0], frame[2, 1], frame[2, 2]
    cx = nx + first * frame[0, 0] + second * frame[1, 0]
    cy = ny + first * frame[0, 1] + second * frame[1, 1]
    cz = nz + first * frame[0, 2] + second * frame[1, 2]
    rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
    press = (
        cx,
        cy,
        cz,
        ry * cz - rz * cy + third * nx,
        rz * cx - rx * cz + third * ny,
        rx * cy - ry * cx + third * nz,
    )
    along = (nx, ny, nz, ry * nz - rz * ny, rz * nx - rx * nz, rx * ny - ry * nx)
    turning = torsion.turning[i]
    yx, yy, yz = move_tip(
        model, work, i, cx + third * turning[0], cy + third * turning[1], cz + third * turning[2]
    )
    give = nx * yx + ny * yy + nz * yz
    plain = move_tip(model, work, i, nx, ny, nz)
    torsion.gives[i] = give
    torsion.yields[i, 0], torsion.yields[i, 1], torsion.yields[i, 2] = yx, yy, yz
    for k in range(6):
        torsion.presses[i, k] = press[k]
    for a in range(6):
        part = press[a] / give
        for b in range(6):
            torsion.sigma[a, b] += part * along[b]
    return give / (nx * plain[0] + ny * plain[1] + nz * plain[2])


@compiled
def pull_object(work: Record, i: int, x: float, y: float, z: float) -> None:
    """Adds H^T times a tip force to the load."""
    kin, load = work.kin, work.torsion.load
    rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
    load[0] += x
    load[1] += y
    load[2] += z
    load[3] += ry * z - rz * y
    load[4] += rz * x - rx * z
    load[5] += rx * y - ry * x


@compiled
def press_object(work: Record, i: int, force: float) -> None:
    """Adds the wrench of a slipping contact with a given normal force to the load."""
    for k in range(6):
        work.torsion.load[k] += force * work.torsion.presses[i, k]


@compiled
def along_normal(kin: Record, i: int, x: float, y: float, z: float) -> float:
    """Component of a vector along the normal."""
    normal = kin.frames[i, 2]
    return normal[0] * x + normal[1] * y + normal[2] * z


@compiled
def load_phases(model: Record, discrete: Record, state: Record, work: Record) -> None:
    """Computes the right side in the current phases, without moments in stick."""
    kin, dynamics, torsion = work.kin, work.dynamics, work.torsion
    object_bias(state, work.system, model.truth, model.hand.gravity, work.column)
    for k in range(6):
        torsion.load[k] = model.load[k] - work.column[k]
    for i in range(model.num_fingers):
        x = work.tip_forces[i, 0] - dynamics.bias[i, 0]
        y = work.tip_forces[i, 1] - dynamics.bias[i, 1]
        z = work.tip_forces[i, 2] - dynamics.bias[i, 2]
        bx, by, bz = kin.bias[i, 0], kin.bias[i, 1], kin.bias[i, 2]
        if discrete.phases[i] == STICK:
            lx, ly, lz = multiply(dynamics.inertia[i], bx, by, bz)
            x, y, z = x - lx, y - ly, z - lz
            pull_object(work, i, x, y, z)
        else:
            x, y, z = move_tip(model, work, i, x, y, z)
            x, y, z = x - bx, y - by, z - bz
            press_object(work, i, along_normal(kin, i, x, y, z) / torsion.gives[i])
        torsion.free[i, 0], torsion.free[i, 1], torsion.free[i, 2] = x, y, z


@compiled
def solve_phases(torsion: Record, right: Floats, motion: Floats) -> None:
    """Computes Sigma^-1 times a right side."""
    solve_dense(torsion.sigma, 6, torsion.sigma_order, right, motion)


@compiled
def point_motion(kin: Record, motion: Floats, i: int) -> tuple[float, float, float]:
    """Product of H_i and a motion of the object."""
    rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
    return (
        motion[0] + motion[4] * rz - motion[5] * ry,
        motion[1] + motion[5] * rx - motion[3] * rz,
        motion[2] + motion[3] * ry - motion[4] * rx,
    )


@compiled
def slip_forces(
    work: Record, motion: Floats, i: int, x: float, y: float, z: float
) -> tuple[float, float, float, float]:
    """F_n of a slipping contact, and the motion of its fingertip on the object.

    Args:
        work: Workspace after `assemble_phases`.
        motion: Motion of the object.
        i: Index of the contact.
        x: Motion of the fingertip without contact, along the world x axis.
        y: The same along y.
        z: The same along z.
    """
    torsion = work.torsion
    gx, gy, gz = point_motion(work.kin, motion, i)
    x, y, z = x - gx, y - gy, z - gz
    force = along_normal(work.kin, i, x, y, z) / torsion.gives[i]
    yields = torsion.yields[i]
    return force, x - yields[0] * force, y - yields[1] * force, z - yields[2] * force


@compiled
def along_tangent(kin: Record, i: int, axis: int, x: float, y: float, z: float) -> float:
    """Component of a vector along a tangent."""
    tangent = kin.frames[i, axis]
    return tangent[0] * x + tangent[1] * y + tangent[2] * z


@compiled
def twist_of(torsion: Record, i: int, motion: Floats) -> float:
    """Part of e psi'' of a sticking contact that is due to the motion of the object."""
    total = 0.0
    for k in range(6):
        total += torsion.twists[i, k] * motion[k]
    return total


@compiled
def turn_mobility(model: Record, work: Record, i: int) -> float:
    """Mobility e psi'' per F_tau / e of contact ``i`` without other forces."""
    normal, e, turning = (
        work.kin.frames[i, 2],
        model.hand.eccentricities[i],
        work.torsion.turning[i],
    )
    x, y, z = times(work.torsion.turn_inverse, normal[0], normal[1], normal[2])
    total = normal[0] * x + normal[1] * y + normal[2] * z
    x, y, z = move_tip(model, work, i, turning[0], turning[1], turning[2])
    total += turning[0] * x + turning[1] * y + turning[2] * z
    return e * e * total


@compiled
def spin_rest(model: Record, work: Record, i: int) -> float:
    """Part of e psi'' of a sticking contact at zero acceleration of the object."""
    kin, turning, total = work.kin, work.torsion.turning[i], work.torsion.gyration[i]
    for c in range(3):
        total += turning[c] * (kin.bias[i, c] - kin.curvature[i, c])
    return model.hand.eccentricities[i] * total


@compiled
def push_of_stick(
    model: Record, work: Record, i: int, moment: float, motion: Floats
) -> tuple[float, float, float]:
    """Change of the force of a sticking contact with F_tau / e and the motion of the object."""
    torsion, e = work.torsion, model.hand.eccentricities[i]
    gx, gy, gz = point_motion(work.kin, motion, i)
    lx, ly, lz = multiply(work.dynamics.inertia[i], gx, gy, gz)
    turning = torsion.turning[i]
    return to_contact_frame(
        work.kin,
        i,
        e * moment * turning[0] - lx,
        e * moment * turning[1] - ly,
        e * moment * turning[2] - lz,
    )


@compiled
def take_stick(model: Record, work: Record, i: int, moment: float, creeps: bool) -> None:
    """Writes force and accelerations of contact ``i`` in stick with the moment F_tau / e."""
    torsion, motion, e = work.torsion, work.acceleration, model.hand.eccentricities[i]
    gx, gy, gz = point_motion(work.kin, motion, i)
    lx, ly, lz = multiply(work.dynamics.inertia[i], gx, gy, gz)
    free, turning = torsion.free[i], torsion.turning[i]
    x, y, z = to_contact_frame(
        work.kin,
        i,
        free[0] - lx + e * moment * turning[0],
        free[1] - ly + e * moment * turning[1],
        free[2] - lz + e * moment * turning[2],
    )
    work.forces[i, 0], work.forces[i, 1], work.forces[i, 2], work.moments[i] = x, y, z, moment
    work.slip_acceleration[i, 0] = work.slip_acceleration[i, 1] = work.spin_acceleration[i] = 0.0
    if creeps:
        work.spin_acceleration[i] = twist_of(torsion, i, motion) + spin_rest(model, work, i)


@compiled
def take_slip(model: Record, work: Record, i: int) -> None:
    """Writes force and accelerations of contact ``i`` in slip."""
    torsion, kin, motion, e = (
        work.torsion,
        work.kin,
        work.acceleration,
        model.hand.eccentricities[i],
    )
    free, turning = torsion.free[i], torsion.turning[i]
    force, x, y, z = slip_forces(work, motion, i, free[0], free[1], free[2])
    bound = model.truth.friction[i] * force
    for axis in range(2):
        work.forces[i, axis] = -work.gamma[i, axis] * bound
        work.slip_acceleration[i, axis] = along_tangent(kin, i, axis, x, y, z)
    work.forces[i, 2] = force
    work.moments[i] = -work.gamma[i, NORMAL - 1] * bound if e > 0.0 else 0.0
    gx, gy, gz = point_motion(kin, motion, i)
    ax = x + gx + kin.bias[i, 0] - kin.curvature[i, 0]
    ay = y + gy + kin.bias[i, 1] - kin.curvature[i, 1]
    az = z + gz + kin.bias[i, 2] - kin.curvature[i, 2]
    turned = along_normal(kin, i, motion[3], motion[4], motion[5])
    work.spin_acceleration[i] = e * (
        turning[0] * ax + turning[1] * ay + turning[2] * az - turned + torsion.gyration[i]
    )
