"""Panels that differ between spatial and planar hands."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.space import SPATIAL
from slipgrasp.figures.panels import (
    Curve,
    Panel,
    Values,
    axis_colour,
    contact_force_panel,
    finger_colour,
    finger_curves,
    lighter,
    link_colour,
    panel_of,
    torque_panel,
)
from slipgrasp.recordings.palette import CONE

_AXES = "xyz"


def spatial_tracking_panels(result: RunResult) -> tuple[Panel, ...]:
    """Errors of the object's position and attitude, and both slips of every fingertip."""
    spins = (_spin_panel(result),) if result.trace.shape.soft else ()
    return (*_pose_panels(result), _slip_panel(result), *spins)


def _pose_panels(result: RunResult) -> Iterator[Panel]:
    quantities = (
        ("object position error", "$e$ [mm]", "$e_{axis}$"),
        ("object attitude error, as a rotation vector", r"$e_\theta$ [mrad]", r"$e_{\theta axis}$"),
    )
    errors = 1e3 * result.trace.tracking_error
    for k, (title, label, symbol) in enumerate(quantities):
        curves = [
            Curve(
                label=symbol.replace("axis", axis),
                colour=axis_colour(way),
                values=errors[:, 3 * k + way],
            )
            for way, axis in enumerate(_AXES)
        ]
        yield panel_of(title, range(result.trace.shape.num_contacts), {label: curves})


def _slip_panel(result: RunResult) -> Panel:
    trace = result.trace
    slip = trace.slip.reshape(len(trace), -1, 2)
    speed = np.linalg.norm(trace.slip_velocity.reshape(len(trace), -1, 2), axis=2)
    return _contact_panel(
        result,
        "fingertip slips along both tangents of their faces, and their speeds",
        {"$s_x$ [mm]": slip[..., 0], "$s_y$ [mm]": slip[..., 1], r"$|\dot s|$ [mm/s]": speed},
    )


def _spin_panel(result: RunResult) -> Panel:
    """Rotation of soft fingertips on their faces, its rate, and the moment."""
    trace = result.trace
    return _contact_panel(
        result,
        "fingertip rotations on their faces about the inward normals, and their moments",
        {
            r"$\psi$ [mrad]": trace.spin,
            r"$\dot\psi$ [mrad/s]": trace.spin_velocity,
            r"$F_\tau$ [mN m]": trace.torsional_moment,
        },
    )


def _contact_panel(result: RunResult, title: str, quantities: Mapping[str, Values]) -> Panel:
    """Quantities of all contacts, ``(rows, contacts)`` in SI units, by label in thousandths."""
    names = result.scenario.finger_names
    plots = {
        label: finger_curves(1e3 * values, () if k else names)
        for k, (label, values) in enumerate(quantities.items())
    }
    return panel_of(title, range(result.trace.shape.num_contacts), plots)


def spatial_force_panels(result: RunResult) -> tuple[Panel, ...]:
    """Joint torques of every finger, and the two components of its force on the object."""
    return tuple(panel for i in range(len(result.scenario.fingers)) for panel in _forces(result, i))


def _forces(result: RunResult, finger: int) -> Iterator[Panel]:
    trace, colour = result.trace, finger_colour(finger)
    joints = range(SPATIAL.joints_per_finger)
    yield torque_panel(result, finger, [lighter(colour, 0.33 * joint) for joint in joints])
    normal = trace.normal_force[:, finger]
    limit = trace.friction_coefficient[:, finger] * normal
    yield contact_force_panel(
        result,
        finger,
        Curve(label=r"$\mu F_n$", colour=CONE, values=limit, role="limit"),
        Curve(label="$F_n$ normal", colour=link_colour(finger, 0), values=normal),
        Curve(
            label="$|F_t|$ tangential",
            colour=link_colour(finger, 1),
            values=trace.tangential_size[:, finger],
        ),
    )
