"""Everything that changes during a run in space, in records, so that it can be interrupted."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import call, compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import (
    MAX_FINGERS,
    Floats,
    Record,
    make_record,
    make_unset_record,
)
from slipgrasp.core.kernel.planar.run import (
    CHANGE_CAPACITY,
    FIRST_STEP,
    MAX_SLIP_STATES,
    MAX_WAITING,
    ROOM_TO_SPARE,
    ROWS_PER_STEP,
    slip_room,
)
from slipgrasp.core.kernel.spatial.guards import GUARDS
from slipgrasp.core.kernel.spatial.learning import MEMORY
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.own_law import OWN_LAW
from slipgrasp.core.kernel.spatial.prediction import PREDICTION
from slipgrasp.core.kernel.spatial.rows import (
    MAX_COLUMNS,
    ROW,
    spatial_evaluate,
    spatial_fill,
)
from slipgrasp.core.kernel.spatial.selection import SELECTION_ROOM, normalise
from slipgrasp.core.kernel.spatial.sensing import SENSES
from slipgrasp.core.kernel.spatial.state import STATE, parts_of
from slipgrasp.core.kernel.spatial.stepper import STEP
from slipgrasp.core.kernel.spatial.tally import TALLY, spatial_tally
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, WORKSPACE
from slipgrasp.core.scenario import MAX_CHATTER_CHANGES, MAX_DIAGNOSTICS, MAX_UNKNOWNS
from slipgrasp.core.scenario.spatial import SpatialScenario

ROWS_BEFORE_PAUSE = 2048
TICKS_BEFORE_PAUSE = 2048
ROW_CAPACITY = ROWS_BEFORE_PAUSE + ROWS_PER_STEP + 2 * MAX_SLIP_STATES + ROOM_TO_SPARE
TICK_COLUMNS = 1 + 3 * MAX_FINGERS + MAX_UNKNOWNS + MAX_DIAGNOSTICS

# Everything that changes during a run, but for the outlet.
PROGRESS = np.dtype(
    [
        ("step", STEP),  # its start is the present state
        ("discrete", DISCRETE),
        ("old", DISCRETE),  # before the present jump
        ("work", WORKSPACE),
        ("selection", SELECTION_ROOM),
        ("guards", GUARDS),
        ("row", ROW),  # the last one evaluated
        ("tally", TALLY),
        ("slip", slip_room(STATE, DISCRETE, ROW, WORKSPACE)),
        ("senses", SENSES),
        ("memory", MEMORY),
        ("own", OWN_LAW),
        ("prediction", PREDICTION),
        ("now", np.float64),  # simulation time [s]
        ("step_size", np.float64),  # to try next [s]
        ("rank", np.int64),  # of the method for the next step
        ("quiet_steps", np.int64),  # in a row, far within tolerance
        ("tick_origin", np.float64),  # time of tick 0 [s]
        ("last_tick", np.float64),  # [s]
        ("last_event", np.float64),  # [s]
        ("ticks", np.int64),
        ("outputs", np.int64),  # output times served
        ("steps", np.int64),
        ("stalls", np.int64),  # events in a row without progress in time
        ("concerned", np.int64),  # contact or finger of the last event, -1 if none
        ("fired", np.int64),  # 1 where the present step ends at an event
        ("lost", np.int64),  # 1 once a row of the trace has a number that is not finite
        ("pace_time", np.float64),  # when the steps were last looked at for their size [s]
        ("pace_steps", np.int64),  # and how many there were
        ("begun", np.int64),  # 1 once the present stretch has begun
        ("num_changes", np.int64),  # in the buffer
        ("all_changes", np.int64),
        ("last_stick", np.float64),  # time of the last change to stick; -inf if none [s]
        ("warning_counts", np.int64, (7,)),
        ("warning_times", np.float64, (7,)),  # first of each [s]
        ("pending_rates", np.float64, (MAX_UNKNOWNS,)),  # for the next tick
        ("acting", np.int64),  # 1 once a torque acts
        ("given", np.float64, (MAX_FINGERS, 3)),  # of the last command, by the joints [N m]
        ("first_waiting", np.int64),  # place of the oldest command that waits
        ("num_waiting", np.int64),
        ("due", np.float64, (MAX_WAITING,)),  # when they act [s]
        ("waiting", np.float64, (MAX_WAITING, MAX_FINGERS, 3)),  # [N m]
        ("old_phases", np.int64, (MAX_FINGERS,)),
    ],
    align=True,
)

# What a run writes for the caller to take away.
OUTLET = np.dtype(
    [
        ("keeps_rows", np.int64),  # 0: rows only count in the tally
        ("num_rows", np.int64),
        ("changes", np.float64, (CHANGE_CAPACITY, 4)),  # time, contact, from, to
        ("history", np.float64, (MAX_CHATTER_CHANGES,)),  # times of the latest phase changes [s]
        ("rows", np.float64, (ROW_CAPACITY * MAX_COLUMNS,)),  # of the trace, one after another
        ("num_ticks", np.int64),
        ("ticks", np.float64, ((TICKS_BEFORE_PAUSE + 1) * TICK_COLUMNS,)),
    ],
    align=True,
)


def make_run(scenario: SpatialScenario, *, keeps_rows: bool) -> tuple[Record, Record]:
    """A run that has not begun, and empty buffers for it."""
    run, outlet = make_record(PROGRESS), make_unset_record(OUTLET)
    run.last_event = run.last_stick = -np.inf
    run.step_size = FIRST_STEP
    run.concerned = -1
    run.tally.last_slip = -np.inf
    run.tally.least_margin[:] = run.tally.row_margin[:] = np.inf
    parts_of(run.step.start, len(scenario.fingers)).pose[:] = scenario.trajectory.start
    call(spatial_normalise, run.step.start)
    for k, estimate in enumerate(scenario.estimates):
        run.discrete.estimates[k] = estimate.initial
    outlet.keeps_rows = int(keeps_rows)
    outlet.num_rows = outlet.num_ticks = 0
    outlet["history"][: scenario.simulation.chatter_changes] = -np.inf
    return run, outlet


@compiled_apart(types.void, STATE)
def spatial_normalise(state: Record) -> None:
    """Gives the attitude its length 1."""
    normalise(state)


def last_row(model: Record, run: Record) -> Floats:
    """The last row of a run that keeps none, ``(1, num_columns)``."""
    call(spatial_evaluate, model, run.row, run.work)
    call(spatial_fill, model, run.row, run.work)
    values: Floats = run.row.values[None, : run.row.length].copy()
    return values


@compiled
def copy_discrete(model: Record, source: Record, target: Record) -> None:
    """Copies all of what stays fixed between two jumps."""
    for i in range(model.num_fingers):
        target.phases[i], target.beliefs[i] = source.phases[i], source.beliefs[i]
        for axis in range(2):
            target.frozen[i, axis] = source.frozen[i, axis]
            target.slips[i, axis] = source.slips[i, axis]
            target.directions[i, axis] = source.directions[i, axis]
        for joint in range(3):
            target.torques[i, joint] = source.torques[i, joint]
            target.commanded[i, joint] = source.commanded[i, joint]
    for k in range(model.num_unknowns):
        target.estimates[k] = source.estimates[k]
    target.violation, target.piece = source.violation, source.piece
    target.added_grip = source.added_grip
    for k in range(model.num_diagnostics):
        target.diagnostics[k] = source.diagnostics[k]


@compiled
def next_output(model: Record, run: Record) -> float:
    """When the next row is due [s]."""
    return run.outputs / model.numerics.output_rate


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET, DISCRETE, types.float64, STATE, types.float64)
def spatial_emit_as_of(
    model: Record,
    run: Record,
    outlet: Record,
    discrete: Record,
    t: float,
    state: Record,
    written: float,
) -> int:
    """Appends a row for ``state`` at time ``t``, which it says is ``written``, a rounding beside.

    Returns:
        0 where the row is not finite and is dropped.
    """
    row = run.row
    row.time = t
    for k in range(model.num_states):
        row.state.x[k] = state.x[k]
    copy_discrete(model, discrete, row.discrete)
    if spatial_evaluate(model, row, run.work) == 0:
        return 0
    row.time = written
    if outlet.keeps_rows == 1:
        spatial_fill(model, row, run.work)
        first = outlet.num_rows * row.length
        for k in range(row.length):
            outlet.rows[first + k] = row.values[k]
        outlet.num_rows += 1
    spatial_tally(model, row, run.work, run.tally)
    return 1


@compiled
def emit_due(model: Record, run: Record, outlet: Record, discrete: Record, written: float) -> None:
    """Appends a row for the present state; one that is not finite is dropped, and ends the run."""
    if spatial_emit_as_of(model, run, outlet, discrete, run.now, run.step.start, written) == 0:
        run.lost = 1


@compiled
def spatial_emit(model: Record, run: Record, outlet: Record, discrete: Record) -> None:
    """Appends a row for the present state, as of now."""
    run.work.at_start = 0
    emit_due(model, run, outlet, discrete, run.now)


@compiled
def store_tick(model: Record, run: Record, outlet: Record) -> None:
    """Appends what the law answered: with it the run can be made again without the law."""
    if outlet.keeps_rows == 0:
        return
    n, p, discrete = model.num_fingers, model.num_unknowns, run.discrete
    at = outlet.num_ticks * (1 + 3 * n + p + model.num_diagnostics)
    outlet.ticks[at] = run.now
    at += 1
    for i in range(n):
        for joint in range(3):
            outlet.ticks[at + 3 * i + joint] = discrete.commanded[i, joint]
    at += 3 * n
    for k in range(p):
        told = model.law.facts.is_own
        outlet.ticks[at + k] = run.own.answer.estimates[k] if told else discrete.estimates[k]
    for k in range(model.num_diagnostics):
        outlet.ticks[at + p + k] = discrete.diagnostics[k]
    outlet.num_ticks += 1
