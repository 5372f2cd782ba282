"""The hybrid loop of a run in space, in resumable pieces: tick, flow, detect, locate, jump.

Torques are held from tick to tick, so that nothing jumps between two ticks but phases, and a law
need not be asked which phases it believes in. No step passes a tick; output times have no part in
the steps.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import call, compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.laws.own_law import ANSWERED, ASKED
from slipgrasp.core.kernel.loop.progress import (
    CHANGE_CAPACITY,
    ROOM_TO_SPARE,
    ROWS_BEFORE_PAUSE,
    TICKS_BEFORE_PAUSE,
)
from slipgrasp.core.kernel.loop.status import (
    EVENT_STALL,
    LEFT_FACE,
    MAX_STEPS,
    NOT_FINITE,
    PAINLEVE,
    REACHED,
    RUNNING,
    SEPARATED,
    SINGULAR,
    STEP_UNDERFLOW,
    STIFF,
)
from slipgrasp.core.kernel.loop.ticks import next_command, next_tick
from slipgrasp.core.kernel.spatial.dynamics import stored_energy
from slipgrasp.core.kernel.spatial.extremes import spatial_count
from slipgrasp.core.kernel.spatial.flow import SURE_SPEED, spatial_plant
from slipgrasp.core.kernel.spatial.guards import (
    FACE,
    NORMAL_FORCE,
    PER_CONTACT,
    PHASE,
)
from slipgrasp.core.kernel.spatial.guards import SINGULAR as SINGULAR_FINGER
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
    OUTLET,
    PROGRESS,
    emit,
    emit_due,
)
from slipgrasp.core.kernel.spatial.slip_rows import spatial_follow_slip, spatial_leave_slip
from slipgrasp.core.kernel.spatial.state import slip_velocity_at, supplied_at
from slipgrasp.core.kernel.spatial.steps import (
    spatial_accept,
    spatial_cut,
    spatial_emit_inside,
    stop_in_patch,
)
from slipgrasp.core.kernel.spatial.tick import control_tick, spatial_apply
from slipgrasp.core.kernel.spatial.ways import axes_of, way_speed

STALLED, MAX_STALLS = 1e-9, 20
PACE_STEPS, LEAST_PACE = 50_000, 1e-9
STOPS_TOO, STOPS_WITHIN = 1e-7, 1e-8  # slips that end with another one [m/s, s]


@compiled
def _pass_step(model: Record, run: Record, size: float, until: float) -> None:
    """The end of the step becomes the present state."""
    step = run.step
    for k in range(model.num_states):
        step.start.x[k] = step.end.x[k]
        step.slopes[0].x[k] = step.slopes[step.last].x[k]
    run.now = until if size == until - run.now and run.fired == 0 else run.now + size


@compiled
def _thaw(model: Record, run: Record) -> bool:
    """Lets slips that are fast enough tell their own direction; True if any does from now on."""
    discrete, found = run.discrete, False
    for i in range(model.num_fingers):
        for way in range(model.ways):
            if discrete.frozen[i, way] == 0:
                continue
            if way_speed(model, run.step.start, i, way) >= SURE_SPEED:
                discrete.frozen[i, way] = 0
                _align(model, run, i, way)
                found = True
    return found


@compiled
def _align(model: Record, run: Record, i: int, way: int) -> None:
    """Gives a slip the direction that it was taken for, so that no force jumps."""
    speed = way_speed(model, run.step.start, i, way)
    for axis in axes_of(model, way):
        at = slip_velocity_at(model.num_fingers, i, axis)
        run.step.start.x[at] = speed * run.discrete.directions[i, axis]


@compiled
def _find_end(model: Record, run: Record) -> int:
    """Whether a fired guard ends the run, and which contact or finger is concerned."""
    n, fired = model.num_fingers, run.guards.fired
    for i in range(n):
        base = PER_CONTACT * i
        status = RUNNING
        if fired[base + NORMAL_FORCE] == 1:
            status = SEPARATED
        elif fired[base + FACE] == 1:
            status = LEFT_FACE
        elif fired[base + SINGULAR_FINGER] == 1:
            status = SINGULAR
        if status != RUNNING:
            run.concerned = i
            return status
    return PAINLEVE if fired[PER_CONTACT * n] == 1 else RUNNING


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET)
def spatial_event(model: Record, run: Record, outlet: Record) -> int:
    """What the guards that fired mean: the end of the run, or other phases."""
    n, discrete, state = model.num_fingers, run.discrete, run.step.start
    run.stalls = run.stalls + 1 if run.now - run.last_event < STALLED else 0
    run.last_event = run.now
    keep_old(model, run)
    status = _find_end(model, run)
    if status == RUNNING and run.stalls > MAX_STALLS:
        status = EVENT_STALL
    if status != RUNNING:
        emit(model, run, outlet, discrete)
        return status
    emit(model, run, outlet, discrete)
    for i in range(n):
        for way in range(model.ways):
            fired = run.guards.fired[PER_CONTACT * i + PHASE + way] == 1
            slips = discrete.slips[i, way] != 0.0
            run.selection.leaving[i, way] = 1 if fired and not slips else 0
            if slips and (fired or _stops_too(model, run, i, way)):
                run.concerned = i
                for axis in axes_of(model, way):
                    state.x[slip_velocity_at(n, i, axis)] = 0.0
    return finish_jump(model, run, outlet, settle(model, run), False)


@compiled
def _stops_too(model: Record, run: Record, i: int, way: int) -> bool:
    """Whether a slip is so slow that it would end at the same instant."""
    n, x, slope = model.num_fingers, run.step.start.x, run.step.slopes[0].x
    speed = way_speed(model, run.step.start, i, way)
    if run.discrete.frozen[i, way] == 1 or not speed < STOPS_TOO:
        return False
    power = 0.0
    for axis in axes_of(model, way):
        at = slip_velocity_at(n, i, axis)
        power += x[at] * slope[at]
    return power < 0.0 and speed * speed < STOPS_WITHIN * -power


@compiled
def _is_stiff(run: Record) -> bool:
    """Whether the latest steps were so short that the run would never end."""
    steps = run.steps - run.pace_steps
    if steps < PACE_STEPS:
        return False
    pace = (run.now - run.pace_time) / steps
    run.pace_steps, run.pace_time = run.steps, run.now
    return pace < LEAST_PACE


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET, types.float64)
def spatial_once(model: Record, run: Record, outlet: Record, t_stop: float) -> int:
    """One step, cut at the first event in it, and the jump at its end if there is one."""
    if run.own.asked == ANSWERED or next_tick(model, run) <= run.now:
        return control_tick(model, run, outlet, 0, 0)
    if next_command(run) <= run.now:
        return spatial_apply(model, run, outlet)
    emit_due(model, run, outlet)
    until = min(t_stop, next_tick(model, run), next_command(run))
    size = spatial_accept(model, run, until)
    if size == 0.0:
        emit(model, run, outlet, run.discrete)
        return STEP_UNDERFLOW
    size = spatial_cut(model, run, stop_in_patch(model, run, size))
    spatial_count(model, run, size)
    spatial_emit_inside(model, run, outlet, size)
    spatial_follow_slip(model, run, outlet, size)
    _pass_step(model, run, size, until)
    if run.fired == 1:
        return spatial_event(model, run, outlet)
    if _thaw(model, run):
        spatial_plant(model, run.discrete, run.step.start, run.work)
        restart(model, run)
    return RUNNING


@compiled
def _begin_stretch(model: Record, run: Record, outlet: Record, first: int, same_ticks: int) -> int:
    """Starts the run, or goes on after a timed change under new constants."""
    run.begun = 1
    forget_errors(run.work.room)
    if first == 0:
        _book_energy(model, run)
    if same_ticks == 0:
        run.tick_origin, run.ticks = run.now, 0
    if run.now >= next_tick(model, run):
        return control_tick(model, run, outlet, first, 1)
    keep_old(model, run)
    forget_leaving(model, run)
    return finish_jump(model, run, outlet, settle(model, run), False)


@compiled
def _book_energy(model: Record, run: Record) -> None:
    """Adds to the supplied energy what a timed change of mass or inertia brings in."""
    state = run.step.start
    spatial_plant(model, run.discrete, state, run.work)
    kinetic, potential = stored_energy(model.hand, model.truth, run.work.kin, state)
    before = run.row.kinetic_energy + run.row.potential_energy
    state.x[supplied_at(model.num_fingers)] += kinetic + potential - before


@compiled
def _advance_steps(
    model: Record,
    run: Record,
    outlet: Record,
    t_stop: float,
    first: int,
    same_ticks: int,
    max_steps: int,
) -> int:
    """The same without the rows of a slip that the stretch cuts short."""
    if run.begun == 0:
        status = _begin_stretch(model, run, outlet, first, same_ticks)
        if status == RUNNING and run.lost == 1:
            status = NOT_FINITE
        if status != RUNNING:
            return status
    for _ in range(max_steps):
        if run.own.asked == ASKED:
            return RUNNING
        if outlet.num_rows > ROWS_BEFORE_PAUSE or outlet.num_ticks >= TICKS_BEFORE_PAUSE:
            return RUNNING
        if run.num_changes > CHANGE_CAPACITY - ROOM_TO_SPARE:
            return RUNNING
        if run.now >= t_stop:
            emit(model, run, outlet, run.discrete)
            return NOT_FINITE if run.lost == 1 else REACHED
        if run.steps >= model.numerics.max_steps:
            emit(model, run, outlet, run.discrete)
            return MAX_STEPS
        status = spatial_once(model, run, outlet, t_stop)
        if status == RUNNING and run.lost == 1:
            status = NOT_FINITE
        elif status == RUNNING and _is_stiff(run):
            emit(model, run, outlet, run.discrete)
            status = STIFF
        if status != RUNNING:
            return status
    return RUNNING


@compiled_apart(
    types.int64, MODEL, PROGRESS, OUTLET, types.float64, types.int64, types.int64, types.int64
)
def spatial_advance(
    model: Record,
    run: Record,
    outlet: Record,
    t_stop: float,
    first: int,
    same_ticks: int,
    max_steps: int,
) -> int:
    """Advances the run by at most ``max_steps`` steps, at most to ``t_stop``.

    Arguments and answer are those of `slipgrasp.core.kernel.planar.advance.advance`.
    """
    status = _advance_steps(model, run, outlet, t_stop, first, same_ticks, max_steps)
    if status != RUNNING:
        spatial_leave_slip(model, run, outlet, 1)
    return status


def advance_run(
    model: Record,
    run: Record,
    outlet: Record,
    t_stop: float,
    *,
    first: bool,
    same_ticks: bool,
    max_steps: int,
) -> int:
    """Advances a run as `spatial_advance` does; from Python, without the GIL."""
    flags = int(first), int(same_ticks)
    status: int = call(spatial_advance, model, run, outlet, t_stop, *flags, max_steps)
    return status
