"""Inertia, bias and static forces of fingers that are chains of joints."""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.numerics.linear import cross
from slipgrasp.core.kernel.spatial.chain import to_coordinates, turned


@compiled
def moment_at_chain(
    chain: Record, now: Record, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Tip force J^-T J_omega^T m that is equivalent to a moment m on the last link."""
    for k in range(chain.links):
        now.torques[k] = now.axes[k, 0] * x + now.axes[k, 1] * y + now.axes[k, 2] * z
    return _tip_force(chain, now)


@compiled
def _tip_force(chain: Record, now: Record) -> tuple[float, float, float]:
    """Tip force J^-T A^T tau for the torques of all joints."""
    to_coordinates(chain, now.torques, now.bias)
    inverse, t0, t1, t2 = now.inverse, now.bias[0], now.bias[1], now.bias[2]
    return (
        inverse[0, 0] * t0 + inverse[1, 0] * t1 + inverse[2, 0] * t2,
        inverse[0, 1] * t0 + inverse[1, 1] * t1 + inverse[2, 1] * t2,
        inverse[0, 2] * t0 + inverse[1, 2] * t1 + inverse[2, 2] * t2,
    )


@compiled
def weigh_chain(chain: Record, masses: Floats, gravity: float, now: Record) -> tuple[float, float]:
    """Computes M and h in ``inertia`` and ``bias``, after `move_chain`, from the tip inwards.

    The links beyond a joint are combined: mass m, first moment s and inertia I about the base. The
    force f = m v' + w' x s + w x (m v + w x s) and the moment about the base
    n = I w' + s x v' + w x (I w + s x v) + v x (m v + w x s) are summed link by link.

    Returns:
        Mass [kg], and mass times height of the centre of mass above the base [kg m].
    """
    mass = sx = sy = sz = 0.0
    xx = xy = xz = yy = yz = zz = 0.0
    fx = fy = fz = nx = ny = nz = 0.0
    for back in range(chain.links):
        k: int = chain.links - 1 - back
        own = masses[k]
        if own != 0.0:
            hx, hy, hz = _set_body(chain, own, now, k)
            force, moment = _bias_wrench(own, hx, hy, hz, now, k)
            body = now.body
            fx, fy, fz = fx + force[0], fy + force[1], fz + force[2] + gravity * own
            nx, ny = nx + moment[0] + gravity * hy, ny + moment[1] - gravity * hx
            nz, mass, sx, sy, sz = nz + moment[2], mass + own, sx + hx, sy + hy, sz + hz
            xx, xy, xz = xx + body[0], xy + body[1], xz + body[2]
            yy, yz, zz = yy + body[3], yz + body[4], zz + body[5]
        axes, moves = now.axes[k], now.moves[k]
        ax, ay, az, vx, vy, vz = axes[0], axes[1], axes[2], moves[0], moves[1], moves[2]
        now.torques[k] = ax * nx + ay * ny + az * nz + vx * fx + vy * fy + vz * fz
        # Momentum of the links beyond the joint, about the base, for the joint rate 1.
        px, py, pz = cross(ax, ay, az, sx, sy, sz)
        px, py, pz = px + mass * vx, py + mass * vy, pz + mass * vz
        lx, ly, lz = cross(sx, sy, sz, vx, vy, vz)
        lx += xx * ax + xy * ay + xz * az
        ly += xy * ax + yy * ay + yz * az
        lz += xz * ax + yz * ay + zz * az
        for j in range(k + 1):
            axes, moves = now.axes[j], now.moves[j]
            spin = axes[0] * lx + axes[1] * ly + axes[2] * lz
            now.matrix[j, k] = spin + moves[0] * px + moves[1] * py + moves[2] * pz
    _reduce(chain, now)
    return mass, sz


@compiled
def _set_body(chain: Record, mass: float, now: Record, k: int) -> tuple[float, float, float]:
    """First moment of a link about the base; writes its inertia about the base to ``body``."""
    turn, inertia, body = now.turns[k], chain.inertias[k], now.body
    cx, cy, cz = turned(turn, chain.centres[k])
    x, y, z = cx + now.origins[k, 0], cy + now.origins[k, 1], cz + now.origins[k, 2]
    at = 0
    for a in range(3):
        ix, iy, iz = _symmetric(inertia, turn[a, 0], turn[a, 1], turn[a, 2])
        for b in range(a, 3):
            body[at] = mass * (ix * turn[b, 0] + iy * turn[b, 1] + iz * turn[b, 2])
            at += 1
    hx, hy, hz = mass * x, mass * y, mass * z
    body[0] += hy * y + hz * z
    body[1] -= hx * y
    body[2] -= hx * z
    body[3] += hx * x + hz * z
    body[4] -= hy * z
    body[5] += hx * x + hy * y
    return hx, hy, hz


@compiled
def _bias_wrench(
    mass: float, sx: float, sy: float, sz: float, now: Record, k: int
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Force on a link and moment about the base at zero joint accelerations."""
    spins, drifts, body = now.spins[k], now.drifts[k], now.body
    wx, wy, wz, ax, ay, az = spins[0], spins[1], spins[2], spins[3], spins[4], spins[5]
    vx, vy, vz, bx, by, bz = drifts[0], drifts[1], drifts[2], drifts[3], drifts[4], drifts[5]
    px, py, pz = cross(wx, wy, wz, sx, sy, sz)
    px, py, pz = px + mass * vx, py + mass * vy, pz + mass * vz  # momentum
    lx, ly, lz = _symmetric(body, wx, wy, wz)
    qx, qy, qz = cross(sx, sy, sz, vx, vy, vz)
    lx, ly, lz = lx + qx, ly + qy, lz + qz  # angular momentum
    fx, fy, fz = cross(ax, ay, az, sx, sy, sz)
    qx, qy, qz = cross(wx, wy, wz, px, py, pz)
    fx, fy, fz = fx + mass * bx + qx, fy + mass * by + qy, fz + mass * bz + qz
    nx, ny, nz = _symmetric(body, ax, ay, az)
    qx, qy, qz = cross(sx, sy, sz, bx, by, bz)
    nx, ny, nz = nx + qx, ny + qy, nz + qz
    qx, qy, qz = cross(wx, wy, wz, lx, ly, lz)
    nx, ny, nz = nx + qx, ny + qy, nz + qz
    qx, qy, qz = cross(vx, vy, vz, px, py, pz)
    return (fx, fy, fz), (nx + qx, ny + qy, nz + qz)


@compiled
def _reduce(chain: Record, now: Record) -> None:
    """Computes A^T M A and A^T h of the coordinates."""
    to_coordinates(chain, now.torques, now.bias)
    at = 0
    for a in range(3):
        for b in range(a, 3):
            total = now.matrix[a, b]
            if chain.couples == 1:
                total = 0.0
                for j in range(chain.links):
                    for k in range(j, chain.links):
                        first = chain.ratios[j, a] * chain.ratios[k, b]
                        if k > j:
                            first += chain.ratios[k, a] * chain.ratios[j, b]
                        total += first * now.matrix[j, k]
            now.inertia[at] = total
            at += 1


@compiled
def see_at_tip(
    inverse: Floats,
    inertia: Floats,
    bias: Floats,
    curvature: Floats,
    tip_inertia: Floats,
    tip_bias: Floats,
) -> None:
    """Computes Lambda = J^-T M J^-1 and f_0 = J^-T h - Lambda J' q' of a finger."""
    at = 0
    for a in range(3):
        x, y, z = _symmetric(inertia, inverse[0, a], inverse[1, a], inverse[2, a])
        for b in range(a, 3):
            tip_inertia[at] = x * inverse[0, b] + y * inverse[1, b] + z * inverse[2, b]
            at += 1
    lost = _symmetric(tip_inertia, curvature[0], curvature[1], curvature[2])
    for a in range(3):
        force = inverse[0, a] * bias[0] + inverse[1, a] * bias[1] + inverse[2, a] * bias[2]
        tip_bias[a] = force - lost[a]


@compiled
def chain_weight(
    chain: Record, masses: Floats, gravity: float, now: Record
) -> tuple[float, float, float]:
    """Tip force that corresponds to the joint torques that support the links."""
    weight = mx = my = 0.0
    for back in range(chain.links):
        k: int = chain.links - 1 - back
        own = gravity * masses[k]
        cx, cy, _ = turned(now.turns[k], chain.centres[k])
        weight += own
        mx, my = mx + own * (cy + now.origins[k, 1]), my - own * (cx + now.origins[k, 0])
        now.torques[k] = now.axes[k, 0] * mx + now.axes[k, 1] * my + now.moves[k, 2] * weight
    return _tip_force(chain, now)


@compiled
def _symmetric(matrix: Floats, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Product of a symmetric matrix (xx, xy, xz, yy, yz, zz) and a vector."""
    return (
        matrix[0] * x + matrix[1] * y + matrix[2] * z,
        matrix[1] * x + matrix[3] * y + matrix[4] * z,
        matrix[2] * x + matrix[4] * y + matrix[5] * z,
    )
