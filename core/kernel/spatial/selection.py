"""Selection of phases and slip directions (docs/space.md, Selection).

Slip directions are a continuum, so phases are not enumerated: if not all free contacts can stick,
phases and directions are derived from the solution of the contact problem.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.friction import has_static_excess
from slipgrasp.core.kernel.loop.guards import FORCE_BAND
from slipgrasp.core.kernel.spatial.contact_problem import (
    SELECTION_ROOM,
    spatial_contacts,
)
from slipgrasp.core.kernel.spatial.contact_solution import (
    LEAVING_SHARE,
    NONE_CONSISTENT,
    NONE_REGULAR,
    OPENS,
    SELECTED,
    begin_slip,
    find_closed,
    let_slip,
    size_in_way,
)
from slipgrasp.core.kernel.spatial.flow import (
    SURE_SPEED,
    set_derivative,
    spatial_phases,
    spatial_plant,
)
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.state import STATE, normalise, velocity_at
from slipgrasp.core.kernel.spatial.torsion import begin_contact_problem, spatial_begin_at_once
from slipgrasp.core.kernel.spatial.torsion_directions import (
    LEAVES,
    RESTS,
    is_short,
    let_marked_stick,
    mark_resting,
)
from slipgrasp.core.kernel.spatial.torsion_stops import spatial_keep_stick
from slipgrasp.core.kernel.spatial.ways import (
    axes_of,
    friction_margin,
    name_phase,
    parts_of_way,
    way_speed,
)
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, WORKSPACE

PROBE_TIME, MARGIN_SLOPE = 1e-6, 1e-5
AGREEMENT = 1e-6  # of forces of Newton's method and the reduced form, absolute [N] and relative


@compiled
def _free_contacts(model: Record, discrete: Record, state: Record, room: Record) -> None:
    """Marks slip modes at rest as free and sets them to stick; the others keep their directions."""
    n = model.num_fingers
    room.restarts = 0
    for i in range(n):
        for way in range(model.ways):
            speed = way_speed(model, state, i, way)
            # Slower slips change direction at once: within 1e-8 s at 1 m/s^2 across them. Sticking
            # contacts with undetermined moments may creep. Slow slips of soft contacts are treated
            # as at onset: an immediate stop could also stop the object.
            sticks = model.soft == 1 and discrete.slips[i, way] == 0.0
            begins = model.soft == 1 and not sticks and 0.0 < speed < SURE_SPEED
            has_begun = begins and discrete.frozen[i, way] != 0
            for part in range(0 if model.soft == 0 or has_begun else 3):
                discrete.crept[i, part] = 0.0
            free = (speed < SURE_SPEED or sticks) and not begins
            room.stopped[i] = 1 if model.soft == 1 and free and not sticks else 0
            room.free[i, way] = 1 if free else 0
            room.bounds[i, way] = model.truth.static_friction[i]
            discrete.frozen[i, way] = 1 if begins else 0
            for axis in axes_of(model, way):
                discrete.slips[i, axis] = 0.0 if free else 1.0
            for part in parts_of_way(model, way):
                at = velocity_at(n, i, part)
                if not has_begun:
                    discrete.directions[i, part] = 0.0 if free else state.x[at] / speed
                if free:
                    state.x[at] = 0.0
        name_phase(model, discrete, i)


@compiled
def _all_consistent(model: Record, discrete: Record, work: Record, room: Record) -> bool:
    """True if the forces allow all free slip modes to stick."""
    consistent = True
    for i in range(model.num_fingers):
        for way in range(model.ways):
            if room.free[i, way] == 0:
                continue
            normal, margin = work.forces[i, 2], friction_margin(model, discrete, work, i, way)
            room.margins[i, way] = margin
            if not normal > 0.0 or margin < -FORCE_BAND * (1.0 + normal):
                consistent = False
    return consistent


@compiled
def _opens(n: int, work: Record, room: Record) -> int:
    """SELECTED if every contact pushes, otherwise OPENS; stores the contact."""
    for i in range(n):
        if not work.forces[i, 2] > 0.0:
            room.concerned = i
            return OPENS
    return SELECTED


@compiled
def _pulls(n: int, work: Record, room: Record) -> int:
    """OPENS if a contact pulls in the selected phases, otherwise SELECTED; stores the contact.

    A force of nearly zero has no certain direction, and so no certain phase. A law may demand none.
    """
    for i in range(n):
        if not work.forces[i, 2] > -FORCE_BAND:
            room.concerned = i
            return OPENS
    return SELECTED


@compiled
def _is_near(model: Record, work: Record, room: Record, i: int, way: int) -> bool:
    """True if a free slip mode sticks with its force on the bound of friction."""
    band = FORCE_BAND * (1.0 + work.forces[i, 2])
    if model.soft == 1 and room.leaving[i, way] == 1:
        band = LEAVING_SHARE * work.forces[i, 2]
    return room.free[i, way] == 1 and room.margins[i, way] <= band


@compiled
def _find_leaving(
    model: Record, discrete: Record, state: Record, work: Record, room: Record
) -> bool:
    """True if a sticking contact on its cone is about to leave it during motion in stick."""
    n, doubtful = model.num_fingers, False
    for i in range(n):
        for way in range(model.ways):
            near = _is_near(model, work, room, i, way)
            room.leaving[i, way] = room.leaving[i, way] if near else 0
            doubtful = doubtful or (near and room.leaving[i, way] == 0)
    if doubtful:
        _probe_slopes(model, discrete, state, work, room)
    found = False
    for i in range(n):
        for way in range(model.ways):
            found = found or room.leaving[i, way] == 1
    return found


@compiled
def _probe_slopes(
    model: Record, discrete: Record, state: Record, work: Record, room: Record
) -> None:
    """Marks slip modes whose forces leave the cone within a short time of motion in stick."""
    set_derivative(model, state, room.derivative, work)
    for k in range(model.num_states):
        room.probe.x[k] = state.x[k] + PROBE_TIME * room.derivative.x[k]
    normalise(room.probe)
    spatial_plant(model, discrete, room.probe, work)
    for i in range(model.num_fingers):
        for way in range(model.ways):
            after = friction_margin(model, discrete, work, i, way)
            slope = (after - room.margins[i, way]) / PROBE_TIME
            least = -MARGIN_SLOPE * (1.0 + work.forces[i, 2])
            if _is_near(model, work, room, i, way) and slope < least:
                room.leaving[i, way] = 1
    spatial_plant(model, discrete, state, work)


@compiled
def _let_leave(model: Record, discrete: Record, work: Record, room: Record) -> None:
    """Starts slips that begin smoothly, opposite to the friction force: g = -F_t / |F_t|."""
    for i in range(model.num_fingers):
        for way in range(model.ways):
            x, y, z = work.forces[i, 0], work.forces[i, 1], work.moments[i]
            if room.leaving[i, way] == 1 and size_in_way(model, way, x, y, z) > 0.0:
                begin_slip(model, discrete, i, way, -x, -y, -z)
        name_phase(model, discrete, i)


@compiled
def _loosen_overcome(model: Record, work: Record, room: Record) -> bool:
    """Sets sliding friction if static friction is exceeded while all free contacts stick.

    Contacts that could stick or slip then slip. Returns True if there are any.
    """
    found = False
    for i in range(model.num_fingers):
        for way in range(model.ways):
            if has_static_excess(model, i) and _is_near(model, work, room, i, way):
                room.bounds[i, way] = model.truth.friction[i]
                found = True
    return found


@compiled
def _take_phases(model: Record, discrete: Record, state: Record, work: Record) -> None:
    """Evaluates the state in new phases."""
    spatial_phases(model, discrete, state, work)
    if model.soft == 1:
        spatial_begin_at_once(model, discrete, state, work)


@compiled
def _let_stick(model: Record, discrete: Record, state: Record, work: Record, room: Record) -> int:
    """Sets free slip modes to stick or to a smooth onset of slip; `NONE_CONSISTENT` on failure."""
    consistent = _all_consistent(model, discrete, work, room)
    if not consistent or _find_leaving(model, discrete, state, work, room):
        if _loosen_overcome(model, work, room) or not consistent:
            return NONE_CONSISTENT
        _let_leave(model, discrete, work, room)
        _take_phases(model, discrete, state, work)
    return _opens(model.num_fingers, work, room)


@compiled
def _let_overcome(model: Record, discrete: Record, work: Record, room: Record) -> bool:
    """Starts the slip of soft contacts that stick, but are outside their bound due to creep."""
    found = False
    for i in range(model.num_fingers):
        margin = friction_margin(model, discrete, work, i, 0)
        is_outside = margin < -FORCE_BAND * (1.0 + work.forces[i, 2])
        if room.free[i, 0] == 1 and discrete.slips[i, 0] == 0.0 and is_outside:
            x, y, z = work.forces[i, 0], work.forces[i, 1], work.moments[i]
            begin_slip(model, discrete, i, 0, -x, -y, -z)
            name_phase(model, discrete, i)
            found = True
    return found


@compiled
def _let_all_overcome(
    model: Record, discrete: Record, state: Record, work: Record, room: Record
) -> None:
    """Repeats `_let_overcome` until no contact is outside its bound."""
    for _ in range(model.num_fingers):
        if not _let_overcome(model, discrete, work, room):
            return
        _take_phases(model, discrete, state, work)


@compiled
def _agrees(model: Record, work: Record, room: Record) -> bool:
    """True if the reduced form in the selected phases gives the forces of the contact problem."""
    for i in range(model.num_fingers):
        for k in range(3):
            force = room.force[3 * i + k]
            if not abs(force - work.forces[i, k]) <= AGREEMENT * (1.0 + abs(force)):
                return False
    return True


@compiled_apart(types.void, MODEL, DISCRETE, STATE, WORKSPACE, SELECTION_ROOM)
def spatial_let_rest(
    model: Record, discrete: Record, state: Record, work: Record, room: Record
) -> None:
    """Starts slips of soft contacts outside their bounds, and sets those at rest to stick."""
    _let_slip_or_rest(model, discrete, state, work, room)
    if _rests_at_once(model, discrete, work):
        # Rows have the friction of a slip, under which another contact may be outside its bound.
        spatial_phases(model, discrete, state, work)
        _let_overcome(model, discrete, work, room)
        _take_phases(model, discrete, state, work)


@compiled
def _rests_at_once(model: Record, discrete: Record, work: Record) -> bool:
    """True if a contact that has just begun to slip rests after an instant."""
    for i in range(model.num_fingers):
        if discrete.frozen[i, 0] == LEAVES and is_short(work.gamma, i):
            return True
    return False


@compiled
def _let_slip_or_rest(
    model: Record, discrete: Record, state: Record, work: Record, room: Record
) -> None:
    """Repeats slips outside bounds and rests until neither changes a phase."""
    for _ in range(model.num_fingers):
        _let_all_overcome(model, discrete, state, work, room)
        if not mark_resting(model, discrete, discrete.directions):
            return
        for i in range(model.num_fingers):
            if discrete.frozen[i, 0] == RESTS:
                room.free[i, 0] = 1
        let_marked_stick(model, discrete, state)
        _take_phases(model, discrete, state, work)
    _let_all_overcome(model, discrete, state, work, room)


@compiled_apart(types.int64, MODEL, DISCRETE, STATE, WORKSPACE, SELECTION_ROOM)
def spatial_select(
    model: Record, discrete: Record, state: Record, work: Record, room: Record
) -> int:
    """Selects the phases for the current torque, and evaluates ``work`` in them.

    Args:
        model: Constants of the run.
        discrete: Discrete state; its phases and directions are set.
        state: State; slip velocities treated as zero become exactly zero.
        work: Workspace.
        room: Intermediate values; ``leaving`` is 1 for forces that have just reached their bound.
    """
    _free_contacts(model, discrete, state, room)
    spatial_plant(model, discrete, state, work)
    if model.soft == 1:
        if spatial_keep_stick(model, discrete, state, work) != 0:
            spatial_plant(model, discrete, state, work)
        spatial_begin_at_once(model, discrete, state, work)
    room.concerned = -1
    if not work.system.determinant > 0.0:
        return NONE_REGULAR
    status = _let_stick(model, discrete, state, work, room)
    if status == SELECTED:
        if model.soft == 1:
            spatial_let_rest(model, discrete, state, work, room)
        return status
    if model.soft == 1:
        begin_contact_problem(model, discrete, state, work, 0.0)
    else:
        spatial_contacts(model, state, work, room)
    if status == NONE_CONSISTENT:
        status = let_slip(model, discrete, work, room)
    if status != SELECTED and not find_closed(model, discrete, work, room):
        return status
    _take_phases(model, discrete, state, work)
    if model.soft == 1:
        spatial_let_rest(model, discrete, state, work, room)
    if not work.system.determinant > 0.0:
        return NONE_REGULAR
    if model.soft == 1:
        return _pulls(model.num_fingers, work, room)
    return SELECTED if _agrees(model, work, room) else NONE_CONSISTENT
