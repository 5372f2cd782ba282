"""Output of rows of the trace and of phase changes."""

from __future__ import annotations

from typing import Any

from numba import types

from slipgrasp.core.kernel.compilation.compiler import call, compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.loop.progress import OUTPUT_ROUNDING, Layouts


def make_output(
    layouts: Layouts, evaluate_row: Any, fill_row: Any, add_to_tally: Any, copy_discrete: Any
) -> tuple[Any, ...]:
    """Creates the output functions of one kind of hand.

    Args:
        layouts: Records of this kind of hand.
        evaluate_row: Evaluates the closed loop for the state in a row; 0 if it is not finite.
        fill_row: Writes the signals of an evaluated row.
        add_to_tally: Adds an evaluated row to the accumulators of the metrics.
        copy_discrete: Copies the discrete state.

    Returns:
        Functions that evaluate a state, store the evaluated row, write a row with another time,
        write such a row or end the run, write the current state, write the rows that are due, and,
        for Python, return the last row of a run without a trace.
    """
    prefix, model_type, state_type, discrete_type, run_type, outlet_type = layouts
    parts = model_type, run_type, outlet_type

    @compiled
    def _set_row(model: Record, t: float, state: Record, discrete: Record, row: Record) -> None:
        row.time = t
        for k in range(model.num_states):
            row.state.x[k] = state.x[k]
        copy_discrete(model, discrete, row.discrete)

    @compiled_apart(
        types.int64,
        *(model_type, run_type, discrete_type, types.float64, state_type),
        prefix=prefix,
    )
    def evaluate_at(model: Record, run: Record, discrete: Record, t: float, state: Record) -> int:
        """Evaluates ``state`` into ``run.row``; 0 if it is not finite."""
        _set_row(model, t, state, discrete, run.row)
        return evaluate_row(model, run.row, run.work)

    @compiled_apart(types.void, *parts, prefix=prefix)
    def store_row(model: Record, run: Record, outlet: Record) -> None:
        """Appends the evaluated row and adds it to the accumulators."""
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

    @compiled_apart(
        types.int64,
        *(*parts, discrete_type, types.float64, state_type, types.float64),
        prefix=prefix,
    )
    def emit_as_of(
        model: Record,
        run: Record,
        outlet: Record,
        discrete: Record,
        t: float,
        state: Record,
        written: float,
    ) -> int:
        """Appends a row for ``state`` at ``t`` with the time ``written``, equal within rounding.

        Returns:
            1, or 0 if the row is not finite and was dropped.
        """
        if evaluate_at(model, run, discrete, t, state) == 0:
            return 0
        run.row.time = written
        store_row(model, run, outlet)
        return 1

    @compiled
    def emit_or_end(
        model: Record,
        run: Record,
        outlet: Record,
        discrete: Record,
        t: float,
        state: Record,
        written: float,
    ) -> None:
        """As `emit_as_of`; a row that is not finite ends the run."""
        if emit_as_of(model, run, outlet, discrete, t, state, written) == 0:
            run.lost = 1

    @compiled
    def emit(model: Record, run: Record, outlet: Record, discrete: Record) -> None:
        """Appends a row for the current state and time."""
        emit_or_end(model, run, outlet, discrete, run.now, run.step.start, run.now)

    @compiled
    def emit_due(model: Record, run: Record, outlet: Record) -> None:
        """Writes the rows that are due at the current state.

        Called before the next step, while the evaluation of the state is still available.
        """
        while True:
            t = next_output(model, run)
            if t > run.now + OUTPUT_ROUNDING:
                return
            emit_or_end(model, run, outlet, run.discrete, run.now, run.step.start, t)
            run.outputs += 1

    def last_row(model: Record, run: Record) -> Floats:
        """Returns the last row of a run without a trace, ``(1, num_columns)``."""
        row = run.last_row
        call(evaluate_row, model, row, run.work)
        call(fill_row, model, row, run.work)
        values: Floats = row.values[None, : row.length].copy()
        return values

    return evaluate_at, store_row, emit_as_of, emit_or_end, emit, emit_due, last_row


@compiled
def next_output(model: Record, run: Record) -> float:
    """Time of the next row [s]."""
    return run.outputs / model.numerics.output_rate


@compiled
def pass_output_times(model: Record, run: Record) -> None:
    """Skips output times up to now, after an event has written its rows."""
    while next_output(model, run) <= run.now + OUTPUT_ROUNDING:
        run.outputs += 1


@compiled
def log_changes(model: Record, run: Record, outlet: Record) -> bool:
    """Logs every contact whose phase differs from the stored one.

    Returns:
        True if there were too many changes in the chatter window, or in one period of sampled
        control if that is shorter, because commanded changes are not chatter.
    """
    now = run.now
    chatters = False
    window = model.numerics.chatter_window
    if model.law.period > 0.0:
        window = min(window, model.law.period)
    for i in range(model.num_fingers):
        before, after = run.old.phases[i], run.discrete.phases[i]
        if before == after:
            continue
        slot = (run.all_changes - run.turns) % model.numerics.chatter_changes
        chatters = chatters or now - outlet.history[slot] < window
        outlet.history[slot] = now
        log_change(run, outlet, i, before, after)
    return chatters


@compiled
def log_change(run: Record, outlet: Record, i: int, before: int, after: int) -> None:
    """Logs the phase change of contact ``i``."""
    entry = run.num_changes
    outlet.changes[entry, 0], outlet.changes[entry, 1] = run.now, i
    outlet.changes[entry, 2], outlet.changes[entry, 3] = before, after
    run.num_changes += 1
    run.all_changes += 1
    if after == 0:
        run.last_stick = run.now


@compiled
def phases_changed(model: Record, run: Record) -> bool:
    """True if any phase differs from the stored one."""
    for i in range(model.num_fingers):
        if run.discrete.phases[i] != run.old.phases[i]:
            return True
    return False


def rows_in(outlet: Record, num_columns: int) -> Floats:
    """Rows in the buffer, ``(rows, num_columns)``, as a view."""
    count = int(outlet.num_rows)
    rows: Floats = outlet["rows"][: count * num_columns].reshape(count, num_columns)
    return rows


def settled_rows(run: Record, outlet: Record) -> int:
    """Number of final rows in the buffer; rows may still be inserted after these."""
    return int(run.slip.since if run.slip.level > 0 else outlet.num_rows)


def take_rows(run: Record, outlet: Record, num_columns: int) -> Floats:
    """Removes and returns the final rows."""
    count, rows = settled_rows(run, outlet), rows_in(outlet, num_columns)
    taken: Floats = rows[:count].copy()
    outlet.num_rows -= count
    run.slip.since -= count
    rows[: len(rows) - count] = rows[count:].copy()
    return taken


def ticks_in(outlet: Record, num_columns: int) -> Floats:
    """Ticks in the buffer, ``(ticks, num_columns)``, as a view."""
    count = int(outlet.num_ticks)
    ticks: Floats = outlet["ticks"][: count * num_columns].reshape(count, num_columns)
    return ticks
