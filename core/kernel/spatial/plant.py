"""Reduced equations of a spatial hand (Eq. 18) and their solution, contact by contact.

With H_i = [I, -S(r_i)], f_i = Lambda_i (H_i nu' + T_i s_i'' + b_i) + f_0,i, the force on the object
is F_i = u_i - f_i, and

    M_o nu' + h_o = sum H_i^T F_i + load,      e_k . F_i = 0 for every slipping direction k,

e_k = t_k - gamma_k mu n. Eliminating the slips of every contact with K = e_k . Lambda t_l (2x2)
leaves Sigma (6x6). The same equations with estimated parameters are the controller's model.
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Record
from slipgrasp.core.kernel.numerics.dense import factor_dense, solve_dense, solve_dense_transposed
from slipgrasp.core.kernel.spatial.dynamics import multiply, world_inertia
from slipgrasp.core.kernel.spatial.state import SPIN, slip_coordinate

# Sigma, and terms of the slipping contacts.
SYSTEM = np.dtype(
    [
        ("body", np.float64, (6,)),  # R I_b R^T: xx, xy, xz, yy, yz, zz
        ("sigma", np.float64, (6, 6)),  # LU factors
        ("order", np.int64, (6,)),
        ("determinant", np.float64),  # of M~
        ("normals", np.float64, (MAX_FINGERS, 2, 3)),  # e_x, e_y; 0 in stick
        ("moved", np.float64, (MAX_FINGERS, 2, 3)),  # Lambda t_k
        ("felt", np.float64, (MAX_FINGERS, 2, 3)),  # Lambda e_k
        ("inverse", np.float64, (MAX_FINGERS, 2, 2)),  # K^-1; 0 in stick
        ("right", np.float64, (6,)),
        ("solution", np.float64, (6,)),
    ],
    align=True,
)


# Index of an element of a symmetric 3x3 matrix among its six entries.
_ENTRIES = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])


@compiled
def assemble(
    kin: Record, dynamics: Record, truth: Record, slips: Floats, gamma: Floats, system: Record
) -> None:
    """Fills ``system`` and factors Sigma.

    Args:
        kin: Kinematics.
        dynamics: Tip dynamics of the fingers for the masses of ``truth``.
        truth: Masses and friction.
        slips: ``(n, 2)``, 1 if a contact slips along a tangent.
        gamma: ``(n, 2)``, slip directions.
        system: Output.
    """
    world_inertia(kin, truth.inertias, system.body)
    sigma = system.sigma
    set_body_inertia(truth.object_mass, system.body, sigma)
    determinant = 1.0
    for i in range(truth.num_fingers):
        determinant *= _eliminate_slips(kin, dynamics, truth, slips, gamma, system, i)
        _add_finger(kin, dynamics, system, i)
    system.determinant = determinant * factor_dense(sigma, 6, system.order)


@compiled
def set_body_inertia(mass: float, body: Floats, sigma: Floats) -> None:
    """Sets Sigma to the inertia of the object, with ``body`` about its centre in world axes."""
    for a in range(6):
        for b in range(6):
            sigma[a, b] = 0.0
    for a in range(3):
        sigma[a, a] = mass
    sigma[3, 3], sigma[3, 4], sigma[3, 5] = body[0], body[1], body[2]
    sigma[4, 3], sigma[4, 4], sigma[4, 5] = body[1], body[3], body[4]
    sigma[5, 3], sigma[5, 4], sigma[5, 5] = body[2], body[4], body[5]


@compiled
def _eliminate_slips(
    kin: Record,
    dynamics: Record,
    truth: Record,
    slips: Floats,
    gamma: Floats,
    system: Record,
    i: int,
) -> float:
    """Computes the terms of the slips of contact ``i``; returns det K."""
    inertia, mu = dynamics.inertia[i], truth.friction[i]
    inverse = system.inverse[i]
    for k in range(2):
        inverse[k, 0] = inverse[k, 1] = 0.0
        moves = slips[i, k]
        slope = mu * gamma[i, k]
        for c in range(3):
            system.normals[i, k, c] = moves * (kin.frames[i, k, c] - slope * kin.frames[i, 2, c])
        if moves == 0.0:
            for c in range(3):
                system.moved[i, k, c] = system.felt[i, k, c] = 0.0
            continue
        t, e = kin.frames[i, k], system.normals[i, k]
        x, y, z = multiply(inertia, t[0], t[1], t[2])
        system.moved[i, k, 0], system.moved[i, k, 1], system.moved[i, k, 2] = x, y, z
        x, y, z = multiply(inertia, e[0], e[1], e[2])
        system.felt[i, k, 0], system.felt[i, k, 1], system.felt[i, k, 2] = x, y, z
    if slips[i, 0] == 0.0 and slips[i, 1] == 0.0:
        return 1.0
    k00, k01 = _product(system, i, 0, 0), _product(system, i, 0, 1)
    k10, k11 = _product(system, i, 1, 0), _product(system, i, 1, 1)
    if slips[i, 1] == 0.0:
        inverse[0, 0] = 1.0 / k00
        return k00
    if slips[i, 0] == 0.0:
        inverse[1, 1] = 1.0 / k11
        return k11
    determinant = k00 * k11 - k01 * k10
    inverse[0, 0], inverse[0, 1] = k11 / determinant, -k01 / determinant
    inverse[1, 0], inverse[1, 1] = -k10 / determinant, k00 / determinant
    return determinant


@compiled
def _product(system: Record, i: int, row: int, column: int) -> float:
    """e_row . Lambda t_column."""
    e, moved = system.normals[i, row], system.moved[i, column]
    return e[0] * moved[0] + e[1] * moved[1] + e[2] * moved[2]


@compiled
def _add_finger(kin: Record, dynamics: Record, system: Record, i: int) -> None:
    """Adds H^T (Lambda - Lambda T K^-1 e^T Lambda) H to Sigma."""
    full = dynamics.inertia[i]
    sigma, inverse = system.sigma, system.inverse[i]
    # Columns l of Lambda' = Lambda - Lambda T K^-1 e^T Lambda.
    for b in range(3):
        first = inverse[0, 0] * system.felt[i, 0, b] + inverse[0, 1] * system.felt[i, 1, b]
        second = inverse[1, 0] * system.felt[i, 0, b] + inverse[1, 1] * system.felt[i, 1, b]
        for a in range(3):
            system.right[a] = (
                full[_ENTRIES[a, b]]
                - system.moved[i, 0, a] * first
                - system.moved[i, 1, a] * second
            )
        _add_column(kin, sigma, i, b, system.right[0], system.right[1], system.right[2])


@compiled
def _add_column(
    kin: Record, sigma: Floats, i: int, b: int, lx: float, ly: float, lz: float
) -> None:
    """Adds column b of Lambda', which multiplies v_b and, through w x r, the spin."""
    rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
    mx, my, mz = ry * lz - rz * ly, rz * lx - rx * lz, rx * ly - ry * lx
    column = (lx, ly, lz, mx, my, mz)
    for a in range(6):
        value = column[a]
        sigma[a, b] += value
        if b == 0:
            sigma[a, 4] += value * rz
            sigma[a, 5] -= value * ry
        elif b == 1:
            sigma[a, 5] += value * rx
            sigma[a, 3] -= value * rz
        else:
            sigma[a, 3] += value * ry
            sigma[a, 4] -= value * rx


@compiled
def tip_inertia_columns(kin: Record, inertia: Floats, sigma: Floats, i: int) -> None:
    """Adds H^T Lambda H of a sticking contact to Sigma."""
    for b in range(3):
        first, second, third = _ENTRIES[0, b], _ENTRIES[1, b], _ENTRIES[2, b]
        _add_column(kin, sigma, i, b, inertia[first], inertia[second], inertia[third])


@compiled
def object_bias(state: Record, system: Record, truth: Record, gravity: float, bias: Floats) -> None:
    """Computes h_o, weight and gyroscopic moment, six numbers."""
    x, body = state.x, system.body
    wx, wy, wz = x[SPIN], x[SPIN + 1], x[SPIN + 2]
    lx, ly, lz = multiply(body, wx, wy, wz)
    bias[0] = bias[1] = 0.0
    bias[2] = truth.object_mass * gravity
    bias[3], bias[4], bias[5] = wy * lz - wz * ly, wz * lx - wx * lz, wx * ly - wy * lx


@compiled
def tip_acceleration(
    kin: Record, i: int, acceleration: Floats, first: float, second: float
) -> tuple[float, float, float]:
    """Acceleration of fingertip ``i`` for nu' and its two slip accelerations."""
    ax, ay, az = acceleration[3], acceleration[4], acceleration[5]
    rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
    tx, ty = kin.frames[i, 0], kin.frames[i, 1]
    return (
        acceleration[0] + ay * rz - az * ry + first * tx[0] + second * ty[0] + kin.bias[i, 0],
        acceleration[1] + az * rx - ax * rz + first * tx[1] + second * ty[1] + kin.bias[i, 1],
        acceleration[2] + ax * ry - ay * rx + first * tx[2] + second * ty[2] + kin.bias[i, 2],
    )


@compiled
def own_force(
    kin: Record, dynamics: Record, i: int, acceleration: Floats, slip_acceleration: Floats
) -> tuple[float, float, float]:
    """Tip force f_i required to move finger ``i`` without contact."""
    x, y, z = tip_acceleration(
        kin, i, acceleration, slip_acceleration[i, 0], slip_acceleration[i, 1]
    )
    fx, fy, fz = multiply(dynamics.inertia[i], x, y, z)
    return fx + dynamics.bias[i, 0], fy + dynamics.bias[i, 1], fz + dynamics.bias[i, 2]


@compiled
def to_contact_frame(
    kin: Record, i: int, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """C_i^T times a vector: its parts along -t_x, -t_y and n."""
    frame = kin.frames[i]
    return (
        -(frame[0, 0] * x + frame[0, 1] * y + frame[0, 2] * z),
        -(frame[1, 0] * x + frame[1, 1] * y + frame[1, 2] * z),
        frame[2, 0] * x + frame[2, 1] * y + frame[2, 2] * z,
    )


@compiled
def to_world(
    kin: Record, i: int, first: float, second: float, normal: float
) -> tuple[float, float, float]:
    """C_i times a vector given in the contact frame."""
    frame = kin.frames[i]
    return (
        frame[2, 0] * normal - frame[0, 0] * first - frame[1, 0] * second,
        frame[2, 1] * normal - frame[0, 1] * first - frame[1, 1] * second,
        frame[2, 2] * normal - frame[0, 2] * first - frame[1, 2] * second,
    )


@compiled
def solve_plant(model: Record, state: Record, work: Record) -> None:
    """Computes accelerations and contact forces for the tip forces ``work.tip_forces`` (Eq. 17)."""
    system = work.system
    solve_motion(model, state, work, work.dynamics, system, model.truth, model.load)
    for i in range(model.num_fingers):
        _put_on_cone(system, model.truth.friction[i], i, work)


@compiled
def solve_motion(
    model: Record,
    state: Record,
    work: Record,
    dynamics: Record,
    system: Record,
    masses: Record,
    load: Floats,
) -> None:
    """As `solve_plant`, with the true or the estimated dynamics, equations and masses."""
    n, kin, right = model.num_fingers, work.kin, system.right
    object_bias(state, system, masses, model.hand.gravity, work.column)
    for k in range(6):
        right[k] = load[k] - work.column[k]
    for i in range(n):
        bx, by, bz = multiply(dynamics.inertia[i], kin.bias[i, 0], kin.bias[i, 1], kin.bias[i, 2])
        gx = work.tip_forces[i, 0] - dynamics.bias[i, 0] - bx
        gy = work.tip_forces[i, 1] - dynamics.bias[i, 1] - by
        gz = work.tip_forces[i, 2] - dynamics.bias[i, 2] - bz
        work.available[i, 0], work.available[i, 1], work.available[i, 2] = gx, gy, gz
        first, second = _slips_for(
            system, i, _along(system, i, 0, gx, gy, gz), _along(system, i, 1, gx, gy, gz)
        )
        moved = system.moved[i]
        fx = gx - first * moved[0, 0] - second * moved[1, 0]
        fy = gy - first * moved[0, 1] - second * moved[1, 1]
        fz = gz - first * moved[0, 2] - second * moved[1, 2]
        rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
        right[0] += fx
        right[1] += fy
        right[2] += fz
        right[3] += ry * fz - rz * fy
        right[4] += rz * fx - rx * fz
        right[5] += rx * fy - ry * fx
    solve_dense(system.sigma, 6, system.order, right, work.acceleration)
    for i in range(n):
        _solve_contact(kin, dynamics, system, i, work)


@compiled
def _along(system: Record, i: int, k: int, x: float, y: float, z: float) -> float:
    e = system.normals[i, k]
    return e[0] * x + e[1] * y + e[2] * z


@compiled
def _slips_for(system: Record, i: int, first: float, second: float) -> tuple[float, float]:
    """Product of K^-1 and two numbers."""
    inverse = system.inverse[i]
    return (
        inverse[0, 0] * first + inverse[0, 1] * second,
        inverse[1, 0] * first + inverse[1, 1] * second,
    )


@compiled
def _solve_contact(kin: Record, dynamics: Record, system: Record, i: int, work: Record) -> None:
    """Computes slip acceleration and force of a contact from the acceleration of the object."""
    a = work.acceleration
    rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
    hx = a[0] + a[4] * rz - a[5] * ry
    hy = a[1] + a[5] * rx - a[3] * rz
    hz = a[2] + a[3] * ry - a[4] * rx
    lx, ly, lz = multiply(dynamics.inertia[i], hx, hy, hz)
    fx = work.available[i, 0] - lx
    fy = work.available[i, 1] - ly
    fz = work.available[i, 2] - lz
    first, second = _slips_for(
        system, i, _along(system, i, 0, fx, fy, fz), _along(system, i, 1, fx, fy, fz)
    )
    work.slip_acceleration[i, 0], work.slip_acceleration[i, 1] = first, second
    moved = system.moved[i]
    x, y, z = to_contact_frame(
        kin,
        i,
        fx - first * moved[0, 0] - second * moved[1, 0],
        fy - first * moved[0, 1] - second * moved[1, 1],
        fz - first * moved[0, 2] - second * moved[1, 2],
    )
    work.forces[i, 0], work.forces[i, 1], work.forces[i, 2] = x, y, z


@compiled
def _put_on_cone(system: Record, friction: float, i: int, work: Record) -> None:
    """Sets F_k = -gamma_k mu F_n of a slipping contact, exact even for a nearly straight finger."""
    for k in range(2):
        if system.inverse[i, k, k] != 0.0:
            work.forces[i, k] = -friction * work.gamma[i, k] * work.forces[i, 2]


@compiled
def weigh_error(n: int, kin: Record, system: Record, weights: Floats, weighted: Floats) -> None:
    """Writes M~^-T times ``weights`` ``(6 + 2n,)`` to ``weighted``; 0 for sticking directions."""
    right = system.right
    for k in range(6):
        right[k] = weights[k]
    for i in range(n):
        # K^-T w_s, mapped by the rows e_k . Lambda H of the contact.
        inverse = system.inverse[i]
        w0, w1 = weights[slip_coordinate(i, 0)], weights[slip_coordinate(i, 1)]
        first = inverse[0, 0] * w0 + inverse[1, 0] * w1
        second = inverse[0, 1] * w0 + inverse[1, 1] * w1
        _subtract_wrench(kin, system.felt[i], i, first, second, right)
    solve_dense_transposed(system.sigma, 6, system.order, right, system.solution)
    for k in range(6):
        weighted[k] = system.solution[k]
    for i in range(n):
        x, y, z = _arm_product(kin, i, system.solution)
        moved, inverse = system.moved[i], system.inverse[i]
        w0 = weights[slip_coordinate(i, 0)] - (moved[0, 0] * x + moved[0, 1] * y + moved[0, 2] * z)
        w1 = weights[slip_coordinate(i, 1)] - (moved[1, 0] * x + moved[1, 1] * y + moved[1, 2] * z)
        weighted[slip_coordinate(i, 0)] = inverse[0, 0] * w0 + inverse[1, 0] * w1
        weighted[slip_coordinate(i, 1)] = inverse[0, 1] * w0 + inverse[1, 1] * w1


@compiled
def _subtract_wrench(
    kin: Record, forces: Floats, i: int, first: float, second: float, right: Floats
) -> None:
    fx = first * forces[0, 0] + second * forces[1, 0]
    fy = first * forces[0, 1] + second * forces[1, 1]
    fz = first * forces[0, 2] + second * forces[1, 2]
    rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
    right[0] -= fx
    right[1] -= fy
    right[2] -= fz
    right[3] -= ry * fz - rz * fy
    right[4] -= rz * fx - rx * fz
    right[5] -= rx * fy - ry * fx


@compiled
def _arm_product(kin: Record, i: int, vector: Floats) -> tuple[float, float, float]:
    """Product of H_i and six numbers."""
    rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
    return (
        vector[0] + vector[4] * rz - vector[5] * ry,
        vector[1] + vector[5] * rx - vector[3] * rz,
        vector[2] + vector[3] * ry - vector[4] * rx,
    )
