"""Additional rows inside a slip, so that short slips are resolved as well as long ones.

The duration of a slip is known only at its end. Until then, states are stored at a spacing that
starts at a small fraction of the output interval. Whenever there are too many, every other state is
dropped; at the end, the missing rows are made from the stored states. The states are interpolated
and evaluated separately: the run and its integrals do not depend on them.
"""

from __future__ import annotations

from typing import Any

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.progress import OUTPUT_ROUNDING, Layouts
from slipgrasp.core.kernel.loop.rows import Columns, column_of
from slipgrasp.core.kernel.loop.tally import count_row_forces

LEAST_ROWS = 49  # per slip, in addition to its first row
LEAST_DISTANCE = 1e-6  # between two instants [s]
GIVEN_BACK = 1e-10  # [J]
MAX_ADDED_ROWS = 5000  # per run: a run with chatter has an unlimited number of slips


def make_slip_rows(
    layouts: Layouts,
    *,
    sample: Any,
    copy_discrete: Any,
    evaluate_row: Any,
    is_past_event: Any,
    fill_row: Any,
    friction_margin: Any,
    dissipated: Columns,
) -> tuple[Any, Any]:
    """Creates the storage of states during slip and the output of their rows.

    Args:
        layouts: Records of the kind of hand.
        sample: Computes the state at a fraction of the last step.
        copy_discrete: Copies the discrete state.
        evaluate_row: Evaluates a row; 0 if it is not finite.
        is_past_event: Returns 1 if any guard is past its level.
        fill_row: Writes the signals of an evaluated row.
        friction_margin: Returns the friction margin of a contact [N].
        dissipated: Column of the dissipated energy in a row.
    """
    records = layouts.model, layouts.progress, layouts.outlet

    @compiled
    def _evaluate(model: Record, run: Record, row: Record) -> int:
        """Fills a row for its state; 0 if the state is not finite or past an event."""
        work = run.slip.work
        if evaluate_row(model, row, work) == 0:
            return 0
        if is_past_event(model, row.discrete, row.state, work, run.guards) == 1:
            return 0
        fill_row(model, row, work)
        count_row_forces(model, row, work, run.tally, friction_margin)
        return 1

    @compiled_apart(types.void, *records, types.float64, prefix=layouts.prefix)
    def follow_slip(model: Record, run: Record, outlet: Record, h: float) -> None:
        """Stores states inside the last step while a contact starts to slip."""
        _follow(model, run, outlet, h, sample, copy_discrete)

    @compiled_apart(types.void, *records, types.int64, prefix=layouts.prefix)
    def leave_slip(model: Record, run: Record, outlet: Record, at_end: int) -> None:
        """Writes the missing rows of a slip, at a phase change or the end of the segment."""
        column = column_of(model, dissipated)
        _leave(model, run, outlet, at_end, column, _evaluate, copy_discrete)

    return follow_slip, leave_slip


@compiled
def _follow(model: Record, run: Record, outlet: Record, h: float, sample: Any, copy: Any) -> None:
    """Stores states inside the last step, with ``sample`` and ``copy`` of the kind of hand."""
    slip, rate = run.slip, model.numerics.output_rate
    if outlet.keeps_rows == 0 or (slip.level == 0 and not _begin(model, run, outlet)):
        return
    wanted, rows = _wanted_rows(model, slip), outlet.num_rows - slip.since
    if rows >= wanted:
        _let_go(model, slip)
    # If twice the spacing gives enough states in this step, the states between are not needed.
    while slip.level > 0 and h * rate * (1 << (slip.level - 1)) > wanted:
        _drop_every_other(model, slip, copy)
    while slip.level > 0:
        parts = 1 << slip.level
        t = slip.next / (rate * parts)
        if t >= run.now + h - OUTPUT_ROUNDING:
            return
        if slip.next % parts != 0:
            k = slip.count
            sample(model, run, h, (t - run.now) / h, slip.states[k])
            copy(model, run.discrete, slip.discrete[k])
            slip.instants[k] = slip.next
            slip.count = k + 1
        slip.next += 1
        if slip.count + rows > 2 * wanted:
            _drop_every_other(model, slip, copy)


@compiled
def _wanted_rows(model: Record, slip: Record) -> int:
    """Number of rows that the current slips need from the first stored state on."""
    seen = LEAST_ROWS
    for i in range(model.num_fingers):
        if slip.phases[i] != 0:
            seen = min(seen, slip.seen[i])
    return LEAST_ROWS - seen


@compiled
def _begin(model: Record, run: Record, outlet: Record) -> bool:
    """Starts storing states if a slipping contact has too few rows."""
    slip, is_due = run.slip, False
    for i in range(model.num_fingers):
        slip.phases[i] = run.discrete.phases[i]
        is_due = is_due or (slip.phases[i] != 0 and slip.seen[i] < LEAST_ROWS)
    rate = model.numerics.output_rate
    if not is_due or slip.added >= MAX_ADDED_ROWS or 2.0 * rate * LEAST_DISTANCE > 1.0:
        return False
    slip.level, slip.count, slip.since = 1, 0, outlet.num_rows
    # Rows at output times inside the last step already exist.
    length = run.row.length
    while slip.since > 0 and outlet.rows[(slip.since - 1) * length] > run.now:
        slip.since -= 1
    while rate * (2 << slip.level) * LEAST_DISTANCE <= 1.0:
        slip.level += 1
    slip.next = int(run.now * rate * (1 << slip.level)) + 1
    return True


@compiled
def _drop_every_other(model: Record, slip: Record, copy: Any) -> None:
    """Doubles the spacing; stops storing at the spacing of the output times."""
    count = 0
    for k in range(slip.count):
        if slip.instants[k] % 2 == 0:
            slip.instants[count] = slip.instants[k] // 2
            for j in range(model.num_states):
                slip.states[count].x[j] = slip.states[k].x[j]
            copy(model, slip.discrete[k], slip.discrete[count])
            count += 1
    slip.count, slip.next = count, (slip.next + 1) // 2
    slip.level -= 1
    if slip.level == 0:
        _let_go(model, slip)


@compiled
def _let_go(model: Record, slip: Record) -> None:
    """Stops storing states of slips in progress."""
    slip.level = slip.count = 0
    for i in range(model.num_fingers):
        slip.seen[i] = LEAST_ROWS


@compiled
def _leave(
    model: Record,
    run: Record,
    outlet: Record,
    at_end: int,
    lost: int,
    evaluate: Any,
    copy: Any,
) -> None:
    """Writes the missing rows of slips: all for a slip that ends, half for one in progress.

    Args:
        model: Constants of the run.
        run: The run.
        outlet: Output buffers.
        at_end: 1 at the end of the segment.
        lost: Column of the energy dissipated by friction.
        evaluate: Fills a row of the run; returns 1 on success.
        copy: Copies the discrete state.
    """
    slip, n = run.slip, model.num_fingers
    if slip.level > 0:
        wanted, rows, is_over = 0, outlet.num_rows - slip.since, at_end == 1
        for i in range(n):
            goes_on = at_end == 0 and run.discrete.phases[i] == slip.phases[i]
            is_over = is_over or not goes_on
            if slip.phases[i] != 0:
                least = LEAST_ROWS // 2 if goes_on else LEAST_ROWS
                wanted = max(wanted, least - slip.seen[i] - rows)
        if not is_over:
            return
        rows += _add_rows(model, run, outlet, min(wanted, slip.count), lost, evaluate, copy)
        for i in range(n):
            slip.seen[i] += rows
        slip.level = slip.count = 0
    for i in range(n):
        if run.discrete.phases[i] == 0 or run.discrete.phases[i] != slip.phases[i]:
            slip.seen[i] = 0


@compiled
def _add_rows(
    model: Record,
    run: Record,
    outlet: Record,
    wanted: int,
    lost: int,
    evaluate: Any,
    copy: Any,
) -> int:
    """Evaluates evenly selected states as rows; returns the number of new rows."""
    slip, row, added = run.slip, run.slip.row, 0
    rate = model.numerics.output_rate * (1 << slip.level)
    for k in range(slip.count):
        if (k + 1) * wanted // slip.count == k * wanted // slip.count:
            continue
        row.time = slip.instants[k] / rate
        for j in range(model.num_states):
            row.state.x[j] = slip.states[k].x[j]
        copy(model, slip.discrete[k], row.discrete)
        if evaluate(model, run, row) == 1:
            added += _insert(outlet, slip.since, row, lost)
    slip.added += added
    return added


@compiled
def _insert(outlet: Record, first: int, row: Record, lost: int) -> int:
    """Inserts a row among the latest ones by its time, the first column.

    Rejects rows after the last one, because the run ends before them, and rows with decreasing
    dissipated energy (column ``lost``), an error of the interpolant at kinks of the law.

    Returns:
        Number of inserted rows: 1 or 0.
    """
    rows, length, place = outlet.rows, row.length, outlet.num_rows
    while place > first and rows[(place - 1) * length] > row.time:
        place -= 1
    if place == outlet.num_rows:
        return 0
    if place > 0 and row.values[lost] < rows[(place - 1) * length + lost] - GIVEN_BACK:
        return 0
    if rows[place * length + lost] < row.values[lost] - GIVEN_BACK:
        return 0
    for k in range(outlet.num_rows * length - 1, place * length - 1, -1):
        rows[k + length] = rows[k]
    for k in range(length):
        rows[place * length + k] = row.values[k]
    outlet.num_rows += 1
    return 1
