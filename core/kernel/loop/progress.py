"""Complete state of a run in records, so that it can be interrupted and resumed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Layout, Record
from slipgrasp.core.scenario import MAX_CHATTER_CHANGES, MAX_DIAGNOSTICS, MAX_UNKNOWNS

# Warnings with their counts and first times.
AMBIGUITIES, HOLDS, CLAMPED, SATURATED, FREE_ROTATION, RESTARTS, SOFTENED, TORSION_SPLIT = range(8)
NUM_WARNINGS = 8

MAX_WAITING = 128
ROWS_PER_STEP = 10_001  # of the longest step at the highest output rate
ROWS_BEFORE_PAUSE = 2048
CHANGE_CAPACITY = 512
ROOM_TO_SPARE = 16
TICKS_BEFORE_PAUSE = 2048
MAX_SLIP_STATES = 108
ROW_CAPACITY = ROWS_BEFORE_PAUSE + ROWS_PER_STEP + 2 * MAX_SLIP_STATES + ROOM_TO_SPARE
OUTPUT_ROUNDING = 1e-12
FIRST_STEP = 5e-4
AT_POLE = 2  # in ``fired``: the law commands unbounded forces


class Layouts(NamedTuple):
    """Records of one kind of hand, for compiling the units of its loop."""

    prefix: str  # of the symbols of these units
    model: Layout
    state: Layout
    discrete: Layout
    progress: Layout
    outlet: Layout


def slip_states_layout(state: Layout, discrete: Layout, row: Layout, work: Layout) -> Layout:
    """States at the start of a slip, for additional rows (`slip_rows`)."""
    fields = [
        ("level", np.int64),  # their spacing is 2**-level of the output interval; 0 for none
        ("next", np.int64),  # index of the next instant at that spacing
        ("since", np.int64),  # number of rows in the buffer when storing began
        ("phases", np.int64, (MAX_FINGERS,)),  # in that time
        ("seen", np.int64, (MAX_FINGERS,)),  # earlier rows of the current slip, per contact
        ("added", np.int64),  # rows in the whole run
        ("count", np.int64),
        ("instants", np.int64, (MAX_SLIP_STATES,)),
        ("states", state, (MAX_SLIP_STATES,)),
        ("discrete", discrete, (MAX_SLIP_STATES,)),
        ("row", row),
        ("work", work),
    ]
    return np.dtype(fields, align=True)


def progress_layout(parts: Sequence[tuple[str, Layout]], num_joints: int) -> Layout:
    """Layout of the complete state of a run, without the output buffers.

    Args:
        parts: Records of the kind of hand by name: ``step``, whose start is the current state,
            ``discrete``, ``old``, the discrete state before the current jump, and others.
        num_joints: Number of joints of a finger.
    """
    fields = [
        ("now", np.float64),  # simulation time [s]
        ("step_size", np.float64),  # to try next [s]
        ("rank", np.int64),  # of the method for the next step
        ("quiet_steps", np.int64),  # consecutive steps far within tolerance
        ("hold_until", np.float64),  # end of a recognition hold, inf if none [s]
        ("tick_origin", np.float64),  # time of tick 0 of sampled control [s]
        ("last_tick", np.float64),  # [s]
        ("last_event", np.float64),  # [s]
        ("before_time", np.float64),  # just before a jump of the law at an unknown time [s]
        ("location_error", np.float64),  # relative error of the step to the last event
        ("ticks", np.int64),
        ("outputs", np.int64),  # number of output times passed
        ("steps", np.int64),
        ("stalls", np.int64),  # consecutive events without progress in time
        ("concerned", np.int64),  # contact or finger of the last event, -1 if none
        ("fired", np.int64),  # 1 if the current step ends at an event, 2 before a pole
        ("lost", np.int64),  # 1 after a row of the trace had a number that is not finite
        ("pace_time", np.float64),  # time of the last check of step sizes [s]
        ("pace_steps", np.int64),  # and number of steps then
        ("begun", np.int64),  # 1 after the start of the current segment
        ("num_changes", np.int64),  # in the buffer
        ("all_changes", np.int64),
        ("turns", np.int64),  # stops followed by slip in another direction
        ("last_stick", np.float64),  # time of the last change to stick; -inf if none [s]
        ("warning_counts", np.int64, (NUM_WARNINGS,)),
        ("warning_times", np.float64, (NUM_WARNINGS,)),  # first of each [s]
        ("pending_rates", np.float64, (MAX_UNKNOWNS,)),  # of sampled control, for the next tick
        ("acting", np.int64),  # 1 after the first torque of sampled control acts
        ("given", np.float64, (MAX_FINGERS, num_joints)),  # last command, limited
        ("first_waiting", np.int64),  # index of the oldest waiting command
        ("num_waiting", np.int64),
        ("due", np.float64, (MAX_WAITING,)),  # when they act [s]
        ("waiting", np.float64, (MAX_WAITING, MAX_FINGERS, num_joints)),  # [N m]
    ]
    return np.dtype([*parts, *fields], align=True)


def tick_columns(num_joints: int) -> int:
    """Number of values of the longest tick: time, command, estimates and diagnostics."""
    return 1 + num_joints * MAX_FINGERS + MAX_UNKNOWNS + MAX_DIAGNOSTICS


def outlet_layout(row: Layout, num_joints: int) -> Layout:
    """Layout of the output buffers of a run; the caller empties them.

    Args:
        row: Layout of a row.
        num_joints: Number of joints of a finger.
    """
    fields = [
        ("keeps_rows", np.int64),  # 0: rows are only accumulated
        ("num_rows", np.int64),
        ("changes", np.float64, (CHANGE_CAPACITY, 4)),  # time, contact, from, to
        ("history", np.float64, (MAX_CHATTER_CHANGES,)),  # times of the latest phase changes [s]
        # Rows of the trace, contiguous.
        ("rows", np.float64, (ROW_CAPACITY * row["values"].shape[0],)),
        ("num_ticks", np.int64),
        # Ticks, contiguous.
        ("ticks", np.float64, ((TICKS_BEFORE_PAUSE + 1) * tick_columns(num_joints),)),
    ]
    return np.dtype(fields, align=True)


@compiled
def warn(run: Record, code: int) -> None:
    """Counts a warning and stores its first time."""
    if run.warning_counts[code] == 0:
        run.warning_times[code] = run.now
    run.warning_counts[code] += 1


@compiled
def warn_once(run: Record, code: int) -> None:
    """Stores a warning of a lasting condition once, with its start time."""
    if run.warning_counts[code] == 0:
        warn(run, code)
