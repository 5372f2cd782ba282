"""Profile likelihood: how far each parameter can go while the others follow, and its class."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from slipgrasp.core.fit.objective import Objective
from slipgrasp.core.fit.optimiser import Minimum, minimise
from slipgrasp.core.trace.signals import Floats

ParameterClass = Literal["bounded", "only above", "only below", "flat"]

THRESHOLD_95 = 3.841458820694124
"""95 % quantile of chi-squared with one degree of freedom."""

_RELATIVE_ERROR = 0.03
_RELATIVE_WIDTH = 3e-3
_MOST_REFINEMENTS = 12
_GROWTH = 2.0
_LEAST_STEP = 2e-4
_LARGEST_STEP = 0.2
_BETTER = 0.1


class BetterMinimumError(Exception):
    """The profile went through a point below the minimum that it started from."""

    def __init__(self, minimum: Minimum) -> None:
        self.minimum = minimum
        super().__init__("a lower minimum")


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """The profile of one parameter.

    Attributes:
        points: Share of the range and rise of chi-squared above its minimum, by share.
        low: Share where the rise passes the threshold below the minimum; None if it does not
            within the range.
        high: The same above.
    """

    points: tuple[tuple[float, float], ...]
    low: float | None
    high: float | None

    @property
    def kind(self) -> ParameterClass:
        """Which sides the data bound."""
        if self.low is None:
            return "flat" if self.high is None else "only above"
        return "only below" if self.high is None else "bounded"


def profile(
    objective: Objective,
    best: Minimum,
    index: int,
    threshold: float,
    note: Callable[[float, float], None] = lambda share, rise: None,
) -> Profile:
    """The profile of a parameter, from the minimum to the threshold on both sides.

    Args:
        objective: The objective.
        best: Its minimum.
        index: The parameter.
        threshold: Rise of chi-squared at the ends of the interval.
        note: Called with every share and the rise there.

    Raises:
        BetterMinimumError: If there is a lower minimum.
    """
    step = _first_step(best, index, threshold)
    side = _Side(objective, best, index, threshold, note)
    high, above = side.search(step)
    low, below = side.search(-step)
    points = {float(best.shares[index]): 0.0, **above, **below}
    return Profile(points=tuple(sorted(points.items())), low=low, high=high)


def rise_at(objective: Objective, best: Minimum, index: int, truth: Floats) -> float:
    """Rise of chi-squared where one parameter has its true share and the others follow.

    Args:
        objective: The objective.
        best: Its minimum.
        index: The parameter.
        truth: The true shares, from which the others start.
    """
    found = minimise(objective, truth, {index: float(truth[index])})
    return found.chi_squared - best.chi_squared


def _first_step(best: Minimum, index: int, threshold: float) -> float:
    """Distance at which the rise would reach the threshold if chi-squared were a parabola."""
    information = best.jacobian.T @ best.jacobian
    variance = np.linalg.pinv(information, rcond=1e-10)[index, index]
    seen = information[index, index] > 0.0 and variance > 0.0
    step = float(np.sqrt(threshold * variance)) if seen else _LARGEST_STEP
    return min(max(step, _LEAST_STEP), _LARGEST_STEP)


class _Side:
    """The search on one side of the minimum.

    The other parameters start where the points so far lead to: in a narrow valley, such as that
    of two frictions which only their ratio decides, a search from elsewhere would not find it.
    """

    def __init__(
        self,
        objective: Objective,
        best: Minimum,
        index: int,
        threshold: float,
        note: Callable[[float, float], None],
    ) -> None:
        self._note = note
        self._objective = objective
        self._best = best
        self._index = index
        self._threshold = threshold
        self._origin = float(best.shares[index])
        self._tangent = _tangent(best, index)

    def search(self, step: float) -> tuple[float | None, dict[float, float]]:
        """The share where the rise passes the threshold, and the rises on the way."""
        end = 1.0 if step > 0.0 else 0.0
        path = [self._best.shares]
        inner = (self._origin, 0.0)
        rises: dict[float, float] = {}
        while inner[0] != end:
            share = self._origin + step
            share = min(share, end) if step > 0.0 else max(share, end)
            rise, found = self._rise(share, path)
            rises[share] = rise
            if rise > self._threshold:
                return self._refine(inner, (share, rise), path, rises), rises
            inner = share, rise
            path.append(found.shares)
            step *= _GROWTH
        return None, rises

    def _rise(self, share: float, path: list[Floats]) -> tuple[float, Minimum]:
        """The rise at a share, from the start that leads lower."""
        fixed = {self._index: share}
        starts = [self._predicted(share, path), path[-1]]
        found = minimise(self._objective, starts[0], fixed)
        if found.chi_squared - self._best.chi_squared > self._threshold:
            other = minimise(self._objective, starts[1], fixed)
            found = min(found, other, key=lambda each: each.chi_squared)
        rise = found.chi_squared - self._best.chi_squared
        if rise < -_BETTER:
            raise BetterMinimumError(found)
        rise = max(rise, 0.0)
        self._note(share, rise)
        return rise, found

    def _predicted(self, share: float, path: list[Floats]) -> Floats:
        """Where the other parameters are expected, by the last two points of the path."""
        last = path[-1]
        slope = self._tangent
        if len(path) > 1:
            slope = (last - path[-2]) / (last[self._index] - path[-2][self._index])
        return np.clip(last + slope * (share - last[self._index]), 0.0, 1.0)

    def _refine(
        self,
        inner: tuple[float, float],
        outer: tuple[float, float],
        path: list[Floats],
        rises: dict[float, float],
    ) -> float:
        """Where the rise is the threshold: its root is nearly straight in the distance.

        Every second step halves the distance, for the rise may have a jump.
        """
        for number in range(_MOST_REFINEMENTS):
            if abs(outer[0] - inner[0]) < _RELATIVE_WIDTH * abs(outer[0] - self._origin):
                break
            roots = [np.sqrt(rise) for _, rise in (inner, outer)]
            part = float((np.sqrt(self._threshold) - roots[0]) / (roots[1] - roots[0]))
            part = 0.5 if number % 2 else min(max(part, 0.1), 0.9)
            share = inner[0] + part * (outer[0] - inner[0])
            rise, found = self._rise(share, path)
            rises[share] = rise
            if abs(rise - self._threshold) < _RELATIVE_ERROR * self._threshold:
                return share
            if rise > self._threshold:
                outer = share, rise
            else:
                inner = share, rise
                path.append(found.shares)
        return outer[0]


def _tangent(best: Minimum, index: int) -> Floats:
    """How the others follow one parameter to first order: minus H_oo^-1 H_oi, by share."""
    information = best.jacobian.T @ best.jacobian
    others = [k for k in range(len(best.shares)) if k != index]
    slope = np.zeros(len(best.shares))
    slope[index] = 1.0
    block = information[np.ix_(others, others)]
    slope[others] = -np.linalg.pinv(block, rcond=1e-10) @ information[others, index]
    return slope
