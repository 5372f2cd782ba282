"""Phases and slip directions from the solved contact problem (docs/space.md, Selection)."""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.friction import has_static_excess
from slipgrasp.core.kernel.loop.guards import FORCE_BAND
from slipgrasp.core.kernel.spatial.contact_problem import (
    FEW_STARTS,
    MANY_STARTS,
    SELECTION_ROOM,
    solve_contacts,
)
from slipgrasp.core.kernel.spatial.enumeration import REST_FORCE, spatial_enumerate
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.torsion_directions import LEAVES
from slipgrasp.core.kernel.spatial.ways import axes_of, name_phase, size_with_spin, way_size
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, WORKSPACE

SELECTED, NONE_CONSISTENT, OPENS, NONE_REGULAR = range(4)
LEAVING_SHARE = 1e-3  # relative decrease by creep of a force that has just reached its bound


@compiled
def size_in_way(model: Record, way: int, x: float, y: float, z: float) -> float:
    """Magnitude of a tangential vector in a slip mode, including spin for soft fingertips."""
    return size_with_spin(x, y, z) if model.soft == 1 else way_size(model, way, x, y)


@compiled
def begin_slip(
    model: Record,
    discrete: Record,
    i: int,
    way: int,
    first: float,
    second: float,
    third: float,
) -> None:
    """Starts a slip along a tangential vector with a component about the normal.

    At this instant the friction of a soft contact is that of the solution or of stick, so that
    creep causes no jump of forces.
    """
    discrete.frozen[i, way] = 1 if model.soft == 0 else LEAVES
    size = size_in_way(model, way, first, second, third)
    for axis in axes_of(model, way):
        discrete.slips[i, axis] = 1.0
        discrete.directions[i, axis] = (first if axis == 0 else second) / size
    if model.soft == 1:
        discrete.directions[i, 2] = third / size


@compiled
def _loosen_slipping(model: Record, discrete: Record, room: Record) -> bool:
    """Sets sliding friction where the solution slips under static friction; True if any.

    All free slip modes are then reset to stick.
    """
    found = False
    for i in range(model.num_fingers):
        for way in range(model.ways):
            if _slips_on_static_bound(model, discrete, room, i, way):
                room.bounds[i, way] = model.truth.friction[i]
                found = True
    if found:
        _let_rest(model, discrete, room)
    return found


@compiled
def _slips_on_static_bound(model: Record, discrete: Record, room: Record, i: int, way: int) -> bool:
    """True if a free slip mode slips in the solution under its larger static friction."""
    begins = room.free[i, way] == 1 and discrete.slips[i, way] == 1.0
    return begins and room.bounds[i, way] > model.truth.friction[i]


@compiled
def _let_rest(model: Record, discrete: Record, room: Record) -> None:
    """Sets all free slip modes to stick."""
    for i in range(model.num_fingers):
        for way in range(model.ways):
            if room.free[i, way] == 1:
                discrete.frozen[i, way] = 0
                for axis in axes_of(model, way):
                    discrete.slips[i, axis] = discrete.directions[i, axis] = 0.0
                discrete.directions[i, 2] = 0.0


@compiled
def _take_solution(model: Record, discrete: Record, room: Record) -> int:
    """Sets phases and directions from the solved forces and accelerations."""
    status = SELECTED
    for i in range(model.num_fingers):
        if not room.force[3 * i + 2] > 0.0:
            room.concerned = i
            status = OPENS
        for way in range(model.ways):
            if room.free[i, way] == 1:
                _take_way(model, discrete, room, i, way)
        name_phase(model, discrete, i)
    return status


@compiled
def _take_way(model: Record, discrete: Record, room: Record, i: int, way: int) -> None:
    """Sets a free slip mode to slip if it accelerates or leaves its cone smoothly.

    The direction is opposite to the friction force, which is known however small the acceleration.
    """
    first, mobility = 3 * i, room.mobility
    mass = 1.0 / max(mobility[first, first], mobility[first + 1, first + 1])
    x, y = room.opening[first], room.opening[first + 1]
    fx, fy, normal = room.force[first], room.force[first + 1], room.force[first + 2]
    z, fz = room.spins[i], room.moments[i]
    force, cone = size_in_way(model, way, fx, fy, fz), room.bounds[i, way] * normal
    accelerates = mass * size_in_way(model, way, x, y, z) > REST_FORCE * (1.0 + normal)
    share = FORCE_BAND if model.soft == 0 or room.leaving[i, way] == 0 else LEAVING_SHARE
    is_on_cone = force >= cone * (1.0 - share) and force > 0.0
    if is_on_cone and (accelerates or room.leaving[i, way] == 1):
        begin_slip(model, discrete, i, way, -fx, -fy, -fz)
    elif accelerates:
        begin_slip(model, discrete, i, way, x, y, z)


@compiled_apart(types.int64, MODEL, DISCRETE, WORKSPACE, SELECTION_ROOM, types.int64, types.int64)
def spatial_answer(
    model: Record, discrete: Record, work: Record, room: Record, first: int, starts: int
) -> int:
    """Solves the contact problem for the current bounds, and sets phases and directions.

    The arguments are those of `solve_contacts`.
    """
    if solve_contacts(model, discrete, work, room, first, starts) == 0:
        return NONE_CONSISTENT
    return _take_solution(model, discrete, room)


@compiled
def let_slip(model: Record, discrete: Record, work: Record, room: Record) -> int:
    """Sets phases and directions by the contact problem, with sliding friction for slips."""
    while True:
        status = spatial_answer(model, discrete, work, room, 0, MANY_STARTS)
        if status == NONE_CONSISTENT or not _loosen_slipping(model, discrete, room):
            return status


@compiled
def find_closed(model: Record, discrete: Record, work: Record, room: Record) -> bool:
    """Tries all choices of static or sliding friction; True if all contacts push in a solution.

    Several choices may be consistent if friction in stick is larger than in slip. In the pyramid,
    all combinations of phases are tried last.
    """
    concerned, restarts = room.concerned, room.restarts
    for choice in range(1 << (model.ways * model.num_fingers)):
        if _choose_bounds(model, room, choice) and _is_held(model, discrete, work, room):
            return True
    room.concerned, room.restarts = concerned, restarts
    return model.ways == 2 and spatial_enumerate(model, discrete, room) == 1


@compiled
def _choose_bounds(model: Record, room: Record, choice: int) -> bool:
    """Sets sliding friction for the slip modes in the bits of ``choice``; False if not applicable.

    Soft contacts may have several solutions even if static and sliding friction are equal.
    """
    truth, has_excess = model.truth, model.soft == 1
    for i in range(model.num_fingers):
        for way in range(model.ways):
            is_loose = (choice >> (model.ways * i + way)) & 1 == 1
            has_choice = has_static_excess(model, i) and room.free[i, way] == 1
            if is_loose and not has_choice:
                return False
            has_excess = has_excess or has_choice
            room.bounds[i, way] = truth.friction[i] if is_loose else truth.static_friction[i]
    return has_excess


@compiled
def _is_held(model: Record, discrete: Record, work: Record, room: Record) -> bool:
    """True if a solution has closed contacts, and sticks where static friction is set.

    With slips in progress the problem may have several solutions, so more starts are tried.
    """
    first, status = 0, OPENS
    while status != NONE_CONSISTENT:
        _let_rest(model, discrete, room)
        starts = FEW_STARTS if model.soft == 0 else MANY_STARTS
        status = spatial_answer(model, discrete, work, room, first, starts)
        if status == SELECTED and _keeps_static_bounds(model, discrete, room):
            return True
        first = room.start + 1
    return False


@compiled
def _keeps_static_bounds(model: Record, discrete: Record, room: Record) -> bool:
    """True if all slip modes with larger static friction stick in the solution."""
    for i in range(model.num_fingers):
        for way in range(model.ways):
            if _slips_on_static_bound(model, discrete, room, i, way):
                return False
    return True
