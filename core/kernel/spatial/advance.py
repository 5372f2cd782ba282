"""Events, jumps at known instants, and the loop of a spatial run.

Torques are constant between ticks, so that only phases jump there. No step passes a tick, and the
steps do not depend on output times.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.laws.own_law import ANSWERED
from slipgrasp.core.kernel.loop.advance import (
    MAX_STALLS,
    book_energy,
    count_stall,
    make_advance,
)
from slipgrasp.core.kernel.loop.guards import FORCE_BAND, find_end
from slipgrasp.core.kernel.loop.output import phases_changed
from slipgrasp.core.kernel.loop.status import (
    EVENT_STALL,
    RUNNING,
)
from slipgrasp.core.kernel.loop.ticks import next_command, next_tick
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.spatial.dynamics import stored_energy
from slipgrasp.core.kernel.spatial.flow import SURE_SPEED, set_derivative, spatial_plant
from slipgrasp.core.kernel.spatial.guards import (
    PER_CONTACT,
    PHASE,
    find_limited,
)
from slipgrasp.core.kernel.spatial.interior import spatial_count
from slipgrasp.core.kernel.spatial.jump import (
    finish_jump,
    forget_leaving,
    keep_old,
    restart,
    settle,
)
from slipgrasp.core.kernel.spatial.law import forget_errors
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.run import (
    LAYOUTS,
    OUTLET,
    PROGRESS,
    copy_discrete,
    emit,
    emit_due,
    follow_slip,
    leave_slip,
)
from slipgrasp.core.kernel.spatial.state import supplied_at, velocity_at
from slipgrasp.core.kernel.spatial.steps import (
    spatial_accept,
    spatial_cut,
    spatial_emit_inside,
    stop_in_patch,
)
from slipgrasp.core.kernel.spatial.tick import control_tick, spatial_apply
from slipgrasp.core.kernel.spatial.torsion import begins_slip
from slipgrasp.core.kernel.spatial.torsion_directions import (
    keep_directions_at_rest,
    let_marked_stick,
    mark_resting,
)
from slipgrasp.core.kernel.spatial.torsion_equations import spin_of
from slipgrasp.core.kernel.spatial.torsion_stops import (
    spatial_keep_stick,
    spatial_stop_slips,
    spatial_turn_slip,
)
from slipgrasp.core.kernel.spatial.ways import friction_margin, parts_of_way, way_speed
from slipgrasp.core.kernel.spatial.workspace import STICK

TURNS = 4  # impulses that align a slip
LEAST_TURN = 0.1  # spin part of a slip direction above which the spin determines the speed
STOPS_TOO, STOPS_WITHIN = 1e-7, 1e-8  # speed and time to stop of simultaneous stops [m/s, s]


@compiled
def _thaw(model: Record, run: Record) -> bool:
    """Releases the held directions of slips that are fast enough; True if there are any."""
    discrete, found = run.discrete, False
    for i in range(model.num_fingers):
        for way in range(model.ways):
            if discrete.frozen[i, way] == 0:
                continue
            if way_speed(model, run.step.start, i, way) >= SURE_SPEED:
                discrete.frozen[i, way] = 0
                if model.soft == 0:
                    _align(model, run, i, way)
                found = True
    return found


@compiled
def _align(model: Record, run: Record, i: int, way: int) -> None:
    """Aligns a slip velocity with its held direction, so that no force jumps."""
    state, direction = run.step.start, run.discrete.directions[i]
    if model.soft == 1:
        _turn_crept(model, run, i)
    speed = _speed_along(model, run, i, way)
    for part in parts_of_way(model, way):
        at = velocity_at(model.num_fingers, i, part)
        state.x[at] = speed * direction[part]


@compiled
def _turn_crept(model: Record, run: Record, i: int) -> None:
    """Aligns a soft contact that has crept far off its direction by impulses."""
    n, state, direction = model.num_fingers, run.step.start, run.discrete.directions[i]
    for _ in range(TURNS):
        speed = _speed_along(model, run, i, 0)
        dx = speed * direction[0] - state.x[velocity_at(n, i, 0)]
        dy = speed * direction[1] - state.x[velocity_at(n, i, 1)]
        if dx * dx + dy * dy <= square(SURE_SPEED):
            return
        spatial_turn_slip(model, run.discrete, state, run.work, i, dx, dy)


@compiled
def _speed_along(model: Record, run: Record, i: int, way: int) -> float:
    """Speed along the held direction with which a slip is aligned [m/s].

    The spin of a soft contact has a large inertia and is not changed: it determines the speed.
    """
    state, direction = run.step.start, run.discrete.directions[i]
    if model.soft == 1 and abs(direction[2]) > LEAST_TURN:
        by_spin = spin_of(model, state, run.work, i) / direction[2]
        if by_spin > 0.0:
            return by_spin
    return way_speed(model, state, i, way)


@compiled
def _point_onsets(model: Record, run: Record) -> None:
    """Keeps the friction of soft contacts that are at rest after an onset step on its bound."""
    if begins_slip(model, run.discrete):
        step = run.step
        keep_directions_at_rest(model, step.directions, step.begun, run.discrete)


@compiled
def _let_rest(model: Record, run: Record) -> None:
    """Sets soft contacts at slip onset that are at rest to stick, before the row of an event.

    If this would put other contacts outside their limit surfaces, the phases are not changed, and
    the row has the friction of slip.
    """
    if not begins_slip(model, run.discrete):
        return
    if not mark_resting(model, run.discrete, run.step.directions):
        return
    let_marked_stick(model, run.discrete, run.step.start)
    spatial_plant(model, run.discrete, run.step.start, run.work)
    if _is_overcome(model, run):
        copy_discrete(model, run.old, run.discrete)
        mark_resting(model, run.discrete, run.step.directions)


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET)
def spatial_event(model: Record, run: Record, outlet: Record) -> int:
    """Handles the guards that fired: end of the run or phase changes."""
    n, discrete, state = model.num_fingers, run.discrete, run.step.start
    begins = begins_slip(model, discrete)
    _point_onsets(model, run)
    count_stall(run)
    keep_old(model, run)
    _let_rest(model, run)
    status = find_end(model, run, PER_CONTACT)
    if status == RUNNING:
        status = find_limited(model, run)
    if status == RUNNING and run.stalls > MAX_STALLS:
        status = EVENT_STALL
    if status != RUNNING:
        emit(model, run, outlet, discrete)
        return status
    if not (begins and _is_invalid(model, run)):
        emit(model, run, outlet, discrete)
    let_marked_stick(model, discrete, state)
    is_stop = _is_stop(model, run)
    for i in range(n):
        for way in range(model.ways):
            fired = run.guards.fired[PER_CONTACT * i + PHASE + way] == 1
            slips = discrete.slips[i, way] != 0.0
            stuck = run.old.slips[i, way] == 0.0  # not if it came to rest just now
            run.selection.leaving[i, way] = 1 if fired and stuck else 0
            if slips and (fired or _stops_too(model, run, i, way, is_stop)):
                run.concerned = i
                if model.soft == 1:
                    discrete.phases[i] = STICK
                    continue
                for part in parts_of_way(model, way):
                    state.x[velocity_at(n, i, part)] = 0.0
    if model.soft == 1:
        spatial_stop_slips(model, discrete, state, run.work)
    return finish_jump(model, run, outlet, settle(model, run), False)


@compiled
def _is_stop(model: Record, run: Record) -> bool:
    """True if a slip of a hand with soft fingertips has just ended."""
    for i in range(model.num_fingers if model.soft == 1 else 0):
        if run.old.slips[i, 0] != 0.0 and run.guards.fired[PER_CONTACT * i + PHASE] == 1:
            return True
    return False


@compiled
def _stops_too(model: Record, run: Record, i: int, way: int, is_stop: bool) -> bool:
    """True if a slip is so slow that it would end at the same instant.

    Soft contacts on the same turning object stop together; ``is_stop`` is true if one has stopped.
    """
    n, x, slope = model.num_fingers, run.step.start.x, run.step.slopes[0].x
    speed = way_speed(model, run.step.start, i, way)
    if is_stop and run.discrete.frozen[i, way] == 0 and speed < SURE_SPEED:
        return True
    if run.discrete.frozen[i, way] != 0 or not speed < STOPS_TOO:
        return False
    power = 0.0
    for part in parts_of_way(model, way):
        at = velocity_at(n, i, part)
        power += x[at] * slope[at]
    return power < 0.0 and speed * speed < STOPS_WITHIN * -power


@compiled
def _next_stop(model: Record, run: Record, t_stop: float) -> float:
    """Next instant at which a torque may change."""
    return min(t_stop, next_tick(model, run), next_command(run))


@compiled
def _pass_instant(model: Record, run: Record, outlet: Record, _t_stop: float) -> int:
    """Handles the jump of the torque at a tick or at the time of a command."""
    if run.own.asked == ANSWERED or next_tick(model, run) <= run.now:
        return control_tick(model, run, outlet, 0, 0)
    return spatial_apply(model, run, outlet)


@compiled
def _cut(model: Record, run: Record, size: float) -> float:
    """Shortens the step to its first event."""
    return spatial_cut(model, run, stop_in_patch(model, run, size))


@compiled
def _finish_step(model: Record, run: Record, outlet: Record, _t_stop: float, _reaches: bool) -> int:
    """Releases the directions of fast slips at the end of a step without an event."""
    if model.soft == 1:
        return _finish_soft_step(model, run, outlet)
    if _thaw(model, run):
        spatial_plant(model, run.discrete, run.step.start, run.work)
        restart(model, run)
    return RUNNING


@compiled
def _finish_soft_step(model: Record, run: Record, outlet: Record) -> int:
    """As `_finish_step`, for soft fingertips: contacts that have come to rest stick again."""
    discrete, start, begins = run.discrete, run.step.start, begins_slip(model, run.discrete)
    _point_onsets(model, run)
    keep_old(model, run)
    if begins and mark_resting(model, discrete, run.step.directions):
        let_marked_stick(model, discrete, start)
        return _select_again(model, run, outlet)
    moved = spatial_keep_stick(model, discrete, start, run.work) == 2
    changes = begins and _thaw(model, run)
    if not changes and not moved:
        return RUNNING
    for i in range(model.num_fingers):
        if run.old.frozen[i, 0] == 1 and discrete.frozen[i, 0] == 0 and discrete.slips[i, 0] == 1.0:
            _align(model, run, i, 0)
    spatial_plant(model, discrete, start, run.work)
    if _is_overcome(model, run):
        return _select_again(model, run, outlet)
    if begins:
        return _finish_phases(model, run, outlet, RUNNING)
    # The smallest impulse changes the direction of a slow slip.
    set_derivative(model, start, run.step.slopes[0], run.work)
    return RUNNING


@compiled
def _is_overcome(model: Record, run: Record) -> bool:
    """True if a sticking contact is outside its limit surface after other contacts changed."""
    for i in range(model.num_fingers):
        margin = friction_margin(model, run.discrete, run.work, i, 0)
        is_outside = margin < -FORCE_BAND * (1.0 + run.work.forces[i, 2])
        if run.discrete.phases[i] == STICK and is_outside:
            return True
    return False


@compiled
def _is_invalid(model: Record, run: Record) -> bool:
    """True if a sticking contact is outside its limit surface at an event of a slip at onset.

    The friction of that slip jumps if its step is too short to have a direction.
    """
    spatial_plant(model, run.discrete, run.step.start, run.work)
    return _is_overcome(model, run)


@compiled
def _select_again(model: Record, run: Record, outlet: Record) -> int:
    """Selects phases again after a soft contact has come to rest or must begin to slip."""
    forget_leaving(model, run)
    return _finish_phases(model, run, outlet, settle(model, run))


@compiled
def _finish_phases(model: Record, run: Record, outlet: Record, status: int) -> int:
    """Completes a step after which soft contacts may have other phases.

    No row shows the previous phases, because they were already invalid.
    """
    if status != RUNNING or phases_changed(model, run):
        return finish_jump(model, run, outlet, status, status != RUNNING)
    restart(model, run)
    return RUNNING


@compiled
def _begin_stretch(model: Record, run: Record, outlet: Record, first: int, same_ticks: int) -> int:
    """Starts the run, or continues it after a timed change with new constants."""
    run.begun = 1
    forget_errors(run.work.room)
    if first == 0:
        spatial_plant(model, run.discrete, run.step.start, run.work)
        book_energy(model, run, stored_energy, supplied_at(model))
    if same_ticks == 0:
        run.tick_origin, run.ticks = run.now, 0
    if run.now >= next_tick(model, run):
        return control_tick(model, run, outlet, first, 1)
    keep_old(model, run)
    forget_leaving(model, run)
    return finish_jump(model, run, outlet, settle(model, run), False)


@compiled
def _emit_end(model: Record, run: Record, outlet: Record, _t_stop: float) -> None:
    """Appends the row at the end of the segment."""
    emit(model, run, outlet, run.discrete)


advance, advance_run = make_advance(
    LAYOUTS,
    emit=emit,
    emit_end=_emit_end,
    emit_due=emit_due,
    begin=_begin_stretch,
    next_stop=_next_stop,
    pass_instant=_pass_instant,
    take_step=spatial_accept,
    cut=_cut,
    count_step=spatial_count,
    emit_inside=spatial_emit_inside,
    follow_slip=follow_slip,
    leave_slip=leave_slip,
    pass_event=spatial_event,
    finish_step=_finish_step,
    pace_steps=50_000,
    least_pace=1e-9,
)
