"""Content of the charts of a run: lines over time, in the units of their titles.

Colours distinguish fingers, and a dashed line is the reference of its solid counterpart: the cone,
the true value, or the second joint.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import PLANAR, RAIL, SPATIAL
from slipgrasp.core.scenario.loading import parameter_definitions
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.words.parameter_words import key_words, unit_words
from slipgrasp.recordings.palette import FINGERS
from slipgrasp.web.charts import rail_charts
from slipgrasp.web.charts.chart import (
    LEAST_LENGTH,
    Chart,
    Line,
    balance_charts,
    contact_lines,
    margin_chart,
    moment_limits,
)
from slipgrasp.web.charts.slide_charts import motion_charts, slide_charts

Values = NDArray[np.float64]

_SMALL = 0.1
"""Smaller estimates are shown in thousandths of their unit."""
# For errors of the attitude: text of the description; key, label and colour of each.
_TURNS = {
    PLANAR: ("", (("theta", "θ", 2),)),
    SPATIAL: (
        ": a rotation vector in world axes",
        (("x", "x", 0), ("y", "y", 1), ("z", "z", 2)),
    ),
}
_QUANTITIES = {"1": "Friction", "kg": "Mass", "kg m²": "Inertia"}


def contact_charts(result: RunResult) -> tuple[Chart, ...]:
    """Slip, slip velocity, and friction against its limits; spins where fingertips are soft."""
    trace, names = result.trace, result.scenario.finger_names
    tangential, symbol = trace.tangential_size, tangential_symbol(trace)
    limits = trace.friction_coefficient * trace.normal_force
    slips = {PLANAR: _planar_slips, SPATIAL: _spatial_slips}[trace.shape.space]
    forces = margin_chart(
        (
            "forces",
            f"Tangential force |{symbol}| and its limit μFₙ",
            "N",
            "The band between a force and its limit is the margin; where it closes, the tip slips.",
        ),
        names,
        ("force", f"|{symbol}|", tangential),
        ("limit", "μFₙ", limits),
    )
    return (*slips(trace, names), forces, *(_spin_charts(result) if trace.shape.soft else ()))


def _spin_charts(result: RunResult) -> tuple[Chart, ...]:
    """Rotation of soft fingertips, and their moments with their limits."""
    trace, names = result.trace, result.scenario.finger_names
    return (
        Chart(
            "spin",
            "Spin",
            "mrad",
            "Rotation of each soft fingertip on its face, about the inward normal.",
            tuple(contact_lines("spin", names, 1e3 * trace.spin)),
            least=LEAST_LENGTH,
        ),
        margin_chart(
            (
                "moments",
                "Torsional moment and its limit at the current tangential force",
                "mN m",
                "The band between a moment and its limit is the margin; where it closes, the "
                "fingertip turns and slides simultaneously.",
            ),
            names,
            ("moment", "moment", 1e3 * np.abs(trace.torsional_moment)),
            ("most", "limit", 1e3 * moment_limits(result)),
        ),
    )


def tangential_symbol(trace: Trace) -> str:
    """Symbol of the tangential force: its only component, or its magnitude."""
    return "F" + {"x": "ₓ", "t": "ₜ"}[trace.shape.space.force_index]


def _planar_slips(trace: Trace, names: Sequence[str]) -> tuple[Chart, ...]:
    return (
        Chart(
            "slip",
            "Slip",
            "mm",
            "Slip of each fingertip along its face. It is constant while the fingertip sticks.",
            tuple(contact_lines("slip", names, 1e3 * trace.slip)),
            least=LEAST_LENGTH,
        ),
        Chart(
            "slip-velocity",
            "Slip velocity",
            "mm/s",
            "Speed of each fingertip along its face; exactly zero while it sticks.",
            tuple(contact_lines("velocity", names, 1e3 * trace.slip_velocity)),
            least=LEAST_LENGTH,
        ),
    )


def _spatial_slips(trace: Trace, names: Sequence[str]) -> tuple[Chart, ...]:
    """Both slips of every contact, and the speed."""
    slip = 1e3 * trace.slip.reshape(len(trace), -1, 2)
    speed = 1e3 * np.linalg.norm(trace.slip_velocity.reshape(len(trace), -1, 2), axis=2)
    both = [
        line
        for k, axis in enumerate("xy")
        for line in contact_lines(
            f"slip-{axis}", [f"{name} {axis}" for name in names], slip[:, :, k], dashed=k > 0
        )
    ]
    return (
        Chart(
            "slip",
            "Slip along both tangents",
            "mm",
            "Slip of each fingertip on its face: x, towards the object's z axis, is solid, and y, "
            "across it, is dashed. Both are constant while the fingertip sticks.",
            tuple(both),
            least=LEAST_LENGTH,
        ),
        Chart(
            "slip-velocity",
            "Slip speed",
            "mm/s",
            "Speed of each fingertip on its face; exactly zero while it sticks.",
            tuple(contact_lines("velocity", names, speed)),
            least=LEAST_LENGTH,
        ),
    )


def tracking_charts(result: RunResult) -> tuple[Chart, ...]:
    """Errors of the object's pose, and the joint torques."""
    trace = result.trace
    space, count = trace.shape.space, trace.shape.space.num_positions
    errors = 1e3 * trace.tracking_error
    about_turns, turns = _TURNS[space]
    return (
        Chart(
            "position-error",
            "Position error, desired − actual",
            "mm",
            "Distance of the object's centre from its desired position.",
            tuple(_axes(space.positions, errors[:, :count])),
            least=LEAST_LENGTH,
        ),
        Chart(
            "turn-error",
            "Orientation error, desired − actual",
            "mrad",
            f"Rotation of the object from its desired attitude{about_turns}.",
            tuple(
                Line(key, label, FINGERS[colour], errors[:, count + k])
                for k, (key, label, colour) in enumerate(turns)
            ),
            least=LEAST_LENGTH,
        ),
        *_joint_charts(result),
    )


def _joint_charts(result: RunResult) -> Iterator[Chart]:
    """Torques of revolute joints, and forces of slides."""
    trace, names = result.trace, result.scenario.finger_names
    slides, joints_per_finger = result.trace.shape.slides, trace.shape.joints_per_finger
    others = "second" if joints_per_finger == 2 else "others"
    for key, title, unit, joint, of_slides in (
        ("torques", "Joint torques", "N m", "joint", False),
        ("slide-forces", "Forces on the slides", "N", "slide", True),
    ):
        lines: list[Line] = []
        for k in range(joints_per_finger):
            columns = range(k, trace.shape.width_of_joints, joints_per_finger)
            chosen = [column for column in columns if (column in slides) is of_slides]
            labels = [f"{names[column // joints_per_finger]} {k + 1}" for column in chosen]
            torques = trace.joint_torque[:, chosen]
            lines += contact_lines(f"{joint}-{k + 1}", labels, torques, dashed=k > 0)
        if lines:
            yield Chart(
                key,
                title,
                unit,
                f"Commands of the controller: the first {joint} of a finger is solid, "
                f"the {others} are dashed.",
                tuple(lines),
            )


def _axes(names: Sequence[str], values: Values) -> Iterator[Line]:
    for i, name in enumerate(names):
        yield Line(name, name, FINGERS[i], values[:, i])


def estimate_charts(result: RunResult) -> tuple[Chart, ...]:
    """One chart per unit, with solid estimates and dashed true values."""
    trace, names = result.trace, result.scenario.finger_names
    definitions = parameter_definitions(result.scenario)
    unknowns = trace.shape.unknowns
    units = [definitions[key].unit for key in unknowns]
    firsts = {each.parameter: abs(each.initial) for each in result.scenario.estimates}

    def chart(unit: str) -> Chart:
        members = [i for i, other in enumerate(units) if other == unit]
        labels = [key_words(unknowns[i], names) for i in members]
        estimates, truth = trace.estimates[:, members], trace.true_parameters[:, members]
        # The labels of an axis have three decimals.
        is_small = max(firsts[unknowns[i]] for i in members) < _SMALL and unit != "1"
        scale, prefix = (1e3, "10⁻³ ") if is_small else (1.0, "")
        return Chart(
            f"estimates-{_QUANTITIES.get(unit, unit).lower()}",
            f"{_QUANTITIES.get(unit, 'Parameter')} estimates and true values",
            f"{prefix}{unit_words(unit).strip(' []')}".rstrip() or "1",
            "Estimates, solid, and true values, dashed.",
            (
                *contact_lines("estimate", labels, scale * estimates),
                *contact_lines("truth", ["true"] * len(members), scale * truth, dashed=True),
            ),
        )

    return tuple(chart(unit) for unit in dict.fromkeys(units))


def charts_of_estimates(result: RunResult) -> tuple[Chart, ...]:
    """The estimates, and the diagnostics of a custom law."""
    return (*estimate_charts(result), *diagnostic_charts(result))


def diagnostic_charts(result: RunResult) -> tuple[Chart, ...]:
    """One chart per diagnostic of a custom law."""
    diagnostics = result.trace.shape.diagnostics
    return tuple(
        Chart(
            f"law-{each.name.replace('_', '-')}",
            f"{key_words(each.name, ()).capitalize()}, as reported by the law",
            each.unit,
            each.text,
            (Line("value", each.name, FINGERS[k % len(FINGERS)], result.trace.diagnostics[:, k]),),
        )
        for k, each in enumerate(diagnostics)
    )


def energy_charts(result: RunResult) -> tuple[Chart, ...]:
    """The Lyapunov value with its rate, and the energy balance."""
    trace, value = result.trace, result.trace.lyapunov_value
    return (
        Chart(
            "lyapunov",
            "Lyapunov value V",
            "1",
            "A single measure of all errors of pose, slip and estimates; it should decrease.",
            (Line("value", "V", FINGERS[1], value),),
        ),
        Chart(
            "lyapunov-rate",
            "Rate of the Lyapunov value, dV/dt",
            "1/s",
            "Rate of change of the Lyapunov value between rows; below zero the errors decrease.",
            (Line("rate", "dV/dt", FINGERS[1], rate_of_change(trace.times, value)),),
        ),
        *balance_charts(result),
    )


_Charts = Callable[[RunResult], tuple[Chart, ...]]


def _either(charts: _Charts, of_slide: _Charts, on_rail: _Charts) -> _Charts:
    """Charts of a hand, or those of a body on a support or a rail."""

    def charts_of_run(result: RunResult) -> tuple[Chart, ...]:
        space = result.scenario.space
        if space is RAIL:
            return on_rail(result)
        return (charts if space.has_hand else of_slide)(result)

    return charts_of_run


ESTIMATES_TAB = "Estimates"

CHART_TABS: dict[str, _Charts] = {
    "Contact": _either(contact_charts, slide_charts, rail_charts.contact_charts),
    "Motion": _either(tracking_charts, motion_charts, rail_charts.motion_charts),
    ESTIMATES_TAB: charts_of_estimates,
    "Energy": _either(energy_charts, balance_charts, balance_charts),
}
"""The charts of a run by tab."""


def charts_of(result: RunResult) -> dict[str, tuple[Chart, ...]]:
    """All charts of a run, by tab; their keys are unique over all tabs."""
    return {tab: make_charts(result) for tab, make_charts in CHART_TABS.items()}


def rate_of_change(times: Values, values: Values) -> Values:
    """The first derivative of a signal, at each of its rows.

    The slopes to the previous and next row are weighted by proximity, as for a parabola through all
    three points. Two rows at one time are the sides of an event, across which no slope is computed.

    Args:
        times: Times of the rows, shape ``(rows,)`` [s].
        values: Values of the rows, shape ``(rows,)``.

    Returns:
        Shape ``(rows,)``, per second; 0 at a row without a neighbour at another time.
    """
    steps = np.diff(times)
    slopes = np.divide(np.diff(values), steps, out=np.zeros_like(steps), where=steps > 0.0)
    step_before, step_after = np.append(0.0, steps), np.append(steps, 0.0)
    weight_before = np.where(step_after > 0.0, step_after, 1.0) * (step_before > 0.0)
    weight_after = np.where(step_before > 0.0, step_before, 1.0) * (step_after > 0.0)
    weighted = weight_before * np.append(0.0, slopes) + weight_after * np.append(slopes, 0.0)
    total = weight_before + weight_after
    return np.divide(weighted, total, out=np.zeros_like(total), where=total > 0.0)
