"""The diagrams of the documentation, drawn from its tables, in the style of the figures of a run.

`python -m benchmarks.charts docs` draws all of them again.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.report import read_table
from slipgrasp.figures.style import PAGE_WIDTH, add_axes, new_figure, paint, paper_style
from slipgrasp.recordings.palette import MUTED

Rows = list[list[str]]
"""Heads and rows of a table."""

_NUMBER = re.compile(r"[\d.]+(?:e[-+]\d+)?")
_COLOURS = ("#005596", "#e66100", "#5d3a9b", "#1a8a5a", "#7a828c", "#c2185b")
_NOT_HELD = "#c8ccd2"
_MARGIN, _TITLE, _LABEL, _LEGEND = 14.0, 8.0, 12.0, 4.5  # [mm]


class Panel(NamedTuple):
    """One pair of axes with the curves of a table.

    Attributes:
        title: Its title.
        across: Label of the horizontal axis; the head of the first column if empty.
        columns: Columns of x and y, one curve per label of the first column; one curve per column
            over the first one if None.
        settings: Further properties of the axes.
    """

    title: str
    across: str = ""
    columns: tuple[int, int] | None = None
    settings: Mapping[str, Any] = {}


def draw_panels(height: float, panels: Sequence[Panel], *tables: Rows) -> Figure:
    """Panels side by side, each with a legend below.

    Args:
        height: Height of the axes [mm].
        panels: The panels.
        *tables: The table of each panel, or one for all of them.
    """
    shown = tables if len(tables) > 1 else tables * len(panels)
    curves = [
        by_labels(rows, *panel.columns) if panel.columns else by_columns(rows)
        for panel, rows in zip(panels, shown, strict=True)
    ]
    step = (PAGE_WIDTH - 4.0) / len(panels)
    with paper_style():
        figure = new_figure(_TITLE + height + _LABEL + _LEGEND * max(map(len, curves)))
        for k, (panel, rows, those) in enumerate(zip(panels, shown, curves, strict=True)):
            axes = add_axes(figure, _MARGIN + k * step, _TITLE, step - _MARGIN, height)
            for index, (name, points) in enumerate(those.items()):
                _draw_curve(axes, name, np.array(points), index)
            axes.set_title(panel.title, loc="left", fontsize=8.5)
            axes.set(xlabel=panel.across or rows[0][0], **panel.settings)
            axes.legend(loc="upper left", bbox_to_anchor=(0.0, -_LABEL / height))
        return figure


def _draw_curve(axes: Axes, name: str, points: np.ndarray, index: int) -> None:
    x, y, *bounds = points.T
    errors = np.abs(np.array(bounds) - y) if bounds else None
    colour, line = _COLOURS[index % len(_COLOURS)], ("o-", "s--")[index % 2]
    axes.errorbar(x, y, errors, fmt=line, color=colour, label=name, markersize=3, capsize=1.5)


def by_columns(rows: Rows) -> dict[str, list[list[float]]]:
    """One curve per column over the first one; intervals in brackets are bounds."""
    heads, *rows = rows
    return {
        head: [[float(row[0]), *_numbers(row[k])[: 3 if "%" in row[k] else 1]] for row in rows]
        for k, head in enumerate(heads)
        if k > 0
    }


def by_labels(rows: Rows, x: int, y: int) -> dict[str, list[list[float]]]:
    """One curve per label in the first column.

    Args:
        rows: The table.
        x: Column of x.
        y: Column of y.
    """
    curves: dict[str, list[list[float]]] = {}
    for row in rows[1:]:
        curves.setdefault(row[0], []).append([float(row[x]), float(row[y])])
    return curves


def _numbers(cell: str) -> list[float]:
    return [float(number) for number in _NUMBER.findall(cell)]


def draw_assumptions(rows: Rows) -> Figure:
    """Slip path of both cases, one row per choice; crosses are lost objects."""
    (_, *preset), *choices = rows[1:]
    with paper_style():
        row, top = 4.2, 12.0
        figure = new_figure(top + row * len(choices) + 12.0)
        for column, (title, k) in enumerate((("(a) case I", 1), ("(b) case II", 4))):
            axes = add_axes(figure, 74.0 + 54.0 * column, top, 48.0, row * len(choices))
            default = float(preset[k - 1])
            axes.axvline(default, color=paint(MUTED), linewidth=0.7)
            for place, choice in enumerate(choices):
                if choice[k] == "–":
                    continue
                path, lost = max(float(choice[k]), 0.01), "`" in choice[k + 1]
                colour = _COLOURS[lost]
                axes.plot([default, path], [place, place], color=colour, linewidth=0.9)
                axes.plot(path, place, "X" if lost else "o", color=colour, markersize=3.5)
            axes.set(xscale="log", xlim=(7e-3, 300.0), ylim=(len(choices) - 0.4, -0.6))
            axes.set_xlabel("longest slip path [mm]")
            axes.set_title(title, loc="left", fontsize=8.5)
            axes.set_yticks(range(len(choices)), [choice[0] for choice in choices])
            axes.tick_params(labelleft=column == 0, axis="y", length=0)
        return figure


def draw_laws(*tables: Rows) -> Figure:
    """Objects held by every law in every world: tables without and with latency, by hand."""
    with paper_style():
        figure = Figure((12.0, 7.2), layout="constrained")
        for k, axes in enumerate(figure.subplots(len(tables) // 2, 1)):
            axes.set_title(f"{k + 2} fingers", loc="left", pad=20.0)
            _draw_hand(axes, *tables[2 * k : 2 * k + 2])
        return figure


def _draw_hand(axes: Axes, prompt: Rows, late: Rows) -> None:
    """One row per law, one column per world; with latency twice, without and with prediction."""
    laws = prompt[0][1:]
    worlds, shares = [], []
    for words, (heads, *rows), suffix in (
        ("no latency", prompt, ""),
        ("latency, no prediction", late, ""),
        ("latency, with prediction (grey: not offered)", late, ", predicts"),
    ):
        axes.axvline(len(worlds) - 0.5, color="white", linewidth=4.0)
        axes.text(len(worlds) - 0.4, -0.65, words, fontsize=9)
        for world, *cells in rows:
            found = dict(zip(heads[1:], cells, strict=True))
            worlds.append(world)
            shares.append([_share(found.get(law + suffix, "")) for law in laws])
    values = np.array(shares).T
    for (row, column), value in np.ndenumerate(values):
        if np.isfinite(value):
            colour = "black" if value > 55.0 else "white"
            place = {"ha": "center", "va": "center", "fontsize": 7.5}
            axes.text(column, row, f"{value:.3g}", color=colour, **place)
    axes.set_facecolor(_NOT_HELD)
    image = axes.imshow(values, vmin=0.0, vmax=100.0, cmap="viridis", aspect="auto")
    axes.figure.colorbar(image, ax=axes, label="held [%]")
    axes.set_yticks(range(len(laws)), laws)
    axes.set_xticks(range(len(worlds)), worlds, rotation=40, ha="right", fontsize=7.5)


def _share(cell: str) -> float:
    return _numbers(cell)[0] if cell else np.nan


def draw_success_maps(sides: np.ndarray, maps: Mapping[str, np.ndarray]) -> Figure:
    """Slip path over both friction coefficients, one map per law, side by side.

    Args:
        sides: Friction coefficients along both axes.
        maps: Longest slip path [mm] of each law, ``(right, left)``; NaN if it is not held.
    """
    with paper_style():
        figure = Figure((4.6 * len(maps) + 1.0, 4.6), layout="constrained")
        axes = figure.subplots(1, len(maps), sharey=True, squeeze=False)[0]
        extent = (sides[0], sides[-1], sides[0], sides[-1])
        limits = {"norm": "log", "vmin": 0.03, "vmax": 60.0}
        for axis, (law, values) in zip(axes, maps.items(), strict=True):
            axis.imshow(values, origin="lower", extent=extent, cmap="viridis", **limits)
            axis.set_facecolor(_NOT_HELD)
            axis.set_title(f"{law}: {100.0 * np.isfinite(values).mean():.0f} % held")
            axis.set_xlabel("friction of the left fingertip")
        axes[0].set_ylabel("friction of the right fingertip")
        label = "slip path where held [mm]; grey: lost"
        figure.colorbar(axes[0].images[0], ax=axes, label=label, shrink=0.9)
        return figure


class Diagram(NamedTuple):
    """A diagram of the documentation.

    Attributes:
        page: The page with its tables.
        tables: Names of the tables.
        draw: Draws it from their rows.
    """

    page: str
    tables: tuple[str, ...]
    draw: Callable[..., Figure]


_WORLDS = ("robustness-two", "robustness-two-late", "robustness-three", "robustness-three-late")
_SWEEPS = ("robustness-noise", "robustness-latency")
_SHARES = [Panel("held objects [%]", settings={"ylim": (-3.0, 103.0)})] * 2
_COST, _LOG = "CPU time of 0.3 s [ms]", {"xscale": "log", "yscale": "log"}
_ERRORS = [
    Panel("(a) error of the end of slip [s]", _COST, (2, 3), _LOG),
    Panel("(b) error of the end state [m]", _COST, (2, 4), _LOG),
]
_TIMES = [
    Panel("(a) CPU time of case I", "simulated time [s]"),
    Panel("(b) CPU time of 7 s", "fingers"),
]
_SIZES = ("scaling-duration", "scaling-fingers")
_draw_shares = partial(draw_panels, 70.0, _SHARES)
_draw_errors, _draw_times = partial(draw_panels, 78.0, _ERRORS), partial(draw_panels, 60.0, _TIMES)
DIAGRAMS = {
    "assumptions.svg": Diagram("assumptions.md", ("assumptions",), draw_assumptions),
    "claims.png": Diagram("robustness.md", ("claim-1", "claim-2"), _draw_shares),
    "robustness.png": Diagram("robustness.md", _WORLDS, draw_laws),
    "robustness-sweeps.png": Diagram("robustness.md", _SWEEPS, _draw_shares),
    "scaling.svg": Diagram("benchmarks.md", _SIZES, _draw_times),
    "work-precision.svg": Diagram("benchmarks.md", ("work-precision",), _draw_errors),
}


def draw_diagrams(docs: Path, changed: Iterable[str]) -> None:
    """Draws the diagrams with a changed table.

    Args:
        docs: Folder of the documentation.
        changed: Names of the changed tables.
    """
    names = set(changed)
    for image, diagram in DIAGRAMS.items():
        if names & set(diagram.tables):
            tables = [read_table(docs / diagram.page, name) for name in diagram.tables]
            save(diagram.draw(*tables), docs / "images" / image)


def save(figure: Figure, path: Path) -> None:
    """Saves a diagram; the same numbers give the same bytes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with paper_style():
        figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)


if __name__ == "__main__":
    draw_diagrams(Path(sys.argv[1]), [name for each in DIAGRAMS.values() for name in each.tables])
