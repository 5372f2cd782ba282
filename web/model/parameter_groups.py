"""Groups and labels of the parameters in the scenario editor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from slipgrasp.core.scenario import PLANAR, Scenario, Space
from slipgrasp.core.scenario.custom_laws import LAW_PARAMETERS, custom_laws
from slipgrasp.core.scenario.field_errors import find_template
from slipgrasp.core.scenario.parameters import Parameter, iterate_parameters
from slipgrasp.core.scenario.space import SPACES
from slipgrasp.core.words.parameter_words import key_words, unit_after, unit_words
from slipgrasp.web.model.disturbances import Disturbance, disturbance_parameters
from slipgrasp.web.model.draft import is_of_law
from slipgrasp.web.model.row_text import is_of_rows, row_parameters

CONTROLLER = "Controller"
"""Title of the group with the main settings of the control law."""

_ESTIMATES = "Initial estimates"
_MAIN = ("object", "fingers", "estimates", "controller")
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
    "initial_deviation",
    "slip_position_gain",
    "estimate_norm_bound",
    "minimum",
    "maximum",
)
_NOUNS = {"pulses": "Push", "patches": "Low-friction patch"}
_FOLDED_TITLES = {
    "controller": "Controller in detail",
    "object": "Shape of the object",
    "estimates": "Unknowns and their bounds",
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
        is_open: Whether it is expanded initially.
        entries: Its controls, in order.
    """

    title: str
    is_open: bool
    entries: tuple[Entry, ...]


def group_parameters(
    definitions: Mapping[str, Parameter], names: Sequence[str]
) -> tuple[Group, ...]:
    """All parameters of a scenario: expanded groups of the main ones, then collapsed ones.

    Args:
        definitions: Every parameter by key.
        names: Names of the fingers.
    """
    groups: dict[tuple[str, bool], list[Entry]] = {}
    for title, is_open, entry in _placed(definitions, names):
        groups.setdefault((title, is_open), []).append(entry)
    ordered = sorted(groups.items(), key=lambda item: not item[0][1])
    return tuple(Group(title, opened, tuple(entries)) for (title, opened), entries in ordered)


def _placed(
    definitions: Mapping[str, Parameter], names: Sequence[str]
) -> Iterator[tuple[str, bool, Entry]]:
    single = (parameter for parameter in definitions.values() if not is_of_rows(parameter.key))
    rows = row_parameters(_space_of(definitions))
    for parameter in sorted((*single, *rows.values()), key=_rank):
        is_open = _is_main(parameter)
        label = control_label(parameter, definitions, names)
        as_text = parameter.kind == "number-or-list" and parameter.optional
        entry = Entry(parameter, label, as_text)
        yield _title(parameter.key, is_open, names), is_open, entry
        if parameter.kind == "number-or-list" and not parameter.optional:
            each = key_words(parameter.key.partition(".")[2], names) + ", each"
            entry = Entry(parameter, each + unit_words(parameter.unit), True)
            yield _title(parameter.key, False, names), False, entry


def _rank(parameter: Parameter) -> int:
    head = parameter.key.partition(".")[0]
    return _MAIN.index(head) if head in _MAIN else len(_MAIN)


def _is_main(parameter: Parameter) -> bool:
    head, last = parameter.key.partition(".")[0], parameter.key.rpartition(".")[2]
    return parameter.changeable and head in _MAIN and last not in _DETAILS


def _title(key: str, is_open: bool, names: Sequence[str]) -> str:
    head, _, rest = key.partition(".")
    if head == "fingers":
        finger = f"{names[int(rest.partition('.')[0])].capitalize()} finger"
        return finger if is_open else f"Build of the {finger.lower()}"
    if not is_open:
        return _FOLDED_TITLES[head]
    return _ESTIMATES if head == "estimates" else head.capitalize()


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
        return Group(kind, True, tuple(entry(each) for each in parameters if is_of_law(each.key)))

    return tuple(group(law.name) for law in custom_laws() if law.parameters)


def disturbance_title(disturbance: Disturbance) -> str:
    """The name of a disturbance, such as ``Push at 0.08 s``."""
    return f"{_NOUNS[disturbance.place]} at {disturbance.time:g} s"


def disturbance_groups(
    disturbances: Sequence[Disturbance], names: Sequence[str], space: Space
) -> tuple[Group, ...]:
    """A collapsed group for each disturbance, so that the controls below do not move.

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
        Group(disturbance_title(disturbance), is_open=False, entries=tuple(own))
        for disturbance, own in zip(disturbances, entries.values(), strict=True)
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
    """The kind of hand of parameters, from the moments of inertia of its object."""
    return next((space for space in SPACES if space.inertias[0] in definitions), PLANAR)


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
