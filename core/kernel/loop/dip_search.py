"""The search for guards that sink below their level and recover within one step.

The values of a guard at the slopes of the step show where it may be lowest: a value between two
others is not below the lines through their neighbours, on either side, also where the law has a
kink. Only if these lines cross near its level, the continuous extension of the method is asked for
the least value itself. This costs nothing but comparisons in nearly all steps, and no output time
has a part in it.

The planar and the spatial kernel share it: `slipgrasp.core.kernel.planar.interior` and
`slipgrasp.core.kernel.spatial.interior` say which guards are sampled and how one is evaluated.
"""

from __future__ import annotations

from typing import Any

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.progress import Layouts
from slipgrasp.core.kernel.numerics.methods import method_of

# A guard is looked at where its least value may come this near to its level, as a share of the
# range of its values in the step: by the values alone, and by the lines through them.
NEAR, NEAR_LINES = 0.5, 0.02
LEAST_FRACTION = 1e-6
GOLDEN = 0.3819660112501051
LEAST_WIDTH = 1e-5  # of the search, as a share of the step


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
    """Looks for the least value of guard ``j`` in a part of the step by golden sections.

    Returns:
        The share of the step at which it is below ``past``; 0 if it is not.
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
            # So steep it is nowhere that it could reach its level between these points.
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


@compiled
def search_step(
    model: Record, run: Record, h: float, j: int, noise: float, value_inside: Any
) -> float:
    """The share of the step at which guard ``j`` is past its level; 0 if it is nowhere.

    Args:
        model: Constants of the run.
        run: The run, with the step just taken and samples of the guard at its slopes.
        h: Size of the step [s].
        j: Number of the guard.
        noise: By how much it must be past its level.
        value_inside: Its value at a share of the step.
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
    """Whether guard ``j`` comes near its level at the slopes of a step.

    Args:
        model: Constants of the run.
        step: The step, with samples of the guard at the slopes inside it.
        j: Number of the guard.
        start: Value at the start of the step, from now on a sample too.
        end: Value at its end, likewise.
        level: Through which it falls.
    """
    method = method_of(model, step)
    step.samples[method.ordered[0], j], step.samples[method.last, j] = start, end
    least, largest = min(start, end), max(start, end)
    for row in range(1, method.last):
        least = min(least, step.samples[row, j])
        largest = max(largest, step.samples[row, j])
    return least - level < NEAR * (largest - least)


def make_dip_of(layouts: Layouts, band_of: Any, value_inside: Any) -> tuple[Any, Any]:
    """How a mechanics looks for a guard that is past its level inside the step just taken.

    Args:
        layouts: Its records.
        band_of: Noise and band of a guard.
        value_inside: Value of a guard at a share of the step.

    Returns:
        The search, for a guard with samples at all slopes; the same where those come near its
        level, for one whose samples at the ends are missing.
    """

    @compiled_apart(
        types.float64,
        *(layouts.model, layouts.progress, types.float64, types.int64),
        prefix=layouts.prefix,
    )
    def find_least(model: Record, run: Record, h: float, j: int) -> float:
        """The share of the step at which guard ``j`` is past its level; 0 if it is nowhere."""
        noise, _ = band_of(model, run.discrete, run.guards.ends, j)
        return search_step(model, run, h, j, noise, value_inside)

    @compiled
    def dip_of(model: Record, run: Record, h: float, j: int) -> float:
        """The same, where the guard comes near its level at all."""
        guards = run.guards
        if not comes_near(model, run.step, j, guards.starts[j], guards.ends[j], guards.levels[j]):
            return 0.0
        return find_least(model, run, h, j)

    return find_least, dip_of
