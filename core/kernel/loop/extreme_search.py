"""Search for extremes of forces inside a step.

The forces at the stages of the step are known. The extreme is computed from the dense output of
the method only if one of these values is close to a new extreme of the run, and either lies inside
the step or at an end where the force becomes more extreme towards the inside.

`slipgrasp.core.kernel.planar.interior` and `slipgrasp.core.kernel.spatial.interior` define the
guards that are forces, and their evaluation.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.dip_search import GOLDEN
from slipgrasp.core.kernel.loop.progress import Layouts
from slipgrasp.core.kernel.loop.tally import count_force, count_forces, count_margin
from slipgrasp.core.kernel.numerics.methods import method_of

# Distance of a value from the previous extreme below which its neighbourhood is searched, as a
# fraction of the range of the values in the step.
NEAR = 0.25
FLAT = 1e-9  # relative to 1 plus the value: smaller changes in a step are rounding errors
WIDTH = 3e-4  # of the search, as a fraction of the step
KINK_WIDTH = 1e-5  # the same if the law may have a kink: the error is proportional to the width
ROUND = 1.5  # ratio of the possible curvature of a force to that of its values
BESIDE = 1e-3  # distance from an end at which the slope of a force is tested, as a fraction


@compiled
def nears_record(
    model: Record, step: Record, j: int, sign: float, start: float, end: float, record: float
) -> bool:
    """True if guard ``j`` may have a new extreme in a step; a fast test before `least_inside`.

    The arguments are those of `least_inside`.
    """
    least, largest = min(start, end), max(start, end)
    for row in range(1, method_of(model, step).last):
        least = min(least, step.samples[row, j])
        largest = max(largest, step.samples[row, j])
    spread, best = largest - least, least if sign > 0.0 else -largest
    return spread > FLAT * (1.0 + abs(best)) and best < record + NEAR * spread


@compiled
def least_inside(
    model: Record,
    run: Record,
    h: float,
    j: int,
    sign: float,
    start: float,
    end: float,
    record: float,
    value_inside: Any,
) -> float:
    """Minimum of ``sign`` times guard ``j`` inside the step; inf if it is not a new extreme.

    Args:
        model: Constants of the run.
        run: The run, with the step just taken and samples of the guard at its stages.
        h: Size of the step [s].
        j: Index of the guard.
        sign: 1 for its minimum, -1 for its maximum.
        start: Value of the guard at the start of the step.
        end: Value of the guard at the end of the step.
        record: Minimum of the run so far.
        value_inside: Returns the value of a guard at a fraction of the step.
    """
    step, method = run.step, method_of(model, run.step)
    step.samples[0, j], step.samples[method.last, j] = start, end
    least, largest, place = np.inf, -np.inf, 0
    for k in range(method.num_ordered):
        value = sign * step.samples[method.ordered[k], j]
        largest = max(largest, value)
        if value < least:
            least, place = value, k
    spread = largest - least
    if not (spread > FLAT * (1.0 + abs(least)) and least < record + NEAR * spread):
        return np.inf
    final = method.num_ordered - 1
    ends = min(sign * start, sign * end)
    share, value = 0.0, np.inf
    # A kink of the law between two stages is invisible; with constant torques there is none.
    may_turn = model.law.period == 0.0
    width = KINK_WIDTH if may_turn else WIDTH
    if place not in (0, final):
        # Stages have low-order states, whose force may appear more extreme than it is.
        share = method.nodes[method.ordered[place]]
        value = sign * value_inside(model, run, h, j, share)
        if not value < ends:
            may_turn, place = True, 0 if sign * start < sign * end else final
    if place in (0, final):
        if place == final and not (may_turn or _may_turn_inside(model, step, j)):
            return np.inf
        share = BESIDE if place == 0 else 1.0 - BESIDE
        value = sign * value_inside(model, run, h, j, share)
        if not value < ends - FLAT * (1.0 + abs(ends)):
            return np.inf
    # For the same reason, the extreme may lie beyond the adjacent nodes.
    low, high = method.ordered[max(place - 3, 0)], method.ordered[min(place + 3, final)]
    shares = method.nodes[low], method.nodes[high]
    return _search(model, run, h, j, sign, shares[0], shares[1], share, value, width, value_inside)


@compiled
def _may_turn_inside(model: Record, step: Record, j: int) -> bool:
    """True if guard ``j``, extreme at an end of the step, may be more extreme next to it.

    A parabola through both ends has its extreme between them if its total change is less than its
    curvature. The curvature is the largest one implied by an inner value, times `ROUND`, because
    the first stages have low-order states. Stages at the same time are averaged: the errors of the
    two stages of the classical Runge-Kutta method at half a step cancel.
    """
    method, samples = method_of(model, step), step.samples
    start = samples[0, j]
    rise = samples[method.last, j] - start
    for k in range(1, method.num_ordered - 1):
        share, value, count = method.nodes[method.ordered[k]], 0.0, 0
        for row in range(1, method.last):
            if method.nodes[row] == share:
                value += samples[row, j]
                count += 1
        beside = abs(value / count - (start + share * rise))
        if abs(rise) * share * (1.0 - share) < ROUND * beside:
            return True
    return False


@compiled
def _to_vertex(x1: float, x2: float, x3: float, y1: float, y2: float, y3: float) -> float:
    """Distance from ``x1`` to the vertex of the parabola through three points; inf if none."""
    a, b = (x1 - x2) * (y1 - y3), (x1 - x3) * (y1 - y2)
    return 0.5 * ((x1 - x3) * b - (x1 - x2) * a) / (a - b) if a != b else np.inf


@compiled
def _search(
    model: Record,
    run: Record,
    h: float,
    j: int,
    sign: float,
    low: float,
    high: float,
    x1: float,
    y1: float,
    width: float,
    value_inside: Any,
) -> float:
    """Minimum of ``sign`` times guard ``j`` between two fractions, starting from an inner point.

    Brent's method: parabolas through the three best points, golden sections if these do not
    converge (Algorithms for Minimization without Derivatives, 1973, chapter 5).
    """
    x2, x3, y2, y3 = x1, x1, y1, y1
    last = before = 0.0
    while max(x1 - low, high - x1) > width:
        wider = (low if x1 - low > high - x1 else high) - x1
        move = _to_vertex(x1, x2, x3, y1, y2, y3)
        if abs(move) < 0.5 * abs(before) and low < x1 + move < high:
            before = last
        else:
            before, move = wider, GOLDEN * wider
        if abs(move) < 0.5 * width:
            move = 0.5 * width if wider > 0.0 else -0.5 * width
        last, x = move, x1 + move
        y = sign * value_inside(model, run, h, j, x)
        if y <= y1:
            low, high = (low, x1) if move < 0.0 else (x1, high)
            x3, y3, x2, y2, x1, y1 = x2, y2, x1, y1, x, y
            continue
        low, high = (x, high) if move < 0.0 else (low, x)
        if y <= y2 or x2 == x1:
            x3, y3, x2, y2 = x2, y2, x, y
        elif y <= y3 or x3 in (x1, x2):
            x3, y3 = x, y
    return y1


def make_count_extremes(
    layouts: Layouts, per_contact: int, count_ways: Any, value_inside: Any
) -> Any:
    """Creates the accumulation of the forces in a step, for one kind of hand.

    Args:
        layouts: Records of this kind of hand.
        per_contact: Number of guards per contact.
        count_ways: Returns the number of phase guards among these for a model.
        value_inside: Returns the value of a guard at a fraction of the step.
    """

    @compiled_apart(
        types.float64,
        *(layouts.model, layouts.progress, types.float64, types.int64),
        *(types.float64, types.float64, types.float64),
        prefix=layouts.prefix,
    )
    def find_extreme(
        model: Record, run: Record, h: float, j: int, sign: float, start: float, record: float
    ) -> float:
        """Minimum of ``sign`` times guard ``j`` in the step; inf if it is not a new extreme."""
        end = run.guards.ends[j]
        return least_inside(model, run, h, j, sign, start, end, record, value_inside)

    @compiled
    def _extreme_of(
        model: Record, run: Record, h: float, j: int, sign: float, start: float, record: float
    ) -> float:
        """As `find_extreme`, but inf if no new extreme is possible."""
        if not nears_record(model, run.step, j, sign, start, run.guards.ends[j], record):
            return np.inf
        return find_extreme(model, run, h, j, sign, start, record)

    @compiled
    def count_extremes(model: Record, run: Record, h: float) -> None:
        """Accumulates the forces in the step of size ``h`` and at its end."""
        discrete, tally = run.discrete, run.tally
        for i in range(model.num_fingers):
            base, peak = per_contact * i, tally.peak_normal_force[i]
            normal = base + per_contact - 3
            least = _extreme_of(model, run, h, normal, -1.0, tally.force[i], -peak)
            count_force(tally.peak_normal_force, i, -least)
            if discrete.phases[i] == 0:
                for way in range(count_ways(model)):
                    record, start = tally.least_margin[i], tally.margins[i, way]
                    least = _extreme_of(model, run, h, base + way, 1.0, start, record)
                    count_margin(tally.least_margin, i, least)
        count_forces(model, discrete, run.guards.ends, tally, per_contact, count_ways(model))

    return count_extremes
