"""The hybrid loop of a run in space, in resumable pieces: tick, flow, detect, locate, jump.

Torques are held from tick to tick, so that nothing jumps between two ticks but phases, and a law
need not be asked which phases it believes in. No step passes a tick or an output time.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compiler import call, compiled, compiled_apart
from slipgrasp.core.kernel.jump import (
    CHATTERING,
    EVENT_STALL,
    INCONSISTENT,
    LEFT_FACE,
    MAX_STEPS,
    MODEL_SINGULAR,
    NOT_FINITE,
    PAINLEVE,
    REACHED,
    RUNNING,
    SEPARATED,
    SINGULAR,
    STEP_UNDERFLOW,
    STIFF,
)
from slipgrasp.core.kernel.records import Record
from slipgrasp.core.kernel.run import (
    CHANGE_CAPACITY,
    CLAMPED,
    FIRST_STEP,
    OUTPUT_ROUNDING,
    ROOM_TO_SPARE,
    log_changes,
    phases_changed,
    warn,
)
from slipgrasp.core.kernel.space.command import spatial_command
from slipgrasp.core.kernel.space.dynamics import stored_energy
from slipgrasp.core.kernel.space.flow import SURE_SPEED, set_derivative, slip_speed, spatial_plant
from slipgrasp.core.kernel.space.guards import (
    FACE,
    NORMAL_FORCE,
    PER_CONTACT,
    PHASE,
    relax,
    spatial_arm,
    spatial_fired,
)
from slipgrasp.core.kernel.space.guards import SINGULAR as SINGULAR_FINGER
from slipgrasp.core.kernel.space.learning import spatial_learn
from slipgrasp.core.kernel.space.model import MODEL
from slipgrasp.core.kernel.space.run import (
    OUTLET,
    PROGRESS,
    ROWS_BEFORE_PAUSE,
    TICKS_BEFORE_PAUSE,
    copy_discrete,
    spatial_emit,
    store_tick,
)
from slipgrasp.core.kernel.space.selection import (
    NONE_REGULAR,
    OPENS,
    SELECTED,
    spatial_select,
)
from slipgrasp.core.kernel.space.state import slip_velocity_at, supplied_at
from slipgrasp.core.kernel.space.steps import spatial_accept, spatial_locate
from slipgrasp.core.kernel.space.workspace import STICK

FREE_ROTATION, RESTARTS, SOFTENED = 4, 5, 6  # of the warnings, after those of the plane
STALLED, MAX_STALLS = 1e-9, 20
PACE_STEPS, LEAST_PACE = 50_000, 1e-9
STOPS_TOO, STOPS_WITHIN = 1e-7, 1e-8  # slips that end with another one [m/s, s]


@compiled
def _next_tick(model: Record, run: Record) -> float:
    return run.tick_origin + run.ticks * model.law.period


@compiled
def _next_output(model: Record, run: Record) -> float:
    return run.outputs / model.numerics.output_rate


@compiled
def _restart(model: Record, run: Record) -> None:
    """First slope in the present phases, whose evaluation is at hand; guards armed."""
    set_derivative(model, run.step.start, run.step.slopes[0], run.work)
    spatial_arm(model, run.discrete, run.step.start, run.work, run.guards)


@compiled
def _settle(model: Record, run: Record) -> int:
    """Selects phases for the torque that is held."""
    verdict = spatial_select(model, run.discrete, run.step.start, run.work, run.selection)
    for _ in range(run.selection.restarts):
        warn(run, RESTARTS)
    if verdict == SELECTED:
        return RUNNING
    run.concerned = run.selection.concerned
    if verdict == OPENS:
        return SEPARATED
    return PAINLEVE if verdict == NONE_REGULAR else INCONSISTENT


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET, types.int64, types.int64)
def spatial_tick(model: Record, run: Record, outlet: Record, first: int, stretch: int) -> int:
    """One tick of sampled control: new estimates, new torque, new selection, and what is learnt.

    Args:
        model: Constants of the run.
        run: The run.
        outlet: Buffers for rows and phase changes.
        first: 1 at the start of the run.
        stretch: 1 at the start of a stretch, which gives two rows.
    """
    discrete, work = run.discrete, run.work
    _keep_old(model, run)
    _advance_estimates(model, run)
    run.ticks += 1
    regular = spatial_command(model, discrete, run.now, run.step.start, work)
    if regular == 0:
        spatial_emit(model, run, outlet, run.old)
        return MODEL_SINGULAR
    store_tick(model, run, outlet)
    if work.grasp.rank < 6:
        warn(run, FREE_ROTATION)
    if work.grasp.soft > 0:
        warn(run, SOFTENED)
    if first == 1:
        # The stick that every run assumes at its start, under the first torque.
        copy_discrete(model, discrete, run.old)
    for i in range(model.num_fingers):
        run.selection.leaving[i] = 0
    status = _settle(model, run)
    if status == RUNNING:
        spatial_learn(model, discrete, run.step.start, work, run.memory)
        for k in range(model.num_unknowns):
            run.pending_rates[k] = work.rates[k]
    if status != RUNNING or stretch == 1 or phases_changed(model, run):
        # At the start of a later stretch the row before is written already.
        return _finish_jump(model, run, outlet, status, stretch == 0 or first == 1)
    _restart(model, run)
    return RUNNING


@compiled
def _keep_old(model: Record, run: Record) -> None:
    copy_discrete(model, run.discrete, run.old)
    for i in range(model.num_fingers):
        run.old_phases[i] = run.discrete.phases[i]


@compiled
def _advance_estimates(model: Record, run: Record) -> None:
    """One Euler step of the estimates over the period that ends now, projected on their bounds."""
    elapsed, unknowns = run.now - run.last_tick, model.unknowns
    run.last_tick = run.now
    for k in range(model.num_unknowns):
        value = run.discrete.estimates[k] + elapsed * run.pending_rates[k]
        bounded = min(max(value, unknowns.minimum[k]), unknowns.maximum[k])
        if bounded != value:
            warn(run, CLAMPED)
        run.discrete.estimates[k] = bounded


@compiled
def _finish_jump(model: Record, run: Record, outlet: Record, status: int, before: bool) -> int:
    """Writes the rows before and after, logs phase changes and prepares the flow that follows."""
    if before:
        spatial_emit(model, run, outlet, run.old)
    if status != RUNNING:
        return status
    chatters = log_changes(model, run, outlet)
    spatial_emit(model, run, outlet, run.discrete)
    while _next_output(model, run) <= run.now + OUTPUT_ROUNDING:
        run.outputs += 1
    _restart(model, run)
    run.step_size = min(run.step_size, FIRST_STEP)
    return CHATTERING if chatters else RUNNING


@compiled
def _pass_step(model: Record, run: Record, size: float, until: float, fired: int) -> None:
    """The end of the step becomes the present state."""
    step = run.step
    last = model.methods[step.rank].last
    for k in range(model.num_states):
        step.start.x[k] = step.end.x[k]
        step.slopes[0].x[k] = step.slopes[last].x[k]
    run.now = until if size == until - run.now and fired == 0 else run.now + size


@compiled
def _thaw(model: Record, run: Record) -> bool:
    """Lets slips that are fast enough tell their own direction; True if any does from now on."""
    n, discrete, found = model.num_fingers, run.discrete, False
    for i in range(n):
        if discrete.frozen[i] == 1 and slip_speed(n, run.step.start, i) >= SURE_SPEED:
            discrete.frozen[i] = 0
            found = True
    return found


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
    _keep_old(model, run)
    status = _find_end(model, run)
    if status == RUNNING and run.stalls > MAX_STALLS:
        status = EVENT_STALL
    if status != RUNNING:
        spatial_emit(model, run, outlet, discrete)
        return status
    spatial_emit(model, run, outlet, discrete)
    for i in range(n):
        fired = run.guards.fired[PER_CONTACT * i + PHASE] == 1
        run.selection.leaving[i] = 1 if fired and discrete.phases[i] == STICK else 0
        if discrete.phases[i] == STICK:
            continue
        if fired or _stops_too(model, run, i):
            run.concerned = i
            for axis in range(2):
                state.x[slip_velocity_at(n, i, axis)] = 0.0
    return _finish_jump(model, run, outlet, _settle(model, run), False)


@compiled
def _stops_too(model: Record, run: Record, i: int) -> bool:
    """Whether a slip is so slow that it would end at the same instant."""
    n, x, slope = model.num_fingers, run.step.start.x, run.step.slopes[0].x
    speed = slip_speed(n, run.step.start, i)
    if run.discrete.frozen[i] == 1 or not speed < STOPS_TOO:
        return False
    power = 0.0
    for axis in range(2):
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
    if _next_tick(model, run) <= run.now:
        return spatial_tick(model, run, outlet, 0, 0)
    while model.motion.breaks[run.discrete.piece] <= run.now:
        run.discrete.piece += 1
    while _next_output(model, run) <= run.now + OUTPUT_ROUNDING:
        spatial_emit(model, run, outlet, run.discrete)
        run.outputs += 1
    until = min(t_stop, _next_tick(model, run), _next_output(model, run))
    size = spatial_accept(model, run, until)
    if size == 0.0:
        spatial_emit(model, run, outlet, run.discrete)
        return STEP_UNDERFLOW
    fired = spatial_fired(model, run.discrete, run.step.end, run.work, run.guards)
    if fired == 1:
        size = spatial_locate(model, run, size)
    else:
        relax(model, run.discrete, run.work, run.guards)
    _pass_step(model, run, size, until, fired)
    if fired == 1:
        return spatial_event(model, run, outlet)
    if _thaw(model, run):
        spatial_plant(model, run.discrete, run.step.start, run.work)
        _restart(model, run)
    return RUNNING


@compiled
def _begin_stretch(model: Record, run: Record, outlet: Record, first: int, same_ticks: int) -> int:
    """Starts the run, or goes on after a timed change under new constants."""
    run.begun = 1
    if first == 0:
        _book_energy(model, run)
    if same_ticks == 0:
        run.tick_origin, run.ticks = run.now, 0
    while model.motion.breaks[run.discrete.piece] <= run.now:
        run.discrete.piece += 1
    if run.now >= _next_tick(model, run):
        return spatial_tick(model, run, outlet, first, 1)
    _keep_old(model, run)
    for i in range(model.num_fingers):
        run.selection.leaving[i] = 0
    return _finish_jump(model, run, outlet, _settle(model, run), False)


@compiled
def _book_energy(model: Record, run: Record) -> None:
    """Adds to the supplied energy what a timed change of mass or inertia brings in."""
    state = run.step.start
    spatial_plant(model, run.discrete, state, run.work)
    kinetic, potential = stored_energy(model.hand, model.truth, run.work.kin, state)
    before = run.row.kinetic_energy + run.row.potential_energy
    state.x[supplied_at(model.num_fingers)] += kinetic + potential - before


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

    Arguments and answer are those of `slipgrasp.core.kernel.advance.advance`.
    """
    if run.begun == 0:
        status = _begin_stretch(model, run, outlet, first, same_ticks)
        if status == RUNNING and run.lost == 1:
            status = NOT_FINITE
        if status != RUNNING:
            return status
    for _ in range(max_steps):
        if outlet.num_rows > ROWS_BEFORE_PAUSE or outlet.num_ticks >= TICKS_BEFORE_PAUSE:
            return RUNNING
        if run.num_changes > CHANGE_CAPACITY - ROOM_TO_SPARE:
            return RUNNING
        if run.now >= t_stop:
            spatial_emit(model, run, outlet, run.discrete)
            return NOT_FINITE if run.lost == 1 else REACHED
        if run.steps >= model.numerics.max_steps:
            spatial_emit(model, run, outlet, run.discrete)
            return MAX_STEPS
        status = spatial_once(model, run, outlet, t_stop)
        if status == RUNNING and run.lost == 1:
            status = NOT_FINITE
        elif status == RUNNING and _is_stiff(run):
            spatial_emit(model, run, outlet, run.discrete)
            status = STIFF
        if status != RUNNING:
            return status
    return RUNNING


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
