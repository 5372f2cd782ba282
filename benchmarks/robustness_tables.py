"""Tables and the diagram of every law in every world (`benchmarks.robustness_gains`)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.image import AxesImage

from benchmarks.report import Table, format_share
from benchmarks.robustness_charts import new_figure, save
from benchmarks.robustness_gains import HANDS, Cell, Found, Result, can_predict
from benchmarks.robustness_worlds import LATE

_HOW_WORLDS = (
    "ideal",
    "noise 3 mm/s",
    "friction falls by 40 %",
    "latency 30 ms",
    "detected after 20 ms, latency 17 ms",
)
_PICTURED = (2, 3)  # fingers
_LEGEND = "Held (95 % interval), gains K_p/K_v; {} objects per cell, {} others for the gains."


def tabulate(found: Found) -> list[Table]:
    """Tables of every cell: two, three and more fingers, without and with latency.

    Args:
        found: Results of the cells of `robustness_gains.plan`.
    """
    hands = {"two": (2,), "three": (3,), "more": (4, 6)}
    tables = [
        _tabulate_hands(name, fingers, late, found)
        for name, fingers in hands.items()
        for late in (False, True)
    ]
    return [*tables, _tabulate_how(found)]


def describe(result: Result) -> str:
    """Fraction held with its interval, and the gains: ``100.0 % (99.6–100.0), 100/20``."""
    position, velocity = result.gains
    return f"{format_share(result.held, result.count)}, {position:g}/{velocity:g}"


def draw_shares(found: Found, path: Path) -> None:
    """Fraction held by every law in every world, without and with prediction."""
    figure = new_figure(15.5, 9.0)
    axes = figure.subplots(len(_PICTURED), 1)
    for axis, fingers in zip(axes, _PICTURED, strict=True):
        image = _draw_hand(axis, found, fingers)
        axis.set_title(f"{fingers} fingers", loc="left", pad=20.0)
        figure.colorbar(image, ax=axis, label="held [%]")
    save(figure, path)


def _tabulate_hands(name: str, hands: Sequence[int], late: bool, found: Found) -> Table:
    sample = HANDS[hands[0]]
    worlds = [world for world in sample.worlds if (world in LATE) == late]
    columns = [
        (law, ahead)
        for law in sample.laws
        for ahead in ((False, True) if late and can_predict(law, LATE[0]) else (False,))
    ]
    rows = tuple(
        (
            f"{fingers} fingers: {world}" if len(hands) > 1 else world,
            *(describe(found[Cell(fingers, world, law, ahead)]) for law, ahead in columns),
        )
        for fingers in hands
        for world in worlds
    )
    heads = ("world", *(f"{law}, predicts" if ahead else law for law, ahead in columns))
    first = [found[Cell(hands[0], world, *column)] for world in worlds for column in columns]
    shown = " or ".join(map(str, sorted({result.count for result in first})))
    tuned = (sample.late if late else sample.prompt).tuned
    note = _LEGEND.format(shown, tuned)
    table = f"robustness-{name}-late" if late else f"robustness-{name}"
    return Table(table, heads, rows, (note,), "robustness.md")


def _tabulate_how(found: Found) -> Table:
    """Slip and grip of two fingers, with prediction if possible."""
    laws = HANDS[2].laws
    rows = tuple(
        (
            law,
            *(
                _describe_how(found[Cell(2, world, law, can_predict(law, world))])
                for world in _HOW_WORLDS
            ),
        )
        for law in laws
    )
    note = (
        "Two fingers, with prediction where a law has it: slip path of all runs, median/worst "
        "[mm]; at the end, the least mu F_n / |F_x| of both contacts, median of the held objects."
    )
    return Table("robustness-how", ("law", *_HOW_WORLDS), rows, (note,), "robustness.md")


def _describe_how(result: Result) -> str:
    safety = "–" if np.isnan(result.safety) else f"{result.safety:.2f}"
    return f"{1e3 * result.median:.2f}/{1e3 * result.worst:.1f}; {safety}"


def _draw_hand(axis: Axes, found: Found, fingers: int) -> AxesImage:
    """One row per law, one column per world; with latency twice, without and with prediction."""
    sample = HANDS[fingers]
    prompt = [world for world in sample.worlds if world not in LATE]
    late = [world for world in sample.worlds if world in LATE]
    columns = [(world, False) for world in prompt]
    columns += [(world, ahead) for ahead in (False, True) for world in late]
    shares = np.full((len(sample.laws), len(columns)), np.nan)
    for row, law in enumerate(sample.laws):
        for column, (world, ahead) in enumerate(columns):
            if result := found.get(Cell(fingers, world, law, ahead)):
                shares[row, column] = 100.0 * result.held / result.count
                text = f"{shares[row, column]:.3g}"
                light = shares[row, column] > 55.0
                axis.text(column, row, text, ha="center", va="center", fontsize=7.5)
                axis.texts[-1].set_color("black" if light else "white")
    axis.set_facecolor("#c8ccd2")
    image = axis.imshow(shares, vmin=0.0, vmax=100.0, cmap="viridis", aspect="auto")
    for start, words in (
        (0, "no latency"),
        (len(prompt), "latency, no prediction"),
        (len(prompt) + len(late), "latency, with prediction (grey: not offered)"),
    ):
        axis.axvline(start - 0.5, color="white", linewidth=4.0)
        axis.text(start - 0.4, -0.65, words, fontsize=9)
    axis.set_yticks(range(len(sample.laws)), sample.laws)
    axis.set_xticks(
        range(len(columns)), [world for world, _ in columns], rotation=40, ha="right", fontsize=7.5
    )
    return image
