"""Panels of a body on a support: its motion, and the friction on it."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.run.result import RunResult
from slipgrasp.figures.panels import Curve, Panel, Plot, Values, axis_colour, lighter
from slipgrasp.recordings.palette import CONE, MARK

_CONTACT = (0,)


def motion_panels(result: RunResult) -> tuple[Panel, ...]:
    """Displacement, rotation and velocities of the body."""
    trace = result.trace
    ways, speeds = 1e3 * trace.slip, trace.slip_velocity
    turn, rate = 1e3 * trace.spin[:, 0], trace.spin_velocity[:, 0]
    return (
        _panel("displacement of the body", {"$x$, $y$ [mm]": ways}),
        _panel("velocity of the body", {"$v_x$, $v_y$ [m/s]": speeds}),
        _panel("turn of the body", {r"$\theta$ [mrad]": turn}),
        _panel("angular velocity of the body", {r"$\omega$ [rad/s]": rate}),
    )


def friction_panels(result: RunResult) -> tuple[Panel, ...]:
    """Friction force with its limit, and friction moment."""
    trace = result.trace
    limit = (trace.friction_coefficient * trace.normal_force)[:, 0]
    force = Plot(
        label="$|f|$ [N]",
        curves=(
            Curve(label=r"$\mu N$", colour=CONE, values=limit, role="limit"),
            Curve(label="$|f|$ friction", colour=MARK, values=trace.tangential_size[:, 0]),
        ),
        least_span=0.02,
        with_zero=True,
    )
    moment = 1e3 * trace.torsional_moment[:, 0]
    return (
        Panel(title="friction force on the body", plots=(force,), contacts=_CONTACT),
        _panel("friction moment on the body", {"$M$ [mN m]": moment}),
    )


def _panel(title: str, plots: dict[str, Values]) -> Panel:
    """Quantities ``(rows,)``, or along x and y ``(rows, 2)``, by label."""
    return Panel(
        title=title,
        plots=tuple(
            Plot(label=label, curves=_curves(values), least_span=0.02, with_zero=True)
            for label, values in plots.items()
        ),
        contacts=_CONTACT,
    )


def _curves(values: Values) -> tuple[Curve, ...]:
    if values.ndim == 1:
        return (Curve(label="", colour=MARK, values=values),)
    colours = axis_colour(0), lighter(axis_colour(1), 0.2)
    named = zip("xy", colours, np.transpose(values), strict=True)
    return tuple(Curve(label=f"${axis}$", colour=c, values=each) for axis, c, each in named)
