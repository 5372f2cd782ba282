"""State of a planar run, its initialization, and its output."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import call, compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import (
    Record,
    make_record,
    make_unset_record,
)
from slipgrasp.core.kernel.loop.output import make_output
from slipgrasp.core.kernel.loop.progress import (
    FIRST_STEP,
    Layouts,
    outlet_layout,
    progress_layout,
    slip_states_layout,
)
from slipgrasp.core.kernel.loop.slip_rows import make_slip_rows
from slipgrasp.core.kernel.loop.stages import interpolate
from slipgrasp.core.kernel.loop.tally import begin_tally
from slipgrasp.core.kernel.planar.flow import forget_mechanics
from slipgrasp.core.kernel.planar.guards import GUARDS, friction_margin, is_past_event
from slipgrasp.core.kernel.planar.laws.composite import COMPOSITE_MEMORY
from slipgrasp.core.kernel.planar.laws.own_law import OWN_LAW
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.prediction import PREDICTION
from slipgrasp.core.kernel.planar.rows import AT, ROW, evaluate_row, fill_row
from slipgrasp.core.kernel.planar.selection import SELECTION_ROOM
from slipgrasp.core.kernel.planar.sensing import SENSES
from slipgrasp.core.kernel.planar.state import STATE, estimate_at
from slipgrasp.core.kernel.planar.stepper import STEP, prepare_interpolant
from slipgrasp.core.kernel.planar.tally import TALLY, add_to_tally
from slipgrasp.core.kernel.planar.workspace import DISCRETE, WORKSPACE
from slipgrasp.core.scenario.space import PLANAR
from slipgrasp.core.scenario.table import TABLE

PROGRESS = progress_layout(
    [
        ("step", STEP),
        ("before", STATE),  # just before a jump of the law at an unknown instant
        ("discrete", DISCRETE),
        ("old", DISCRETE),
        ("work", WORKSPACE),
        ("selection", SELECTION_ROOM),
        ("guards", GUARDS),
        ("row", ROW),  # the last one evaluated
        ("last_row", ROW),  # the last one counted, if rows are not stored
        ("slip", slip_states_layout(STATE, DISCRETE, ROW, WORKSPACE)),
        ("tally", TALLY),
        ("senses", SENSES),
        ("memory", COMPOSITE_MEMORY),
        ("own", OWN_LAW),
        ("prediction", PREDICTION),
    ],
    PLANAR.joints_per_finger,
)
OUTLET = outlet_layout(ROW, PLANAR.joints_per_finger)
LAYOUTS = Layouts("", MODEL, STATE, DISCRETE, PROGRESS, OUTLET)


def make_run(table: Record, *, keeps_rows: bool) -> tuple[Record, Record]:
    """Returns a run at its start and empty output buffers; see `begin_run`."""
    run = make_record(PROGRESS)
    # Left unset: the operating system does not allocate memory that is never written.
    outlet = make_unset_record(OUTLET)
    call(begin_run, table, run, outlet, int(keeps_rows))
    return run, outlet


@compiled_apart(types.void, TABLE, PROGRESS, OUTLET, types.int64)
def begin_run(table: Record, run: Record, outlet: Record, keeps_rows: int) -> None:
    """Initializes a run: start pose, initial estimates, no events.

    Args:
        table: Parameters of the scenario.
        run: The run, all zero.
        outlet: Buffers for rows and phase changes.
        keeps_rows: 1 if rows are stored, 0 if they are only added to the metrics.
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
    run.discrete.closing_force = table.controller.grip_force
    outlet.keeps_rows = keeps_rows
    outlet.num_rows = outlet.num_ticks = 0
    for k in range(int(table.simulation.chatter_changes)):
        outlet.history[k] = -np.inf


@compiled
def copy_discrete(model: Record, source: Record, target: Record) -> None:
    """Copies the state that is constant between jumps."""
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
    target.closing_force = source.closing_force
    target.piece = source.piece


evaluate_at, store_row, _, emit_or_end, emit, emit_due, last_row = make_output(
    LAYOUTS, evaluate_row, fill_row, add_to_tally, copy_discrete
)


@compiled
def emit_before_jump(model: Record, run: Record, outlet: Record) -> None:
    """Appends a row for the last state before a jump of the law, with the time of the jump."""
    emit_or_end(model, run, outlet, run.discrete, run.before_time, run.before, run.now)


@compiled
def keep_old(model: Record, run: Record) -> None:
    """Stores the discrete state before a jump, for the row before it."""
    copy_discrete(model, run.discrete, run.old)


@compiled
def _state_inside(model: Record, run: Record, h: float, fraction: float, state: Record) -> None:
    """Interpolates the state inside the step just taken."""
    # The constants may have changed since the previous slip.
    forget_mechanics(run.slip.work)
    prepare_interpolant(model, run.discrete, run.now, h, run.step, run.slip.work)
    interpolate(model, run.step, fraction, state)


follow_slip, leave_slip = make_slip_rows(
    LAYOUTS,
    sample=_state_inside,
    copy_discrete=copy_discrete,
    evaluate_row=evaluate_row,
    is_past_event=is_past_event,
    fill_row=fill_row,
    friction_margin=friction_margin,
    dissipated=AT.dissipated_energy,
)
