"""Contact forces that exert a desired wrench on the object (docs/model.md, Grasp force).

G = [W; -D of the slipping contacts] maps the contact forces F^ ``(2n,)``, in their contact frames,
to the wrench and to 0. If G has no more rows than columns, the result is the smallest F^ with
G F^ = (d, 0); otherwise it is the least-squares solution.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Floats, Integers, Record
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.numerics.linear import orthonormalize
from slipgrasp.core.kernel.planar.kinematics import to_contact_frame, to_inertial_frame
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.reduced import torques_to_forces
from slipgrasp.core.kernel.planar.state import count_coordinates
from slipgrasp.core.kernel.planar.workspace import WORKSPACE

DEPENDENT_ROWS = 1e-13


@compiled
def share_wrench(kin: Record, n: int, room: Record) -> int:
    """Computes F^ = W^+ d for sticking contacts.

    The smallest forces are f_i = a + b S (r_i - r), r the mean contact point: a produces the
    force, b the moment about r.

    Returns:
        1, or 0 if all contacts coincide.
    """
    share, mean_x, mean_y = 1.0 / n, 0.0, 0.0
    for i in range(n):
        mean_x += share * kin.arms[i, 0]
        mean_y += share * kin.arms[i, 1]
    spread, size = 0.0, 0.0
    for i in range(n):
        x, y = kin.arms[i, 0], kin.arms[i, 1]
        spread += square(x - mean_x) + square(y - mean_y)
        size += x * x + y * y
    ax, ay = share * room.right_side[0], share * room.right_side[1]
    b = (room.right_side[2] - n * (mean_x * ay - mean_y * ax)) / spread
    for i in range(n):
        fx = ax - b * (kin.arms[i, 1] - mean_y)
        fy = ay + b * (kin.arms[i, 0] - mean_x)
        along, normal = to_contact_frame(kin, i, fx, fy)
        room.contact_force[i, 0], room.contact_force[i, 1] = along, normal
    return 1 if spread > DEPENDENT_ROWS * size else 0


@compiled
def find_squeeze(kin: Record, room: Record) -> None:
    """Computes the direction of the internal force of two sticking contacts, not normalized."""
    dx, dy = kin.arms[1, 0] - kin.arms[0, 0], kin.arms[1, 1] - kin.arms[0, 1]
    for i in range(2):
        sign = 1.0 if i == 0 else -1.0
        along, normal = to_contact_frame(kin, i, sign * dx, sign * dy)
        room.direction[2 * i], room.direction[2 * i + 1] = along, normal


@compiled_apart(types.int64, MODEL, WORKSPACE)
def distribute_wrench(model: Record, work: Record) -> int:
    """Computes F^ = G^+ (d, 0) in any phase.

    Without grasp force (y = 0), F^ belongs to the smallest torque with B~ tau = M~ v + h~.

    Returns:
        1, or 0 if the rows of G are dependent.
    """
    n, kin, room = model.num_fingers, work.kin, work.room
    rows = assemble_rows(kin, work.believed, room.on_cone, room)
    weighed = rows <= 2 * n and not model.law.grasp_force
    if weighed:
        _weigh_by_torque(rows, n, kin, room)
    regular = _apply_pseudoinverse(rows, 2 * n, room)
    if weighed:
        torques_to_forces(kin, n, room.contact_force, room.contact_force)
        for i in range(n):
            fx = room.contact_force[i, 0] - room.believed_force[i, 0]
            fy = room.contact_force[i, 1] - room.believed_force[i, 1]
            along, normal = to_contact_frame(kin, i, fx, fy)
            room.contact_force[i, 0], room.contact_force[i, 1] = along, normal
    return regular


@compiled
def _apply_pseudoinverse(rows: int, columns: int, room: Record) -> int:
    if rows > columns:
        _transpose(room.basis, rows)
    least = orthonormalize(room.basis, room.triangle, max(rows, columns), min(rows, columns))
    if rows > columns:
        _solve_least_squares(rows, columns, room)
    else:
        _solve_least_norm(rows, columns, room)
    return 1 if least > DEPENDENT_ROWS else 0


@compiled
def assemble_rows(kin: Record, believed: Record, on_cone: Integers, room: Record) -> int:
    """Writes G^T to ``basis`` and (d, 0) to ``right_side``; returns the number of rows of G."""
    n = believed.num_fingers
    rows = 3
    for i in range(2 * n):
        for k in range(count_coordinates(n)):
            room.basis[i, k] = 0.0
    for i in range(n):
        tx, ty = kin.tangents[i, 0], kin.tangents[i, 1]
        rx, ry = kin.arms[i, 0], kin.arms[i, 1]
        room.basis[2 * i, 0], room.basis[2 * i, 1] = -tx, -ty
        room.basis[2 * i, 2] = ry * tx - rx * ty
        room.basis[2 * i + 1, 0], room.basis[2 * i + 1, 1] = ty, -tx
        room.basis[2 * i + 1, 2] = -rx * tx - ry * ty
        if on_cone[i] != 0:
            room.basis[2 * i, rows] = -1.0
            room.basis[2 * i + 1, rows] = -on_cone[i] * believed.friction[i]
            room.right_side[rows] = 0.0
            rows += 1
    return rows


@compiled
def _transpose(matrix: Floats, size: int) -> None:
    for i in range(size):
        for j in range(i):
            matrix[i, j], matrix[j, i] = matrix[j, i], matrix[i, j]


@compiled
def _solve_least_norm(rows: int, columns: int, room: Record) -> None:
    """Computes F^ = G^+ (d, 0) from the QR factors of G^T, if G has no more rows than columns."""
    for i in range(rows):
        for j in range(i):
            room.right_side[i] -= room.triangle[j, i] * room.right_side[j]
        room.right_side[i] /= room.triangle[i, i]
    for i in range(columns):
        total = 0.0
        for k in range(rows):
            total += room.basis[i, k] * room.right_side[k]
        room.contact_force[i // 2, i % 2] = total


@compiled
def _solve_least_squares(rows: int, columns: int, room: Record) -> None:
    """Computes F^ = G^+ (d, 0) from the QR factors of G, if G has more rows than columns."""
    for k in range(columns - 1, -1, -1):
        total = 0.0
        for i in range(rows):
            total += room.basis[i, k] * room.right_side[i]
        for j in range(k + 1, columns):
            total -= room.triangle[k, j] * room.contact_force[j // 2, j % 2]
        room.contact_force[k // 2, k % 2] = total / room.triangle[k, k]


@compiled
def _weigh_by_torque(rows: int, n: int, kin: Record, room: Record) -> None:
    """Replaces G F^ = (d, 0) by B~ tau = M~ v + h~, so that the torque is smallest (y = 0)."""
    for i in range(n):
        fx, fy = room.believed_force[i, 0], room.believed_force[i, 1]
        along, normal = to_contact_frame(kin, i, fx, fy)
        for k in range(rows):
            first, second = room.basis[2 * i, k], room.basis[2 * i + 1, k]
            room.right_side[k] += first * along + second * normal
            wx, wy = to_inertial_frame(kin, i, first, second)
            room.basis[2 * i, k] = kin.inverses[i, 0, 0] * wx + kin.inverses[i, 0, 1] * wy
            room.basis[2 * i + 1, k] = kin.inverses[i, 1, 0] * wx + kin.inverses[i, 1, 1] * wy
