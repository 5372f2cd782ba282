"""Guards that sink below their level and recover within one step.

The values of a guard at the slopes of the step show where it may be lowest: a value between two
others is not below the lines through their neighbours, on either side, also where the law has a
kink. Only if these lines cross near its level, the continuous extension of the method is asked for
the least value itself. This costs nothing but comparisons in nearly all steps, and no output time
has a part in it.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.flow import flow
from slipgrasp.core.kernel.guards import (
    NEAR_SINGULAR,
    NORMAL_FORCE,
    PER_CONTACT,
    PHASE,
    SINGULAR,
    VIOLATION_BAND,
    band_of,
    guard_value,
    sample_guards,
)
from slipgrasp.core.kernel.model import MODEL
from slipgrasp.core.kernel.records import Record
from slipgrasp.core.kernel.run import PROGRESS
from slipgrasp.core.kernel.state import estimate_at, slip_velocity_at
from slipgrasp.core.kernel.stepper import interpolate, method_of, prepare_interpolant

# A guard is looked at where its least value may come this near to its level, as a share of the
# range of its values in the step: by the values alone, and by the lines through them.
NEAR, NEAR_LINES = 0.5, 0.02
LEAST_FRACTION = 1e-6
GOLDEN = 0.3819660112501051
LEAST_WIDTH = 1e-5  # of the search, as a share of the step


@compiled
def _coordinate(model: Record, discrete: Record, j: int) -> int:
    """The coordinate of the state that guard ``j`` watches; -1 where it watches something else."""
    n = model.num_fingers
    if j < PER_CONTACT * n:
        i = j // PER_CONTACT
        slips = j % PER_CONTACT == PHASE and discrete.phases[i] != 0
        return slip_velocity_at(n, i) if slips else -1
    k = j - PER_CONTACT * n - 1
    return estimate_at(n, k) if k >= 0 and discrete.clamps[k] == 0 else -1


@compiled
def _value_inside(model: Record, run: Record, h: float, j: int, share: float) -> float:
    """Value of guard ``j`` at a share of the step."""
    step, room = run.step, run.selection
    prepare_interpolant(model, run.discrete, run.now, h, step, run.work)
    interpolate(model, step, share, step.stage)
    coordinate = _coordinate(model, run.discrete, j)
    if coordinate >= 0:
        return guard_value(model, run.discrete, j, step.stage.x[coordinate])
    t = run.now + share * h
    flow(model, run.discrete, t, step.stage, room.derivative, run.work)
    row = method_of(model, step).last + 1  # of a slope that only the interpolant uses
    sample_guards(model, run.discrete, run.work, step.samples, row)
    return step.samples[row, j]


@compiled
def _search(
    model: Record, run: Record, h: float, j: int, low: float, high: float, past: float
) -> float:
    """Looks for the least value of guard ``j`` in a part of the step by golden sections.

    Returns:
        The share of the step at which it is below ``past``; 0 if it is not.
    """
    low, high = max(low, LEAST_FRACTION), min(high, 1.0 - LEAST_FRACTION)
    y0, y3 = _value_inside(model, run, h, j, low), _value_inside(model, run, h, j, high)
    x1, x2 = low + GOLDEN * (high - low), high - GOLDEN * (high - low)
    y1, y2 = _value_inside(model, run, h, j, x1), _value_inside(model, run, h, j, x2)
    while True:
        if y1 < past:
            return x1
        if y2 < past:
            return x2
        side = x1 - low
        steepest = max(abs(y1 - y0) / side, abs(y3 - y2) / side, abs(y2 - y1) / (x2 - x1))
        if high - low < LEAST_WIDTH or min(y1, y2) - past > steepest * side:
            # So steep it is nowhere that it could reach its level between these points.
            return 0.0
        if y1 < y2:
            high, x2, y3, y2 = x2, x1, y2, y1
            x1 = low + GOLDEN * (high - low)
            y1 = _value_inside(model, run, h, j, x1)
        else:
            low, x1, y0, y1 = x1, x2, y1, y2
            x2 = high - GOLDEN * (high - low)
            y2 = _value_inside(model, run, h, j, x2)


@compiled
def _slope(model: Record, run: Record, j: int, k: int) -> float:
    """Slope of guard ``j`` per step between node ``k``, counted from the start, and the next."""
    method = method_of(model, run.step)
    a, b = method.ordered[k], method.ordered[k + 1]
    rise = run.step.samples[b, j] - run.step.samples[a, j]
    return rise / (method.nodes[b] - method.nodes[a])


@compiled
def _may_fall_between(model: Record, run: Record, j: int, k: int, near: float) -> bool:
    """Whether guard ``j`` may sink to ``near`` and recover between node ``k`` and the next.

    It falls before the first and rises after the second, and the lines of both cross below; where
    it does only one of that, its line alone decides.
    """
    method, samples = method_of(model, run.step), run.step.samples
    a, b = method.ordered[k], method.ordered[k + 1]
    width, start, end = method.nodes[b] - method.nodes[a], samples[a, j], samples[b, j]
    falls = _slope(model, run, j, k - 1) if k > 0 else 0.0
    rises = _slope(model, run, j, k + 1) if k + 2 < method.num_ordered else 0.0
    if not falls < 0.0:
        return rises > 0.0 and end - rises * width < near
    if not rises > 0.0:
        return start + falls * width < near
    crossing = (end - start - rises * width) / (falls - rises)
    return 0.0 <= crossing <= width and start + falls * crossing < near


@compiled_apart(types.float64, MODEL, PROGRESS, types.float64, types.int64)
def _find_least(model: Record, run: Record, h: float, j: int) -> float:
    """The share of the step at which guard ``j`` is past its level; 0 if it is nowhere."""
    method, samples = method_of(model, run.step), run.step.samples
    least, largest = samples[0, j], samples[0, j]
    for k in range(1, method.num_ordered):
        value = samples[method.ordered[k], j]
        least, largest = min(least, value), max(largest, value)
    near = run.guards.levels[j] + NEAR_LINES * (largest - least)
    noise, _ = band_of(model, run.discrete, run.guards.ends, j)
    past = run.guards.levels[j] - noise
    for k in range(method.num_ordered - 1):
        low, high = method.nodes[method.ordered[k]], method.nodes[method.ordered[k + 1]]
        is_low = k > 0 and samples[method.ordered[k], j] < near
        if is_low and _value_inside(model, run, h, j, low) < past:
            return low
        if _may_fall_between(model, run, j, k, near):
            found = _search(model, run, h, j, low, high, past)
            if found > 0.0:
                return found
    return 0.0


@compiled
def _dip_of(model: Record, run: Record, h: float, j: int) -> float:
    """The share of the step at which guard ``j``, whose samples are kept, is past its level."""
    guards, step, last = run.guards, run.step, method_of(model, run.step).last
    start, end = guards.starts[j], guards.ends[j]
    least, largest = min(start, end), max(start, end)
    for row in range(1, last):
        least = min(least, step.samples[row, j])
        largest = max(largest, step.samples[row, j])
    if not least - guards.levels[j] < NEAR * (largest - least):
        return 0.0
    step.samples[0, j], step.samples[last, j] = start, end
    return _find_least(model, run, h, j)


@compiled
def _dip_of_coordinate(model: Record, run: Record, h: float, j: int) -> float:
    """The share of the step at which guard ``j``, which watches a coordinate, is past its level.

    The slopes of a coordinate are known: they give its values at the nodes of the step.
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
    """The share of the step at which the law is on the other side of a jump; 0 if nowhere."""
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
    """When, in a step of size ``h`` just taken, a guard is past its level; 0 if none is [s].

    At the end no guard is past its level, or the event has been located there; the first of its
    falls may still lie before. The end of a face is not looked at: a slip velocity keeps its sign
    within a phase.
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
