"""Matrix P of the Lyapunov function, A^T P + P A = -Q (Eq. 25), in closed form.

Gains are diagonal, so that A consists of 2-by-2 blocks A_k = [0 1; -K_p -K_v], one per coordinate,
and P of blocks X for pairs of coordinates, A_j^T X + X A_k = -Q_jk. If K_p = 0, no P > 0 solves
Eq. 25: the position of the coordinate is then not weighted in Q, and its rows and columns in P are
0 (docs/model.md, Lyapunov matrix).
"""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Record


@compiled
def pack_lyapunov(law: Record, k: int, q11: float, q12: float, q22: float) -> None:
    """Packs the block of P for one coordinate."""
    position_gain, velocity_gain = law.position_gains[k], law.velocity_gains[k]
    p11 = p12 = 0.0
    if position_gain > 0.0:
        p12 = q11 / (2.0 * position_gain)
    p22 = (q22 / 2.0 + p12) / velocity_gain
    if position_gain > 0.0:
        p11 = position_gain * p22 + velocity_gain * p12 - q12
    law.lyapunov_11[k], law.lyapunov_12[k], law.lyapunov_22[k] = p11, p12, p22


@compiled
def pack_coupling(
    law: Record, size: int, j: int, k: int, q11: float, q12: float, q21: float, q22: float
) -> None:
    """Packs the block of P for two of ``size`` coordinates."""
    a, b = law.position_gains[j], law.velocity_gains[j]
    c, d = law.position_gains[k], law.velocity_gains[k]
    if a == 0.0:
        q11 = q12 = 0.0
    if c == 0.0:
        q11 = q21 = 0.0
    p12 = p21 = 0.0
    if a + c > 0.0:
        slope = (a - c) / (b + d)
        right = q12 - q21 - slope * q22
        determinant = slope * (a - c) + a * d + b * c
        p12 = (a * right - (slope - b) * q11) / determinant
        p21 = ((slope + d) * q11 - c * right) / determinant
    p22 = (p12 + p21 + q22) / (b + d)
    law.couplings[j, k] = a * p22 + d * p12 - q12 if a > 0.0 and c > 0.0 else 0.0
    law.couplings[j, size + k] = p12
    law.couplings[size + j, k] = p21
    law.couplings[size + j, size + k] = p22


@compiled
def coupled_value(law: Record, error: Floats, rate: Floats, size: int) -> float:
    """Contribution of entries of P between different coordinates to V of Eq. 44."""
    value = 0.0
    for j in range(size):
        for k in range(size):
            if k != j:
                value += error[j] * law.couplings[j, k] * error[k]
                value += 2.0 * error[j] * law.couplings[j, size + k] * rate[k]
                value += rate[j] * law.couplings[size + j, size + k] * rate[k]
    return value


@compiled
def add_couplings(law: Record, error: Floats, rate: Floats, size: int, weighted: Floats) -> None:
    """Adds the contribution of entries of P between different coordinates to E^T P xi."""
    for k in range(size):
        for j in range(size):
            if k != j:
                weighted[k] += law.couplings[size + k, j] * error[j]
                weighted[k] += law.couplings[size + k, size + j] * rate[j]


@compiled
def error_value(law: Record, room: Record, size: int) -> float:
    """V of Eq. 44 for the errors in ``room``, without the contribution of the estimates."""
    value = 0.0
    for k in range(size):
        e, rate = room.error[k], room.error_rate[k]
        value += law.lyapunov_11[k] * e * e + 2.0 * law.lyapunov_12[k] * e * rate
        value += law.lyapunov_22[k] * rate * rate
    if law.couples:
        value += coupled_value(law, room.error, room.error_rate, size)
    return value


@compiled
def error_weights(law: Record, room: Record, size: int, weights: Floats) -> None:
    """Writes E^T P xi for the errors in ``room``."""
    for k in range(size):
        weights[k] = law.lyapunov_12[k] * room.error[k] + law.lyapunov_22[k] * room.error_rate[k]
    if law.couples:
        add_couplings(law, room.error, room.error_rate, size, weights)
