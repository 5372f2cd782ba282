"""Everything that changes during a run, in arrays, so that it can be interrupted and resumed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from core.kernel.compiler import compiled
from core.kernel.flow import DISCRETE, WORKSPACE
from core.kernel.guards import MAX_GUARDS
from core.kernel.records import (
    MAX_FINGERS,
    MAX_STATE,
    MAX_UNKNOWNS,
    Floats,
    Record,
    make_record,
)
from core.kernel.rows import write_row
from core.kernel.selection import SELECTION_ROOM
from core.kernel.stepper import STEP

# Warnings, counted with their first time.
AMBIGUITIES, HOLDS, CLAMPED = range(3)

ROWS_BEFORE_PAUSE = 512
CHANGE_CAPACITY = 512
ROOM_TO_SPARE = 16
OUTPUT_ROUNDING = 1e-12
FIRST_STEP = 1e-4


# Everything that changes during a run, but for the outlet.
PROGRESS = np.dtype(
    [
        ("step", STEP),  # its start is the present state
        ("discrete", DISCRETE),
        ("work", WORKSPACE),
        ("selection", SELECTION_ROOM),
        ("guards", np.float64, (MAX_GUARDS,)),
        ("levels", np.float64, (MAX_GUARDS,)),
        ("fired", np.int64, (MAX_GUARDS,)),
        ("now", np.float64),  # simulation time [s]
        ("step_size", np.float64),  # to try next [s]
        ("hold_until", np.float64),  # end of a recognition hold, inf if none [s]
        ("tick_origin", np.float64),  # time of tick 0 of sampled control [s]
        ("last_tick", np.float64),  # [s]
        ("last_energy", np.float64),  # of the last row written [J]
        ("last_event", np.float64),  # [s]
        ("ticks", np.int64),
        ("outputs", np.int64),  # outlet times served
        ("steps", np.int64),
        ("stalls", np.int64),  # events in a row without progress in time
        ("concerned", np.int64),  # contact or finger of the last event, -1 if none
        ("begun", np.bool_),  # whether the present stretch has begun
        ("num_rows", np.int64),  # in the buffer
        ("num_changes", np.int64),  # in the buffer
        ("all_changes", np.int64),
        ("warning_counts", np.int64, (3,)),
        ("warning_times", np.float64, (3,)),  # first of each [s]
        ("pending_rates", np.float64, (MAX_UNKNOWNS,)),  # of sampled control, for the next tick
        ("old_torques", np.float64, (MAX_FINGERS, 2)),  # before the present jump
        ("old_phases", np.int64, (MAX_FINGERS,)),
        ("old_beliefs", np.int64, (MAX_FINGERS,)),
        ("scratch", np.float64, (MAX_STATE,)),
        ("derivative", np.float64, (MAX_STATE,)),
        ("torques", np.float64, (MAX_FINGERS, 2)),
    ],
    align=True,
)


class Outlet(NamedTuple):
    """What a run writes for the caller to take away."""

    rows: Floats  # (capacity, columns) of the trace
    changes: Floats  # (CHANGE_CAPACITY, 4) time, contact, from, to
    history: Floats  # times of the latest phase changes, for the chatter window


def make_progress() -> Record:
    """A run that has not begun: everything zero, nothing held, no event yet."""
    progress = make_record(PROGRESS)
    progress.hold_until = np.inf
    progress.last_event = -np.inf
    progress.step_size = FIRST_STEP
    progress.concerned = -1
    return progress


def make_outlet(num_columns: int, rows_per_step: int, chatter_changes: int) -> Outlet:
    """Empty buffers.

    Args:
        num_columns: Of a row.
        rows_per_step: How many output times one step can pass at most.
        chatter_changes: Length of the history of phase changes.
    """
    capacity = ROWS_BEFORE_PAUSE + rows_per_step + ROOM_TO_SPARE
    return Outlet(
        rows=np.zeros((capacity, num_columns)),
        changes=np.zeros((CHANGE_CAPACITY, 4)),
        history=np.full(chatter_changes, -np.inf),
    )


@compiled
def warn(run: Record, code: int) -> None:
    """Counts a warning and keeps the time of the first."""
    if run.warning_counts[code] == 0:
        run.warning_times[code] = run.now
    run.warning_counts[code] += 1


@compiled
def emit(model: Record, run: Record, outlet: Outlet, t: float, state: Floats) -> None:
    """Appends a row for ``state``; a row that is not finite is dropped."""
    row = outlet.rows[run.num_rows]
    if write_row(model, run.discrete, t, state, run.derivative, run.torques, run.work, row):
        run.num_rows += 1
        run.last_energy = row[row.shape[0] - 4] + row[row.shape[0] - 3]


@compiled
def pass_output_times(model: Record, run: Record) -> None:
    """Marks outlet times up to now as served, where an event has written its own rows."""
    now = run.now + OUTPUT_ROUNDING
    while run.outputs / model.numerics.output_rate <= now:
        run.outputs += 1


@compiled
def keep_old(run: Record) -> None:
    """Remembers phases, belief and torques before a jump, for the row before it."""
    run.old_phases[:] = run.discrete.phases
    run.old_beliefs[:] = run.discrete.beliefs
    run.old_torques[:, :] = run.discrete.torques


@compiled
def exchange_old(model: Record, run: Record) -> None:
    """Exchanges the present phases, belief and torques with the remembered ones."""
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


@compiled
def log_changes(model: Record, run: Record, outlet: Outlet) -> bool:
    """Logs every contact whose phase differs from the remembered one.

    Returns:
        True if there have been too many changes in the chatter window.
    """
    now = run.now
    chatters = False
    for i in range(model.num_fingers):
        if run.discrete.phases[i] == run.old_phases[i]:
            continue
        entry = outlet.changes[run.num_changes]
        entry[0], entry[1] = now, i
        entry[2], entry[3] = run.old_phases[i], run.discrete.phases[i]
        run.num_changes += 1
        slot = run.all_changes % outlet.history.shape[0]
        chatters = chatters or now - outlet.history[slot] < model.numerics.chatter_window
        outlet.history[slot] = now
        run.all_changes += 1
    return chatters


@compiled
def phases_changed(model: Record, run: Record) -> bool:
    """Whether any phase differs from the remembered one."""
    for i in range(model.num_fingers):
        if run.discrete.phases[i] != run.old_phases[i]:
            return True
    return False
