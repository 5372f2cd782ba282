"""Content of the charts of an object on a rail."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.palette import FINGERS
from slipgrasp.web.charts.chart import LEAST_LENGTH, Chart, Line, contact_lines, margin_chart

Values = NDArray[np.float64]

_NAMES = ("fingertip", "object on rail")


def contact_charts(result: RunResult) -> tuple[Chart, ...]:
    """Slips, slip velocities, friction against its limits, and normal forces."""
    trace = result.trace
    limits = trace.friction_coefficient * trace.normal_force
    velocities, normals = ([f"{name} {what}" for name in _NAMES] for what in ("velocity", "N"))
    return (
        Chart(
            "slip",
            "Slip of the fingertip",
            "mm",
            "Displacement of the fingertip along the face of the object.",
            (Line("slip-0", _NAMES[0], FINGERS[0], 1e3 * trace.slip[:, 0]),),
            least=LEAST_LENGTH,
        ),
        Chart(
            "slip-velocity",
            "Slip velocities",
            "mm/s",
            "Of the fingertip on the object, and of the object on the rail; zero in stick.",
            tuple(contact_lines("velocity", velocities, 1e3 * trace.slip_velocity)),
            least=LEAST_LENGTH,
        ),
        margin_chart(
            (
                "forces",
                "Friction forces |F| and their limits μN",
                "N",
                "The band between a force and its limit is the margin; where it closes, the "
                "contact slips.",
            ),
            _NAMES,
            ("force", "|F|", trace.tangential_size),
            ("limit", "μN", limits),
        ),
        Chart(
            "normal-forces",
            "Normal forces",
            "N",
            "Of the fingertip and of the rail on the object; the rail can only push.",
            tuple(contact_lines("normal", normals, trace.normal_force)),
        ),
    )


def motion_charts(result: RunResult) -> tuple[Chart, ...]:
    """Position and desired position, tracking error, and joint torques."""
    trace = result.trace
    torques = enumerate(trace.joint_torque.T)
    return (
        Chart(
            "position",
            "Position along the rail",
            "mm",
            "Position of the object, and its desired position.",
            (
                Line("x", "x", FINGERS[0], 1e3 * trace.object_pose[:, 0]),
                Line("desired", "desired", FINGERS[0], 1e3 * trace.desired_pose[:, 0], dashed=True),
            ),
            least=LEAST_LENGTH,
        ),
        Chart(
            "position-error",
            "Tracking error",
            "mm",
            "Desired minus actual position.",
            (Line("error", "x", FINGERS[1], 1e3 * trace.tracking_error[:, 0]),),
            least=LEAST_LENGTH,
        ),
        Chart(
            "torques",
            "Joint torques",
            "N m",
            "Commands of the controller.",
            tuple(Line(f"joint-{k + 1}", f"joint {k + 1}", FINGERS[k], v) for k, v in torques),
        ),
    )
