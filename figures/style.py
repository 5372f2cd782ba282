"""Style of figures: fonts, line widths and sizes for print; without pyplot and user settings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from threading import RLock
from types import MappingProxyType
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slipgrasp.recordings.palette import Rgb

PAGE_WIDTH = 180.0
"""Width of a page with two columns [mm]."""

_MM_PER_INCH = 25.4

_STYLE: dict[Any, Any] = {
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 8.5,
    "axes.labelsize": 8.5,
    "axes.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "axes.formatter.useoffset": False,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.major.width": 0.5,
    "ytick.major.width": 0.5,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "lines.linewidth": 1.1,
    "hatch.linewidth": 0.45,
    "lines.solid_joinstyle": "round",
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "legend.handlelength": 1.7,
    "legend.handletextpad": 0.5,
    "legend.columnspacing": 1.3,
    "legend.borderpad": 0.0,
    "legend.borderaxespad": 0.0,
    "savefig.dpi": 200,
    "svg.fonttype": "path",
    # A fixed salt makes the names of an SVG's elements, and so its bytes, depend on the run alone.
    "svg.hashsalt": "slipgrasp",
    "pdf.fonttype": 42,
}

_SCREEN: dict[Any, Any] = {"font.family": "DejaVu Sans", "mathtext.fontset": "dejavusans"}

_TURN = RLock()


@contextmanager
def paper_style(overrides: Mapping[Any, Any] = MappingProxyType({})) -> Iterator[None]:
    """A context with the style of all figures, independent of the user's settings.

    Figures must be drawn and saved in it. matplotlib's settings and fonts are global to the
    process, so that threads take turns.
    """
    with _TURN, matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_STYLE | dict(overrides))
        yield


def screen_style() -> AbstractContextManager[None]:
    """A context with the style of pictures of a hand, in a typeface for screens."""
    return paper_style(_SCREEN)


def new_figure(height: float) -> Figure:
    """An empty figure with the width of the page.

    Args:
        height: Its height [mm].
    """
    return Figure(figsize=(PAGE_WIDTH / _MM_PER_INCH, height / _MM_PER_INCH))


def add_axes(figure: Figure, left: float, top: float, width: float, height: float) -> Axes:
    """Axes at a position on the page, measured from its upper left corner [mm]."""
    page_height = figure.get_figheight() * _MM_PER_INCH
    bottom = page_height - top - height
    return figure.add_axes(
        (
            left / PAGE_WIDTH,
            bottom / page_height,
            width / PAGE_WIDTH,
            height / page_height,
        )
    )


def add_box(figure: Figure, left: float, top: float, width: float, height: float) -> Axes:
    """The same without lines and numbers, for text, keys and pictures."""
    axes = add_axes(figure, left, top, width, height)
    axes.set_axis_off()
    return axes


def add_title(
    figure: Figure, text: str, left: float, top: float, width: float, height: float
) -> None:
    """Writes the title of a part of the page at the left of a box [mm]."""
    box = add_box(figure, left, top, width, height)
    box.text(2.0 / width, 0.5, text, va="center", fontsize=9.5)


def paint(colour: Rgb) -> tuple[float, float, float]:
    """The colour in matplotlib's form."""
    red, green, blue = colour
    return (red / 255, green / 255, blue / 255)
