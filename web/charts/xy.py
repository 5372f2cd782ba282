"""Charts of one quantity against another over the time of a run, such as forces and their cones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import RAIL, Scenario
from slipgrasp.core.scenario.spatial_geometry import friction_outline
from slipgrasp.core.trace.trace import Trace
from slipgrasp.recordings.palette import FINGERS, MUTED
from slipgrasp.web.charts.chart import LEAST_LENGTH, Chart, Line, contact_lines, eccentricities
from slipgrasp.web.charts.charts import tangential_symbol
from slipgrasp.web.charts.chosen import choosable, chosen_charts

Values = NDArray[np.float64]

XY_TAB = "XY"
_BEFORE = "A force outside is the force that stick would have needed just before a slip."


@dataclass(frozen=True, slots=True, eq=False)
class XyChart:
    """A chart with curves of vertical values against horizontal ones.

    Attributes:
        chart: Vertical values, one line per curve.
        across: Horizontal values, one per row for each curve.
        across_words: Label of the horizontal axis, with unit.
        outlines: Fixed outlines, such as the edge of a cone: corners (horizontal, vertical) of
            each, shape ``(points, 2)``.
        is_true_to_scale: Whether both axes have equal scales.
        span: Limits of the horizontal axis, if fixed.
        least_across: The horizontal range includes at least -least to +least.
    """

    chart: Chart
    across: tuple[Values, ...]
    across_words: str
    outlines: tuple[Values, ...] = ()
    is_true_to_scale: bool = False
    span: tuple[float, float] | None = None
    least_across: float = 0.0


def xy_charts(result: RunResult) -> tuple[XyChart, ...]:
    """Slip, contact forces and path of the object, each against a related quantity."""
    trace, scenario = result.trace, result.scenario
    names = scenario.finger_names
    if scenario.space is RAIL:
        return (_speed_over_slip(trace, names), _force_in_cone(trace, names))
    if not scenario.space.has_hand:
        return _slide_path(trace), _slide_speed(trace)
    charts = [_speed_over_slip(trace, names), _object_path(trace)]
    if scenario.friction_cone != "pyramid":
        charts.insert(1, _force_in_cone(trace, names))
    if trace.shape.space.num_tangents == 2:
        charts = [_slip_paths(trace, names), _friction_shares(trace, scenario), *charts]
    if trace.shape.soft:
        charts.insert(2, _moment_shares(result))
    return tuple(charts)


def _path_chart(chart: Chart, across: tuple[Values, ...], words: str) -> XyChart:
    """A path in the plane [mm]."""
    least = LEAST_LENGTH
    return XyChart(
        replace(chart, least=least), across, words, is_true_to_scale=True, least_across=least
    )


def _speed_chart(chart: Chart, trace: Trace) -> XyChart:
    """Speeds against distances slid [mm]."""
    across = tuple(1e3 * trace.slip_of_contacts.T)
    words = f"{trace.shape.space.slip_words} [mm]"
    return XyChart(replace(chart, least=LEAST_LENGTH), across, words, least_across=LEAST_LENGTH)


def _slide_path(trace: Trace) -> XyChart:
    """Path of a body on a support."""
    place = 1e3 * trace.slip
    chart = Chart(
        "xy-object",
        "Path of the body, y upwards",
        "mm",
        "The path of the centre of the body on the support from its start, seen from above.",
        (Line("object", "body", FINGERS[0], place[:, 1]),),
    )
    return _path_chart(chart, (place[:, 0],), "x [mm]")


def _slide_speed(trace: Trace) -> XyChart:
    """Sliding speed of a body on a support against the distance slid."""
    chart = Chart(
        "xy-slip",
        "Sliding speed against distance slid",
        "mm/s",
        "Under friction alone, the speed falls with the square root of the remaining distance.",
        (Line("speed", "body", FINGERS[0], 1e3 * np.linalg.norm(trace.slip_velocity, axis=1)),),
    )
    return _speed_chart(chart, trace)


def chosen_xy_charts(result: RunResult, names: Sequence[str], across: str) -> tuple[XyChart, ...]:
    """The selected signals against another one, one chart per unit, in SI units.

    Args:
        result: The run.
        names: Names of columns; unknown ones are ignored.
        across: Name of the column on the horizontal axis; without it there are no charts.
    """
    column = choosable(result.trace).get(across)
    if column is None:
        return ()
    unit = f" [{column.unit}]" if column.unit not in ("", "1") else ""
    return tuple(
        XyChart(
            Chart(
                f"xy-{chart.key}",
                f"{chart.title} against {across}",
                chart.unit,
                chart.about,
                chart.lines,
            ),
            (column.values.astype(float),) * len(chart.lines),
            f"{across}{unit}",
        )
        for chart in chosen_charts(result, names)
    )


def _slip_paths(trace: Trace, names: Sequence[str]) -> XyChart:
    slip = 1e3 * trace.slip.reshape(len(trace), -1, 2)
    chart = Chart(
        "xy-path",
        "Path of each slip on its face, x upwards",
        "mm",
        "The path of each fingertip on its face, from the initial contact point: x, towards "
        "the object's z axis, is vertical, and y is horizontal.",
        tuple(contact_lines("finger", names, slip[:, :, 0])),
    )
    return _path_chart(chart, tuple(slip[:, :, 1].T), "slip y [mm]")


def _friction_shares(trace: Trace, scenario: Scenario) -> XyChart:
    """Friction on the object divided by its limit, in the axes of slip."""
    force = -trace.tangential_force.reshape(len(trace), -1, 2)
    limit = trace.friction_coefficient * trace.normal_force
    share = np.full_like(force, np.nan)
    np.divide(force, limit[:, :, None], out=share, where=limit[:, :, None] > 0.0)
    edge = friction_outline(scenario, corners=72)
    where = (
        "square; if the contact slips along a tangent, it is on the side of that tangent"
        if scenario.friction_cone == "pyramid"
        else "circle; in slip it is on the circle, and points in the direction of the slip"
    )
    return XyChart(
        Chart(
            "xy-disc",
            f"Friction over μFₙ in its {scenario.friction_cone}, x upwards",
            "1",
            "The friction on the object divided by its current limit, in the axes of slip. "
            f"In stick it is inside the {where}. {_BEFORE}",
            tuple(contact_lines("finger", scenario.finger_names, share[:, :, 0])),
        ),
        tuple(share[:, :, 1].T),
        "friction along y over μFₙ",
        (np.concatenate([edge, edge[:1]]),),
        is_true_to_scale=True,
    )


def _moment_shares(result: RunResult) -> XyChart:
    """Moment and tangential force of each soft fingertip, as fractions of their limits."""
    trace, names = result.trace, result.scenario.finger_names
    limit = trace.friction_coefficient * trace.normal_force
    most = eccentricities(result) * limit
    upwards, across = np.full_like(limit, np.nan), np.full_like(limit, np.nan)
    np.divide(np.abs(trace.torsional_moment), most, out=upwards, where=most > 0.0)
    np.divide(trace.tangential_size, limit, out=across, where=limit > 0.0)
    angles = np.linspace(0.0, 0.5 * np.pi, 37)
    return XyChart(
        Chart(
            "xy-moment",
            "Torsional moment over eμFₙ and tangential force over μFₙ",
            "1",
            "Each soft fingertip sticks inside its limit surface, here the circle; on it "
            f"the fingertip turns and slides simultaneously. {_BEFORE}",
            tuple(contact_lines("finger", names, upwards)),
        ),
        tuple(across.T),
        "tangential force |Fₜ| over μFₙ",
        (np.stack([np.cos(angles), np.sin(angles)], axis=1),),
        is_true_to_scale=True,
    )


def _speed_over_slip(trace: Trace, names: Sequence[str]) -> XyChart:
    """Phase portrait of every slip."""
    speed, what = trace.slip_velocity, "Slip velocity against slip"
    if trace.shape.space.has_paths:
        speed = np.linalg.norm(speed.reshape(len(trace), -1, 2), axis=2)
        what = "Slip speed against travelled distance"
    chart = Chart(
        "xy-slip",
        what,
        "mm/s",
        "Each slip leaves the zero line and returns to it when the fingertip sticks.",
        tuple(contact_lines("finger", names, 1e3 * speed)),
    )
    return _speed_chart(chart, trace)


def _force_in_cone(trace: Trace, names: Sequence[str]) -> XyChart:
    """Contact forces, and the edges of each cone at its widest and its narrowest."""
    tangential, symbol, signs = trace.tangential_force, tangential_symbol(trace), (-1.0, 1.0)
    if trace.shape.space.num_tangents == 2:
        tangential, symbol, signs = trace.tangential_size, f"|{symbol}|", (1.0,)
    most = 1.1 * float(trace.normal_force.max(initial=0.0))
    slopes = {
        sign * friction
        for friction in chain.from_iterable(
            (float(column.min()), float(column.max())) for column in trace.friction_coefficient.T
        )
        for sign in signs
    }
    return XyChart(
        Chart(
            "xy-cone",
            f"Tangential force {symbol} and normal force",
            "N",
            "A fingertip sticks while its force is within its cone, whose edges are dashed, and "
            "slips with its force on an edge. Where friction changes, the widest and the narrowest "
            f"cone are drawn. {_BEFORE}",
            tuple(contact_lines("finger", names, tangential)),
        ),
        tuple(trace.normal_force.T),
        "normal force Fₙ [N]",
        tuple(np.array([[0.0, 0.0], [most, slope * most]]) for slope in sorted(slopes)),
    )


def _object_path(trace: Trace) -> XyChart:
    """Path of the object's centre, and the desired path, relative to the start."""
    *across, name = trace.shape.space.positions
    up = len(across)
    place = 1e3 * (trace.object_pose - trace.object_pose[0])[:, : up + 1]
    wanted = place + 1e3 * trace.tracking_error[:, : up + 1]
    chart = Chart(
        "xy-object",
        f"Path of the object, {name} upwards",
        "mm",
        "The path of the object's centre from its start (solid), and the desired path (dashed)"
        + (", seen from the front." if up == 2 else "."),
        (
            Line("wanted", "desired", MUTED, wanted[:, up], dashed=True),
            Line("object", "object", FINGERS[0], place[:, up]),
        ),
    )
    return _path_chart(chart, (wanted[:, 0], place[:, 0]), "x [mm]")
