"""Search for the lowest minimum: least squares from many starts, then scans over each friction.

Where a contact sticks, chi-squared does not depend on its friction, and where slip begins it
jumps. Least squares steps across such a jump onto the plateau, and cannot leave it. A scan over the
friction shows the valleys; a search that is confined to one does not leave it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from slipgrasp.core.fit.objective import Objective
from slipgrasp.core.fit.optimiser import SAME_MINIMUM, Minimum, minimise, start_points
from slipgrasp.core.fit.progress import ProgressReports
from slipgrasp.core.fit.report import EXPLAINED
from slipgrasp.core.trace.signals import Floats

SCAN_POINTS = 32
MOST_VALLEYS = 4
MOST_MINIMA = 4
"""Largest number of minima, the lowest ones, that are scanned until one explains the data."""

_FLAT = 1e-6
"""Relative change of chi-squared between points of a scan below which it is a plateau."""


def search_from_starts(
    objective: Objective, count: int, seed: int, reports: ProgressReports
) -> list[Minimum]:
    """The minima from the scenario and a Sobol sequence, lowest first."""
    points = start_points(objective.problem.start, count, seed)
    minima = []
    for number, point in enumerate(points):
        reports.enter("searching", number / len(points))
        minima.append(minimise(objective, point))
        reports.improve(min(minima, key=_height))
    return sorted(minima, key=_height)


def scan_frictions(
    objective: Objective, minima: Sequence[Minimum], reports: ProgressReports
) -> Minimum:
    """The lowest minimum found by scans over friction coefficients from other minima.

    Args:
        objective: The objective.
        minima: Minima, lowest first.
        reports: Receives the progress.
    """
    best = minima[0]
    chosen = _different(minima)[:MOST_MINIMA]
    for number, minimum in enumerate(chosen):
        if number > 0 and best.chi_squared <= EXPLAINED * objective.degrees_of_freedom:
            break
        reports.enter("scanning friction", number / len(chosen))
        best = min(best, _descended(objective, minimum), key=_height)
        reports.improve(best)
    return best


def _height(minimum: Minimum) -> float:
    return minimum.chi_squared


def _different(minima: Sequence[Minimum]) -> list[Minimum]:
    heights = [-np.inf, *map(_height, minima)]
    rises = np.diff(heights)
    return [each for each, rise in zip(minima, rises, strict=True) if rise >= SAME_MINIMUM]


def _descended(objective: Objective, minimum: Minimum) -> Minimum:
    """The minimum from which no scan finds a lower one."""
    while (lower := _lower(objective, minimum)) is not None:
        minimum = lower
    return minimum


def _lower(objective: Objective, minimum: Minimum) -> Minimum | None:
    """A lower minimum in a valley of a scan over a friction, if there is one."""
    for index, parameter in enumerate(objective.problem.parameters):
        if parameter.contact is None:
            continue
        for share in _valleys(objective, minimum.shares, index):
            start = minimum.shares.copy()
            start[index] = share
            reach = 1.0 / SCAN_POINTS
            limits = max(share - reach, 0.0), min(share + reach, 1.0)
            found = minimise(objective, start, limits={index: limits})
            if found.chi_squared < minimum.chi_squared - SAME_MINIMUM:
                return minimise(objective, found.shares)
    return None


def _valleys(objective: Objective, shares: Floats, index: int) -> Iterator[float]:
    """Scaled values of a parameter where a scan has local minima, lowest first.

    Points of a plateau count as infinitely high, because an adjacent valley may be so narrow that
    no point of the scan in it is lower than the plateau.
    """
    scan = (np.arange(SCAN_POINTS) + 0.5) / SCAN_POINTS
    points = np.tile(shares, (SCAN_POINTS, 1))
    points[:, index] = scan
    heights = np.array([objective.chi_squared(point) for point in points])
    flat = np.abs(np.diff(heights)) <= _FLAT * heights[1:]
    heights[np.append(flat, False) | np.insert(flat, 0, False)] = np.inf
    around = np.concatenate([[np.inf], heights, [np.inf]])
    lowest = (heights < np.inf) & (heights <= around[:-2]) & (heights < around[2:])
    found = np.flatnonzero(lowest & (np.abs(scan - shares[index]) > 1.0 / SCAN_POINTS))
    yield from scan[found[np.argsort(heights[found])]][:MOST_VALLEYS].tolist()
