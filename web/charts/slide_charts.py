"""Content of the charts of a body on a support."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.palette import FINGERS
from slipgrasp.web.charts.chart import LEAST_LENGTH, Chart, Line, margin_chart, moment_limits


def slide_charts(result: RunResult) -> tuple[Chart, ...]:
    """Distance slid, speed, and friction against its limits."""
    trace = result.trace
    speed = np.linalg.norm(trace.slip_velocity, axis=1)
    own, other = FINGERS[0], FINGERS[1]
    return (
        Chart(
            "slip",
            "Displacement on the support",
            "mm",
            "Displacement of the body from its start. It is constant while the body rests.",
            (
                Line("slip-x-0", "x", own, 1e3 * trace.slip[:, 0]),
                Line("slip-y-0", "y", other, 1e3 * trace.slip[:, 1]),
                Line("path-0", "distance slid", own, 1e3 * trace.slip_path[:, 0], dashed=True),
            ),
            least=LEAST_LENGTH,
        ),
        Chart(
            "slip-velocity",
            "Sliding speed",
            "mm/s",
            "Speed of the body on the support; exactly zero while it rests.",
            (Line("velocity-0", "speed", own, 1e3 * speed),),
            least=LEAST_LENGTH,
        ),
        margin_chart(
            (
                "forces",
                "Friction force |f| and its limit μN",
                "N",
                "The band between the force and its limit is the margin, which the friction moment "
                "reduces.",
            ),
            ("",),
            ("force", "|f|", trace.tangential_size),
            ("limit", "μN", trace.friction_coefficient * trace.normal_force),
        ),
        margin_chart(
            (
                "moments",
                "Friction moment |M| and its limit at the current friction force",
                "mN m",
                "Friction force and moment share one limit, the ellipsoid limit surface of the "
                "contact; a contact without a radius has no friction moment.",
            ),
            ("",),
            ("moment", "|M|", 1e3 * np.abs(trace.torsional_moment)),
            ("most", "limit", 1e3 * moment_limits(result)),
        ),
    )


def motion_charts(result: RunResult) -> tuple[Chart, ...]:
    """Turn, velocity and angular velocity of the body."""
    trace = result.trace
    velocity = trace.object_velocity
    return (
        Chart(
            "spin",
            "Turn",
            "mrad",
            "Angle by which the body has turned since its start.",
            (Line("spin-0", "θ", FINGERS[2], 1e3 * trace.spin[:, 0]),),
            least=LEAST_LENGTH,
        ),
        Chart(
            "velocity",
            "Velocity",
            "m/s",
            "Velocity of the centre of mass in the plane of the support.",
            (
                Line("velocity-x", "x", FINGERS[0], velocity[:, 0]),
                Line("velocity-y", "y", FINGERS[1], velocity[:, 1]),
            ),
        ),
        Chart(
            "turn-rate",
            "Angular velocity",
            "rad/s",
            "Angular velocity about the normal of the support.",
            (Line("turn-rate", "ω", FINGERS[2], velocity[:, 2]),),
        ),
    )
