"""Groups and labels of the parameters in the scenario editor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from slipgrasp.core.scenario import PLANAR, RAIL, SUPPORT, Scenario, Space
from slipgrasp.core.scenario.custom_laws import LAW_PARAMETERS, custom_laws
from slipgrasp.core.scenario.field_errors import find_template
from slipgrasp.core.scenario.parameters import Parameter, iterate_parameters
from slipgrasp.core.scenario.space import HANDS
from slipgrasp.core.words.parameter_words import key_words, unit_after, unit_words
from slipgrasp.web.model.disturbances import Disturbance, disturbance_parameters
from slipgrasp.web.model.draft import is_of_law
from slipgrasp.web.model.row_text import is_of_rows, row_parameters

LAW_TITLE = "Control law"
"""Title of the group with the main settings of the control law."""

MOST_MAIN = 6
"""Largest number of controls that are shown of a selected part."""
_MAIN = ("object", "fingers", "finger", "support", "rail", "motion", "controller")
_AT_START = "motion"
"""A main part although none of its parameters can change during a run."""

# Changeable, but only useful for experts.
_DETAILS = (
    "recognition_time",
    "latency",
    "minimum_normal_force",
    "maximum_normal_force",
    "force_noise",
    "velocity_noise",
    "prediction",
    "link_mass_ratio",
    "link_length_ratio",
    "force_rate",
    "force_bandwidth",
    "joint_damping",
    "joint_friction",
    "static_friction",
    "control_period",
    "lyapunov_weight",
    "distribution",
    "initial_deviation",
    "slip_position_gain",
    "estimate_norm_bound",
    "minimum",
    "maximum",
)
# The main parameters of a part, the most important first; the others follow in scenario order.
_FIRST = ("mass", "friction", "kind", "grip_force")
_NOUNS = {"pulses": "Push", "patches": "Low-friction patch"}
_FOLDED_TITLES = {
    "controller": "Control law in detail",
    "object": "Object in detail",
    "estimates": "Estimated parameters and their bounds",
    "support": "Support in detail",
    "finger": "Finger in detail",
    "rail": "Rail in detail",
    "motion": "Start",
    "trajectory": "Desired motion",
    "sensing": "Sensing",
    "actuation": "Actuation",
    "simulation": "Simulation",
    "title": "Title",
}


@dataclass(frozen=True, slots=True)
class Entry:
    """A control in a group.

    Attributes:
        parameter: Its parameter.
        label: Label in the group, with unit.
        as_text: Whether it is a text field, for one number or a list.
    """

    parameter: Parameter
    label: str
    as_text: bool = False

    @property
    def kind_key(self) -> str:
        """Key of the parameter that selects the kind of its part."""
        return kind_key(self.parameter.key)


def kind_key(key: str) -> str:
    """Key of the parameter that selects the kind of the part of a parameter."""
    part, _, inside = key.partition(".")
    index = inside.partition(".")[0]
    return f"{part}.{index}.kind" if index.isdigit() else f"{part}.kind"


@dataclass(frozen=True, slots=True)
class Group:
    """A group of controls.

    Attributes:
        title: Title.
        part: The part of the scenario that shows it when selected; empty for details.
        entries: Its controls, in order.
    """

    title: str
    part: str
    entries: tuple[Entry, ...]


def group_parameters(
    definitions: Mapping[str, Parameter], names: Sequence[str]
) -> tuple[Group, ...]:
    """All parameters of a scenario: the main ones of each part, then the details.

    Args:
        definitions: Every parameter by key.
        names: Names of the fingers.
    """
    groups: dict[tuple[str, str], list[Entry]] = {}
    for title, part, entry in _placed(definitions, names):
        groups.setdefault((title, part), []).append(entry)
    ordered = sorted(groups.items(), key=lambda item: not item[0][1])
    return tuple(Group(title, part, tuple(entries)) for (title, part), entries in ordered)


def _placed(
    definitions: Mapping[str, Parameter], names: Sequence[str]
) -> Iterator[tuple[str, str, Entry]]:
    single = (parameter for parameter in definitions.values() if not is_of_rows(parameter.key))
    rows = row_parameters(_space_of(definitions))
    counts: dict[str, int] = {}
    for parameter in sorted((*single, *rows.values()), key=partial(_rank, definitions)):
        part = _part_of(parameter, definitions) if _is_main(parameter) else ""
        counts[part] = counts.get(part, 0) + _is_used(parameter, definitions)
        if counts[part] > MOST_MAIN:
            part = ""
        label = control_label(parameter, definitions, names)
        if part and parameter.key.startswith("estimates."):
            estimated = definitions[_estimated_key(parameter, definitions)]
            label = f"estimated {control_label(estimated, definitions, names)}"
        as_text = parameter.kind == "number-or-list" and parameter.optional
        entry = Entry(parameter, label, as_text)
        yield _title(parameter.key, part, names), part, entry
        if parameter.kind == "number-or-list" and not parameter.optional:
            each = key_words(parameter.key.partition(".")[2], names) + ", each"
            entry = Entry(parameter, each + unit_words(parameter.unit), True)
            yield _title(parameter.key, "", names), "", entry


def _rank(definitions: Mapping[str, Parameter], parameter: Parameter) -> tuple[int, int, int]:
    """Sort key: by part, within a part by importance, estimates last."""
    key = parameter.key
    part = _part_of(parameter, definitions)
    head, last = part.partition(".")[0], key.rpartition(".")[2]
    place = _MAIN.index(head) if head in _MAIN else len(_MAIN)
    wanted = _FIRST.index(last) if last in _FIRST else len(_FIRST)
    return place, int(key.startswith("estimates.")), wanted


def _part_of(parameter: Parameter, definitions: Mapping[str, Parameter]) -> str:
    """The part that a parameter belongs to; an estimate belongs to that of its parameter."""
    key = parameter.key
    if key.startswith("estimates."):
        key = _estimated_key(parameter, definitions)
    head, _, rest = key.partition(".")
    return f"fingers.{rest.partition('.')[0]}" if head == "fingers" else head


def _estimated_key(parameter: Parameter, definitions: Mapping[str, Parameter]) -> str:
    """Key of the estimated parameter."""
    return str(definitions[f"{parameter.key.rpartition('.')[0]}.parameter"].value)


def _is_main(parameter: Parameter) -> bool:
    head, last = parameter.key.partition(".")[0], parameter.key.rpartition(".")[2]
    is_used = parameter.changeable or head == _AT_START
    return is_used and head in (*_MAIN, "estimates") and last not in _DETAILS


def _is_used(parameter: Parameter, definitions: Mapping[str, Parameter]) -> bool:
    """True unless the part is of a kind that lacks the parameter."""
    kind = definitions.get(kind_key(parameter.key))
    return not parameter.used_by or kind is None or kind.value in parameter.used_by


def _title(key: str, part: str, names: Sequence[str]) -> str:
    head, _, rest = (part or key).partition(".")
    if head == "fingers":
        finger = f"{names[int(rest.partition('.')[0])].capitalize()} finger"
        return finger if part else f"{finger} in detail"
    if not part:
        return _FOLDED_TITLES[head]
    return LAW_TITLE if head == "controller" else head.capitalize()


def law_groups(base: Scenario) -> tuple[Group, ...]:
    """A group for every custom law with parameters, titled with its name.

    Args:
        base: Scenario with the initial values of the law.
    """

    def entry(parameter: Parameter) -> Entry:
        name = parameter.key.removeprefix(f"{LAW_PARAMETERS}.")
        return Entry(parameter, key_words(name, ()) + unit_words(parameter.unit))

    def group(kind: str) -> Group:
        given = base.controller.parameters if kind == base.controller.kind else {}
        controller = replace(base.controller, kind=kind, parameters=given)
        parameters = iterate_parameters(controller, "controller.")
        return Group(
            kind, "controller", tuple(entry(each) for each in parameters if is_of_law(each.key))
        )

    laws = custom_laws() if base.space.has_hand else ()
    return tuple(group(law.name) for law in laws if law.parameters)


def disturbance_title(disturbance: Disturbance) -> str:
    """The name of a disturbance, such as ``Push at 0.08 s``."""
    return f"{_NOUNS[disturbance.place]} at {disturbance.time:.4g} s"


def disturbance_groups(
    disturbances: Sequence[Disturbance], names: Sequence[str], space: Space
) -> tuple[Group, ...]:
    """A group for each push and each low-friction patch.

    Args:
        disturbances: The disturbances.
        names: Names of the fingers.
        space: Kind of hand.
    """
    entries: dict[str, list[Entry]] = {}
    for parameter in disturbance_parameters(disturbances, space):
        place, index, own = parameter.key.split(".", 2)
        label = key_words(own, names) + unit_words(parameter.unit)
        entries.setdefault(f"{place}.{index}", []).append(Entry(parameter, label))
    return tuple(
        Group(disturbance_title(disturbance), part, tuple(own))
        for disturbance, (part, own) in zip(disturbances, entries.items(), strict=True)
    )


def control_label(
    parameter: Parameter, definitions: Mapping[str, Parameter], names: Sequence[str]
) -> str:
    """The label of a control in its group, with unit.

    Args:
        parameter: Its parameter.
        definitions: Every parameter by key.
        names: Names of the fingers.
    """
    parts = parameter.key.split(".")
    if parts[0] == "estimates":
        if parts[2] == "parameter":
            return f"unknown {int(parts[1]) + 1}"
        target = definitions.get(str(definitions[f"estimates.{parts[1]}.parameter"].value))
        words = key_words(target.key, names) if target else f"unknown {int(parts[1]) + 1}"
        which = "" if parts[2] == "initial" else f", {parts[2]}"
        return words + which + unit_words(target.unit if target else "")
    if parameter.key == "controller.kind":
        return key_words(parameter.key, names)
    inside = parts[2:] if parts[0] == "fingers" else parts[1:]
    words = key_words(".".join(inside or parts), names, _space_of(definitions))
    return words + unit_words(parameter.unit)


def _space_of(definitions: Mapping[str, Parameter]) -> Space:
    """The kind of scenario of parameters, from its support or the moments of inertia."""
    if "support.friction" in definitions:
        return SUPPORT
    if "rail.friction" in definitions:
        return RAIL
    return next((space for space in HANDS if space.inertias[0] in definitions), PLANAR)


def value_words(scenario: Scenario, key: str, value: str) -> str:
    """A parameter with a value, such as ``object mass 1.4 kg``.

    Args:
        scenario: The scenario.
        key: Its key.
        value: The value, in the unit of the parameter.
    """
    template = find_template(key)
    unit = template.unit if template else ""
    words = key_words(key, scenario.finger_names, scenario.space)
    return f"{words} {value}{unit_after(unit)}"
