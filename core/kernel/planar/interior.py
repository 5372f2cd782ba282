"""Events inside a step of a planar run, and extremes of the forces."""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.dip_search import NEAR, make_dip_of
from slipgrasp.core.kernel.loop.extreme_search import make_count_extremes
from slipgrasp.core.kernel.loop.guards import NEAR_SINGULAR
from slipgrasp.core.kernel.loop.stages import interpolate
from slipgrasp.core.kernel.numerics.methods import method_of
from slipgrasp.core.kernel.planar.flow import flow
from slipgrasp.core.kernel.planar.guards import (
    NORMAL_FORCE,
    PER_CONTACT,
    PHASE,
    SINGULAR,
    VIOLATION_BAND,
    band_of,
    evaluate_ends,
    guard_value,
    sample_guards,
)
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.run import LAYOUTS, PROGRESS
from slipgrasp.core.kernel.planar.state import estimate_at, slip_velocity_at
from slipgrasp.core.kernel.planar.stepper import prepare_interpolant, take_step
from slipgrasp.core.kernel.planar.tally import add_step


@compiled
def _coordinate(model: Record, discrete: Record, j: int) -> int:
    """Index of the coordinate that guard ``j`` depends on; -1 if it depends on more than one."""
    n = model.num_fingers
    if j < PER_CONTACT * n:
        i = j // PER_CONTACT
        slips = j % PER_CONTACT == PHASE and discrete.phases[i] != 0
        return slip_velocity_at(n, i) if slips else -1
    k = j - PER_CONTACT * n - 1
    return estimate_at(n, k) if k >= 0 and discrete.clamps[k] == 0 else -1


@compiled
def value_inside(model: Record, run: Record, h: float, j: int, share: float) -> float:
    """Value of guard ``j`` at the fraction ``share`` of the step."""
    step, room = run.step, run.selection
    prepare_interpolant(model, run.discrete, run.now, h, step, run.work)
    interpolate(model, step, share, step.stage)
    coordinate = _coordinate(model, run.discrete, j)
    if coordinate >= 0:
        return guard_value(model, run.discrete, j, step.stage.x[coordinate])
    t = run.now + share * h
    flow(model, run.discrete, t, step.stage, room.derivative, run.work)
    row = method_of(model, step).last + 1  # of a slope used only by the interpolant
    sample_guards(model, run.discrete, run.work, step.samples, row)
    return step.samples[row, j]


_find_least, _dip_of = make_dip_of(LAYOUTS, band_of, value_inside)


@compiled
def _dip_of_coordinate(model: Record, run: Record, h: float, j: int) -> float:
    """Fraction of the step at which guard ``j``, of one coordinate, is past its level; 0 if never.

    The known slopes of the coordinate give its values at the nodes of the step.
    """
    guards, step, method = run.guards, run.step, method_of(model, run.step)
    coordinate = _coordinate(model, run.discrete, j)
    least = min(guards.starts[j], guards.ends[j]) - guards.levels[j]
    steepest = 0.0
    for row in range(method.last + 1):
        steepest = max(steepest, abs(step.slopes[row].x[coordinate]))
    if not least < NEAR * h * steepest:
        return 0.0
    value, before = step.start.x[coordinate], 0
    step.samples[0, j] = guards.starts[j]
    for k in range(1, method.num_ordered):
        row = method.ordered[k]
        width = h * (method.nodes[row] - method.nodes[before])
        slopes = step.slopes[before].x[coordinate] + step.slopes[row].x[coordinate]
        value += 0.5 * width * slopes
        step.samples[row, j] = guard_value(model, run.discrete, j, value)
        before = row
    step.samples[method.last, j] = guards.ends[j]
    return _find_least(model, run, h, j)


@compiled
def _jump_inside(model: Record, run: Record) -> float:
    """Fraction of the step at which the law has jumped; 0 if never."""
    last, method = run.guards.count - 1, method_of(model, run.step)
    if run.guards.fired[last] == 0:
        for k in range(1, method.num_ordered - 1):
            row = method.ordered[k]
            infeasible = 1 if run.step.samples[row, last] > VIOLATION_BAND else 0
            if infeasible != run.guards.infeasible:
                return method.nodes[row]
    return 0.0


@compiled_apart(types.float64, MODEL, PROGRESS, types.float64)
def find_dip(model: Record, run: Record, h: float) -> float:
    """Time within a step of size ``h`` at which a guard is past its level; 0 if never [s].

    At the end of the step no guard is past its level, or an event has been located there; an
    earlier event may still lie inside. The end of a face needs no search: within a phase the slip
    velocity keeps its sign.
    """
    guards, phases = run.guards, run.discrete.phases
    found, slips = 0.0, False
    for i in range(model.num_fingers):
        base = PER_CONTACT * i
        if phases[i] == 0:
            found = max(found, _dip_of(model, run, h, base + PHASE))
        else:
            slips = True
            found = max(found, _dip_of_coordinate(model, run, h, base + PHASE))
            found = max(found, _dip_of(model, run, h, base + NORMAL_FORCE))
        nearest = min(guards.starts[base + SINGULAR], guards.ends[base + SINGULAR])
        if nearest < NEAR_SINGULAR:
            found = max(found, _dip_of(model, run, h, base + SINGULAR))
    first = PER_CONTACT * model.num_fingers
    if slips:
        found = max(found, _dip_of(model, run, h, first))
    if model.law.period == 0.0:
        for j in range(first + 1, guards.count - 1):
            if run.discrete.clamps[j - first - 1] == 0:
                found = max(found, _dip_of_coordinate(model, run, h, j))
            else:
                found = max(found, _dip_of(model, run, h, j))
        found = max(found, _jump_inside(model, run))
    return found * h


@compiled
def _count_ways(_model: Record) -> int:
    """Number of slip directions that limit a planar contact in a phase."""
    return 1


_count_extremes = make_count_extremes(LAYOUTS, PER_CONTACT, _count_ways, value_inside)


@compiled_apart(types.void, MODEL, PROGRESS, types.float64)
def count_step(model: Record, run: Record, h: float) -> None:
    """Adds the step of size ``h`` from the current state to the metrics.

    If the law jumps at the end, the extremes are counted up to just before the jump.
    """
    discrete, guards, step, work = run.discrete, run.guards, run.step, run.work
    add_step(model, discrete, step, run.now, h, run.tally)
    if run.fired == 1 and guards.fired[guards.count - 1] == 1:
        before = run.before_time - run.now
        if before > 0.0:
            take_step(model, discrete, run.now, before, step, work)
            evaluate_ends(model, discrete, step.end, work, guards)
            _count_extremes(model, run, before)
        take_step(model, discrete, run.now, h, step, work)
    else:
        _count_extremes(model, run, h)
    step.efforts[0] = step.efforts[method_of(model, step).last]
