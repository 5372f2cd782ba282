"""Content of a figure of two runs: groups of columns with one quantity over time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.unknowns import Unknown, parse_unknown
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.figures.panels import estimate_label, finger_colour, unknown_colour, unknown_symbol
from slipgrasp.recordings.compare.alignment import MatchedRows, match_rows
from slipgrasp.recordings.compare.comparison import Comparison
from slipgrasp.recordings.palette import FINGERS, MARK, MUTED, Rgb
from slipgrasp.scene.states import drawable

_MOST_NAMED = 3
_FIRST, _SECOND = FINGERS[-1], MARK

_ESTIMATE_TITLES = {
    "link_mass": "estimated link masses",
    "friction": "estimated friction",
    "object_mass": "estimated mass of the object",
    "object_inertia": "estimated inertia of the object",
}


class Pair(NamedTuple):
    """Two runs, their columns by name, and their rows at common instants."""

    a: RunResult
    b: RunResult
    of_a: dict[str, NDArray[np.float64]]
    of_b: dict[str, NDArray[np.float64]]
    rows: MatchedRows
    comparison: Comparison


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One column of both runs.

    Attributes:
        column: Its name (`slipgrasp.core.trace.columns`).
        label: Label in the legend; empty if it is the only line.
        colour: Its colour.
    """

    column: str
    label: str
    colour: Rgb


@dataclass(frozen=True, slots=True, kw_only=True)
class Trend:
    """Columns that share their axes.

    Attributes:
        title: Title.
        label: Quantity and unit of the axis.
        scale: Factor from SI to that unit.
        lines: The columns.
        least_span: Smallest vertical range, in the unit of the axis.
    """

    title: str
    label: str
    scale: float
    lines: tuple[Line, ...]
    least_span: float


DRAWN_SIGNALS = frozenset(
    ("slip", "slip_path", "normal_force", "friction_margin", "tracking_error", "estimates")
)
"""The signals of the columns of all trends."""


def pair_of(comparison: Comparison, a: RunResult, b: RunResult) -> Pair:
    """Prepares two runs for an overlay."""
    of_a, of_b = (_columns(run) for run in (a, b))
    rows = match_rows(a.trace.times, b.trace.times)
    return Pair(a, b, of_a, of_b, rows, comparison)


def _columns(run: RunResult) -> dict[str, NDArray[np.float64]]:
    return {column.name: drawable(column.values.astype(float)) for column in columns_of(run.trace)}


_SLIP_TITLES = {"slip": "fingertip slips", "slip_path": "paths of the fingertips"}


def trends_of(a: RunResult, b: RunResult) -> tuple[Trend, ...]:
    """Slips, forces, margins, tracking errors, and common estimates."""
    slip = a.trace.shape.space.slip_signal
    margin = rf"$\mu F_n - |F_{a.trace.shape.space.force_index}|$ [N]"
    return (
        _contact_trend(a, _SLIP_TITLES[slip], slip, "$s$ [mm]", 1e3),
        _contact_trend(a, "normal forces", "normal_force", "$F_n$ [N]", 1.0),
        _contact_trend(a, "distance to slip", "friction_margin", margin, 1.0),
        *_error_trends(a),
        *_estimate_trends(a, b),
    )


def _error_trends(run: RunResult) -> Iterator[Trend]:
    positions, turns = run.trace.shape.space.positions, run.trace.shape.space.turns
    for title, label, symbol, group in (
        ("object position errors", "$e$ [mm]", "$e_{}$", positions),
        ("object orientation error", r"$e_\theta$ [mrad]", r"$e_{{\theta {}}}$", turns),
    ):
        colours = (MARK,) if len(group) == 1 else (_FIRST, _SECOND, MUTED)
        lines = tuple(
            Line(
                column=f"error_{name}",
                label=symbol.format(name[-1]) if len(group) > 1 else "",
                colour=colour,
            )
            for name, colour in zip(group, colours, strict=False)
        )
        yield Trend(title=title, label=label, scale=1e3, lines=lines, least_span=0.02)


def _contact_trend(run: RunResult, title: str, signal: str, label: str, scale: float) -> Trend:
    names = run.scenario.finger_names
    lines = tuple(
        Line(
            column=f"{signal}_{i}",
            label=name if len(names) <= _MOST_NAMED else str(i + 1),
            colour=finger_colour(i),
        )
        for i, name in enumerate(names)
    )
    return Trend(title=title, label=label, scale=scale, lines=lines, least_span=0.02)


def _estimate_trends(a: RunResult, b: RunResult) -> Iterator[Trend]:
    """One per kind of unknown that both controllers estimate."""
    shared = [key for key in a.trace.shape.unknowns if key in b.trace.shape.unknowns]
    unknowns = {key: parse_unknown(a.scenario, key) for key in shared}
    for kind, title in _ESTIMATE_TITLES.items():
        members = {key: u for key, u in unknowns.items() if u is not None and u.kind == kind}
        if not members:
            continue
        lines = tuple(_estimate_line(key, u, len(members)) for key, u in members.items())
        label = estimate_label(next(iter(members.values())))
        yield Trend(title=title, label=label, scale=1.0, lines=lines, least_span=1e-4)


def _estimate_line(key: str, unknown: Unknown, count: int) -> Line:
    return Line(
        column=f"estimate_{key}",
        label=unknown_symbol(unknown) if count > 1 else "",
        colour=unknown_colour(unknown),
    )
