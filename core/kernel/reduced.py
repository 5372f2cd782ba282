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
    arm, tangent = kin.arms[i], kin.tangents[i]
    slip = acceleration[3 + i]
    return (
        acceleration[0] - acceleration[2] * arm[1] + slip * tangent[0],
        acceleration[1] + acceleration[2] * arm[0] + slip * tangent[1],
    )


@compiled
def inertial_force(
    kin: Record, dynamics: Record, i: int, acceleration: Floats
) -> tuple[float, float]:
    """What the joints of finger ``i`` must give, as a contact force, to move the finger alone."""
    ax, ay = tip_acceleration(kin, i, acceleration)
    inertia, bias = dynamics.inertia[i], dynamics.bias[i]
    return (
        bias[0] + inertia[0, 0] * ax + inertia[0, 1] * ay,
        bias[1] + inertia[1, 0] * ax + inertia[1, 1] * ay,
    )


@compiled
def assemble_inertia(
    kin: Record,
    dynamics: Record,
    truth: Record,
    phases: Integers,
    matrix: Floats,
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
        inertia, frame, arm, tangent = (
            dynamics.inertia[i],
            kin.frames[i],
            kin.arms[i],
            kin.tangents[i],
        )
        row = 3 + i
        for column in range(4):
            if column < 2:
                f0, f1 = inertia[0, column], inertia[1, column]
            elif column == 2:
                f0 = inertia[0, 1] * arm[0] - inertia[0, 0] * arm[1]
                f1 = inertia[1, 1] * arm[0] - inertia[1, 0] * arm[1]
            else:
                f0 = inertia[0, 0] * tangent[0] + inertia[0, 1] * tangent[1]
                f1 = inertia[1, 0] * tangent[0] + inertia[1, 1] * tangent[1]
            target = column if column < 3 else row
            matrix[0, target] += frame[0, 0] * f0 + frame[0, 1] * f1
            matrix[1, target] += frame[1, 0] * f0 + frame[1, 1] * f1
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
        frame = kin.frames[i]
        result[0] += frame[0, 0] * f0 + frame[0, 1] * f1
        result[1] += frame[1, 0] * f0 + frame[1, 1] * f1
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
