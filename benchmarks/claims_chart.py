"""The picture of the claims: held over latency and noise, slip paths at the delays of the field."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from benchmarks.claims import LATE_WORLDS, LATENCIES, NOISES, SIGMAS, Series
from benchmarks.report import share_interval
from benchmarks.robustness_charts import new_figure, save

_STYLES = (
    ("#e66100", "o--"),
    ("#005596", "s--"),
    ("#e66100", "o-"),
    ("#005596", "s-"),
    ("#5d3a9b", "^-"),
)


def draw_claims(
    delay: Sequence[Series],
    noise: Sequence[Series],
    late: Sequence[Series],
    fails: float,
    path: Path,
) -> None:
    """Three squares, one per claim.

    Args:
        delay: Held over latency.
        noise: Held over velocity noise.
        late: Slip paths in the worlds of the third claim.
        fails: Velocity noise at which errors of a row are as expected [m/s].
        path: Where to write.
    """
    figure = new_figure(17.0, 5.0)
    first, second, third = figure.subplots(1, 3)
    _draw_held(first, 1e3 * np.array(LATENCIES), delay, "latency [ms]")
    _draw_held(second, 1e3 * np.array(NOISES), noise, "velocity noise [mm/s]")
    second.set_xscale("log")
    second.axvspan(1e3 * fails, 1e3 * SIGMAS * fails, color="#c8ccd2", alpha=0.6, zorder=0)
    second.text(1e3 * fails, 2.0, " 1 to 6 sigma of 0.3 N", fontsize=8)
    places = np.arange(len(LATE_WORLDS))
    for k, (each, (colour, _)) in enumerate(zip(late, (_STYLES[1], _STYLES[0]), strict=True)):
        worst = [1e3 * point.worst for point in each.points]
        median = [1e3 * point.median for point in each.points]
        at = places + 0.2 * (2 * k - 1)
        third.vlines(at, median, worst, color=colour)
        third.plot(at, worst, "o", color=colour, label=f"{each.name}: median to worst")
        for x, y, point in zip(at, worst, each.points, strict=True):
            text = f"{100.0 * point.held / point.count:.3g} %"
            third.annotate(
                text, (x, y), (0, 4), textcoords="offset points", ha="center", fontsize=8
            )
    third.set_yscale("log")
    third.set_xticks(
        places, [name.replace(", ", ",\n").replace(" by ", "\nby ") for name in LATE_WORLDS]
    )
    third.set_ylabel("slip path [mm]; above it: held")
    third.tick_params(axis="x", labelsize=7)
    third.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, 1.1), ncols=2)
    save(figure, path)


def _draw_held(axis: Axes, at: np.ndarray, series: Sequence[Series], label: str) -> None:
    for each, (colour, style) in zip(series, _STYLES, strict=False):
        shares = np.array([point.held / point.count for point in each.points])
        bounds = np.array([share_interval(point.held, point.count) for point in each.points])
        errors = 100.0 * np.abs(bounds.T - shares)
        axis.errorbar(
            at, 100.0 * shares, errors, fmt=style, color=colour, label=each.name, capsize=2.0
        )
    axis.set_xlabel(label)
    axis.set_ylabel(f"held of {series[0].points[0].count} objects [%]")
    axis.set_ylim(-3.0, 103.0)
    axis.grid(alpha=0.3)
    axis.legend(fontsize=8)
