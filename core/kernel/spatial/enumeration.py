"""Solution of the contact problem of the pyramid by enumeration of all phases.

Newton's method finds one solution per start. If it finds none, or only solutions with an open
contact, enumeration finds a solution with all contacts closed, if one exists.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.guards import FORCE_BAND
from slipgrasp.core.kernel.numerics.dense import factor_dense, solve_dense
from slipgrasp.core.kernel.spatial.contact_problem import SELECTION_ROOM
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.ways import name_phase
from slipgrasp.core.kernel.spatial.workspace import DISCRETE

REST_FORCE = 0.25 * FORCE_BAND  # force that would stop an acceleration regarded as zero [N]
MOST_COMBINATIONS = 3**8  # for four fingers; a few milliseconds


@compiled
def _let_all(model: Record, discrete: Record, room: Record, choice: int) -> None:
    """Sets the phases of free tangents from the ternary digits of ``choice``."""
    for i in range(model.num_fingers):
        for axis in range(2):
            if room.free[i, axis] == 1:
                digit, choice = choice % 3, choice // 3
                discrete.slips[i, axis] = 0.0 if digit == 0 else 1.0
                discrete.directions[i, axis] = 0.0 if digit == 0 else 3.0 - 2.0 * digit
                discrete.frozen[i, axis] = 0 if digit == 0 else 1


@compiled
def _solve(model: Record, discrete: Record, room: Record) -> bool:
    """Solves for forces and accelerations with closed contacts; False if singular."""
    size, matrix = 3 * model.num_fingers, room.matrix
    for a in range(size):
        room.right[a] = -room.offset[a]
        for b in range(size):
            matrix[a, b] = room.mobility[a, b]
    for i in range(model.num_fingers):
        for axis in range(2):
            if discrete.slips[i, axis] == 0.0:
                continue
            row = 3 * i + axis
            room.right[row] = 0.0
            for b in range(size):
                matrix[row, b] = 0.0
            matrix[row, row] = 1.0
            matrix[row, 3 * i + 2] = model.truth.friction[i] * discrete.directions[i, axis]
    if not abs(factor_dense(matrix, size, room.order)) > 0.0:
        return False
    solve_dense(matrix, size, room.order, room.right, room.force)
    for a in range(size):
        total = room.offset[a]
        for b in range(size):
            total += room.mobility[a, b] * room.force[b]
        room.opening[a] = total
    return True


@compiled
def _agrees(model: Record, discrete: Record, room: Record, i: int) -> bool:
    """True if contact ``i`` pushes, and sticks within its bounds or slips in its direction."""
    first = 3 * i
    normal = room.force[first + 2]
    if not normal > 0.0:
        return False
    mass = 1.0 / max(room.mobility[first, first], room.mobility[first + 1, first + 1])
    for axis in range(2):
        if room.free[i, axis] == 0:
            continue
        if discrete.slips[i, axis] == 0.0:
            most = model.truth.static_friction[i] * normal + FORCE_BAND * (1.0 + normal)
            if abs(room.force[first + axis]) > most:
                return False
        else:
            along = discrete.directions[i, axis] * room.opening[first + axis]
            if not mass * along > REST_FORCE * (1.0 + normal):
                return False
    return True


@compiled_apart(types.int64, MODEL, DISCRETE, SELECTION_ROOM)
def spatial_enumerate(model: Record, discrete: Record, room: Record) -> int:
    """Finds phases in which all contacts push; 1, or 0 if there are none or too many to try.

    Args:
        model: Constants of the run, with the pyramid.
        discrete: Discrete state; its phases and directions are set to the solution.
        room: Contact problem and free tangents; ``force`` is set to the solution.
    """
    n, count = model.num_fingers, 1
    for i in range(n):
        for axis in range(2):
            count *= 3 if room.free[i, axis] == 1 else 1
    if count > MOST_COMBINATIONS:
        return 0
    for choice in range(count):
        _let_all(model, discrete, room, choice)
        agrees = _solve(model, discrete, room)
        for i in range(n):
            agrees = agrees and _agrees(model, discrete, room, i)
        if agrees:
            for i in range(n):
                name_phase(model, discrete, i)
            return 1
    return 0
