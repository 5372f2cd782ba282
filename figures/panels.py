"""Content of the figures of a run: panels of curves over time, in the paper's order.

Symbols count from 1 as in the paper: links and joints through all fingers, contacts like their
fingers. Colours distinguish fingers, with dark grey for the object; the second link of a finger has
a lighter tone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.space import PLANAR
from slipgrasp.core.scenario.unknowns import Unknown, parse_unknown
from slipgrasp.recordings.palette import CONE, FINGERS, MARK, Rgb

Values = NDArray[np.float64]

LINKS_PER_FINGER = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Curve:
    """A curve over time.

    Attributes:
        values: One value per row of the trace, in the unit of its plot.
        label: Label in the legend; empty for no entry.
        colour: Its colour.
        role: Whether it is the signal, the true value, or a limit.
    """

    values: Values
    label: str = ""
    colour: Rgb = MARK
    role: Literal["quantity", "truth", "limit"] = "quantity"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plot:
    """One pair of axes.

    Attributes:
        label: Quantity and unit.
        curves: Its curves.
        least_span: Smallest vertical range, so that rounding errors look like zero.
        with_zero: Whether to draw a line at zero.
    """

    label: str
    curves: tuple[Curve, ...]
    least_span: float
    with_zero: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Panel:
    """One panel of a figure.

    Attributes:
        title: Title.
        plots: Axes, from top to bottom.
        contacts: Contacts whose phases are shaded.
    """

    title: str
    plots: tuple[Plot, ...]
    contacts: tuple[int, ...]


def panel_of(
    title: str,
    contacts: Iterable[int],
    plots: Mapping[str, Iterable[Curve]],
    *,
    least_span: float = 0.02,
    with_zero: bool = True,
) -> Panel:
    """A panel with equal options for all its plots.

    Args:
        title: Title.
        contacts: Contacts whose phases are shaded.
        plots: Curves by the label of their axes, from top to bottom.
        least_span: See `Plot`.
        with_zero: See `Plot`.
    """
    options = {"least_span": least_span, "with_zero": with_zero}
    drawn = (Plot(label=label, curves=tuple(curves), **options) for label, curves in plots.items())
    return Panel(title=title, plots=tuple(drawn), contacts=tuple(contacts))


def finger_curves(values: Values, names: Sequence[str] = ()) -> Iterator[Curve]:
    """A curve for each finger of ``(rows, fingers)``; without names they are not in the legend."""
    for i, column in enumerate(values.T):
        yield Curve(label=names[i] if names else "", colour=finger_colour(i), values=column)


def finger_colour(finger: int) -> Rgb:
    """The colour of a finger and of its contact."""
    return FINGERS[finger % len(FINGERS)]


def lighter(colour: Rgb, share: float) -> Rgb:
    """Blends the colour with white, by a fraction from 0 to 1."""
    red, green, blue = (round(channel + share * (255 - channel)) for channel in colour)
    return (red, green, blue)


def tracking_panels(result: RunResult) -> tuple[Panel, ...]:
    """Errors of the object's pose, and the slips with their velocities (Fig. 5 and 8)."""
    trace, names = result.trace, result.scenario.finger_names
    contacts = range(trace.shape.num_contacts)
    errors = (
        ("object horizontal position error", r"$e_x$ [mm]"),
        ("object vertical position error", r"$e_y$ [mm]"),
        ("object orientation error", r"$e_\theta$ [mrad]"),
    )
    columns = 1e3 * trace.tracking_error.T
    # A legend with more than three entries has no space for names; lanes have the same order.
    shown = [f" {name}" if len(names) <= 3 else "" for name in names]
    symbols = [f"$s_{i}${name}" for i, name in enumerate(shown, 1)]
    slips = {
        r"$s$ [mm]": finger_curves(1e3 * trace.slip, symbols),
        r"$\dot s$ [mm/s]": finger_curves(1e3 * trace.slip_velocity),
    }
    return (
        *(
            panel_of(title, contacts, {label: [Curve(values=values)]})
            for (title, label), values in zip(errors, columns, strict=True)
        ),
        panel_of("fingertip slips and their velocities", contacts, slips),
    )


def force_panels(result: RunResult) -> tuple[Panel, ...]:
    """Joint torques of every finger, and its force on the object (Fig. 7 and 10)."""
    return tuple(panel for i in range(len(result.scenario.fingers)) for panel in _forces(result, i))


def _forces(result: RunResult, finger: int) -> Iterator[Panel]:
    trace = result.trace
    links = [link_colour(finger, joint) for joint in range(PLANAR.joints_per_finger)]
    yield torque_panel(result, finger, links)
    limit = (trace.friction_coefficient * trace.normal_force)[:, finger]
    normal, tangential = trace.normal_force[:, finger], trace.tangential_force[:, finger]
    yield contact_force_panel(
        result,
        finger,
        Curve(label=r"$\pm\mu F_n$", colour=CONE, values=limit, role="limit"),
        Curve(colour=CONE, values=-limit, role="limit"),
        Curve(label="$F_n$ normal", colour=links[0], values=normal),
        Curve(label="$F_x$ tangential", colour=links[1], values=tangential),
    )


def torque_panel(result: RunResult, finger: int, colours: Sequence[Rgb]) -> Panel:
    """Joint torques of a finger, or forces on its slides, with one colour per joint."""
    first = len(colours) * finger
    torques = [
        Curve(
            label=rf"$\tau_{{{joint + 1}}}$",
            colour=colour,
            values=result.trace.joint_torque[:, joint],
        )
        for joint, colour in enumerate(colours, first)
    ]
    slides = result.trace.shape.slides
    units = dict.fromkeys("N" if k in slides else "N m" for k in range(first, first + len(colours)))
    what = "forces on the slides" if "N m" not in units else "joint torques"
    title = f"{what} of the {result.scenario.finger_names[finger]} finger"
    label = rf"$\tau$ [{', '.join(units)}]"
    return panel_of(title, (finger,), {label: torques}, least_span=0.01)


def contact_force_panel(result: RunResult, finger: int, *curves: Curve) -> Panel:
    """The force of a finger on the object [N]."""
    title = f"force on the object by the {result.scenario.finger_names[finger]} finger"
    return panel_of(title, (finger,), {"$F$ [N]": curves}, least_span=0.01)


def estimate_panels(result: RunResult) -> tuple[Panel, ...]:
    """Estimates and true values (Fig. 6 and 9).

    Link masses share one panel per finger, friction has one panel per contact, mass and inertia of
    the object have one each, in this order.
    """
    scenario, trace = result.scenario, result.trace
    groups: dict[tuple[str, int], list[tuple[int, Unknown]]] = {}
    for column, key in enumerate(trace.shape.unknowns):
        unknown = parse_unknown(scenario, key)
        assert unknown is not None  # the scenario is valid
        groups.setdefault((unknown.kind, unknown.finger), []).append((column, unknown))
    order = sorted(groups, key=lambda group: (_KINDS.index(group[0]), group[1]))
    return tuple(_estimate_panel(result, groups[group]) for group in order)


_KINDS = ("link_mass", "friction", "object_mass", "object_inertia")


def _estimate_panel(result: RunResult, members: list[tuple[int, Unknown]]) -> Panel:
    trace, first = result.trace, members[0][1]
    truths = [
        Curve(
            label="" if i else "true value",
            values=trace.true_parameters[:, column],
            role="truth",
        )
        for i, (column, _) in enumerate(members)
    ]
    estimates = [
        Curve(
            label=unknown_symbol(unknown),
            colour=unknown_colour(unknown),
            values=trace.estimates[:, column],
        )
        for column, unknown in sorted(members, key=lambda member: member[1])
    ]
    contacts = range(trace.shape.num_contacts) if first.finger < 0 else (first.finger,)
    plots = {estimate_label(first): (*truths, *estimates)}
    title = _estimate_title(result.scenario, first)
    return panel_of(title, contacts, plots, least_span=1e-4, with_zero=False)


def unknown_symbol(unknown: Unknown) -> str:
    """The symbol of the estimate of an unknown parameter."""
    if unknown.kind == "link_mass":
        return rf"$\hat m_{{{LINKS_PER_FINGER * unknown.finger + unknown.link + 1}}}$"
    if unknown.kind == "friction":
        return rf"$\hat\mu_{unknown.finger + 1}$"
    if unknown.kind == "object_mass":
        return r"$\hat m_o$"
    return r"$\hat I_o$" if unknown.link < 0 else rf"$\hat I_{'xyz'[unknown.link]}$"


def unknown_colour(unknown: Unknown) -> Rgb:
    """The colour of the estimate of an unknown parameter."""
    if unknown.finger < 0:
        return axis_colour(unknown.link)
    return link_colour(unknown.finger, unknown.link)


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
        "object_inertia": f"moment{'s' * (len(scenario.space.inertias) > 1)} of inertia of "
        "the object",
    }[unknown.kind]


def axis_colour(axis: int) -> Rgb:
    """The colour of an axis of the object, darkest for z; -1 is the object itself."""
    return lighter(MARK, (0.66, 0.33, 0.0)[axis])


def link_colour(finger: int, link: int) -> Rgb:
    """The colour of the finger, with a lighter tone for its second curve."""
    return lighter(finger_colour(finger), 0.5 * max(link, 0))
