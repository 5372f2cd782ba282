"""Diagram of the claims: held objects over latency and over noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from benchmarks.claims import LATENCIES, NOISES, SIGMAS, Series
from benchmarks.report import share_interval
from benchmarks.robustness_charts import new_figure, save

_STYLES = (("#e66100", "o--"), ("#005596", "s--"), ("#e66100", "o-"), ("#005596", "s-"))


def draw_claims(delay: Series, noise: Series, fails: float, path: Path) -> None:
    """Draws two squares, one per claim.

    Args:
        delay: Held objects over latency.
        noise: Held objects over velocity noise.
        fails: Velocity noise at which errors of a row are as expected [m/s].
        path: Output path.
    """
    figure = new_figure(12.0, 5.0)
    first, second = figure.subplots(1, 2)
    _draw_held(first, 1e3 * np.array(LATENCIES), delay, "latency [ms]")
    _draw_held(second, 1e3 * np.array(NOISES), noise, "velocity noise [mm/s]")
    second.set_xscale("log")
    second.axvspan(1e3 * fails, 1e3 * SIGMAS * fails, color="#c8ccd2", alpha=0.6, zorder=0)
    second.text(1e3 * fails, 2.0, " 1 to 6 sigma of 0.3 N", fontsize=8)
    save(figure, path)


def _draw_held(axis: Axes, at: np.ndarray, series: Series, label: str) -> None:
    count = next(iter(series.values()))[0].count
    for (name, points), (colour, style) in zip(series.items(), _STYLES, strict=True):
        shares = np.array([point.held / point.count for point in points])
        bounds = np.array([share_interval(point.held, point.count) for point in points])
        errors = 100.0 * np.abs(bounds.T - shares)
        axis.errorbar(at, 100.0 * shares, errors, fmt=style, color=colour, label=name, capsize=2.0)
    axis.set_xlabel(label)
    axis.set_ylabel(f"held of {count} objects [%]")
    axis.set_ylim(-3.0, 103.0)
    axis.grid(alpha=0.3)
    axis.legend(fontsize=8)
