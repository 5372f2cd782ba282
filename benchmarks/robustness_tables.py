"""Tables and the diagram of every law in every world (`benchmarks.robustness_gains`)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.report import Table, format_share, table_of_columns
from benchmarks.robustness_gains import HANDS, Cell, Found, Result, can_predict
from benchmarks.robustness_worlds import LATE

_HOW_WORLDS = (
    "ideal",
    "noise 3 mm/s",
    "friction falls by 40 %",
    "latency 30 ms",
    "detected after 20 ms, latency 17 ms",
)
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


def _tabulate_hands(name: str, hands: Sequence[int], late: bool, found: Found) -> Table:
    sample = HANDS[hands[0]]
    worlds = [world for world in sample.worlds if (world in LATE) == late]
    rows = [(fingers, world) for fingers in hands for world in worlds]
    labels = [f"{row[0]} fingers: {row[1]}" if len(hands) > 1 else row[1] for row in rows]
    columns = {
        f"{law}, predicts" if ahead else law: [found[Cell(*row, law, ahead)] for row in rows]
        for law in sample.laws
        for ahead in ((False, True) if late and can_predict(law, LATE[0]) else (False,))
    }
    first = {result.count for results in columns.values() for result in results[: len(worlds)]}
    tuned = (sample.late if late else sample.prompt).tuned
    note = _LEGEND.format(" or ".join(map(str, sorted(first))), tuned)
    table = f"robustness-{name}-late" if late else f"robustness-{name}"
    cells = {head: list(map(describe, results)) for head, results in columns.items()}
    return table_of_columns(table, "world", labels, cells, (note,), "robustness.md")


def _tabulate_how(found: Found) -> Table:
    """Slip and grip of two fingers, with prediction if possible."""
    laws = HANDS[2].laws
    columns = {
        world: [_describe_how(found[Cell(2, world, law, can_predict(law, world))]) for law in laws]
        for world in _HOW_WORLDS
    }
    note = (
        "Two fingers, with prediction where a law has it: slip path of all runs, median/worst "
        "[mm]; at the end, the least mu F_n / |F_x| of both contacts, median of the held objects."
    )
    return table_of_columns("robustness-how", "law", laws, columns, (note,), "robustness.md")


def _describe_how(result: Result) -> str:
    safety = "–" if np.isnan(result.safety) else f"{result.safety:.2f}"
    return f"{1e3 * result.median:.2f}/{1e3 * result.worst:.1f}; {safety}"
