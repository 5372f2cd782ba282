"""Panels of a finger on a rail: motion and slip, and contact forces."""

from __future__ import annotations

from slipgrasp.core.run.result import RunResult
from slipgrasp.figures.panels import Curve, Panel, Plot, Values, finger_colour, lighter
from slipgrasp.recordings.palette import CONE, MARK

_NAMES = ("fingertip", "rail")


def rail_motion_panels(result: RunResult) -> tuple[Panel, ...]:
    """Position with its desired value, error and slip."""
    trace = result.trace
    actual, desired = 1e3 * trace.object_pose[:, 0], 1e3 * trace.desired_pose[:, 0]
    position = (
        Curve(label="$x_d$", colour=CONE, values=desired, role="truth"),
        Curve(label="$x$", colour=MARK, values=actual),
    )
    error, slip = 1e3 * trace.tracking_error[:, 0], 1e3 * trace.slip[:, 0]
    return (
        Panel(
            title="position along the rail",
            plots=(_plot("$x$ [mm]", *position), _plot("$e$ [mm]", _curve(error))),
            contacts=(1,),
        ),
        Panel(
            title="slip of the fingertip",
            plots=(
                _plot("$s$ [mm]", _curve(slip)),
                _plot(r"$\dot s$ [m/s]", _curve(trace.slip_velocity[:, 0])),
            ),
            contacts=(0,),
        ),
    )


def rail_force_panels(result: RunResult) -> tuple[Panel, ...]:
    """Friction with its limit and normal force of both contacts, and joint torques."""
    trace = result.trace
    limits = trace.friction_coefficient * trace.normal_force
    panels = tuple(
        Panel(
            title=f"force of the {name} on the object",
            plots=(
                _plot(
                    "$|F|$ [N]",
                    Curve(label=r"$\mu N$", colour=CONE, values=limits[:, i], role="limit"),
                    Curve(label="$|F|$", colour=MARK, values=trace.tangential_size[:, i]),
                ),
                _plot("$N$ [N]", _curve(trace.normal_force[:, i])),
            ),
            contacts=(i,),
        )
        for i, name in enumerate(_NAMES)
    )
    joints = (
        Curve(label=rf"$\tau_{k + 1}$", colour=lighter(finger_colour(0), 0.4 * k), values=torque)
        for k, torque in enumerate(trace.joint_torque.T)
    )
    torques = Panel(title="joint torques", plots=(_plot(r"$\tau$ [N m]", *joints),), contacts=(0,))
    return (*panels, torques)


def _curve(values: Values) -> Curve:
    return Curve(label="", colour=MARK, values=values)


def _plot(label: str, *curves: Curve) -> Plot:
    return Plot(label=label, curves=curves, least_span=0.02, with_zero=True)
