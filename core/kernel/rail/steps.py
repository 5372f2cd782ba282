"""Steps of a run on a rail within tolerance, up to their first event, and the rows inside them."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.dip_search import make_dip_of
from slipgrasp.core.kernel.loop.extreme_search import make_count_extremes
from slipgrasp.core.kernel.loop.ledger import LEAST_LEDGER_STEP, allowed_imbalance
from slipgrasp.core.kernel.loop.location import LOCATION_SHARE, make_locate
from slipgrasp.core.kernel.loop.output import next_output
from slipgrasp.core.kernel.loop.progress import OUTPUT_ROUNDING
from slipgrasp.core.kernel.loop.stages import interpolate, weigh_slopes
from slipgrasp.core.kernel.numerics.elementary import root, square
from slipgrasp.core.kernel.numerics.methods import method_of
from slipgrasp.core.kernel.planar.dynamics import stored_energy
from slipgrasp.core.kernel.planar.state import dissipated_at, supplied_at
from slipgrasp.core.kernel.rail.flow import flow
from slipgrasp.core.kernel.rail.guards import (
    FACE,
    MAX_GUARDS,
    PER_CONTACT,
    PHASE,
    band_of,
    find_fired,
    find_overlooked,
    guard_of_forces,
    is_past_band,
    is_past_event,
    keep_first_fired,
    least_fired,
    pass_step,
    speed_at,
)
from slipgrasp.core.kernel.rail.model import MODEL
from slipgrasp.core.kernel.rail.rows import add_step
from slipgrasp.core.kernel.rail.run import (
    LAYOUTS,
    OUTLET,
    PROGRESS,
    emit_or_end,
    evaluate_at,
    rail_prepare,
    rail_step,
    store_row,
)

LEAST_STEP = 1e-13
MAX_GROWTH = 10.0
LARGEST_ZERO = 1e-10
MAX_CUTS = 50
CLOSER = 4.0  # energy, than the ledger of hands, which is checked less often


@compiled
def _step_to(model: Record, run: Record, h: float) -> None:
    """Takes a step of size ``h``."""
    rail_step(model, run.discrete, run.now, h, run.step, run.work)


@compiled
def _error_of(model: Record, run: Record, h: float) -> float:
    """Root mean square error of a step relative to the tolerance."""
    step, method, numerics = run.step, method_of(model, run.step), model.numerics
    size = model.num_states
    weigh_slopes(method.error, method.last + 1, size, step, step.terms[0])
    weigh_slopes(method.correction, method.last + 1, size, step, step.terms[1])
    total = correction = 0.0
    for j in range(size):
        largest = max(abs(step.start.x[j]), abs(step.end.x[j]))
        scale = numerics.absolute_tolerance + numerics.relative_tolerance * largest
        total += square(step.terms[0, j] / scale)
        correction += square(step.terms[1, j] / scale)
    if total == 0.0:
        return 0.0
    return h * total / np.sqrt((total + 0.01 * correction) * size)


@compiled
def _imbalance(model: Record, run: Record, h: float) -> float:
    """Energy error at the midpoint and end of a step relative to the allowed one; the larger."""
    step = run.step
    start, _ = _energy(model, run, run.now, step.start)
    rail_prepare(model, run.discrete, run.now, h, step, run.work)
    interpolate(model, step, 0.5, step.stage)
    middle, _ = _energy(model, run, run.now + 0.5 * h, step.stage)
    end, kinetic = _energy(model, run, run.now + h, step.end)
    supplied = step.end.x[supplied_at(model)]
    largest = max(abs(end - start), abs(middle - start))
    return CLOSER * largest / allowed_imbalance(model.numerics, kinetic, supplied)


@compiled
def _energy(model: Record, run: Record, t: float, state: Record) -> tuple[float, float]:
    """Stored minus supplied plus dissipated energy, and the kinetic energy [J]."""
    flow(model, run.discrete, t, state, run.slope, run.work)
    kinetic, potential = stored_energy(model.hand, model.truth, run.work.kin, state)
    supplied, dissipated = state.x[supplied_at(model)], state.x[dissipated_at(model)]
    return kinetic + potential - supplied + dissipated, kinetic


@compiled_apart(types.float64, MODEL, PROGRESS, types.float64)
def rail_accept(model: Record, run: Record, until: float) -> float:
    """Takes a step within tolerance, at most to ``until``; returns its size, 0 on failure."""
    rest, h = until - run.now, min(run.step_size, model.numerics.max_step)
    while True:
        size = rest if h >= rest * (1.0 - 1e-9) else h
        _step_to(model, run, size)
        run.steps += 1
        error = _error_of(model, run, size)
        if error <= 1.0 and size > LEAST_LEDGER_STEP:
            error = max(error, _imbalance(model, run, size))
        roots = method_of(model, run.step).roots
        if error <= 1.0:
            grown = size * min(MAX_GROWTH, 0.9 / root(max(error, 1e-10), roots))
            run.step_size = max(grown, run.step_size) if grown >= size == rest else grown
            return size
        h = size * (max(0.2, 0.9 / root(error, roots)) if error < np.inf else 0.1)
        if h < LEAST_STEP * max(1.0, run.now) and h < rest:
            return 0.0


@compiled
def _size_of_zero(low: float, high: float) -> float:
    """Value below which a guard counts as zero, from its values at the ends of the bracket."""
    return min(LOCATION_SHARE * max(abs(low), abs(high)), LARGEST_ZERO)


@compiled
def _finish_location(model: Record, run: Record, _low: float, high: float) -> None:
    """Takes the step to the event."""
    _step_to(model, run, high)


locate = make_locate(
    LAYOUTS,
    step_to=_step_to,
    least_fired=least_fired,
    is_past_band=is_past_band,
    keep_first_fired=keep_first_fired,
    size_of_zero=_size_of_zero,
    finish=_finish_location,
    bisect_every=8,
)


@compiled
def value_inside(model: Record, run: Record, h: float, j: int, share: float) -> float:
    """Value of guard ``j`` at the fraction ``share`` of the step."""
    step, discrete, i = run.step, run.discrete, j // PER_CONTACT
    rail_prepare(model, discrete, run.now, h, step, run.work)
    interpolate(model, step, share, step.stage)
    if j % PER_CONTACT == PHASE and j < MAX_GUARDS - 1 and discrete.phases[i] != 0:
        return float(discrete.phases[i] * step.stage.x[speed_at(i)])
    flow(model, discrete, run.now + share * h, step.stage, run.slope, run.work)
    return guard_of_forces(model, discrete, run.work, j)


_, dip_of = make_dip_of(LAYOUTS, band_of, value_inside)


@compiled
def _sample_speeds(model: Record, run: Record, h: float) -> None:
    """Stores the phase guards of slipping contacts at the stages of the step."""
    step, method = run.step, method_of(model, run.step)
    for i in range(2):
        phase, at = run.discrete.phases[i], speed_at(i)
        if phase == 0:
            continue
        value, before = step.start.x[at], 0
        for k in range(1, method.num_ordered):
            row = method.ordered[k]
            width = h * (method.nodes[row] - method.nodes[before])
            value += 0.5 * width * (step.slopes[before].x[at] + step.slopes[row].x[at])
            step.samples[row, PER_CONTACT * i + PHASE] = phase * value
            before = row


@compiled
def _find_dip(model: Record, run: Record, h: float) -> float:
    """Time within a step at which a guard is past its level although not at its end; else 0 [s]."""
    _sample_speeds(model, run, h)
    found = 0.0
    for j in range(MAX_GUARDS):
        if j % PER_CONTACT != FACE:
            found = max(found, dip_of(model, run, h, j))
    return found * h


@compiled_apart(types.float64, MODEL, PROGRESS, types.float64)
def rail_cut(model: Record, run: Record, h: float) -> float:
    """Shortens the step just taken to its first event; returns its size and sets ``run.fired``."""
    size = h
    for _ in range(MAX_CUTS):
        # The energy check has evaluated other states.
        flow(model, run.discrete, run.now + size, run.step.end, run.slope, run.work)
        run.fired = find_fired(model, run.discrete, run.step.end, run.work, run.guards)
        if run.fired == 1:
            size = locate(model, run, size)
            # A guard above its level at the end of the full step may have fired before this event.
            while size > 0.0 and find_overlooked(model, run.discrete, run.guards) == 1:
                size = locate(model, run, size)
        dip = _find_dip(model, run, size) if size > 0.0 else 0.0
        if dip == 0.0:
            break
        # A guard is past its level at this instant, although not at the end of the step.
        _step_to(model, run, dip)
        size = dip
    if run.fired == 0:
        pass_step(model, run.discrete, run.guards)
    return size


def _count_ways(_model: Record) -> int:
    """Number of guards that limit a contact in a phase."""
    return 1


_count_extremes = make_count_extremes(LAYOUTS, PER_CONTACT, compiled(_count_ways), value_inside)


@compiled_apart(types.void, MODEL, PROGRESS, types.float64)
def rail_count(model: Record, run: Record, h: float) -> None:
    """Adds the step of size ``h`` from the current state to the metrics."""
    add_step(model, run.discrete, run.step, run.now, h, run.tally)
    _count_extremes(model, run, h)
    run.step.efforts[0] = run.step.efforts[method_of(model, run.step).last]


@compiled
def _agrees(model: Record, run: Record, t: float) -> bool:
    """Evaluates the state inside the step; False if it is past an event or not finite."""
    if evaluate_at(model, run, run.discrete, t, run.step.stage) == 0:
        return False
    return is_past_event(model, run.discrete, run.row.state, run.work, run.guards) == 0


@compiled_apart(types.void, MODEL, PROGRESS, OUTLET, types.float64)
def rail_emit_inside(model: Record, run: Record, outlet: Record, h: float) -> None:
    """Writes the rows at the output times inside the step just taken, by interpolation.

    Once the interpolant is past an event, each row is a shorter step of the method.
    """
    step, end, t = run.step, run.now + h, next_output(model, run)
    if t >= end - OUTPUT_ROUNDING:
        return
    rail_prepare(model, run.discrete, run.now, h, step, run.work)
    lost, is_good = dissipated_at(model), True
    least, most = float(step.start.x[lost]), float(step.end.x[lost])
    while t < end - OUTPUT_ROUNDING:
        if is_good:
            interpolate(model, step, (t - run.now) / h, step.stage)
            least = _set_between(step.stage, lost, least, most)
            is_good = _agrees(model, run, t)
        if is_good:
            store_row(model, run, outlet)
        else:
            _step_to(model, run, t - run.now)
            least = _set_between(step.end, lost, least, most)
            emit_or_end(model, run, outlet, run.discrete, t, step.end, t)
        run.outputs += 1
        t = next_output(model, run)
    if not is_good:
        _step_to(model, run, h)


@compiled
def _set_between(state: Record, j: int, least: float, most: float) -> float:
    """Limits coordinate ``j``, which never decreases in a step, to its range; returns it."""
    state.x[j] = max(least, min(most, state.x[j]))
    return float(state.x[j])
