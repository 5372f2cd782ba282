"""Steps of a spatial run within tolerance, up to their first event, and the rows inside them."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.ledger import LEAST_LEDGER_STEP
from slipgrasp.core.kernel.loop.location import LOCATION_SHARE, make_locate
from slipgrasp.core.kernel.loop.output import next_output
from slipgrasp.core.kernel.loop.progress import OUTPUT_ROUNDING
from slipgrasp.core.kernel.numerics.elementary import root, square
from slipgrasp.core.kernel.spatial.guards import (
    find_fired,
    find_overlooked,
    keep_first_fired,
    least_fired,
    pass_step,
    spatial_past_band,
)
from slipgrasp.core.kernel.spatial.implicit import find_stiffness
from slipgrasp.core.kernel.spatial.interior import spatial_dip
from slipgrasp.core.kernel.spatial.ledger import is_nearly_singular, spatial_imbalance, turns_fast
from slipgrasp.core.kernel.spatial.model import IMPLICIT, MODEL
from slipgrasp.core.kernel.spatial.run import LAYOUTS, OUTLET, PROGRESS, emit_as_of
from slipgrasp.core.kernel.spatial.state import slip_at, slip_velocity_at
from slipgrasp.core.kernel.spatial.stepper import (
    begin_from,
    creeps,
    longest_step,
    loses_direction,
    spatial_error,
    spatial_step,
    state_inside,
)
from slipgrasp.core.kernel.spatial.torsion import begins_slip
from slipgrasp.core.kernel.spatial.torsion_directions import keep_directions_at_rest
from slipgrasp.core.kernel.spatial.workspace import STICK

LEAST_STEP = 1e-14
STIFF = 1.0  # step size times relaxation rate above which steps are implicit
# The implicit steps of soft contacts are rejected more often: explicit ones that are well inside
# their stability follow earlier, and then smaller steps before implicit ones are tried again.
SOFT_STIFF, SOFT_GROWTH = 2.0, 4.0
CAUTION = 30.0  # factor of the error of implicit steps, whose estimate has little margin
LEDGER_CAUTION = 300.0  # of their energy: thousands of equal steps of a creeping slip add up
QUIET, QUIET_STEPS, MAX_GROWTH = 0.03, 100, 10.0
MAX_CUTS = 50
CLOSEST_HALVINGS = 20  # of a step in which a fingertip passes the centre of a patch


@compiled_apart(types.float64, MODEL, PROGRESS, types.float64)
def spatial_accept(model: Record, run: Record, until: float) -> float:
    """Takes a step within tolerance, at most to ``until``; returns its size, 0 on failure."""
    step, discrete, rest = run.step, run.discrete, until - run.now
    sticks = _all_stick(model, run)
    h = min(run.step_size, model.numerics.max_step, longest_step(model, discrete, step))
    largest, growth = model.num_methods - 1, MAX_GROWTH
    limit = STIFF if model.soft == 0 else SOFT_STIFF
    if begins_slip(model, discrete):
        begin_from(model, discrete, step)
    _choose_method(model, run, h, sticks)
    while True:
        size = rest if h >= rest * (1.0 - 1e-9) else h
        spatial_step(model, discrete, size, step, run.work)
        run.steps += 1
        error = spatial_error(model, size, step)
        if step.rank == IMPLICIT:
            error *= CAUTION
        if error <= 1.0 and loses_direction(model, discrete, step):
            error = 16.0
        if error <= 1.0 and _needs_ledger(model, run, size):
            imbalance = spatial_imbalance(model, run, size)
            if model.soft == 1 and step.rank == IMPLICIT:
                imbalance *= LEDGER_CAUTION
            error = max(error, imbalance)
        if error <= 1.0:
            _follow_error(model, run, error, size, rest, sticks, growth)
            return size
        if sticks and step.rank < largest:
            run.quiet_steps = 0
            step.rank += 1
            continue
        shrink = max(0.2, 0.9 / root(error, 2)) if error < np.inf else 0.1
        h = size * shrink
        if step.rank == IMPLICIT and h * step.stiffness.rate < limit:
            step.rank = largest
            growth = MAX_GROWTH if model.soft == 0 else SOFT_GROWTH
        if h < LEAST_STEP * max(1.0, run.now) and h < rest:
            return 0.0


@compiled
def _needs_ledger(model: Record, run: Record, size: float) -> bool:
    """True if the energy of a step must be checked; it is the only error estimate at slip onset."""
    if model.soft == 1 and begins_slip(model, run.discrete):
        return True
    return size > LEAST_LEDGER_STEP and (turns_fast(model, run) or is_nearly_singular(model, run))


@compiled
def _choose_method(model: Record, run: Record, h: float, sticks: bool) -> None:
    """Selects the last method in stick, the highest order in slip, the implicit one in creep."""
    step, largest = run.step, model.num_methods - 1
    crept = run.rank == IMPLICIT
    step.rank = min(run.rank, largest) if sticks else largest
    if sticks or begins_slip(model, run.discrete):
        return
    if crept or creeps(model, run.discrete, step, h):
        find_stiffness(model, run.discrete, step, run.work)
        if h * step.stiffness.rate > STIFF:
            step.rank = IMPLICIT


@compiled
def _follow_error(
    model: Record,
    run: Record,
    error: float,
    size: float,
    rest: float,
    sticks: bool,
    growth: float,
) -> None:
    """Sets the size of the next step, at most ``growth`` times this one, and its order in stick."""
    grown = size * min(growth, 0.9 / root(max(error, 1e-10), 2))
    # The size of a step shortened by a tick is no measure for the next one.
    run.step_size = max(grown, run.step_size) if grown >= size == rest else grown
    run.rank = run.step.rank
    if not sticks:
        return
    if error > QUIET:
        run.quiet_steps = 0
        run.rank = min(run.rank + 1, model.num_methods - 1)
        return
    run.quiet_steps += 1
    if run.quiet_steps >= QUIET_STEPS and run.rank > 0:
        run.quiet_steps = 0
        run.rank -= 1


@compiled
def _outward(model: Record, state: Record, i: int, rim: Record) -> float:
    """Half the rate of the squared distance of contact ``i`` from the centre of a patch [m^2/s]."""
    total = 0.0
    for axis in range(2):
        away = state.x[slip_at(i, axis)] - rim.centre[axis]
        total += away * state.x[slip_velocity_at(model.num_fingers, i, axis)]
    return total


@compiled_apart(types.float64, MODEL, PROGRESS, types.int64, types.int64, types.float64)
def _closest(model: Record, run: Record, i: int, k: int, h: float) -> float:
    """Size of the step at whose end contact ``i`` is closest to the centre of patch ``k``."""
    low, high, rim = 0.0, h, model.hand.rims[i, k]
    for _ in range(CLOSEST_HALVINGS):
        size = 0.5 * (low + high)
        spatial_step(model, run.discrete, size, run.step, run.work)
        if _outward(model, run.step.end, i, rim) < 0.0:
            low = size
        else:
            high = size
    return high


@compiled
def stop_in_patch(model: Record, run: Record, h: float) -> float:
    """Shortens a step that would enter and leave a patch undetected; returns the step size.

    Contacts inside a patch need no check, because patches are convex.
    """
    start, end, size = run.step.start, run.step.end, h
    for i in range(model.num_fingers):
        for k in range(model.hand.num_rims[i]):
            rim = model.hand.rims[i, k]
            if rim.side > 0.0 or not _outward(model, start, i, rim) < 0.0:
                continue
            if not _outward(model, end, i, rim) > 0.0:
                continue
            nearest = _closest(model, run, i, k, size)
            spatial_step(model, run.discrete, nearest, run.step, run.work)
            total = 0.0
            for axis in range(2):
                total += square(end.x[slip_at(i, axis)] - rim.centre[axis])
            if total < rim.radius * rim.radius:
                size = nearest
            else:
                spatial_step(model, run.discrete, size, run.step, run.work)
    return size


@compiled
def _step_to(model: Record, run: Record, h: float) -> None:
    """Repeats the step with another size."""
    spatial_step(model, run.discrete, h, run.step, run.work)


@compiled
def _size_of_zero(low: float, _high: float) -> float:
    """Size of values that count as zero, from the lower value only.

    The upper value may be a force while the lower one is a speed.
    """
    return LOCATION_SHARE * abs(low)


@compiled
def _finish_location(model: Record, run: Record, _low: float, high: float) -> None:
    """Takes the step to the event."""
    _step_to(model, run, high)


locate = make_locate(
    LAYOUTS,
    step_to=_step_to,
    least_fired=least_fired,
    is_past_band=spatial_past_band,
    keep_first_fired=keep_first_fired,
    size_of_zero=_size_of_zero,
    finish=_finish_location,
    bisect_every=3,
)


@compiled_apart(types.float64, MODEL, PROGRESS, types.float64)
def spatial_cut(model: Record, run: Record, h: float) -> float:
    """Shortens the step just taken to its first event; returns its size and sets ``run.fired``."""
    discrete, guards, size = run.discrete, run.guards, h
    for _ in range(MAX_CUTS):
        run.fired = find_fired(model, discrete, run.step.end, run.work, guards)
        if run.fired == 1:
            size = locate(model, run, size)
            # A guard above its level at the end of the full step may have fired before this event.
            while size > 0.0 and find_overlooked(model, discrete, guards) == 1:
                size = locate(model, run, size)
        dip = spatial_dip(model, run, size) if size > 0.0 else 0.0
        if dip == 0.0:
            break
        # A guard is past its level at this instant, although not at the end of the step.
        _step_to(model, run, dip)
        size = dip
    if run.fired == 0:
        pass_step(model, discrete, guards)
    return size


@compiled_apart(types.void, MODEL, PROGRESS, OUTLET, types.float64)
def spatial_emit_inside(model: Record, run: Record, outlet: Record, h: float) -> None:
    """Stores rows at the output times inside the step just taken, each as a shorter step.

    The step itself is then repeated, so that only the rows depend on the output rate. At slip
    onset, rows are interpolated between the ends of the step, with the friction of the step.
    """
    step, end, found = run.step, run.now + h, False
    begins = begins_slip(model, run.discrete)
    state = run.selection.probe if begins else step.end
    while next_output(model, run) < end - OUTPUT_ROUNDING:
        t = next_output(model, run)
        if begins:
            keep_directions_at_rest(model, step.directions, step.begun, run.discrete)
            state_inside(model, step, h, (t - run.now) / h, state)
        else:
            spatial_step(model, run.discrete, t - run.now, step, run.work)
        emit_as_of(model, run, outlet, run.discrete, t, state, t)
        run.outputs += 1
        found = True
    if found:
        spatial_step(model, run.discrete, h, step, run.work)


@compiled
def _all_stick(model: Record, run: Record) -> bool:
    for i in range(model.num_fingers):
        if run.discrete.phases[i] != STICK:
            return False
    return True
