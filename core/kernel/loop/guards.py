"""Guards: quantities that are positive during a phase and fall below their level at its end.

The guards of each contact are its phase guards, its normal force, the distance to the edge of its
face, and the distance of its finger from a singularity. The determinant of M~ follows all contacts.
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
# As wide as the edge of a patch (slipgrasp.core.run.schedule), so that fingertips that cross edges
# at the same time give one event.
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
    """Creates the guards of one kind of hand.

    Args:
        prefix: Prefix of the symbols of the compiled units.
        layouts: Model, discrete state, state, workspace, guards.
        update_values: Computes all guards at the state of the workspace.
        band_of: Returns noise and band of a guard; the sign of a value inside the band is
            uncertain.
        is_beyond: True if a value is below a level by more than noise.

    Returns:
        Functions that arm the guards, check them at a state, find those that fired in a step,
        evaluate them at its end, find overlooked ones, return the smallest distance of the fired
        ones, complete a step without events, and select those that fired first.
    """
    model_type, discrete_type, _, _, guards_type = layouts
    asked = model_type, discrete_type, guards_type

    @compiled
    def _is_past(model: Record, discrete: Record, guards: Record, j: int) -> bool:
        """True if guard ``j`` is below its level by more than noise."""
        if guards.values[j] >= guards.levels[j]:
            return False
        noise, _ = band_of(model, discrete, guards.values, j)
        return is_beyond(guards.values[j], guards.levels[j], noise)

    @compiled_apart(types.void, *layouts, prefix=prefix)
    def arm(model: Record, discrete: Record, state: Record, work: Record, guards: Record) -> None:
        """Arms the guards after a jump; for guards inside their band, the level is lowered.

        Otherwise, the guard of a contact that starts to slip or sticks exactly on its cone would
        fire again at the same instant because of rounding.
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
        """Evaluates all guards at the state of ``work``, the end of a step."""
        update_values(model, discrete, state, work, guards)
        for j in range(guards.count):
            guards.ends[j] = guards.values[j]

    @compiled_apart(types.int64, *asked, prefix=prefix)
    def find_overlooked(model: Record, discrete: Record, guards: Record) -> int:
        """1 if a guard that had not fired at the end of the full step is past its level here.

        Such guards are marked as fired: their event is earlier or simultaneous.
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
        """Smallest distance to the level at this state among the guards that fired."""
        update_values(model, discrete, state, work, guards)
        least = np.inf
        for j in range(guards.count):
            if guards.fired[j] == 1:
                least = min(least, guards.values[j] - guards.levels[j])
        return least

    @compiled_apart(types.void, *asked, prefix=prefix)
    def pass_step(model: Record, discrete: Record, guards: Record) -> None:
        """Completes a step without events: guards that have left their band return to level 0."""
        for j in range(guards.count):
            guards.starts[j] = guards.ends[j]
            if guards.levels[j] < 0.0:
                _, band = band_of(model, discrete, guards.ends, j)
                if guards.ends[j] > band:
                    guards.levels[j] = 0.0

    @compiled
    def keep_first_fired(guards: Record, least: float) -> None:
        """Keeps the fired guards that are at their level here; the others would fire later."""
        for j in range(guards.count):
            guards.ends[j] = guards.values[j]
            if guards.values[j] - guards.levels[j] > max(0.0, least):
                guards.fired[j] = 0

    ends = find_fired, evaluate_ends, find_overlooked
    return arm, is_past_event, *ends, least_fired, pass_step, keep_first_fired


@compiled
def find_end(model: Record, run: Record, per_contact: int) -> int:
    """Status after guards have fired; stores the contact or finger that ends the run.

    Args:
        model: Constants of the run.
        run: The run, with the fired guards.
        per_contact: Number of guards per contact.
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
