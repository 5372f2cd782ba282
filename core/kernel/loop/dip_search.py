"""Search for guards that fall below their level and recover within one step.

The values of a guard at the stages of the step show where its minimum may be: between two stages,
the guard is assumed to lie above the lines through the neighbouring values on either side, even at
a kink of the law. The minimum is computed from the dense output of the method only if these lines
cross near the level. Nearly all steps therefore need only comparisons, and output times have no
influence.

`slipgrasp.core.kernel.planar.interior` and `slipgrasp.core.kernel.spatial.interior` define the
sampled guards and their evaluation.
"""

from __future__ import annotations

from typing import Any

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.progress import Layouts
from slipgrasp.core.kernel.numerics.methods import method_of

# A guard is examined if its minimum is closer to its level than this fraction of the range of its
# values in the step: those at the stages, and those of the lines through them.
NEAR, NEAR_LINES = 0.5, 0.02
LEAST_FRACTION = 1e-6
GOLDEN = 0.3819660112501051
LEAST_WIDTH = 1e-5  # of the search, as a fraction of the step


@compiled
def _search(
    model: Record,
    run: Record,
    h: float,
    j: int,
    low: float,
    high: float,
    past: float,
    value_inside: Any,
) -> float:
    """Searches for the minimum of guard ``j`` in a part of the step by golden-section search.

    Returns:
        A fraction of the step at which the guard is below ``past``; 0 if none is found.
    """
    low, high = max(low, LEAST_FRACTION), min(high, 1.0 - LEAST_FRACTION)
    y0, y3 = value_inside(model, run, h, j, low), value_inside(model, run, h, j, high)
    x1, x2 = low + GOLDEN * (high - low), high - GOLDEN * (high - low)
    y1, y2 = value_inside(model, run, h, j, x1), value_inside(model, run, h, j, x2)
    while True:
        if y1 < past:
            return x1
        if y2 < past:
            return x2
        side = x1 - low
        steepest = max(abs(y1 - y0) / side, abs(y3 - y2) / side, abs(y2 - y1) / (x2 - x1))
        if high - low < LEAST_WIDTH or min(y1, y2) - past > steepest * side:
            # The guard is not steep enough to reach its level between these points.
            return 0.0
        if y1 < y2:
            high, x2, y3, y2 = x2, x1, y2, y1
            x1 = low + GOLDEN * (high - low)
            y1 = value_inside(model, run, h, j, x1)
        else:
            low, x1, y0, y1 = x1, x2, y1, y2
            x2 = high - GOLDEN * (high - low)
            y2 = value_inside(model, run, h, j, x2)


@compiled
def _slope(model: Record, run: Record, j: int, k: int) -> float:
    """Slope of guard ``j`` per step size, between the ``k``-th node of the step and the next."""
    method = method_of(model, run.step)
    a, b = method.ordered[k], method.ordered[k + 1]
    rise = run.step.samples[b, j] - run.step.samples[a, j]
    return rise / (method.nodes[b] - method.nodes[a])


@compiled
def _may_fall_between(model: Record, run: Record, j: int, k: int, near: float) -> bool:
    """True if guard ``j`` may fall to ``near`` and recover between node ``k`` and the next.

    The guard falls before the first node and rises after the second, and the two lines cross below
    ``near``. If it only falls or only rises, its single line decides.
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


@compiled
def search_step(
    model: Record, run: Record, h: float, j: int, noise: float, value_inside: Any
) -> float:
    """A fraction of the step at which guard ``j`` is past its level; 0 if never.

    Args:
        model: Constants of the run.
        run: The run, with the step just taken and samples of the guard at its stages.
        h: Size of the step [s].
        j: Index of the guard.
        noise: Amount by which the guard must be past its level.
        value_inside: Returns the value of a guard at a fraction of the step.
    """
    method, samples = method_of(model, run.step), run.step.samples
    least, largest = samples[0, j], samples[0, j]
    for k in range(1, method.num_ordered):
        value = samples[method.ordered[k], j]
        least, largest = min(least, value), max(largest, value)
    near = run.guards.levels[j] + NEAR_LINES * (largest - least)
    past = run.guards.levels[j] - noise
    for k in range(method.num_ordered - 1):
        low, high = method.nodes[method.ordered[k]], method.nodes[method.ordered[k + 1]]
        is_low = k > 0 and samples[method.ordered[k], j] < near
        if is_low and value_inside(model, run, h, j, low) < past:
            return low
        if _may_fall_between(model, run, j, k, near):
            found = _search(model, run, h, j, low, high, past, value_inside)
            if found > 0.0:
                return found
    return 0.0


@compiled
def comes_near(model: Record, step: Record, j: int, start: float, end: float, level: float) -> bool:
    """True if guard ``j`` comes close to its level at the stages of a step.

    Args:
        model: Constants of the run.
        step: The step, with samples of the guard at its inner stages.
        j: Index of the guard.
        start: Value at the start of the step, stored as a sample.
        end: Value at the end of the step, stored as a sample.
        level: Level through which it falls.
    """
    method = method_of(model, step)
    step.samples[method.ordered[0], j], step.samples[method.last, j] = start, end
    least, largest = min(start, end), max(start, end)
    for row in range(1, method.last):
        least = min(least, step.samples[row, j])
        largest = max(largest, step.samples[row, j])
    return least - level < NEAR * (largest - least)


def make_dip_of(layouts: Layouts, band_of: Any, value_inside: Any) -> tuple[Any, Any]:
    """Creates the search for guards past their level inside a step, for one kind of hand.

    Args:
        layouts: Records of this kind of hand.
        band_of: Returns noise and band of a guard.
        value_inside: Returns the value of a guard at a fraction of the step.

    Returns:
        Two searches: for guards with samples at all stages, and for guards without samples at the
        ends, which are first checked for closeness to their level.
    """

    @compiled_apart(
        types.float64,
        *(layouts.model, layouts.progress, types.float64, types.int64),
        prefix=layouts.prefix,
    )
    def find_least(model: Record, run: Record, h: float, j: int) -> float:
        """A fraction of the step at which guard ``j`` is past its level; 0 if never."""
        noise, _ = band_of(model, run.discrete, run.guards.ends, j)
        return search_step(model, run, h, j, noise, value_inside)

    @compiled
    def dip_of(model: Record, run: Record, h: float, j: int) -> float:
        """As `find_least`, but 0 if the guard does not come close to its level."""
        guards = run.guards
        if not comes_near(model, run.step, j, guards.starts[j], guards.ends[j], guards.levels[j]):
            return 0.0
        return find_least(model, run, h, j)

    return find_least, dip_of
