"""What the charts show: lines over time, in the units of their titles.

In every chart a colour stands for a finger, and a dashed line for what its solid twin is
held against: the cone, the truth, or the second joint.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.loading import parameter_definitions
from core.result import RunResult
from core.trace import JOINTS_PER_FINGER, Trace
from core.types import ContactPhase
from web.colours import FINGERS, Rgb
from web.playback import TimeWindow
from web.sampling import locate
from web.words import key_words, unit_words

__all__ = [
    "Chart",
    "Line",
    "chart_data",
    "contact_charts",
    "control_charts",
    "event_rows",
    "is_slipping",
    "rows_to_draw",
    "values_at",
]

Values = NDArray[np.float64]

_BUCKETS = 160


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """One line of a chart: its values, one per row of the trace."""

    label: str
    colour: Rgb
    values: Values
    dashed: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Chart:
    """One chart: a title, its unit, its lines, and when some contact slips."""

    title: str
    unit: str
    lines: tuple[Line, ...]


def contact_charts(result: RunResult) -> tuple[Chart, ...]:
    """Slip, slip velocity, and the tangential forces against their cones."""
    trace, names = result.trace, result.scenario.finger_names
    limits = trace.friction_coefficient * trace.normal_force
    forces = np.abs(trace.tangential_force)
    return (
        Chart("Slip", "mm", tuple(_per_finger(names, 1e3 * trace.slip))),
        Chart("Slip velocity", "mm/s", tuple(_per_finger(names, 1e3 * trace.slip_velocity))),
        Chart(
            "Tangential force |Fₓ| against its limit μFₙ",
            "N",
            (
                *_per_finger([f"{name} |Fₓ|" for name in names], forces),
                *_per_finger([f"{name} μFₙ" for name in names], limits, dashed=True),
            ),
        ),
    )


def control_charts(result: RunResult) -> tuple[Chart, ...]:
    """Tracking error, estimates against the truth, and torques."""
    trace, names = result.trace, result.scenario.finger_names
    errors = 1e3 * trace.tracking_error
    labels = ("x [mm]", "y [mm]", "θ [mrad]")
    torques = trace.joint_torque.reshape(len(trace), -1, JOINTS_PER_FINGER)
    joints = [
        line
        for k in range(JOINTS_PER_FINGER)
        for line in _per_finger([f"{n} {k + 1}" for n in names], torques[:, :, k], dashed=k > 0)
    ]
    tracking = [
        Line(label, FINGERS[i], errors[:, i], dashed=i > 1) for i, label in enumerate(labels)
    ]
    return (
        Chart("Tracking error, desired − actual", "mm, mrad", tuple(tracking)),
        *_estimate_charts(result),
        Chart("Joint torques", "N m", tuple(joints)),
    )


def _per_finger(labels: Sequence[str], values: Values, dashed: bool = False) -> Iterator[Line]:
    for i, label in enumerate(labels):
        yield Line(label, FINGERS[i % len(FINGERS)], values[:, i], dashed)


def _estimate_charts(result: RunResult) -> Iterator[Chart]:
    """One chart per unit, estimates solid and the truth dashed."""
    trace, names = result.trace, result.scenario.finger_names
    definitions = parameter_definitions(result.scenario)
    units = [definitions[key].unit for key in trace.shape.unknowns]
    for unit in dict.fromkeys(units):
        members = [i for i, other in enumerate(units) if other == unit]
        labels = [key_words(trace.shape.unknowns[i], names) for i in members]
        quantity = {"1": "Friction", "kg": "Mass", "kg m^2": "Inertia"}.get(unit, "Parameter")
        estimates = _per_finger(labels, trace.estimates[:, members])
        truth = _per_finger(["true"] * len(members), trace.true_parameters[:, members], dashed=True)
        yield Chart(
            f"{quantity} estimates against the truth",
            unit_words(unit).strip(" []") or "1",
            (*estimates, *truth),
        )


def event_rows(trace: Trace) -> NDArray[np.intp]:
    """Rows on either side of an event: two rows that share one time."""
    first = np.flatnonzero(np.diff(trace.times) == 0.0)
    return np.unique(np.concatenate([first, first + 1]))


def is_slipping(trace: Trace) -> NDArray[np.bool_]:
    """Whether any contact slips, one value per row."""
    return (trace.phase != ContactPhase.STICK).any(axis=1)


def rows_to_draw(
    trace: Trace, window: TimeWindow, lines: Sequence[Line], buckets: int = _BUCKETS
) -> NDArray[np.intp]:
    """The rows of a window that a chart needs: all of them while they are few.

    Where there are more than a chart has room for, each bucket of rows keeps the lowest and
    the highest value of every line, and every row at an event stays: but for a run that
    chatters, whose thousands of events no chart could tell apart.

    Args:
        trace: The run.
        window: What the chart shows; one row beyond either end is kept, so that lines reach it.
        lines: The lines of the chart.
        buckets: How many buckets there may be; up to four times as many rows are drawn as is.
    """
    start = max(int(np.searchsorted(trace.times, window.start, side="left")) - 1, 0)
    stop = min(int(np.searchsorted(trace.times, window.end, side="right")) + 1, len(trace))
    rows = np.arange(start, stop)
    if len(rows) <= 4 * buckets:
        return rows
    size = -(-len(rows) // buckets)
    padded = np.minimum(np.arange(start, start + size * buckets), stop - 1).reshape(buckets, size)
    kept = [padded[:, 0], np.array([stop - 1])]
    events = event_rows(trace)
    if len(events) <= 4 * buckets:
        kept.append(events)
    for line in lines:
        values = line.values[padded]
        for extreme in (values.argmin(axis=1), values.argmax(axis=1)):
            kept.append(np.take_along_axis(padded, extreme[:, None], axis=1)[:, 0])
    chosen = np.unique(np.concatenate(kept))
    return chosen[(chosen >= start) & (chosen < stop)]


def chart_data(
    trace: Trace, chart: Chart, window: TimeWindow, rows: NDArray[np.intp]
) -> tuple[Values, ...]:
    """The columns of a chart: time, slipping, and the lines.

    The first and the last point lie exactly on the ends of the window.

    Args:
        trace: The run.
        chart: What to draw.
        window: What the chart shows.
        rows: The rows to draw, from `rows_to_draw`.
    """
    inside = rows[(trace.times[rows] >= window.start) & (trace.times[rows] <= window.end)]
    before, after = locate(trace.times, window.start), locate(trace.times, window.end)
    columns = (trace.times, is_slipping(trace).astype(float), *(l.values for l in chart.lines))
    return tuple(
        np.concatenate([[before.read(column)], column[inside], [after.read(column)]])
        for column in columns
    )


def values_at(trace: Trace, chart: Chart, time: float) -> list[float]:
    """What each line of a chart shows at one time, on the straight line between two rows.

    Args:
        trace: The run.
        chart: The chart.
        time: Simulation time [s].
    """
    spot = locate(trace.times, time)
    return [float(spot.read(line.values)) for line in chart.lines]
