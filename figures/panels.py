"""What the figures of a run show: panels of curves over time, in the paper's order.

Symbols count from 1 as in the paper: links and joints through all fingers, contacts as
their fingers. A colour stands for a finger, dark grey for the object; the second link of a
finger has the lighter tone of its colour.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.unknowns import Unknown, parse_unknown
from slipgrasp.core.trace.trace import JOINTS_PER_FINGER
from slipgrasp.recordings.palette import CONE, FINGERS, MARK, Rgb

Values = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Curve:
    """One line over time.

    Attributes:
        label: What the legend calls it; nothing if it needs no entry of its own.
        colour: Its colour.
        values: One per row of the trace, in the unit of its plot.
        role: What it is, or what it is held against: the truth, or a limit.
    """

    label: str
    colour: Rgb
    values: Values
    role: Literal["quantity", "truth", "limit"] = "quantity"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plot:
    """One pair of axes.

    Attributes:
        label: Quantity and unit.
        curves: Its lines.
        least_span: Range of values shown at least, so that rounding errors look like zero.
        with_zero: Whether a line marks zero.
    """

    label: str
    curves: tuple[Curve, ...]
    least_span: float
    with_zero: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Panel:
    """One panel of a figure.

    Attributes:
        title: What it shows.
        plots: Axes, from top to bottom.
        contacts: The contacts whose phases are shaded.
    """

    title: str
    plots: tuple[Plot, ...]
    contacts: tuple[int, ...]


def finger_colour(finger: int) -> Rgb:
    """The colour of a finger and of its contact."""
    return FINGERS[finger % len(FINGERS)]


def lighter(colour: Rgb, share: float) -> Rgb:
    """A tone of the colour with a share of white, 0 … 1."""
    red, green, blue = (round(channel + share * (255 - channel)) for channel in colour)
    return (red, green, blue)


def tracking_panels(result: RunResult) -> tuple[Panel, ...]:
    """Errors of the object's pose, and the slips with their velocities (Fig. 5 and 8)."""
    contacts = tuple(range(result.trace.shape.num_contacts))
    errors = (
        ("object horizontal position error", r"$e_x$ [mm]"),
        ("object vertical position error", r"$e_y$ [mm]"),
        ("object orientation error", r"$e_\theta$ [mrad]"),
    )
    columns = 1e3 * result.trace.tracking_error.T
    poses = [
        Panel(
            title=title,
            plots=(
                Plot(
                    label=label,
                    curves=(Curve(label="", colour=MARK, values=values),),
                    least_span=0.02,
                    with_zero=True,
                ),
            ),
            contacts=contacts,
        )
        for (title, label), values in zip(errors, columns, strict=True)
    ]
    return (*poses, _slip_panel(result, contacts))


def _slip_panel(result: RunResult, contacts: tuple[int, ...]) -> Panel:
    trace, names = result.trace, result.scenario.finger_names
    # A legend of more than three has no room for names; the lanes tell them in the same order.
    shown = [f" {name}" if len(names) <= 3 else "" for name in names]
    slips = [
        Curve(label=f"$s_{i + 1}${shown[i]}", colour=finger_colour(i), values=1e3 * column)
        for i, column in enumerate(trace.slip.T)
    ]
    velocities = [
        Curve(label="", colour=finger_colour(i), values=1e3 * column)
        for i, column in enumerate(trace.slip_velocity.T)
    ]
    return Panel(
        title="fingertip slips and their velocities",
        plots=(
            Plot(label=r"$s$ [mm]", curves=tuple(slips), least_span=0.02, with_zero=True),
            Plot(
                label=r"$\dot s$ [mm/s]", curves=tuple(velocities), least_span=0.02, with_zero=True
            ),
        ),
        contacts=contacts,
    )


def force_panels(result: RunResult) -> tuple[Panel, ...]:
    """For every finger its joint torques, and its force on the object (Fig. 7 and 10)."""
    return tuple(panel for i in range(len(result.scenario.fingers)) for panel in _forces(result, i))


def _forces(result: RunResult, finger: int) -> Iterator[Panel]:
    trace, name = result.trace, result.scenario.finger_names[finger]
    first = JOINTS_PER_FINGER * finger
    torques = [
        Curve(
            label=rf"$\tau_{{{first + k + 1}}}$",
            colour=link_colour(finger, k),
            values=trace.joint_torque[:, first + k],
        )
        for k in range(JOINTS_PER_FINGER)
    ]
    yield Panel(
        title=f"joint torques of the {name} finger",
        plots=(
            Plot(label=r"$\tau$ [N m]", curves=tuple(torques), least_span=0.01, with_zero=True),
        ),
        contacts=(finger,),
    )
    limit = (trace.friction_coefficient * trace.normal_force)[:, finger]
    forces = (
        Curve(label=r"$\pm\mu F_n$", colour=CONE, values=limit, role="limit"),
        Curve(label="", colour=CONE, values=-limit, role="limit"),
        Curve(
            label="$F_n$ normal",
            colour=link_colour(finger, 0),
            values=trace.normal_force[:, finger],
        ),
        Curve(
            label="$F_x$ tangential",
            colour=link_colour(finger, 1),
            values=trace.tangential_force[:, finger],
        ),
    )
    yield Panel(
        title=f"force on the object by the {name} finger",
        plots=(Plot(label="$F$ [N]", curves=forces, least_span=0.01, with_zero=True),),
        contacts=(finger,),
    )


def estimate_panels(result: RunResult) -> tuple[Panel, ...]:
    """The estimates against the truth (Fig. 6 and 9).

    Link masses share one panel per finger, friction has one per contact, mass and inertia
    of the object one each, in this order.
    """
    scenario, trace = result.scenario, result.trace
    groups: dict[tuple[str, int], list[tuple[int, Unknown]]] = {}
    for column, key in enumerate(trace.shape.unknowns):
        unknown = parse_unknown(scenario, key)
        assert unknown is not None  # the scenario has been checked
        groups.setdefault((unknown.kind, unknown.finger), []).append((column, unknown))
    order = sorted(groups, key=lambda group: (_KINDS.index(group[0]), group[1]))
    return tuple(_estimate_panel(result, groups[group]) for group in order)


_KINDS = ("link_mass", "friction", "object_mass", "object_inertia")


def _estimate_panel(result: RunResult, members: list[tuple[int, Unknown]]) -> Panel:
    trace, first = result.trace, members[0][1]
    truths = [
        Curve(
            label="" if i else "true value",
            colour=MARK,
            values=trace.true_parameters[:, column],
            role="truth",
        )
        for i, (column, _) in enumerate(members)
    ]
    estimates = [
        Curve(
            label=unknown_symbol(unknown),
            colour=MARK if unknown.finger < 0 else link_colour(unknown.finger, unknown.link),
            values=trace.estimates[:, column],
        )
        for column, unknown in sorted(members, key=lambda member: member[1])
    ]
    contacts = range(trace.shape.num_contacts) if first.finger < 0 else (first.finger,)
    return Panel(
        title=_estimate_title(result.scenario, first),
        plots=(Plot(label=estimate_label(first), curves=(*truths, *estimates), least_span=1e-4),),
        contacts=tuple(contacts),
    )


def unknown_symbol(unknown: Unknown) -> str:
    """The symbol of the estimate of an unknown parameter."""
    if unknown.kind == "link_mass":
        return rf"$\hat m_{{{JOINTS_PER_FINGER * unknown.finger + unknown.link + 1}}}$"
    if unknown.kind == "friction":
        return rf"$\hat\mu_{unknown.finger + 1}$"
    return r"$\hat m_o$" if unknown.kind == "object_mass" else r"$\hat I_o$"


def estimate_label(unknown: Unknown) -> str:
    """Symbol and unit of an axis that shows such estimates."""
    return {
        "link_mass": r"$\hat m$ [kg]",
        "friction": r"$\hat\mu$ [–]",
        "object_mass": r"$\hat m_o$ [kg]",
        "object_inertia": r"$\hat I_o$ [kg m²]",
    }[unknown.kind]


def _estimate_title(scenario: Scenario, unknown: Unknown) -> str:
    name = scenario.finger_names[unknown.finger]
    return {
        "link_mass": f"masses of the {name} finger links",
        "friction": f"friction at the {name} fingertip",
        "object_mass": "mass of the object",
        "object_inertia": "moment of inertia of the object",
    }[unknown.kind]


def link_colour(finger: int, link: int) -> Rgb:
    """The finger's own colour, and a lighter tone for the second of its curves."""
    return lighter(finger_colour(finger), 0.5 * max(link, 0))
