"""The hybrid loop in resumable chunks: flow, detect, locate, jump."""

from __future__ import annotations

from typing import Any

from numba import types

from slipgrasp.core.kernel.compilation.compiler import call, compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.laws.own_law import ASKED
from slipgrasp.core.kernel.loop.progress import (
    AT_POLE,
    CHANGE_CAPACITY,
    ROOM_TO_SPARE,
    ROWS_BEFORE_PAUSE,
    TICKS_BEFORE_PAUSE,
    Layouts,
)
from slipgrasp.core.kernel.loop.status import (
    MAX_STEPS,
    NOT_FINITE,
    REACHED,
    RUNNING,
    STEP_UNDERFLOW,
    STIFF,
    UNBOUNDED_FORCE,
)
from slipgrasp.core.kernel.numerics.methods import method_of

STALLED, MAX_STALLS = 1e-9, 20


def make_advance(
    layouts: Layouts,
    *,
    emit: Any,
    emit_end: Any,
    emit_due: Any,
    begin: Any,
    next_stop: Any,
    pass_instant: Any,
    take_step: Any,
    cut: Any,
    count_step: Any,
    emit_inside: Any,
    follow_slip: Any,
    leave_slip: Any,
    pass_event: Any,
    finish_step: Any,
    pace_steps: int,
    least_pace: float,
) -> tuple[Any, Any]:
    """Creates the loop for one mechanics: a compiled unit, and a function that calls it.

    Args:
        layouts: Records of these mechanics.
        emit: Appends a row for the current state.
        emit_end: Appends the row at the end of the segment.
        emit_due: Appends the rows at output times up to now.
        begin: Starts a segment of constant parameters; returns a status.
        next_stop: Returns the next known instant, at most the end of the segment.
        pass_instant: Performs the jump at such an instant; returns a status.
        take_step: Takes a step within tolerance, at most to an instant; returns its size, 0 on
            failure.
        cut: Shortens the step to its first event; returns its size.
        count_step: Adds the step to the accumulators of the metrics.
        emit_inside: Appends the rows inside the step.
        follow_slip: Stores states at the start of a slip for additional rows.
        leave_slip: Writes those rows.
        pass_event: Handles the guards that fired; returns a status.
        finish_step: Completes a step without an event; the last argument is true if the step
            reaches its instant.
        pace_steps: Number of consecutive steps whose sizes are checked.
        least_pace: Average step size below which a loop is too stiff [s].
    """

    @compiled
    def _is_stiff(run: Record) -> bool:
        """True if the latest steps were so short that the run would practically never end."""
        steps = run.steps - run.pace_steps
        if steps < pace_steps:
            return False
        pace = (run.now - run.pace_time) / steps
        run.pace_steps, run.pace_time = run.steps, run.now
        return pace < least_pace

    @compiled
    def _advance_once(model: Record, run: Record, outlet: Record, t_stop: float) -> int:
        """Takes a step up to its first event, and performs the jump at its end, if any."""
        now, step = run.now, run.step
        until = next_stop(model, run, t_stop)
        if not until > now:
            return pass_instant(model, run, outlet, t_stop)
        emit_due(model, run, outlet)
        taken = take_step(model, run, until)
        if taken == 0.0:
            emit(model, run, outlet, run.discrete)
            return STEP_UNDERFLOW
        h = cut(model, run, taken)
        if h == 0.0 and run.fired != 1:
            emit(model, run, outlet, run.discrete)
            return UNBOUNDED_FORCE if run.fired == AT_POLE else STEP_UNDERFLOW
        count_step(model, run, h)
        emit_inside(model, run, outlet, h)
        follow_slip(model, run, outlet, h)
        last = method_of(model, step).last
        for k in range(model.num_states):
            step.start.x[k] = step.end.x[k]
            step.slopes[0].x[k] = step.slopes[last].x[k]
        reaches = h == until - now and run.fired == 0
        run.now = until if reaches else now + h
        if run.fired == 1:
            return pass_event(model, run, outlet)
        return finish_step(model, run, outlet, t_stop, reaches)

    @compiled
    def _advance_steps(
        model: Record,
        run: Record,
        outlet: Record,
        t_stop: float,
        first: int,
        same_ticks: int,
        max_steps: int,
    ) -> int:
        """Implements `advance`, except for rows of a slip at the end of the segment."""
        if run.begun == 0:
            status = begin(model, run, outlet, first, same_ticks)
            if status == RUNNING and run.lost == 1:
                status = NOT_FINITE
            if status != RUNNING:
                return status
        for _ in range(max_steps):
            if run.own.asked == ASKED:
                return RUNNING
            if outlet.num_rows > ROWS_BEFORE_PAUSE or outlet.num_ticks >= TICKS_BEFORE_PAUSE:
                return RUNNING
            if run.num_changes > CHANGE_CAPACITY - ROOM_TO_SPARE:
                return RUNNING
            if run.now >= t_stop:
                emit_end(model, run, outlet, t_stop)
                return NOT_FINITE if run.lost == 1 else REACHED
            if run.steps >= model.numerics.max_steps:
                emit(model, run, outlet, run.discrete)
                return MAX_STEPS
            status = _advance_once(model, run, outlet, t_stop)
            if status == RUNNING and run.lost == 1:
                status = NOT_FINITE
            elif status == RUNNING and _is_stiff(run):
                emit(model, run, outlet, run.discrete)
                status = STIFF
            if status != RUNNING:
                return status
        return RUNNING

    @compiled_apart(
        types.int64,
        *(layouts.model, layouts.progress, layouts.outlet),
        *(types.float64, types.int64, types.int64, types.int64),
        prefix=layouts.prefix,
    )
    def advance(
        model: Record,
        run: Record,
        outlet: Record,
        t_stop: float,
        first: int,
        same_ticks: int,
        max_steps: int,
    ) -> int:
        """Advances the run by at most ``max_steps`` steps, at most to ``t_stop``.

        Args:
            model: Constants up to ``t_stop``.
            run: The run.
            outlet: Output buffers for rows, phase changes and ticks; the caller empties them.
            t_stop: End of the run, or the next timed change [s].
            first: 1 if the run starts with this segment.
            same_ticks: 1 if sampled control continues the ticks of the previous segment.
            max_steps: Largest number of steps, which limits the duration of a call.

        Returns:
            RUNNING if another call is needed, REACHED at ``t_stop``, or the reason for the end.
        """
        status = _advance_steps(model, run, outlet, t_stop, first, same_ticks, max_steps)
        if status != RUNNING:
            leave_slip(model, run, outlet, 1)
        return status

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
        """Advances a run like `advance`, for callers in Python; releases the GIL."""
        flags = int(first), int(same_ticks)
        status: int = call(advance, model, run, outlet, t_stop, *flags, max_steps)
        return status

    return advance, advance_run


@compiled
def count_stall(run: Record) -> None:
    """Counts consecutive events without progress in time, including this one."""
    run.stalls = run.stalls + 1 if run.now - run.last_event < STALLED else 0
    run.last_event = run.now


@compiled
def book_energy(model: Record, run: Record, stored_energy: Any, place: int) -> None:
    """Adds the energy of a timed change of mass or inertia to the supplied energy.

    Args:
        model: The new constants.
        run: The run, with the row before the change, and updated kinematics.
        stored_energy: Kinetic and potential energy of a state [J].
        place: Index of the supplied energy in the state.
    """
    state = run.step.start
    kinetic, potential = stored_energy(model.hand, model.truth, run.work.kin, state)
    before = run.row.kinetic_energy + run.row.potential_energy
    state.x[place] += kinetic + potential - before
