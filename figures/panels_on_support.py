"""Panels of a body on a support: its motion, and the friction on it."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.run.result import RunResult
from slipgrasp.figures.panels import Curve, Panel, Values, axis_colour, lighter, panel_of
from slipgrasp.recordings.palette import CONE

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
    force = [
        Curve(label=r"$\mu N$", colour=CONE, values=limit, role="limit"),
        Curve(label="$|f|$ friction", values=trace.tangential_size[:, 0]),
    ]
    moment = 1e3 * trace.torsional_moment[:, 0]
    return (
        panel_of("friction force on the body", _CONTACT, {"$|f|$ [N]": force}),
        _panel("friction moment on the body", {"$M$ [mN m]": moment}),
    )


def _panel(title: str, plots: dict[str, Values]) -> Panel:
    """Quantities ``(rows,)``, or along x and y ``(rows, 2)``, by label."""
    return panel_of(title, _CONTACT, {name: _curves(values) for name, values in plots.items()})


def _curves(values: Values) -> tuple[Curve, ...]:
    if values.ndim == 1:
        return (Curve(values=values),)
    colours = axis_colour(0), lighter(axis_colour(1), 0.2)
    named = zip("xy", colours, np.transpose(values), strict=True)
    return tuple(Curve(label=f"${axis}$", colour=c, values=each) for axis, c, each in named)
