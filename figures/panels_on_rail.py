"""Panels of a finger on a rail: motion and slip, and contact forces."""

from __future__ import annotations

from slipgrasp.core.run.result import RunResult
from slipgrasp.figures.panels import Curve, Panel, finger_colour, lighter, panel_of
from slipgrasp.recordings.palette import CONE

_NAMES = ("fingertip", "rail")


def rail_motion_panels(result: RunResult) -> tuple[Panel, ...]:
    """Position with its desired value, error and slip."""
    trace = result.trace
    actual, desired = 1e3 * trace.object_pose[:, 0], 1e3 * trace.desired_pose[:, 0]
    position = [
        Curve(label="$x_d$", colour=CONE, values=desired, role="truth"),
        Curve(label="$x$", values=actual),
    ]
    error = Curve(values=1e3 * trace.tracking_error[:, 0])
    slip, speed = Curve(values=1e3 * trace.slip[:, 0]), Curve(values=trace.slip_velocity[:, 0])
    slips = {"$s$ [mm]": [slip], r"$\dot s$ [m/s]": [speed]}
    return (
        panel_of("position along the rail", (1,), {"$x$ [mm]": position, "$e$ [mm]": [error]}),
        panel_of("slip of the fingertip", (0,), slips),
    )


def rail_force_panels(result: RunResult) -> tuple[Panel, ...]:
    """Friction with its limit and normal force of both contacts, and joint torques."""
    trace = result.trace
    limits = trace.friction_coefficient * trace.normal_force
    joints = (
        Curve(label=rf"$\tau_{k + 1}$", colour=lighter(finger_colour(0), 0.4 * k), values=torque)
        for k, torque in enumerate(trace.joint_torque.T)
    )
    forces = (
        {
            "$|F|$ [N]": [
                Curve(label=r"$\mu N$", colour=CONE, values=limits[:, i], role="limit"),
                Curve(label="$|F|$", values=trace.tangential_size[:, i]),
            ],
            "$N$ [N]": [Curve(values=trace.normal_force[:, i])],
        }
        for i in range(len(_NAMES))
    )
    named = enumerate(zip(_NAMES, forces, strict=True))
    return (
        *(panel_of(f"force of the {name} on the object", (i,), each) for i, (name, each) in named),
        panel_of("joint torques", (0,), {r"$\tau$ [N m]": joints}),
    )
