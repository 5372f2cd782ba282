"""The size of a page, and the width of each of its columns."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, NamedTuple

from annotated_types import Interval

Pixels = Annotated[int, Interval(ge=0, le=20_000)]

MARGIN = 12
"""Margin between the playback panel and the edges of the scene [px]."""

WIDEST_SHEET = 576
_LEAST_FOR_TWO_COLUMNS = 800
_LEAST_PLAYBACK = 240
_USUAL_COVER = 240
_FEW_LINES = 48
_EDGE = 4
_USUAL_SIZE = (1440, 900)


@dataclass(frozen=True, slots=True)
class Picture:
    """Size of a viewer's image, and of the strip at its bottom covered by a panel [px]."""

    width: int
    height: int
    covered: int = 0

    def is_covered_alike(self, other: Picture) -> bool:
        """Whether the size is equal, and the strip is at most some lines higher than the other."""
        same_size = (self.width, self.height) == (other.width, other.height)
        return same_size and 0 <= self.covered - other.covered <= _FEW_LINES


class Arrangement(Enum):
    """Placement of the panels: in one sheet at the bottom, or next to the scene."""

    SHEET = "sheet"
    ONE_COLUMN = "one column"
    TWO_COLUMNS = "two columns"


@dataclass(frozen=True, slots=True)
class PageLayout:
    """Measurements of a page, in CSS pixels.

    Attributes:
        width: Width of the page.
        height: Its height.
        scene_width: Width of the scene between the columns.
        scene_height: Its height.
        covered: Height of the strip at the bottom of the scene that the playback panel covers.
    """

    width: Pixels
    height: Pixels
    scene_width: Pixels
    scene_height: Pixels
    covered: Pixels

    @property
    def picture(self) -> Picture:
        """The part of the scene for the camera."""
        return Picture(self.scene_width, self.scene_height, self.covered)

    @property
    def arrangement(self) -> Arrangement:
        """Placement of its panels; viser itself creates the sheet."""
        if self.width <= WIDEST_SHEET:
            return Arrangement.SHEET
        wide = self.width >= _LEAST_FOR_TWO_COLUMNS
        return Arrangement.TWO_COLUMNS if wide else Arrangement.ONE_COLUMN

    @property
    def playback(self) -> int:
        """Width of a playback panel that spans the scene [px]."""
        return max(self.scene_width - 2 * MARGIN, _LEAST_PLAYBACK)


class PanelSizes(NamedTuple):
    """Widths of the columns, and height of a chart [px]."""

    results: int
    study: int
    scenario: int
    chart: int


def panel_sizes(width: int, height: int, *, lecture: bool = False) -> PanelSizes:
    """Sizes that leave enough space for the scene [px].

    Args:
        width: Width of the page.
        height: Its height.
        lecture: Whether only one chart is shown, for large audiences.
    """
    if lecture:
        wide = max(round(0.36 * width), 280)
        return PanelSizes(wide, wide, 0, max(round(0.45 * height), 130))
    type_size = type_scale(width)
    results = min(max(round(0.27 * width), 280), round(400 * type_size))
    scenario = min(max(round(0.22 * width), 250), round(320 * type_size))
    chart = min(max((height - 340) // 3 - 48, 130), round(190 * type_size))
    study = min(max(round(0.4 * width), results), round(620 * type_size))
    return PanelSizes(results, study, scenario, chart)


def type_scale(width: int) -> float:
    """Font size of a page relative to the default, as set by `dashboard.css`.

    Args:
        width: Width of the page [px].
    """
    return min(max(0.6 + 0.000275 * width, 1.0), 1.3125)


def guess_layout(width: int, height: int) -> PageLayout:
    """An estimate of a page's measurements from its first image.

    While a page starts, `start.css` leaves the columns free on both sides of the image.

    Args:
        width: Width of the image [px]; on high-resolution screens larger than the scene.
        height: Its height.
    """
    height = min(height, _USUAL_SIZE[1])
    pages = range(_LEAST_FOR_TWO_COLUMNS, _USUAL_SIZE[0])
    page = pages.start + bisect_right(pages, width, key=_scene_width)
    return PageLayout(page, height, _scene_width(page), height, _USUAL_COVER)


def _scene_width(width: int) -> int:
    """Width of the scene between two columns of a page of a given width [px]."""
    sizes = panel_sizes(width, _USUAL_SIZE[1])
    return width - sizes.results - sizes.scenario - 2 * _EDGE
