"""Equations of soft fingertips, whose contacts resist turning about their normal.

Spin is not a coordinate of the hand: psi' = n . (omega_f - omega) is a function of the velocities
of object and slips. The equations are therefore solved for the contact forces (docs/space.md,
Soft fingertips),

    w = (s_x'', s_y'', e psi'', gap'') = G F + c,     F = (F_x, F_y, F_tau / e, F_n),

with w = 0 for a sticking contact and F on the limit surface, a ball in these coordinates, for a
slipping contact. A moment about the normal is equivalent to the tip force k F_tau for the finger,
k = J^-T J_omega^T n, so that only the tip inertia of the fingers is needed.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.loop.links import ON_SLIDES
from slipgrasp.core.kernel.spatial.contact_problem import inverse_of, solve_positive, times
from slipgrasp.core.kernel.spatial.curved_faces import FLAT, normal_rate
from slipgrasp.core.kernel.spatial.dynamics import world_inertia
from slipgrasp.core.kernel.spatial.kinematics import moment_at_tip, tip_turning
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.plant import object_bias
from slipgrasp.core.kernel.spatial.state import SPIN, STATE, VELOCITY, slip_velocity_at
from slipgrasp.core.kernel.spatial.torsion_layout import NORMAL, ROWS, TURN
from slipgrasp.core.kernel.spatial.workspace import WORKSPACE


@compiled_apart(types.void, MODEL, STATE, WORKSPACE)
def spatial_mobility(model: Record, state: Record, work: Record) -> None:
    """Computes G and c, given kinematics, finger dynamics and tip forces of the state."""
    n, torsion = model.num_fingers, work.torsion
    _prepare_object(model, state, work)
    for i in range(n):
        _set_columns(model, work, i)
    for a in range(ROWS * n):
        for b in range(a + 1):
            total = 0.0
            for k in range(6):
                total += torsion.wrenches[a, k] * torsion.responses[b, k]
            torsion.mobility[a, b] = torsion.mobility[b, a] = total
        total = 0.0
        for k in range(6):
            total += torsion.wrenches[a, k] * torsion.fall[k]
        torsion.offset[a] = total
    for i in range(n):
        _add_finger(model, state, work, i)


@compiled
def _prepare_object(model: Record, state: Record, work: Record) -> None:
    """Computes (R I_b R^T)^-1 and the acceleration of the object without contacts."""
    torsion, bias, mass = work.torsion, work.column, model.truth.object_mass
    world_inertia(work.kin, model.truth.inertias, work.system.body)
    entries = inverse_of(work.system.body)
    for k in range(6):
        torsion.turn_inverse[k] = entries[k]
    object_bias(state, work.system, model.truth, model.hand.gravity, bias)
    for k in range(6):
        bias[k] = model.load[k] - bias[k]
    _respond(torsion, mass, bias, torsion.fall)


@compiled
def _respond(torsion: Record, mass: float, wrench: Floats, acceleration: Floats) -> None:
    """Computes M_o^-1 times a wrench."""
    m = torsion.turn_inverse
    x, y, z = wrench[3], wrench[4], wrench[5]
    for k in range(3):
        acceleration[k] = wrench[k] / mass
    acceleration[3] = m[0] * x + m[1] * y + m[2] * z
    acceleration[4] = m[1] * x + m[3] * y + m[4] * z
    acceleration[5] = m[2] * x + m[4] * y + m[5] * z


@compiled
def _set_columns(model: Record, work: Record, i: int) -> None:
    """Computes the effect of unit forces of contact ``i`` on the object and on its finger."""
    kin, torsion, e = work.kin, work.torsion, model.hand.eccentricities[i]
    rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
    nx, ny, nz = kin.frames[i, 2, 0], kin.frames[i, 2, 1], kin.frames[i, 2, 2]
    k = moment_at_tip(model.hand, kin, i, nx, ny, nz)
    for c in range(3):
        torsion.turning[i, c] = k[c]
    for row in range(ROWS):
        column, pull = torsion.wrenches[ROWS * i + row], torsion.pulls[ROWS * i + row]
        if row == TURN:
            for c in range(3):
                column[c], column[3 + c] = 0.0, -e * kin.frames[i, 2, c]
                pull[c] = -e * k[c]
        else:
            sign, axis = (1.0, 2) if row == NORMAL else (-1.0, row)
            x = sign * kin.frames[i, axis, 0]
            y = sign * kin.frames[i, axis, 1]
            z = sign * kin.frames[i, axis, 2]
            column[0], column[1], column[2] = x, y, z
            column[3], column[4], column[5] = ry * z - rz * y, rz * x - rx * z, rx * y - ry * x
            pull[0], pull[1], pull[2] = x, y, z
        _respond(torsion, model.truth.object_mass, column, torsion.responses[ROWS * i + row])


@compiled
def move_tip(
    model: Record, work: Record, i: int, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Acceleration Lambda^-1 f of fingertip ``i`` due to the tip force f = (x, y, z)."""
    inertia = work.dynamics.inertia[i]
    if model.hand.kinds[i] == ON_SLIDES:
        return times(inverse_of(inertia), x, y, z)
    return solve_positive(inertia, x, y, z)


@compiled
def _add_finger(model: Record, state: Record, work: Record, i: int) -> None:
    """Adds the mobility of finger ``i``, the inverse of Lambda, to G and c."""
    kin, torsion, dynamics = work.kin, work.torsion, work.dynamics
    first = ROWS * i
    ax, ay, az = move_tip(
        model,
        work,
        i,
        work.tip_forces[i, 0] - dynamics.bias[i, 0],
        work.tip_forces[i, 1] - dynamics.bias[i, 1],
        work.tip_forces[i, 2] - dynamics.bias[i, 2],
    )
    for row in range(ROWS):
        a, pull = first + row, torsion.pulls[first + row]
        bias = kin.curvature[i] if row == TURN else kin.bias[i]
        torsion.offset[a] -= (
            pull[0] * (ax - bias[0]) + pull[1] * (ay - bias[1]) + pull[2] * (az - bias[2])
        )
        px, py, pz = move_tip(model, work, i, pull[0], pull[1], pull[2])
        for other in range(ROWS):
            b = torsion.pulls[first + other]
            torsion.mobility[a, first + other] += px * b[0] + py * b[1] + pz * b[2]
    e = model.hand.eccentricities[i]
    torsion.offset[first + TURN] += e * spin_bias(model, state, work, i)


@compiled
def spin_bias(model: Record, state: Record, work: Record, i: int) -> float:
    """Spin acceleration n . J_omega' q' + n' . (omega_f - omega) [rad/s^2].

    n' is omega x n, plus R n_o' on a curved face.
    """
    kin, x = work.kin, state.x
    wx, wy, wz = x[SPIN], x[SPIN + 1], x[SPIN + 2]
    nx, ny, nz = kin.frames[i, 2, 0], kin.frames[i, 2, 1], kin.frames[i, 2, 2]
    fx, fy, fz, bx, by, bz = tip_turning(model.hand, kin, i)
    fx, fy, fz = fx - wx, fy - wy, fz - wz
    bias = (
        nx * bx
        + ny * by
        + nz * bz
        + (wy * nz - wz * ny) * fx
        + (wz * nx - wx * nz) * fy
        + (wx * ny - wy * nx) * fz
    )
    face = model.hand.curved_faces[i]
    if face != FLAT:
        n = model.num_fingers
        speeds = x[slip_velocity_at(n, i, 0)], x[slip_velocity_at(n, i, 1)]
        rx, ry, rz = normal_rate(face, model.hand.radii[i], speeds, kin.frames[i])
        bias += rx * fx + ry * fy + rz * fz
    return bias


@compiled
def spin_of(model: Record, state: Record, work: Record, i: int) -> float:
    """Spin velocity psi' of contact ``i`` times its eccentricity, from other velocities [m/s]."""
    n, kin, x, turning = model.num_fingers, work.kin, state.x, work.torsion.turning[i]
    rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
    wx, wy, wz = x[SPIN], x[SPIN + 1], x[SPIN + 2]
    arm_speed = (wy * rz - wz * ry, wz * rx - wx * rz, wx * ry - wy * rx)
    spin = 0.0
    for c in range(3):
        velocity = x[VELOCITY + c] + arm_speed[c]
        for axis in range(2):
            velocity += x[slip_velocity_at(n, i, axis)] * kin.frames[i, axis, c]
        spin += turning[c] * velocity - kin.frames[i, 2, c] * x[SPIN + c]
    return model.hand.eccentricities[i] * spin
