"""The reduced equations M~ x'' + h~ = B~ tau (Eq. 17-18), for any phase of the contacts."""

from __future__ import annotations

from core.kernel.compiler import compiled
from core.kernel.records import Floats, Integers, Record


@compiled
def friction_row(phase: int, friction: float) -> tuple[float, float]:
    """Row D of Eq. 8 for one contact: (0, 0) in stick, (1, gamma mu) in slip."""
    if phase == 0:
        return 0.0, 0.0
    return 1.0, phase * friction


@compiled
def tip_acceleration(kin: Record, i: int, acceleration: Floats) -> tuple[float, float]:
    """Acceleration of fingertip ``i`` for reduced accelerations x'', without its bias."""
    turn, slip = acceleration[2], acceleration[3 + i]
    return (
        acceleration[0] - turn * kin.arms[i, 1] + slip * kin.tangents[i, 0],
        acceleration[1] + turn * kin.arms[i, 0] + slip * kin.tangents[i, 1],
    )


@compiled
def inertial_force(
    kin: Record, dynamics: Record, i: int, acceleration: Floats
) -> tuple[float, float]:
    """What the joints of finger ``i`` must give, as a contact force, to move the finger alone."""
    ax, ay = tip_acceleration(kin, i, acceleration)
    return (
        dynamics.bias[i, 0] + dynamics.inertia[i, 0, 0] * ax + dynamics.inertia[i, 0, 1] * ay,
        dynamics.bias[i, 1] + dynamics.inertia[i, 1, 0] * ax + dynamics.inertia[i, 1, 1] * ay,
    )


@compiled
def assemble_inertia(
    kin: Record, dynamics: Record, truth: Record, phases: Integers, matrix: Floats
) -> None:
    """M~ of Eq. 18, ``(N, N)``; not symmetric."""
    n = truth.num_fingers
    for row in range(3 + n):
        for column in range(3 + n):
            matrix[row, column] = 0.0
    for k in range(3):
        matrix[k, k] = truth.object_inertia[k]
    for i in range(n):
        d0, d1 = friction_row(phases[i], truth.friction[i])
        row = 3 + i
        for column in range(4):
            # The direction in which a unit of this coordinate accelerates the fingertip.
            ux, uy = 1.0, 0.0
            if column == 1:
                ux, uy = 0.0, 1.0
            elif column == 2:
                ux, uy = -kin.arms[i, 1], kin.arms[i, 0]
            elif column == 3:
                ux, uy = kin.tangents[i, 0], kin.tangents[i, 1]
            f0 = dynamics.inertia[i, 0, 0] * ux + dynamics.inertia[i, 0, 1] * uy
            f1 = dynamics.inertia[i, 1, 0] * ux + dynamics.inertia[i, 1, 1] * uy
            target = column if column < 3 else row
            matrix[0, target] += kin.frames[i, 0, 0] * f0 + kin.frames[i, 0, 1] * f1
            matrix[1, target] += kin.frames[i, 1, 0] * f0 + kin.frames[i, 1, 1] * f1
            matrix[2, target] += kin.moments[i, 0] * f0 + kin.moments[i, 1] * f1
            matrix[row, target] = -d0 * f0 - d1 * f1
        if phases[i] == 0:
            matrix[row, row] = 1.0


@compiled
def apply_contact_forces(
    kin: Record, truth: Record, phases: Integers, forces: Floats, result: Floats
) -> None:
    """[W; -D] times contact-frame forces ``(n, 2)``, the left factor of B~ in Eq. 18."""
    n = truth.num_fingers
    result[0] = 0.0
    result[1] = 0.0
    result[2] = 0.0
    for i in range(n):
        d0, d1 = friction_row(phases[i], truth.friction[i])
        f0, f1 = forces[i, 0], forces[i, 1]
        result[0] += kin.frames[i, 0, 0] * f0 + kin.frames[i, 0, 1] * f1
        result[1] += kin.frames[i, 1, 0] * f0 + kin.frames[i, 1, 1] * f1
        result[2] += kin.moments[i, 0] * f0 + kin.moments[i, 1] * f1
        result[3 + i] = -d0 * f0 - d1 * f1


@compiled
def assemble_bias(
    kin: Record,
    dynamics: Record,
    truth: Record,
    gravity: float,
    phases: Integers,
    bias: Floats,
) -> None:
    """h~ of Eq. 18, ``(N,)``."""
    apply_contact_forces(kin, truth, phases, dynamics.bias, bias)
    bias[1] += truth.object_inertia[1] * gravity


@compiled
def torques_to_forces(kin: Record, n: int, torques: Floats, tip_forces: Floats) -> None:
    """U = J_c^-T tau for every finger, ``(n, 2)`` to ``(n, 2)``."""
    for i in range(n):
        first, second = torques[i, 0], torques[i, 1]
        wx = kin.inverses[i, 0, 0] * first + kin.inverses[i, 1, 0] * second
        wy = kin.inverses[i, 0, 1] * first + kin.inverses[i, 1, 1] * second
        tip_forces[i, 0] = kin.frames[i, 0, 0] * wx + kin.frames[i, 1, 0] * wy
        tip_forces[i, 1] = kin.frames[i, 0, 1] * wx + kin.frames[i, 1, 1] * wy


@compiled
def forces_to_torques(kin: Record, n: int, tip_forces: Floats, torques: Floats) -> None:
    """Tau = J_c^T u for every finger, ``(n, 2)`` to ``(n, 2)``."""
    for i in range(n):
        along, normal = tip_forces[i, 0], tip_forces[i, 1]
        wx = kin.frames[i, 0, 0] * along + kin.frames[i, 0, 1] * normal
        wy = kin.frames[i, 1, 0] * along + kin.frames[i, 1, 1] * normal
        torques[i, 0] = kin.jacobians[i, 0, 0] * wx + kin.jacobians[i, 1, 0] * wy
        torques[i, 1] = kin.jacobians[i, 0, 1] * wx + kin.jacobians[i, 1, 1] * wy
