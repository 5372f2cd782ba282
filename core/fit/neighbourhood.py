"""Minimization near a minimum where chi-squared jumps.

Signals jump where an event crosses a control tick. Between two jumps chi-squared has its own
minimum, which least squares does not leave. Runs on lines across the jumps show the lowest one,
also with some parameters fixed or for other data, because signals do not depend on the data.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.fit.objective import Objective, huber
from slipgrasp.core.fit.optimiser import Minimum, minimise
from slipgrasp.core.fit.profile import THRESHOLD_95, Profile, tangent
from slipgrasp.core.trace.signals import Floats

LINE_POINTS = 32

LEAST_JUMP = 0.5
"""Smallest jump of the residuals that counts, in standard deviations.

Noise changes the difference of chi-squared across a smaller one by less than 1 (standard
deviation).
"""

_HALVINGS = 8

NEAR = 4.0
"""Rise of chi-squared, in thresholds, up to which jumps count.

Signals at a distance of d standard deviations from the true ones have a lower chi-squared if the
noise in their direction exceeds d / 2: beyond this rise in less than 2.5 %.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """Runs on a line through a minimum.

    Attributes:
        index: The parameter that varies; the others follow to first order.
        points: Scaled parameters of the runs, shape ``(runs, parameters)``.
        models: Their sampled signals, shape ``(runs, samples, signals)``.
    """

    index: int
    points: Floats
    models: Floats

    @property
    def spacing(self) -> float:
        """Distance between runs, scaled."""
        return float(self.points[1, self.index] - self.points[0, self.index])

    def lowest(self, objective: Objective, jacobian: Floats, fixed: Mapping[int, float]) -> Floats:
        """The point of the lowest chi-squared, the other parameters adjusted to first order.

        The adjusted parameters shift the jumps, so the most promising points are simulated.
        """
        moves = np.zeros_like(self.points)
        for k, share in fixed.items():
            moves[:, k] = share - self.points[:, k]
        free = [k for k in range(moves.shape[1]) if k != self.index and k not in fixed]
        residuals = np.array([objective.residuals_of(model) for model in self.models])
        residuals += moves @ jacobian.T
        moves[:, free] = -residuals @ np.linalg.pinv(jacobian[:, free]).T
        heights = huber(residuals + moves[:, free] @ jacobian[:, free].T).sum(axis=1)
        rows = np.flatnonzero(heights <= heights.min() + THRESHOLD_95)
        adjusted = np.clip(self.points[rows] + moves[rows], 0.0, 1.0)
        return min(adjusted, key=objective.chi_squared)


@dataclass(frozen=True, slots=True, eq=False)
class Neighbourhood:
    """Runs around a minimum.

    Attributes:
        lines: Lines across jumps; empty if there are none.
        jacobian: Derivative of the residuals between the jumps, shape ``(values, parameters)``.
    """

    lines: tuple[Line, ...]
    jacobian: Floats

    def minimise(
        self, objective: Objective, start: Floats, fixed: Mapping[int, float] | None = None
    ) -> Minimum:
        """Finds the lowest minimum on both sides of the jumps.

        Args:
            objective: The objective, perhaps with other data.
            start: Scaled initial parameters.
            fixed: Fixed scaled parameters, by index.
        """
        known = dict(fixed or {})
        found = minimise(objective, start, known)
        for line in self.lines:
            k = line.index
            if k not in known:
                ends = [found]
                near = line.lowest(objective, self.jacobian, known)
                if abs(near[k] - found.shares[k]) > line.spacing:
                    ends.append(minimise(objective, near, known))
                # At a jump all steps of least squares fail, unless they leave this parameter.
                ends += [minimise(objective, e.shares, {**known, k: e.shares[k]}) for e in ends]
                found = min(ends, key=lambda end: end.chi_squared)
        return found if known or not self.lines else replace(found, jacobian=self.jacobian)


def explore(
    objective: Objective, best: Minimum, profiles: Sequence[Profile], threshold: float
) -> Neighbourhood:
    """Simulates runs around a minimum, and keeps the lines on which signals jump.

    A forward difference across a jump is no derivative, but the median of the changes along a line
    is one.

    Args:
        objective: The objective.
        best: Its minimum.
        profiles: The profiles of all parameters, whose intervals determine the lengths.
        threshold: Rise of chi-squared at the ends of the intervals.
    """
    directions = np.array([tangent(best, k) for k in range(len(profiles))])
    slopes = directions @ best.jacobian.T
    lines = []
    for index, found in enumerate(profiles):
        if found.low is None or found.high is None:
            continue
        line = _line(objective, best.shares, directions[index], index, (found.low, found.high))
        residuals = np.array([objective.residuals_of(model) for model in line.models])
        rises = huber(residuals).sum(axis=1) - best.chi_squared
        near = rises <= NEAR * threshold
        changes = np.diff(residuals, axis=0)
        if _jumps(objective, line, residuals, near):
            lines.append(line)
            slopes[index] = np.median(changes[near[1:] & near[:-1]], axis=0) / line.spacing
    return Neighbourhood(tuple(lines), (np.linalg.pinv(directions) @ slopes).T)


def _line(
    objective: Objective,
    shares: Floats,
    direction: Floats,
    index: int,
    interval: tuple[float, float],
) -> Line:
    """Runs over an interval and half of its length on both sides."""
    low, high = interval
    first, last = max(1.5 * low - 0.5 * high, 0.0), min(1.5 * high - 0.5 * low, 1.0)
    distances = np.linspace(first, last, LINE_POINTS) - shares[index]
    points = np.clip(shares + np.outer(distances, direction), 0.0, 1.0)
    return Line(index, points, np.array([objective.model(point) for point in points]))


def _jumps(objective: Objective, line: Line, residuals: Floats, near: NDArray[np.bool_]) -> bool:
    """Whether the residuals jump where their change differs most from those before and after it.

    A jump remains when the distance of the runs is halved again and again; a steep change does not.
    """
    changes = np.diff(residuals, axis=0)
    excess = np.linalg.norm(changes[1:-1] - 0.5 * (changes[:-2] + changes[2:]), axis=1)
    excess[~(near[:-3] & near[1:-2] & near[2:-1] & near[3:])] = 0.0
    if excess.max() <= LEAST_JUMP:
        return False
    row = int(np.argmax(excess)) + 1
    low, high = line.points[row], line.points[row + 1]
    below, above = residuals[row], residuals[row + 1]
    for _ in range(_HALVINGS):
        if np.linalg.norm(above - below) <= LEAST_JUMP:
            return False
        middle = 0.5 * (low + high)
        between = objective.residuals(middle)
        if np.linalg.norm(between - below) > np.linalg.norm(above - between):
            high, above = middle, between
        else:
            low, below = middle, between
    return True
