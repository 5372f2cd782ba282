"""What happens where something jumps in space: phases are selected, rows written, guards armed."""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.output import log_changes, pass_output_times
from slipgrasp.core.kernel.loop.progress import FIRST_STEP, RESTARTS, warn
from slipgrasp.core.kernel.loop.status import (
    CHATTERING,
    INCONSISTENT,
    PAINLEVE,
    RUNNING,
    SEPARATED,
)
from slipgrasp.core.kernel.loop.tally import count_forces
from slipgrasp.core.kernel.spatial.flow import set_derivative, set_directions
from slipgrasp.core.kernel.spatial.guards import PER_CONTACT, arm_guards
from slipgrasp.core.kernel.spatial.run import copy_discrete, emit, leave_slip
from slipgrasp.core.kernel.spatial.selection import NONE_REGULAR, OPENS, SELECTED, spatial_select


@compiled
def restart(model: Record, run: Record) -> None:
    """First slope in the present phases, whose evaluation is at hand; guards armed."""
    set_derivative(model, run.step.start, run.step.slopes[0], run.work)
    arm_guards(model, run.discrete, run.step.start, run.work, run.guards)
    count_forces(model, run.discrete, run.guards.starts, run.tally, PER_CONTACT, model.ways)
    run.work.at_start = 1


@compiled
def forget_leaving(model: Record, run: Record) -> None:
    """No force has just reached its cone."""
    for i in range(model.num_fingers):
        for way in range(model.ways):
            run.selection.leaving[i, way] = 0


@compiled
def settle(model: Record, run: Record) -> int:
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


@compiled
def keep_old(model: Record, run: Record) -> None:
    """Keeps what holds before a jump, directions of slips included: a selection may end them."""
    copy_discrete(model, run.discrete, run.old)
    set_directions(model, run.discrete, run.step.start, run.old.directions)
    for i in range(model.num_fingers):
        for way in range(model.ways):
            # Of a soft contact 2: it has that direction, and does not just begin to slip.
            run.old.frozen[i, way] = int(run.discrete.slips[i, way]) * (1 + model.soft)


@compiled
def finish_jump(model: Record, run: Record, outlet: Record, status: int, before: bool) -> int:
    """Writes the rows before and after, logs phase changes and prepares the flow that follows."""
    if before:
        emit(model, run, outlet, run.old)
    if status != RUNNING:
        return status
    chatters = log_changes(model, run, outlet)
    leave_slip(model, run, outlet, 0)
    emit(model, run, outlet, run.discrete)
    pass_output_times(model, run)
    restart(model, run)
    run.step_size = min(run.step_size, FIRST_STEP)
    return CHATTERING if chatters else RUNNING
