"""Step of a spatial run, its error and its largest size.

The direction of a slow slip is stiff: it relaxes at the rate mu F_n / (m |s'|), and a step past
|s'| = 0 would not be detected. Steps are therefore limited to a fraction of the time to stop of
every slip, and slip velocities have a separate tolerance. Explicit steps are sufficient for slips
that stop; creeping slips would need too many of them.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Record
from slipgrasp.core.kernel.loop.stages import fill_terms, interpolate, weigh_slopes
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.numerics.methods import DENSE_ROWS, MAX_SLOPES, method_of
from slipgrasp.core.kernel.spatial.flow import flow, slip_speed
from slipgrasp.core.kernel.spatial.guards import MAX_GUARDS, sample_guards
from slipgrasp.core.kernel.spatial.implicit import (
    STIFFNESS,
    implicit_step,
    set_normal_stage,
    turn_rate,
)
from slipgrasp.core.kernel.spatial.model import IMPLICIT, MODEL
from slipgrasp.core.kernel.spatial.state import (
    MAX_STATE,
    STATE,
    normalise,
    slip_velocity_at,
    spin_at,
    spin_velocity_at,
    velocity_at,
)
from slipgrasp.core.kernel.spatial.torsion import begins_slip
from slipgrasp.core.kernel.spatial.torsion_onset import onset_step
from slipgrasp.core.kernel.spatial.ways import parts_of_way, way_speed
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, WORKSPACE

SLIP_TOLERANCE = 1e-11  # absolute, of slip velocities [m/s]
STOP_SHARE = 0.6  # largest step relative to the time to stop of a slip
SHORT_STEP, LONG_STEP = 1e-6, 2e-5  # at slip onset, above and below BRISK [s]
ONSET_STEP = 5e-6  # LONG_STEP for soft fingertips [s]
BRISK = 0.1  # slip acceleration [m/s^2]
FASTEST_KEPT = 1e-7  # up to which a slip may keep its initial direction [m/s]
# The mobility of spins is so small that the slip direction is stiff at any speed.
SOFT_CREEP_STEP = 1e-4  # CREEP_STEP for soft fingertips [s]
# A slip creeps if steps are shorter than this [s] and its speed lasts for this many steps.
CREEP_STEP, CREEP_STEPS = 1e-6, 100.0

RELAXES = 1e-2  # rate times step size above which the slopes at the ends mislead inside the step

# A step from ``start`` to ``end`` with its slopes.
STEP = np.dtype(
    [
        ("rank", np.int64),  # of its method
        ("start", STATE),
        ("end", STATE),
        ("slopes", STATE, (MAX_SLOPES,)),
        ("terms", np.float64, (DENSE_ROWS + 3, MAX_STATE)),  # of the interpolant
        ("prepared", np.int64),  # 1 if the terms belong to this step
        ("samples", np.float64, (MAX_SLOPES, MAX_GUARDS)),  # of guards, at the stages
        ("stiffness", STIFFNESS),  # at the start of an implicit step
        ("directions", np.float64, (MAX_FINGERS, 3)),  # at its end, of soft slips at onset
        ("begun", np.float64, (MAX_FINGERS, 3)),  # at its start
    ],
    align=True,
)


@compiled_apart(types.void, MODEL, DISCRETE, types.float64, STEP, WORKSPACE)
def spatial_step(model: Record, discrete: Record, h: float, step: Record, work: Record) -> None:
    """Fills ``end`` and ``slopes``; ``work`` is then evaluated at the end of the step."""
    step.prepared = 0
    if begins_slip(model, discrete) and onset_step(model, discrete, h, step, work):
        return
    if step.rank == IMPLICIT:
        implicit_step(model, discrete, h, step, work)
        return
    for row in range(1, method_of(model, step).last + 1):
        set_normal_stage(model, h, row, step)
        flow(model, discrete, step.end, step.slopes[row], work)
        sample_guards(model, discrete, step.end, work, step.samples, row)


@compiled
def begin_from(model: Record, discrete: Record, step: Record) -> None:
    """Stores the directions at the start of the next step."""
    for i in range(model.num_fingers):
        for part in range(3):
            step.begun[i, part] = discrete.directions[i, part]


@compiled
def state_inside(model: Record, step: Record, h: float, share: float, state: Record) -> None:
    """Interpolates the state at the fraction ``share`` of the step just taken."""
    if step.prepared == 0:
        step.prepared = 1
        fill_terms(model, h, step)
        if step.rank == IMPLICIT:
            _leave_stiff_slopes(model, step, h)
    interpolate(model, step, share, state)
    normalise(state)


@compiled
def _leave_stiff_slopes(model: Record, step: Record, h: float) -> None:
    """Makes slip directions change uniformly inside an implicit step.

    The slopes at its ends are those of the relaxation, which takes only a small part of the step.
    """
    n, start, end = model.num_fingers, step.start.x, step.end.x
    for c in range(step.stiffness.count):
        i = step.stiffness.contacts[c]
        first, second = slip_velocity_at(n, i, 0), slip_velocity_at(n, i, 1)
        if model.soft == 1:
            # Slower relaxation is resolved by the slopes, and carries energy.
            if h * turn_rate(model, step.stiffness, c) > RELAXES:
                _leave_stiff_slopes_of(n, i, step)
            continue
        along, beside = start[first] + end[first], start[second] + end[second]
        inverse = 1.0 / (along * along + beside * beside)
        for term in range(1, 3):
            terms = step.terms[term]
            share = inverse * (along * terms[first] + beside * terms[second])
            terms[first], terms[second] = share * along, share * beside


@compiled
def _leave_stiff_slopes_of(n: int, i: int, step: Record) -> None:
    """As `_leave_stiff_slopes`, for contact ``i`` with its spin."""
    start, end, squared = step.start.x, step.end.x, 0.0
    for part in range(3):
        at = velocity_at(n, i, part)
        squared += square(start[at] + end[at])
    for term in range(1, 3):
        terms, share = step.terms[term], 0.0
        for part in range(3):
            at = velocity_at(n, i, part)
            share += (start[at] + end[at]) * terms[at]
        for part in range(3):
            at = velocity_at(n, i, part)
            terms[at] = share / squared * (start[at] + end[at])


@compiled_apart(types.float64, MODEL, types.float64, STEP)
def spatial_error(model: Record, h: float, step: Record) -> float:
    """Root mean square error of a step relative to the tolerance; not finite if a value is not.

    Overwrites the first terms of the interpolant.
    """
    method, size, n = model.methods[step.rank], model.num_states, model.num_fingers
    relative = model.numerics.relative_tolerance
    absolute = min(model.numerics.absolute_tolerance, SLIP_TOLERANCE)
    first, last, errors = slip_velocity_at(n, 0, 0), slip_velocity_at(n, n, 0), step.terms[0]
    weigh_slopes(method.error, method.last + 1, size, step, errors)
    total = _add_errors(model, h, step, 0, first, 0.0)
    for i in range(n):
        for way in range(model.ways):
            fastest = max(way_speed(model, step.start, i, way), way_speed(model, step.end, i, way))
            for part in parts_of_way(model, way):
                error = h * errors[velocity_at(n, i, part)]
                total += square(error / (absolute + relative * fastest))
    if model.soft == 1:
        total = _add_errors(model, h, step, last, spin_velocity_at(n, 0), total)
        last = spin_at(n, 0)
    return np.sqrt(_add_errors(model, h, step, last, size, total) / size)


@compiled
def _add_errors(
    model: Record, h: float, step: Record, first: int, last: int, total: float
) -> float:
    """Adds the squared errors of states ``first`` to ``last - 1``, relative to the tolerance."""
    numerics = model.numerics
    for j in range(first, last):
        largest = max(abs(step.start.x[j]), abs(step.end.x[j]))
        scale = numerics.absolute_tolerance + numerics.relative_tolerance * largest
        total += square(h * step.terms[0, j] / scale)
    return total


@compiled
def longest_step(model: Record, discrete: Record, step: Record) -> float:
    """Longest step that does not pass the end of a slip [s]; inf if no contact slips."""
    longest = np.inf
    for i in range(model.num_fingers):
        for way in range(model.ways):
            if discrete.slips[i, way] != 0.0:
                longest = min(longest, _longest_along(model, discrete, step, i, way))
    return longest


@compiled
def _longest_along(model: Record, discrete: Record, step: Record, i: int, way: int) -> float:
    """As `longest_step`, for one slip mode of contact ``i``."""
    n, x, slope = model.num_fingers, step.start.x, step.slopes[0].x
    speeds = powers = accelerations = 0.0
    for part in parts_of_way(model, way):
        at = velocity_at(n, i, part)
        speeds += x[at] * x[at]
        powers += x[at] * slope[at]
        accelerations += slope[at] * slope[at]
    if discrete.frozen[i, way] != 0:
        longest = LONG_STEP if model.soft == 0 else ONSET_STEP
        return SHORT_STEP if accelerations > BRISK * BRISK else longest
    if powers >= 0.0:
        return np.inf
    until_stop = STOP_SHARE * speeds / -powers
    # In the pyramid, the sign of a slip shows that it has ended: the last step may pass the end.
    return until_stop if model.ways == 1 else max(until_stop, SHORT_STEP)


@compiled
def creeps(model: Record, discrete: Record, step: Record, h: float) -> bool:
    """True if the direction of a slip, not its speed, limits a step of size ``h``."""
    n, x, slope = model.num_fingers, step.start.x, step.slopes[0].x
    if model.ways == 2 or not h < (CREEP_STEP if model.soft == 0 else SOFT_CREEP_STEP):
        return False
    slowest, power = np.inf, 0.0
    for i in range(n):
        if discrete.slips[i, 0] == 0.0:
            continue
        squared = along = 0.0
        for part in parts_of_way(model, 0):
            at = velocity_at(n, i, part)
            squared += x[at] * x[at]
            along += x[at] * slope[at]
        if discrete.frozen[i, 0] == 0 and squared < slowest:
            slowest, power = squared, along
    return slowest < np.inf and slowest > CREEP_STEPS * h * abs(power)


@compiled
def loses_direction(model: Record, discrete: Record, step: Record) -> bool:
    """True if a slip on the cone does not have the direction assumed in the step.

    The slip has passed zero and reversed, or it is already fast at its onset.
    """
    n, start, end = model.num_fingers, step.start.x, step.end.x
    for i in range(n):
        if model.ways == 2 or discrete.slips[i, 0] == 0.0:
            continue
        if discrete.frozen[i, 0] != 0:
            # The direction of a soft contact is that at the end of its step.
            if model.soft == 0 and slip_speed(n, step.end, i) > FASTEST_KEPT:
                return True
            continue
        along = 0.0
        for part in parts_of_way(model, 0):
            at = velocity_at(n, i, part)
            along += start[at] * end[at]
        if not along > 0.0:
            return True
    return False
