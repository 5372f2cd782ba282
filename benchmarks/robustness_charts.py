"""Diagrams of docs/robustness.md: success maps over both frictions, and sweeps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from benchmarks.report import share_interval

if TYPE_CHECKING:
    from benchmarks.robustness_sweeps import MeasuredSweep

_SERIES = (("#005596", "o"), ("#e66100", "s"), ("#5d3a9b", "^"))
_NOT_HELD = "#c8ccd2"
_RESOLUTION = 130


def draw_success_maps(sides: np.ndarray, maps: Mapping[str, np.ndarray], path: Path) -> None:
    """Slip path over both friction coefficients, one map per law, side by side.

    Args:
        sides: Friction coefficients along both axes.
        maps: Longest slip path [mm] of each law, ``(right, left)``; NaN if it is not held.
        path: Output path.
    """
    figure = new_figure(4.6 * len(maps) + 1.0, 4.6)
    axes = figure.subplots(1, len(maps), sharey=True, squeeze=False)[0]
    extent = (sides[0], sides[-1], sides[0], sides[-1])
    image = None
    for axis, (law, values) in zip(axes, maps.items(), strict=True):
        axis.set_facecolor(_NOT_HELD)
        image = axis.imshow(
            values, origin="lower", extent=extent, cmap="viridis", norm="log", vmin=0.03, vmax=60.0
        )
        share = 100.0 * np.isfinite(values).mean()
        axis.set_title(f"{law}: {share:.0f} % held")
        axis.set_xlabel("friction of the left fingertip")
    axes[0].set_ylabel("friction of the right fingertip")
    figure.colorbar(image, ax=axes, label="slip path where held [mm]; grey: lost", shrink=0.9)
    save(figure, path)


def draw_sweeps(sweeps: Sequence[MeasuredSweep], path: Path) -> None:
    """Fraction held over the swept setting, a square per sweep: composite solid, oracle dashed."""
    figure = new_figure(6.2 * len(sweeps), 4.6)
    axes = figure.subplots(1, len(sweeps), sharey=True, squeeze=False)[0]
    for axis, measured in zip(axes, sweeps, strict=True):
        for (name, shares), (colour, mark) in zip(measured.held.items(), _SERIES, strict=True):
            _draw_series(axis, measured, shares.composite, name, colour, f"{mark}-")
            _draw_series(axis, measured, shares.oracle, f"{name}: oracle", colour, "--")
        axis.set_xlabel(f"{measured.sweep.words} [{measured.sweep.unit}]")
        axis.set_ylim(-3.0, 103.0)
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=3)
    axes[0].set_ylabel(f"held of {sweeps[0].num_objects} objects [%]")
    save(figure, path)


def _draw_series(
    axis: Axes, measured: MeasuredSweep, held: Sequence[int], name: str, colour: str, style: str
) -> None:
    intervals = np.array([share_interval(part, measured.num_objects) for part in held])
    shares = np.array(held) / measured.num_objects
    errors = 100.0 * np.abs(intervals.T - shares)
    axis.errorbar(
        measured.sweep.values,
        100.0 * shares,
        errors,
        fmt=style,
        color=colour,
        label=name,
        capsize=2.0,
        markersize=4.0,
        linewidth=1.2,
    )


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of a size [inch]."""
    figure = Figure((width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, path: Path) -> None:
    """Writes a figure in the format of the documentation."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=_RESOLUTION)
