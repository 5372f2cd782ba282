"""Profile likelihood: range of each parameter while the others adjust, and its class."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, Protocol

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
BETTER = 0.1
"""Difference of chi-squared from which another minimum counts as lower."""


class Minimise(Protocol):
    """A search for a minimum."""

    def __call__(
        self, objective: Objective, start: Floats, fixed: Mapping[int, float] | None = None
    ) -> Minimum:
        """Finds a minimum from scaled parameters, of which some are fixed, by index."""
        ...


class BetterMinimumError(Exception):
    """The profile found a point below the minimum from which it started."""

    def __init__(self, minimum: Minimum) -> None:
        self.minimum = minimum
        super().__init__("a lower minimum")


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """The profile of one parameter.

    Attributes:
        points: Scaled value and rise of chi-squared above its minimum, in order.
        low: Scaled value where the rise crosses the threshold below the minimum; None if it does
            not within the range.
        high: The same above the minimum.
    """

    points: tuple[tuple[float, float], ...]
    low: float | None
    high: float | None

    @property
    def kind(self) -> ParameterClass:
        """The sides on which the data bound the parameter."""
        if self.low is None:
            return "flat" if self.high is None else "only above"
        return "only below" if self.high is None else "bounded"


def profile(
    objective: Objective,
    best: Minimum,
    index: int,
    threshold: float,
    note: Callable[[float, float], None] = lambda share, rise: None,
    search: Minimise = minimise,
) -> Profile:
    """Computes the profile of a parameter, from the minimum to the threshold on both sides.

    Args:
        objective: The objective.
        best: Its minimum.
        index: Index of the parameter.
        threshold: Rise of chi-squared at the ends of the interval.
        note: Called with every share and the rise there.
        search: Finds the minimum at a fixed value.

    Raises:
        BetterMinimumError: If there is a lower minimum.
    """
    step = _first_step(best, index, threshold)
    side = _Side(objective, best, index, threshold, search, note)
    high, above = side.search(step)
    low, below = side.search(-step)
    points = {float(best.shares[index]): 0.0, **above, **below}
    return Profile(points=tuple(sorted(points.items())), low=low, high=high)


def rise_at(
    objective: Objective, best: Minimum, index: int, truth: Floats, search: Minimise = minimise
) -> float:
    """Rise of chi-squared with one parameter at its true value and the others adjusted.

    Args:
        objective: The objective.
        best: Its minimum.
        index: Index of the parameter.
        truth: The true scaled values, from which the others start.
        search: Finds the minimum at a fixed value.
    """
    found = search(objective, truth, {index: float(truth[index])})
    return found.chi_squared - best.chi_squared


def contains(
    objective: Objective,
    best: Minimum,
    index: int,
    threshold: float,
    truth: Floats,
    search: Minimise = minimise,
) -> bool:
    """Whether the interval of a parameter contains its true value.

    Where chi-squared jumps, its rise may exceed the threshold at a value but not further out.

    Args:
        objective: The objective.
        best: Its minimum.
        index: Index of the parameter.
        threshold: Rise of chi-squared at the ends of the interval.
        truth: The true scaled values.
        search: Finds the minimum at a fixed value.

    Raises:
        BetterMinimumError: If there is a lower minimum.
    """
    if rise_at(objective, best, index, truth, search) <= threshold:
        return True
    distance = float(truth[index] - best.shares[index])
    side = _Side(objective, best, index, threshold, search)
    _, rises = side.search(math.copysign(_first_step(best, index, threshold), distance))
    return any(
        rise <= threshold and abs(share - best.shares[index]) > abs(distance)
        for share, rise in rises.items()
    )


def _first_step(best: Minimum, index: int, threshold: float) -> float:
    """Distance at which the rise would reach the threshold if chi-squared were quadratic."""
    information = best.jacobian.T @ best.jacobian
    variance = np.linalg.pinv(information, rcond=1e-10)[index, index]
    seen = information[index, index] > 0.0 and variance > 0.0
    step = float(np.sqrt(threshold * variance)) if seen else _LARGEST_STEP
    return min(max(step, _LEAST_STEP), _LARGEST_STEP)


class _Side:
    """The search on one side of the minimum.

    The other parameters start from an extrapolation of the points so far: in a narrow valley, such
    as that of two frictions with a determined ratio, a search from elsewhere would fail.
    """

    def __init__(
        self,
        objective: Objective,
        best: Minimum,
        index: int,
        threshold: float,
        search: Minimise,
        note: Callable[[float, float], None] = lambda share, rise: None,
    ) -> None:
        self._minimise = search
        self._note = note
        self._objective = objective
        self._best = best
        self._index = index
        self._threshold = threshold
        self._origin = float(best.shares[index])
        self._tangent = tangent(best, index)

    def search(self, step: float) -> tuple[float | None, dict[float, float]]:
        """The scaled value where the rise crosses the threshold, and the rises on the way."""
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
        """The rise at a scaled value, from the better of two starts."""
        fixed = {self._index: share}
        starts = [self._predicted(share, path), path[-1]]
        found = self._minimise(self._objective, starts[0], fixed)
        if found.chi_squared - self._best.chi_squared > self._threshold:
            other = self._minimise(self._objective, starts[1], fixed)
            found = min(found, other, key=lambda each: each.chi_squared)
        rise = found.chi_squared - self._best.chi_squared
        if rise < -BETTER:
            raise BetterMinimumError(found)
        rise = max(rise, 0.0)
        self._note(share, rise)
        return rise, found

    def _predicted(self, share: float, path: list[Floats]) -> Floats:
        """Extrapolates the other parameters from the last two points of the path."""
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
        """Finds where the rise equals the threshold: its root is nearly linear in the distance.

        Every second step halves the distance, because the rise may have a jump.
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


def tangent(best: Minimum, index: int) -> Floats:
    """First-order change of the others with one parameter: -H_oo^-1 H_oi, per scaled value."""
    information = best.jacobian.T @ best.jacobian
    others = [k for k in range(len(best.shares)) if k != index]
    slope = np.zeros(len(best.shares))
    slope[index] = 1.0
    block = information[np.ix_(others, others)]
    slope[others] = -np.linalg.pinv(block, rcond=1e-10) @ information[others, index]
    return slope
