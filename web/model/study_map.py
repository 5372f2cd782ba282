"""The map of a study for display: drawing by a thread, and positions of runs.

Positions are fractions from 0 at the start of an axis to 1 at its end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from slipgrasp.core.study.definition import Study

SIZE = 1000
"""Width and height of a map, in the unit of its SVG."""


class Box(NamedTuple):
    """A part of a map, in fractions of its axes."""

    left: float
    right: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Swatch:
    """A category of outcomes.

    Attributes:
        way: Its index in `slipgrasp.recordings.study.categories.CATEGORIES`.
        words: Name.
        count: Number of its runs.
    """

    way: int
    words: str
    count: int


@dataclass(frozen=True, slots=True)
class MapAxisPicture:
    """One of the two axes.

    Attributes:
        key: The varied key.
        label: Label with unit.
        low: Lower limit, in the unit of the parameter.
        high: Upper limit.
        is_log: Whether the scale is logarithmic.
        borders: Boundaries of the cells as fractions; empty for points.
        ticks: Positions and labels of ticks.
    """

    key: str
    label: str
    low: float
    high: float
    is_log: bool
    borders: tuple[float, ...]
    ticks: tuple[tuple[float, str], ...]

    def share(self, value: float) -> float:
        """The position of a value."""
        low, high = self.low, self.high
        if self.is_log:
            low, high, value = math.log(low), math.log(high), math.log(value)
        return (value - low) / (high - low)

    def cell(self, share: float) -> tuple[float, float]:
        """Both boundaries of the cell at a position; the position itself for points."""
        inside = zip(self.borders, self.borders[1:], strict=False)
        return next((pair for pair in inside if pair[0] <= share < pair[1]), (share, share))


@dataclass(frozen=True, slots=True, eq=False)
class MapPanelPicture:
    """The runs with a common compared setting.

    Attributes:
        values: The setting by key; empty if nothing is compared.
        title: The setting as text.
        marks: Cells or points, as the content of an SVG of 1000 by 1000.
        finished: Number of finished runs.
        held: Number of these that held the object.
    """

    values: dict[str, Any]
    title: str
    marks: str
    finished: int
    held: int


@dataclass(frozen=True, slots=True, eq=False)
class MapPicture:
    """The map of a study with its finished runs.

    Attributes:
        study: The study.
        finished: Number of finished runs.
        held: Number of runs that held the object.
        across: The horizontal axis.
        up: The vertical axis.
        panels: One per compared setting.
        swatches: Categories of outcomes, held first.
        base: Position of the base; None if it is outside the map.
        diagonal: Both ends of the line of equal values; None if it is meaningless.
        lumped: Number of runs along each side of a cell.
        note: Varied parameters that are not distinguished; may be empty.
    """

    study: Study
    finished: int
    held: int
    across: MapAxisPicture
    up: MapAxisPicture
    panels: tuple[MapPanelPicture, ...]
    swatches: tuple[Swatch, ...]
    base: tuple[float, float] | None
    diagonal: tuple[tuple[float, float], tuple[float, float]] | None
    lumped: int
    note: str


def locate(picture: MapPicture, index: int) -> tuple[int, Box] | None:
    """Position of a run: index of its panel, and its cell or point; None if not on the map."""
    if not 0 <= index < picture.study.num_runs:
        return None
    values = picture.study.values_of(index)
    x, y = values.get(picture.across.key), values.get(picture.up.key)
    if not isinstance(x, (int, float)) or not isinstance(y, (int, float)):
        return None
    matching = (
        place
        for place, panel in enumerate(picture.panels)
        if all(values.get(key) == value for key, value in panel.values.items())
    )
    panel = next(matching, None)
    if panel is None:
        return None
    left, right = picture.across.cell(picture.across.share(x))
    low, high = picture.up.cell(picture.up.share(y))
    return panel, Box(left, right, low, high)
