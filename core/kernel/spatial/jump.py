"""Jumps of a spatial run: phase selection, rows, restart of the flow."""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.output import log_change, log_changes, pass_output_times
from slipgrasp.core.kernel.loop.progress import FIRST_STEP, RESTARTS, TORSION_SPLIT, warn, warn_once
from slipgrasp.core.kernel.loop.status import (
    CHATTERING,
    INCONSISTENT,
    PAINLEVE,
    RUNNING,
    SEPARATED,
)
from slipgrasp.core.kernel.loop.tally import count_forces
from slipgrasp.core.kernel.spatial.contact_solution import NONE_REGULAR, OPENS, SELECTED
from slipgrasp.core.kernel.spatial.flow import set_derivative, set_directions
from slipgrasp.core.kernel.spatial.guards import PER_CONTACT, arm_guards
from slipgrasp.core.kernel.spatial.run import copy_discrete, emit, leave_slip
from slipgrasp.core.kernel.spatial.selection import spatial_select
from slipgrasp.core.kernel.spatial.torsion_directions import let_begin
from slipgrasp.core.kernel.spatial.torsion_modes import contacts_creep
from slipgrasp.core.kernel.spatial.workspace import STICK


@compiled
def restart(model: Record, run: Record) -> None:
    """Computes the first slope from the evaluated state and arms the guards."""
    set_derivative(model, run.step.start, run.step.slopes[0], run.work)
    arm_guards(model, run.discrete, run.step.start, run.work, run.guards)
    count_forces(model, run.discrete, run.guards.starts, run.tally, PER_CONTACT, model.ways)
    run.work.at_start = 1
    if model.soft == 1:
        let_begin(model, run.discrete)


@compiled
def forget_leaving(model: Record, run: Record) -> None:
    """Clears the marks of forces that have just reached their cones."""
    for i in range(model.num_fingers):
        for way in range(model.ways):
            run.selection.leaving[i, way] = 0


@compiled
def settle(model: Record, run: Record) -> int:
    """Selects phases for the current torque; returns a status."""
    verdict = spatial_select(model, run.discrete, run.step.start, run.work, run.selection)
    for _ in range(run.selection.restarts):
        warn(run, RESTARTS)
    if verdict == SELECTED:
        if model.soft == 1 and contacts_creep(run.work.torsion):
            warn_once(run, TORSION_SPLIT)
        return RUNNING
    run.concerned = run.selection.concerned
    if verdict == OPENS:
        return SEPARATED
    return PAINLEVE if verdict == NONE_REGULAR else INCONSISTENT


@compiled
def keep_old(model: Record, run: Record) -> None:
    """Stores the discrete state before a jump, with the slip directions at that instant."""
    copy_discrete(model, run.discrete, run.old)
    if model.soft == 1:
        for k in range(model.num_states):
            run.old_state.x[k] = run.step.start.x[k]
        return
    set_directions(model, run.discrete, run.step.start, run.old.directions)
    for i in range(model.num_fingers):
        for way in range(model.ways):
            run.old.frozen[i, way] = int(run.discrete.slips[i, way])


@compiled
def emit_old(model: Record, run: Record, outlet: Record) -> None:
    """Appends the row before a jump that has already happened."""
    if model.soft == 0:
        emit(model, run, outlet, run.old)
        return
    state, discrete = run.step.start, run.row.discrete
    swap_states(model, state, run.old_state)
    copy_discrete(model, run.old, discrete)
    emit(model, run, outlet, discrete)
    swap_states(model, state, run.old_state)


@compiled
def swap_states(model: Record, state: Record, other: Record) -> None:
    """Exchanges two states."""
    for k in range(model.num_states):
        value = state.x[k]
        state.x[k] = other.x[k]
        other.x[k] = value


@compiled
def _log_stops(model: Record, run: Record, outlet: Record) -> None:
    """Logs the stops of contacts that immediately slip in another direction, before their onset."""
    for i in range(model.num_fingers):
        if run.selection.stopped[i] == 1 and run.discrete.phases[i] != STICK:
            log_change(run, outlet, i, run.old.phases[i], STICK)
            run.old.phases[i] = STICK
            run.turns += 1
        run.selection.stopped[i] = 0


@compiled
def finish_jump(model: Record, run: Record, outlet: Record, status: int, before: bool) -> int:
    """Writes the rows before and after a jump, logs phase changes and restarts the flow."""
    if before:
        emit_old(model, run, outlet)
    if status != RUNNING:
        return status
    if model.soft == 1:
        _log_stops(model, run, outlet)
    chatters = log_changes(model, run, outlet)
    leave_slip(model, run, outlet, 0)
    emit(model, run, outlet, run.discrete)
    pass_output_times(model, run)
    restart(model, run)
    run.step_size = min(run.step_size, FIRST_STEP)
    return CHATTERING if chatters else RUNNING
