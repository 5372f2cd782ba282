"""Reduced inertia M~ of Eq. 18 for spatial hands, as a full matrix."""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.spatial.state import count_coordinates, slip_coordinate


@compiled
def fill_inertia(
    kin: Record, dynamics: Record, truth: Record, slips: Floats, system: Record, matrix: Floats
) -> None:
    """Writes M~ ``(6 + 2n, 6 + 2n)`` to ``matrix``.

    Args:
        kin: Kinematics.
        dynamics: Tip dynamics of the fingers for the masses of ``truth``.
        truth: Masses.
        slips: ``(n, 2)``, 1 if a contact slips along a tangent.
        system: Reduced form, assembled for these arguments.
        matrix: Output.
    """
    n = truth.num_fingers
    size = count_coordinates(n)
    for a in range(size):
        for b in range(size):
            matrix[a, b] = 0.0
    for k in range(3):
        matrix[k, k] = truth.object_mass
    body = system.body
    matrix[3, 3], matrix[3, 4], matrix[3, 5] = body[0], body[1], body[2]
    matrix[4, 3], matrix[4, 4], matrix[4, 5] = body[1], body[3], body[4]
    matrix[5, 3], matrix[5, 4], matrix[5, 5] = body[2], body[4], body[5]
    for i in range(n):
        _add_columns(kin, dynamics.inertia[i], slips, system, i, matrix)


@compiled
def _add_columns(
    kin: Record, inertia: Floats, slips: Floats, system: Record, i: int, matrix: Floats
) -> None:
    """Adds a finger: forces per acceleration of the object and of its two slips."""
    rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
    for b in range(8):
        if b < 3:
            ux, uy, uz = (
                (1.0 if b == 0 else 0.0),
                (1.0 if b == 1 else 0.0),
                (1.0 if b == 2 else 0.0),
            )
        elif b == 3:
            ux, uy, uz = 0.0, -rz, ry
        elif b == 4:
            ux, uy, uz = rz, 0.0, -rx
        elif b == 5:
            ux, uy, uz = -ry, rx, 0.0
        else:
            ux, uy, uz = kin.frames[i, b - 6, 0], kin.frames[i, b - 6, 1], kin.frames[i, b - 6, 2]
        fx = inertia[0] * ux + inertia[1] * uy + inertia[2] * uz
        fy = inertia[1] * ux + inertia[3] * uy + inertia[4] * uz
        fz = inertia[2] * ux + inertia[4] * uy + inertia[5] * uz
        column = b if b < 6 else 2 * i + b
        matrix[0, column] += fx
        matrix[1, column] += fy
        matrix[2, column] += fz
        matrix[3, column] += ry * fz - rz * fy
        matrix[4, column] += rz * fx - rx * fz
        matrix[5, column] += rx * fy - ry * fx
        for axis in range(2):
            line = slip_coordinate(i, axis)
            if slips[i, axis] == 0.0:
                matrix[line, column] = 1.0 if line == column else 0.0
            else:
                e = system.normals[i, axis]
                matrix[line, column] = e[0] * fx + e[1] * fy + e[2] * fz
