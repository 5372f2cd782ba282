"""The key of a map: meaning of colours, hatches, marks and lines, with counts and fractions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from slipgrasp.core.scenario.space import Space
from slipgrasp.figures.category_style import colour_of, hatch_of, marker_of
from slipgrasp.figures.map_data import MapAxis, MapPanel
from slipgrasp.figures.map_labels import equality_words, same_quantity
from slipgrasp.figures.panels import lighter
from slipgrasp.figures.style import add_axes, paint
from slipgrasp.recordings.palette import MARK, MUTED
from slipgrasp.recordings.study.categories import CATEGORIES, HELD, category_words

KEY_LINE = 4.4
"""Height of a line of the key [mm]."""

BASE_MARK: dict[str, Any] = {
    "marker": "o",
    "markersize": 4.6,
    "markerfacecolor": "white",
    "markeredgecolor": paint(MARK),
    "markeredgewidth": 1.1,
    "linestyle": "none",
}
EQUAL_LINE: dict[str, Any] = {
    "color": paint(MARK),
    "linewidth": 0.8,
    "linestyle": (0, (4.0, 3.0)),
}
BOUNDARY_LINE: dict[str, Any] = {"color": paint(MARK), "linewidth": 1.1}

_SWATCH = 5.0
_INDENT = 7.0


class KeyLine(NamedTuple):
    """A line of the key.

    Attributes:
        words: Text.
        category: Its category as index into `CATEGORIES`; None for a line or mark.
        style: Style of the line or mark.
    """

    words: str
    category: int | None
    style: dict[str, Any]


def key_lines(panels: Sequence[MapPanel], x: MapAxis, y: MapAxis, space: Space) -> list[KeyLine]:
    """The lines of the key, the same for all panels."""
    counts = np.sum([panel.counts for panel in panels], axis=0)
    shown = [k for k in range(len(CATEGORIES)) if counts[k] or k == HELD]
    lines = [KeyLine(category_words(k, space), k, {}) for k in shown]
    if 0 < counts[HELD] < counts.sum():
        region = f"boundary of the region where it is {category_words(HELD, space)}"
        lines.append(KeyLine(region, None, BOUNDARY_LINE))
    if same_quantity(x.key, y.key):
        lines.append(KeyLine(equality_words(x.key, y.key), None, EQUAL_LINE))
    if x.base is not None and y.base is not None:
        lines.append(KeyLine("the values of the base scenario", None, BASE_MARK))
    return lines


def draw_key(
    figure: Figure,
    lines: Sequence[KeyLine],
    panel: MapPanel,
    place: tuple[float, float, float],
    *,
    has_points: bool,
) -> None:
    """Draws the key of a panel, with the number of runs in each category.

    Args:
        figure: The page.
        lines: Lines of the key.
        panel: The panel.
        place: Left, top and width [mm].
        has_points: Whether runs are points rather than cells.
    """
    left, top, width = place
    axes = add_axes(figure, left, top, width, KEY_LINE * len(lines))
    axes.set_axis_off()
    axes.set_xlim(0.0, width)
    axes.set_ylim(len(lines), 0.0)
    counts, total = panel.counts, len(panel.runs)
    for row, line in enumerate(lines):
        middle = row + 0.5
        if line.category is None:
            _draw_line(axes, line, middle)
        else:
            _draw_swatch(axes, line.category, middle, has_points)
            _draw_counts(axes, int(counts[line.category]), total, width, middle)
        axes.text(_INDENT, middle, line.words, va="center_baseline", fontsize=8.0)


def _draw_counts(axes: Axes, count: int, total: int, width: float, middle: float) -> None:
    share = "< 0.1 %" if 0 < count < 0.0005 * total else f"{100 * count / max(total, 1):.1f} %"
    colour = paint(MARK if count else MUTED)
    for text, right in ((str(count), width - 11.0), (share if count else "–", width)):
        axes.text(right, middle, text, ha="right", va="center_baseline", fontsize=8.0, color=colour)


def _draw_line(axes: Axes, line: KeyLine, middle: float) -> None:
    is_mark = "marker" in line.style
    ends = [0.5 * _SWATCH] if is_mark else [0.0, _SWATCH]
    axes.add_line(Line2D(ends, [middle] * len(ends), **line.style))


def _draw_swatch(axes: Axes, category: int, middle: float, has_points: bool) -> None:
    colour = colour_of(category)
    if has_points:
        style: dict[str, Any] = {"markeredgecolor": paint(MARK), "markeredgewidth": 0.4}
        ground = lighter(colour, 0.62)
        axes.add_patch(Rectangle((0.0, middle - 0.36), _SWATCH, 0.72, color=paint(ground), lw=0.0))
        mark = Line2D([0.5 * _SWATCH], [middle], marker=marker_of(category), color=paint(colour))
        mark.set(markersize=4.6, **style)
        axes.add_line(mark)
        return
    box = {"xy": (0.0, middle - 0.36), "width": _SWATCH, "height": 0.72}
    axes.add_patch(Rectangle(**box, facecolor=paint(colour), linewidth=0.0))
    hatch = {"hatch": hatch_of(category) or None, "edgecolor": paint(lighter(MARK, 0.45))}
    axes.add_patch(Rectangle(**box, facecolor="none", linewidth=0.0, **hatch))
