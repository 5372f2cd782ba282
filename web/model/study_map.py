"""The map of a study, ready to be shown: what a thread has drawn, and where runs stand on it.

Positions are shares: 0 at the begin of an axis and 1 at its end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from slipgrasp.core.study.definition import Study

SIZE = 1000
"""Width and height of the marks of a map, in the unit of their SVG."""


class Box(NamedTuple):
    """A piece of a map, in shares of its axes."""

    left: float
    right: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Swatch:
    """A way in which runs end.

    Attributes:
        way: Its place in `slipgrasp.recordings.study.categories.CATEGORIES`.
        words: What to call it.
        count: How many runs ended so.
    """

    way: int
    words: str
    count: int


@dataclass(frozen=True, slots=True)
class MapAxisPicture:
    """One of the two axes.

    Attributes:
        key: The varied key.
        label: What it is called, with its unit.
        low: Where it begins, in the unit of the parameter.
        high: Where it ends.
        is_log: Whether equal distances are equal ratios.
        borders: Borders of the cells as shares; none where runs are points.
        ticks: Where numbers stand, and the numbers.
    """

    key: str
    label: str
    low: float
    high: float
    is_log: bool
    borders: tuple[float, ...]
    ticks: tuple[tuple[float, str], ...]

    def share(self, value: float) -> float:
        """Where a value stands."""
        low, high = self.low, self.high
        if self.is_log:
            low, high, value = math.log(low), math.log(high), math.log(value)
        return (value - low) / (high - low)

    def cell(self, share: float) -> tuple[float, float]:
        """Both borders of the cell that holds a share; the share itself where there is none."""
        inside = zip(self.borders, self.borders[1:], strict=False)
        return next((pair for pair in inside if pair[0] <= share < pair[1]), (share, share))


@dataclass(frozen=True, slots=True, eq=False)
class MapPanelPicture:
    """The runs that have the compared setting in common.

    Attributes:
        values: The setting by key; empty if nothing is compared.
        title: The setting in words.
        marks: Cells or points, as the inside of an SVG of 1000 by 1000.
        finished: How many of its runs are done.
        held: How many of them held.
    """

    values: dict[str, Any]
    title: str
    marks: str
    finished: int
    held: int


@dataclass(frozen=True, slots=True, eq=False)
class MapPicture:
    """The map of a study with the runs that are done so far.

    Attributes:
        study: The study; None of a page that simulates.
        finished: How many runs are done.
        held: How many of them held.
        across: The horizontal axis.
        up: The vertical axis.
        panels: One per compared setting.
        swatches: How runs ended, held first.
        base: Where the base stands; None where it is beyond the map.
        diagonal: Where both axes are equal: both ends as shares; None where that says nothing.
        lumped: How many runs a cell has along each side.
        note: Varied parameters that are not distinguished; empty if there are none.
    """

    study: Study | None
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
    """Where a run stands: the place of its panel, and its cell or point; None if nowhere."""
    if picture.study is None or not 0 <= index < picture.study.num_runs:
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
