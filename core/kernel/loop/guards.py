"""Guards: quantities that are positive during a phase and cross their level at its end.

The guards of a contact are those of its phases, followed by its normal force, the edge of its face,
and its finger. The determinant of M~ follows all contacts.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Layout, Record
from slipgrasp.core.kernel.loop.status import LEFT_FACE, PAINLEVE, RUNNING, SEPARATED, SINGULAR

FORCE_BAND, FORCE_NOISE = 4e-10, 1e-11
# As wide as the edge of a patch (slipgrasp.core.run.schedule), so that tips that cross their edges
# together do so at once.
SLIP_BAND, SLIP_NOISE = 1e-11, 1e-15
# Guards that end the run cannot fire again.
ENDING_BAND = 1e-12
WIDEST_BAND = 1e-2  # of a force of 10^7 N
NEAR_SINGULAR = 0.05  # sin^2 q2 of a nearly straight or folded finger


def guards_layout(count: int) -> Layout:
    """Values of all guards, at most ``count``, with related data."""
    fields = [
        ("count", np.int64),
        ("values", np.float64, (count,)),
        ("starts", np.float64, (count,)),  # values at the start of the step
        ("ends", np.float64, (count,)),  # and at its end
        ("levels", np.float64, (count,)),
        ("fired", np.int64, (count,)),
        ("infeasible", np.int64),  # 1 if the limits of the grasp force contradict each other
    ]
    return np.dtype(fields, align=True)


def make_guards(
    prefix: str, layouts: Sequence[Layout], update_values: Any, band_of: Any, is_beyond: Any
) -> tuple[Any, ...]:
    """Creates the guards of a mechanics.

    Args:
        prefix: Prefix of the symbols of its units.
        layouts: Model, discrete state, state, workspace, guards.
        update_values: Writes the values of all guards at the state of the workspace.
        band_of: Noise and band of a guard: within its band the sign of a value is uncertain.
        is_beyond: Whether a value is below a level by more than noise.

    Returns:
        Functions that arm them, check whether any is past its level, find those that fired at the
        end of a step, evaluate them there, find overlooked ones, return the smallest distance of
        the fired ones, pass a step, and select those that fired first.
    """
    model_type, discrete_type, _, _, guards_type = layouts
    asked = model_type, discrete_type, guards_type

    @compiled
    def _is_past(model: Record, discrete: Record, guards: Record, j: int) -> bool:
        """Whether guard ``j`` is below its level by more than noise."""
        if guards.values[j] >= guards.levels[j]:
            return False
        noise, _ = band_of(model, discrete, guards.values, j)
        return is_beyond(guards.values[j], guards.levels[j], noise)

    @compiled_apart(types.void, *layouts, prefix=prefix)
    def arm(model: Record, discrete: Record, state: Record, work: Record, guards: Record) -> None:
        """After a jump: a guard that starts inside its band may first fall to twice the band.

        Otherwise, a contact that starts to slip, or rests exactly on its cone, would fire again at
        the same instant because of rounding.
        """
        update_values(model, discrete, state, work, guards)
        for j in range(guards.count):
            value = guards.values[j]
            guards.starts[j], guards.levels[j] = value, 0.0
            if value < WIDEST_BAND:
                _, band = band_of(model, discrete, guards.values, j)
                if value <= band:
                    guards.levels[j] = min(-2.0 * band, value - band)

    @compiled_apart(types.int64, *layouts, prefix=prefix)
    def is_past_event(
        model: Record, discrete: Record, state: Record, work: Record, guards: Record
    ) -> int:
        """1 if any guard is below its level by more than noise."""
        update_values(model, discrete, state, work, guards)
        for j in range(guards.count):
            if _is_past(model, discrete, guards, j):
                return 1
        return 0

    @compiled_apart(types.int64, *layouts, prefix=prefix)
    def find_fired(
        model: Record, discrete: Record, state: Record, work: Record, guards: Record
    ) -> int:
        """1 if any guard is past its level at the end of a step; marks those that fired."""
        evaluate_ends(model, discrete, state, work, guards)
        found = 0
        for j in range(guards.count):
            guards.fired[j] = 1 if _is_past(model, discrete, guards, j) else 0
            found |= guards.fired[j]
        return found

    @compiled
    def evaluate_ends(
        model: Record, discrete: Record, state: Record, work: Record, guards: Record
    ) -> None:
        """Values of all guards at the state of ``work``, as those at the end of a step."""
        update_values(model, discrete, state, work, guards)
        for j in range(guards.count):
            guards.ends[j] = guards.values[j]

    @compiled_apart(types.int64, *asked, prefix=prefix)
    def find_overlooked(model: Record, discrete: Record, guards: Record) -> int:
        """1 if a guard that did not fire in the whole step is past its level at its event.

        Such guards are marked too: theirs is the first event, or one at the same time.
        """
        found = 0
        for j in range(guards.count):
            if guards.fired[j] == 0 and _is_past(model, discrete, guards, j):
                guards.fired[j] = 1
                found = 1
        return found

    @compiled_apart(types.float64, *layouts, prefix=prefix)
    def least_fired(
        model: Record, discrete: Record, state: Record, work: Record, guards: Record
    ) -> float:
        """The smallest distance to its level, at this state, among the guards that fired."""
        update_values(model, discrete, state, work, guards)
        least = np.inf
        for j in range(guards.count):
            if guards.fired[j] == 1:
                least = min(least, guards.values[j] - guards.levels[j])
        return least

    @compiled_apart(types.void, *asked, prefix=prefix)
    def pass_step(model: Record, discrete: Record, guards: Record) -> None:
        """After a step without event: guards that have left their band return to level 0."""
        for j in range(guards.count):
            guards.starts[j] = guards.ends[j]
            if guards.levels[j] < 0.0:
                _, band = band_of(model, discrete, guards.ends, j)
                if guards.ends[j] > band:
                    guards.levels[j] = 0.0

    @compiled
    def keep_first_fired(guards: Record, least: float) -> None:
        """Selects the fired guards that are at their level here; the others would fire later."""
        for j in range(guards.count):
            guards.ends[j] = guards.values[j]
            if guards.values[j] - guards.levels[j] > max(0.0, least):
                guards.fired[j] = 0

    ends = find_fired, evaluate_ends, find_overlooked
    return arm, is_past_event, *ends, least_fired, pass_step, keep_first_fired


@compiled
def find_end(model: Record, run: Record, per_contact: int) -> int:
    """Whether a fired guard ends the run, and the contact or finger responsible.

    Args:
        model: Constants of the run.
        run: The run, whose guards have fired.
        per_contact: Number of guards of a contact.
    """
    n, fired = model.num_fingers, run.guards.fired
    for i in range(n):
        base = per_contact * i
        status = RUNNING
        if fired[base + per_contact - 3] == 1:
            status = SEPARATED
        elif fired[base + per_contact - 2] == 1:
            status = LEFT_FACE
        elif fired[base + per_contact - 1] == 1:
            status = SINGULAR
        if status != RUNNING:
            run.concerned = i
            return status
    return PAINLEVE if fired[per_contact * n] == 1 else RUNNING
