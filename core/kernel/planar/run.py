"""Everything that changes during a run, in records, so that it can be interrupted and resumed."""

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
from slipgrasp.core.kernel.planar.guards import GUARDS
from slipgrasp.core.kernel.planar.laws.composite import COMPOSITE_MEMORY
from slipgrasp.core.kernel.planar.laws.own_law import OWN_LAW
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.prediction import PREDICTION
from slipgrasp.core.kernel.planar.rows import MAX_COLUMNS, ROW, evaluate_row, fill_row
from slipgrasp.core.kernel.planar.selection import SELECTION_ROOM
from slipgrasp.core.kernel.planar.sensing import SENSES
from slipgrasp.core.kernel.planar.state import STATE, estimate_at
from slipgrasp.core.kernel.planar.stepper import STEP
from slipgrasp.core.kernel.planar.tally import TALLY, add_to_tally, begin_tally
from slipgrasp.core.kernel.planar.workspace import DISCRETE, WORKSPACE
from slipgrasp.core.scenario import MAX_CHATTER_CHANGES, MAX_DIAGNOSTICS, MAX_UNKNOWNS
from slipgrasp.core.scenario.table import TABLE

# Warnings, counted with their first time.
AMBIGUITIES, HOLDS, CLAMPED, SATURATED = range(4)

MAX_WAITING = 128
ROWS_PER_STEP = 10_001  # of the longest step at the highest rate of output
ROWS_BEFORE_PAUSE = 2048
CHANGE_CAPACITY = 512
ROOM_TO_SPARE = 16
TICKS_BEFORE_PAUSE = 2048
TICK_COLUMNS = 1 + 2 * MAX_FINGERS + MAX_UNKNOWNS + MAX_DIAGNOSTICS
MAX_SLIP_STATES = 108
ROW_CAPACITY = ROWS_BEFORE_PAUSE + ROWS_PER_STEP + 2 * MAX_SLIP_STATES + ROOM_TO_SPARE
OUTPUT_ROUNDING = 1e-12
FIRST_STEP = 5e-4


def slip_room(
    state: np.dtype[np.void],
    discrete: np.dtype[np.void],
    row: np.dtype[np.void],
    work: np.dtype[np.void],
) -> np.dtype[np.void]:
    """States in the beginning of a slip, of which some become rows (`slip_rows`)."""
    fields = [
        ("level", np.int64),  # they lie 2**level times closer than the output times; 0 for none
        ("next", np.int64),  # number of the next instant, at that distance from each other
        ("since", np.int64),  # rows in the outlet when they began
        ("phases", np.int64, (MAX_FINGERS,)),  # since then
        ("seen", np.int64, (MAX_FINGERS,)),  # rows of the present slip of each contact before
        ("added", np.int64),  # rows in the whole run
        ("count", np.int64),
        ("instants", np.int64, (MAX_SLIP_STATES,)),
        ("states", state, (MAX_SLIP_STATES,)),
        ("discrete", discrete, (MAX_SLIP_STATES,)),
        ("row", row),
        ("work", work),
    ]
    return np.dtype(fields, align=True)


SLIP_ROOM = slip_room(STATE, DISCRETE, ROW, WORKSPACE)

# Everything that changes during a run, but for the outlet.
PROGRESS = np.dtype(
    [
        ("step", STEP),  # its start is the present state
        ("before", STATE),  # just before a jump of the law that no time tells
        ("before_time", np.float64),  # [s]
        ("location_error", np.float64),  # of the step to the last event, over what is allowed
        ("discrete", DISCRETE),
        ("work", WORKSPACE),
        ("selection", SELECTION_ROOM),
        ("guards", GUARDS),
        ("row", ROW),  # the last one evaluated
        ("last_row", ROW),  # the last one counted, where rows are not kept
        ("slip", SLIP_ROOM),
        ("tally", TALLY),
        ("now", np.float64),  # simulation time [s]
        ("step_size", np.float64),  # to try next [s]
        ("rank", np.int64),  # of the method for the next step
        ("quiet_steps", np.int64),  # in a row, far within tolerance
        ("hold_until", np.float64),  # end of a recognition hold, inf if none [s]
        ("tick_origin", np.float64),  # time of tick 0 of sampled control [s]
        ("last_tick", np.float64),  # [s]
        ("last_event", np.float64),  # [s]
        ("ticks", np.int64),
        ("outputs", np.int64),  # output times served
        ("steps", np.int64),
        ("stalls", np.int64),  # events in a row without progress in time
        ("concerned", np.int64),  # contact or finger of the last event, -1 if none
        ("fired", np.int64),  # 1 where the present step ends at an event, 2 before a pole
        ("lost", np.int64),  # 1 once a row of the trace has a number that is not finite
        ("pace_time", np.float64),  # when the steps were last looked at for their size [s]
        ("pace_steps", np.int64),  # and how many there were
        ("begun", np.int64),  # 1 once the present stretch has begun
        ("num_changes", np.int64),  # in the buffer
        ("all_changes", np.int64),
        ("last_stick", np.float64),  # time of the last change to stick; -inf if none [s]
        ("warning_counts", np.int64, (4,)),
        ("warning_times", np.float64, (4,)),  # first of each [s]
        ("pending_rates", np.float64, (MAX_UNKNOWNS,)),  # of sampled control, for the next tick
        ("senses", SENSES),
        ("memory", COMPOSITE_MEMORY),
        ("own", OWN_LAW),
        ("prediction", PREDICTION),
        ("acting", np.int64),  # 1 once a torque of sampled control acts
        ("commanded", np.float64, (MAX_FINGERS, 2)),  # at this tick [N m]
        ("last_command", np.float64, (MAX_FINGERS, 2)),  # the one before [N m]
        ("first_waiting", np.int64),  # place of the oldest command that waits
        ("num_waiting", np.int64),
        ("due", np.float64, (MAX_WAITING,)),  # when they act [s]
        ("waiting", np.float64, (MAX_WAITING, MAX_FINGERS, 2)),  # [N m]
        ("old_torques", np.float64, (MAX_FINGERS, 2)),  # before the present jump
        ("old_commanded", np.float64, (MAX_FINGERS, 2)),
        ("old_diagnostics", np.float64, (MAX_DIAGNOSTICS,)),
        ("old_phases", np.int64, (MAX_FINGERS,)),
        ("old_beliefs", np.int64, (MAX_FINGERS,)),
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
        # Time, command, estimates and diagnostics of each, one after another.
        ("ticks", np.float64, ((TICKS_BEFORE_PAUSE + 1) * TICK_COLUMNS,)),
    ],
    align=True,
)


def make_run(table: Record, *, keeps_rows: bool) -> tuple[Record, Record]:
    """A run that has not begun, and empty buffers for it; see `begin_run`."""
    run = make_record(PROGRESS)
    # Memory that no row touches is never used.
    outlet = make_unset_record(OUTLET)
    call(begin_run, table, run, outlet, int(keeps_rows))
    return run, outlet


@compiled_apart(types.void, TABLE, PROGRESS, OUTLET, types.int64)
def begin_run(table: Record, run: Record, outlet: Record, keeps_rows: int) -> None:
    """Makes a run that has not begun: at its start, nothing held, no event yet.

    Args:
        table: The numbers of its scenario.
        run: The run, all zero.
        outlet: Buffers for rows and phase changes.
        keeps_rows: 1 where rows are stored, 0 where they only count in the tally.
    """
    run.hold_until = np.inf
    run.last_event = run.last_stick = -np.inf
    run.step_size = FIRST_STEP
    run.concerned = -1
    begin_tally(run.tally)
    state, n = run.step.start, int(table.fingers.count)
    for k in range(3):
        state.x[k] = table.trajectory.start[k]
    for k in range(int(table.estimates.count)):
        state.x[estimate_at(n, k)] = table.estimates.entries[k].initial
    outlet.keeps_rows = keeps_rows
    outlet.num_rows = outlet.num_ticks = 0
    for k in range(int(table.simulation.chatter_changes)):
        outlet.history[k] = -np.inf


def rows_in(outlet: Record, num_columns: int) -> Floats:
    """The rows in the buffer, ``(rows, num_columns)``, as a view."""
    count = int(outlet.num_rows)
    rows: Floats = outlet["rows"][: count * num_columns].reshape(count, num_columns)
    return rows


def settled_rows(run: Record, outlet: Record) -> int:
    """How many rows of the buffer never change: others may yet come between the rest."""
    return int(run.slip.since if run.slip.level > 0 else outlet.num_rows)


def take_rows(run: Record, outlet: Record, num_columns: int) -> Floats:
    """The settled rows, which leave the buffer."""
    count, rows = settled_rows(run, outlet), rows_in(outlet, num_columns)
    taken: Floats = rows[:count].copy()
    outlet.num_rows -= count
    run.slip.since -= count
    rows[: len(rows) - count] = rows[count:].copy()
    return taken


def ticks_in(outlet: Record, num_columns: int) -> Floats:
    """The ticks in the buffer, ``(ticks, num_columns)``, as a view."""
    count = int(outlet.num_ticks)
    ticks: Floats = outlet["ticks"][: count * num_columns].reshape(count, num_columns)
    return ticks


def last_row(model: Record, run: Record) -> Floats:
    """The last row of a run that keeps none, ``(1, num_columns)``."""
    row = run.last_row
    call(evaluate_row, model, row, run.work)
    call(fill_row, model, row, run.work)
    values: Floats = row.values[None, : row.length].copy()
    return values


@compiled
def warn(run: Record, code: int) -> None:
    """Counts a warning and keeps the time of the first."""
    if run.warning_counts[code] == 0:
        run.warning_times[code] = run.now
    run.warning_counts[code] += 1


@compiled_apart(types.int64, MODEL, PROGRESS, types.float64, STATE)
def evaluate_at(model: Record, run: Record, t: float, state: Record) -> int:
    """Evaluates ``state`` in the present phases into ``run.row``; 0 if not all is finite."""
    _set_row(model, t, state, run.discrete, run.row)
    return evaluate_row(model, run.row, run.work)


@compiled
def copy_discrete(model: Record, source: Record, target: Record) -> None:
    """Copies what stays fixed between two jumps."""
    for i in range(model.num_fingers):
        target.phases[i] = source.phases[i]
        target.beliefs[i] = source.beliefs[i]
        for joint in range(2):
            target.torques[i, joint] = source.torques[i, joint]
            target.commanded[i, joint] = source.commanded[i, joint]
    for k in range(model.num_diagnostics):
        target.diagnostics[k] = source.diagnostics[k]
    for k in range(model.num_unknowns):
        target.clamps[k] = source.clamps[k]
    target.added_grip = source.added_grip
    target.piece = source.piece


@compiled
def _set_row(model: Record, t: float, state: Record, discrete: Record, row: Record) -> None:
    row.time = t
    for k in range(model.num_states):
        row.state.x[k] = state.x[k]
    copy_discrete(model, discrete, row.discrete)


@compiled_apart(types.void, MODEL, PROGRESS, OUTLET)
def store_row(model: Record, run: Record, outlet: Record) -> None:
    """Appends the row just evaluated and counts it in the tally."""
    row = run.row
    if outlet.keeps_rows == 1:
        fill_row(model, row, run.work)
        start = outlet.num_rows * row.length
        for k in range(row.length):
            outlet.rows[start + k] = row.values[k]
        outlet.num_rows += 1
    else:
        _set_row(model, row.time, row.state, row.discrete, run.last_row)
    add_to_tally(model, row, run.work, run.tally)


@compiled_apart(types.void, MODEL, PROGRESS, OUTLET, types.float64, STATE, types.float64)
def emit_as_of(
    model: Record, run: Record, outlet: Record, t: float, state: Record, written: float
) -> None:
    """Appends a row for ``state`` at time ``t``, which it says is ``written``, a rounding beside.

    One that is not finite is dropped, and ends the run.
    """
    if evaluate_at(model, run, t, state) == 1:
        run.row.time = written
        store_row(model, run, outlet)
    else:
        run.lost = 1


@compiled
def emit(model: Record, run: Record, outlet: Record, t: float, state: Record) -> None:
    """Appends a row for ``state``; one that is not finite is dropped, and ends the run."""
    emit_as_of(model, run, outlet, t, state, t)


@compiled_apart(types.void, MODEL, PROGRESS, OUTLET)
def emit_before_jump(model: Record, run: Record, outlet: Record) -> None:
    """Appends a row for the last state before a jump of the law, as of the instant of the jump."""
    emit_as_of(model, run, outlet, run.before_time, run.before, run.now)


@compiled
def pass_output_times(model: Record, run: Record) -> None:
    """Marks output times up to now as served, where an event has written its own rows."""
    now = run.now + OUTPUT_ROUNDING
    while run.outputs / model.numerics.output_rate <= now:
        run.outputs += 1


@compiled
def keep_old(model: Record, run: Record) -> None:
    """Remembers what jumps with the torques, before it does, for the row before the jump."""
    for i in range(model.num_fingers):
        run.old_phases[i] = run.discrete.phases[i]
        run.old_beliefs[i] = run.discrete.beliefs[i]
        for joint in range(2):
            run.old_torques[i, joint] = run.discrete.torques[i, joint]
            run.old_commanded[i, joint] = run.discrete.commanded[i, joint]
    for k in range(model.num_diagnostics):
        run.old_diagnostics[k] = run.discrete.diagnostics[k]


@compiled
def exchange_old(model: Record, run: Record) -> None:
    """Exchanges what jumps with the torques with what is remembered."""
    for i in range(model.num_fingers):
        phase, belief = run.old_phases[i], run.old_beliefs[i]
        run.old_phases[i] = run.discrete.phases[i]
        run.old_beliefs[i] = run.discrete.beliefs[i]
        run.discrete.phases[i] = phase
        run.discrete.beliefs[i] = belief
        for joint in range(2):
            torque = run.old_torques[i, joint]
            run.old_torques[i, joint] = run.discrete.torques[i, joint]
            run.discrete.torques[i, joint] = torque
            commanded = run.old_commanded[i, joint]
            run.old_commanded[i, joint] = run.discrete.commanded[i, joint]
            run.discrete.commanded[i, joint] = commanded
    for k in range(model.num_diagnostics):
        value = run.old_diagnostics[k]
        run.old_diagnostics[k] = run.discrete.diagnostics[k]
        run.discrete.diagnostics[k] = value


@compiled
def log_changes(model: Record, run: Record, outlet: Record) -> bool:
    """Logs every contact whose phase differs from the remembered one.

    Returns:
        True if there have been too many changes in the chatter window; in one period of
        sampled control where that is shorter, for what the controller commands is no chatter.
    """
    now = run.now
    chatters = False
    window = model.numerics.chatter_window
    if model.law.period > 0.0:
        window = min(window, model.law.period)
    for i in range(model.num_fingers):
        before, after = run.old_phases[i], run.discrete.phases[i]
        if before == after:
            continue
        entry = run.num_changes
        outlet.changes[entry, 0], outlet.changes[entry, 1] = now, i
        outlet.changes[entry, 2], outlet.changes[entry, 3] = before, after
        run.num_changes += 1
        slot = run.all_changes % model.numerics.chatter_changes
        chatters = chatters or now - outlet.history[slot] < window
        outlet.history[slot] = now
        run.all_changes += 1
        if after == 0:
            run.last_stick = now
    return chatters


@compiled
def phases_changed(model: Record, run: Record) -> bool:
    """Whether any phase differs from the remembered one."""
    for i in range(model.num_fingers):
        if run.discrete.phases[i] != run.old_phases[i]:
            return True
    return False
