"""The map of a study for display: drawing by a thread, and positions of runs.

Positions are fractions from 0 at the start of an axis to 1 at its end.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from slipgrasp.core.study.definition import Study
from slipgrasp.figures.map_data import MapAxis
from slipgrasp.recordings.study.categories import HELD

SIZE = 1000
"""Width and height of a map, in the unit of its SVG."""


class Box(NamedTuple):
    """A part of a map, in fractions of its axes."""

    left: float
    right: float
    low: float
    high: float


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
        across: The horizontal axis.
        up: The vertical axis.
        labels: Labels of both, with units.
        panels: One per compared setting.
        counts: Number of runs by shown category, an index in
            `slipgrasp.recordings.study.categories.CATEGORIES`; `HELD` is always shown.
        lumped: Number of runs along each side of a cell.
        note: Varied parameters that are not distinguished; may be empty.
    """

    study: Study
    across: MapAxis
    up: MapAxis
    labels: tuple[str, str]
    panels: tuple[MapPanelPicture, ...]
    counts: dict[int, int]
    lumped: int
    note: str

    @property
    def finished(self) -> int:
        """Number of finished runs."""
        return sum(self.counts.values())

    @property
    def held(self) -> int:
        """Number of runs that held the object."""
        return self.counts[HELD]


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
    return panel, Box(*_cell(picture.across, x), *_cell(picture.up, y))


def _cell(axis: MapAxis, value: float) -> tuple[float, float]:
    """Both ends of the cell of a value; its position for points."""
    if axis.edges is None:
        share = float(axis.share(np.array(value)))
        return share, share
    place = int(np.searchsorted(axis.edges, value, side="right"))
    place = min(max(place, 1), len(axis.edges) - 1)
    low, high = axis.share(axis.edges[place - 1 : place + 1]).tolist()
    return low, high
