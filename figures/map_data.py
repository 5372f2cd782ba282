"""Content of a map: axes, panels, and positions of runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario.parameters import Parameter, describe
from slipgrasp.core.study.definition import Axis, Study, expand_key
from slipgrasp.recordings.exceptions import QueryError
from slipgrasp.recordings.study.categories import CATEGORIES, HELD, categorize
from slipgrasp.recordings.study.map_axes import compared_keys, numeric_keys, parameter_of
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.recordings.study.results_comparison import rows_by_combination

NOTHING = -1
"""Category of cells without a run."""

Values = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class MapAxis:
    """One of the two axes of a map.

    Attributes:
        key: The varied key.
        low: Lower limit, in the unit of the parameter.
        high: Upper limit.
        is_log: Whether the scale is logarithmic.
        edges: Boundaries of the cells; None for points.
        base: The value of the base, None if it is outside the axis.
    """

    key: str
    low: float
    high: float
    is_log: bool
    edges: Values | None
    base: float | None

    def share(self, values: Values) -> Values:
        """Positions of values on the axis, from 0 to 1."""
        low, high = self._scaled(np.array([self.low, self.high]))
        return (self._scaled(values) - low) / (high - low)

    def _scaled(self, values: Values) -> Values:
        return np.log(values) if self.is_log else values


@dataclass(frozen=True, slots=True, eq=False)
class MapPanel:
    """The runs of one panel.

    Attributes:
        values: Their common crossed values, by key.
        runs: Their indices, shape ``(runs,)``.
        categories: Their categories as indices into `CATEGORIES`.
        x: Their values on the horizontal axis.
        y: Their values on the vertical axis.
    """

    values: dict[str, Any]
    runs: NDArray[np.intp]
    categories: NDArray[np.int8]
    x: Values
    y: Values

    @property
    def counts(self) -> NDArray[np.intp]:
        """Number of runs by category."""
        return np.bincount(self.categories, minlength=len(CATEGORIES))


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """A grid of cells.

    Attributes:
        categories: The most frequent category of each cell, shape ``(columns, rows)``; or
            `NOTHING`.
        runs: One run of that category for each cell.
        most: Largest number of runs in a cell.
    """

    categories: NDArray[np.int8]
    runs: NDArray[np.intp]
    most: int

    @property
    def held(self) -> NDArray[np.bool_]:
        """Cells in which the object is held."""
        return self.categories == HELD


def map_axis(results: StudyResults, key: str) -> MapAxis:
    """The axis of a varied key, with its range.

    Raises:
        QueryError: If the key does not vary, or is not numeric.
    """
    study = results.study
    known = numeric_keys(study)
    if key not in known:
        raise QueryError(key, f"'{key[:80]}' is not a varied numeric parameter", known)
    axis = next((axis for axis in study.axes if axis.key == key), None)
    is_log = axis is not None and axis.is_range and axis.scale == "log"
    levels = _levels(axis, study) if axis is not None else None
    if levels is not None:
        edges = _within_limits(_edges(levels, is_log), parameter_of(study, key))
        low, high = float(edges[0]), float(edges[-1])
    else:
        edges = None
        low, high = _bounds(axis, values_on(results, key))
    return MapAxis(key, low, high, is_log, edges, _base_value(study, key, low, high))


def _levels(axis: Axis, study: Study) -> Values | None:
    """The values of an axis that is crossed with all others; None if it is sampled."""
    if axis not in study.crossed_axes:
        return None
    levels = [axis.grid_value(place) for place in range(axis.grid_size)]
    return np.unique(np.array(levels, dtype=np.float64))


def _edges(levels: Values, is_log: bool) -> Values:
    """Boundaries halfway between neighbours, extrapolated at the ends."""
    scaled = np.log(levels) if is_log else levels
    if len(scaled) == 1:
        scaled = scaled + np.array([-0.5, 0.5])
    middles = 0.5 * (scaled[1:] + scaled[:-1])
    if len(levels) == 1:
        edges = scaled
    else:
        edges = np.array([2 * scaled[0] - middles[0], *middles, 2 * scaled[-1] - middles[-1]])
    return np.exp(edges) if is_log else edges


def _bounds(axis: Axis | None, values: Values) -> tuple[float, float]:
    """The sampled range, or the range of listed values with a margin."""
    if axis is not None and axis.minimum is not None and axis.maximum is not None:
        low, high = axis.minimum, axis.maximum
        return (low, high) if low < high else (low - 0.5, high + 0.5)
    known = values[~np.isnan(values)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    margin = 0.05 * (high - low) or 0.5
    return low - margin, high + margin


def _within_limits(edges: Values, parameter: Parameter | None) -> Values:
    """Cuts off what lies beyond the limits of a parameter."""
    least = -np.inf if parameter is None or parameter.minimum is None else parameter.minimum
    most = np.inf if parameter is None or parameter.maximum is None else parameter.maximum
    return np.clip(edges, least, most)


def _base_value(study: Study, key: str, low: float, high: float) -> float | None:
    """The value of the base; None if it is outside the axis, or differs between fingers."""
    described = describe(study.base)
    values = {described[one].value for one in expand_key(study.base, key) if one in described}
    value = values.pop() if len(values) == 1 else None
    if isinstance(value, (int, float)) and low <= value <= high:
        return float(value)
    return None


def values_on(results: StudyResults, key: str) -> Values:
    """The value of a key in each run: varied, or that of the base."""
    values = results.numbers(key)
    parameter = parameter_of(results.study, key)
    base = None if parameter is None else parameter.value
    if isinstance(base, (int, float)):
        return np.where(np.isnan(values), float(base), values)
    return values


def panels_of(results: StudyResults, x: str, y: str) -> list[MapPanel]:
    """The runs of each combination of the values that are not on the axes.

    Args:
        results: The results, which do not grow.
        x: The key on the horizontal axis.
        y: The key on the vertical axis.
    """
    categories = categorize(results)
    horizontal, vertical = values_on(results, x), values_on(results, y)
    keys = compared_keys(results.study, (x, y))
    grouped = rows_by_combination(results, keys) if keys else [({}, np.arange(len(categories)))]
    return [
        MapPanel(values, rows, categories[rows], horizontal[rows], vertical[rows])
        for values, rows in grouped
    ]


def cells_of(panel: MapPanel, x: MapAxis, y: MapAxis) -> Cells:
    """The runs of a panel by cell; a cell shows its most frequent category."""
    assert x.edges is not None and y.edges is not None
    shape = len(x.edges) - 1, len(y.edges) - 1
    column = np.clip(np.searchsorted(x.edges, panel.x) - 1, 0, shape[0] - 1)
    row = np.clip(np.searchsorted(y.edges, panel.y) - 1, 0, shape[1] - 1)
    counts = np.zeros((*shape, len(CATEGORIES)), dtype=np.int32)
    np.add.at(counts, (column, row, panel.categories), 1)
    totals = counts.sum(axis=2)
    categories = np.where(totals > 0, counts.argmax(axis=2), NOTHING).astype(np.int8)
    runs = np.full(shape, NOTHING, dtype=np.intp)
    shown = categories[column, row] == panel.categories
    # In reverse order, so that the first of several runs is stored last.
    runs[column[shown][::-1], row[shown][::-1]] = panel.runs[shown][::-1]
    return Cells(categories, runs, int(totals.max(initial=0)))
