"""Which parameters stand together in the scenario editor, and what they are called there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from core.field_errors import template_key, template_keys
from core.parameters import Parameter
from core.scenario import Scenario
from web.words import key_words, unit_after, unit_words

__all__ = ["Entry", "Group", "group_parameters", "knob_label", "value_words"]

_BELIEFS = "What the controller believes at first"
_MAIN = ("object", "fingers", "estimates", "controller")
# Changeable, but of use only to those who know why.
_DETAILS = ("recognition_time", "estimate_norm_bound", "minimum", "maximum")
_FOLDED_TITLES = {
    "controller": "Controller in detail",
    "object": "Shape of the object",
    "estimates": "Unknowns and their bounds",
    "trajectory": "Desired motion",
    "simulation": "Simulation",
    "title": "Title",
}


@dataclass(frozen=True, slots=True)
class Entry:
    """A place for a knob.

    Attributes:
        parameter: What it sets.
        label: What it is called inside its group, with its unit.
        as_text: Whether it is a text field, for one number or a list of them.
    """

    parameter: Parameter
    label: str
    as_text: bool = False


@dataclass(frozen=True, slots=True)
class Group:
    """Knobs that stand together.

    Attributes:
        title: What the group is called.
        is_open: Whether it is unfolded at first.
        entries: Its knobs, in order.
    """

    title: str
    is_open: bool
    entries: tuple[Entry, ...]


def group_parameters(
    definitions: Mapping[str, Parameter], names: Sequence[str]
) -> tuple[Group, ...]:
    """All parameters of a scenario: open groups with the main ones, then folded ones.

    Args:
        definitions: Every parameter by key.
        names: What the fingers are called.
    """
    groups: dict[tuple[str, bool], list[Entry]] = {}
    for title, is_open, entry in _placed(definitions, names):
        groups.setdefault((title, is_open), []).append(entry)
    ordered = sorted(groups.items(), key=lambda item: not item[0][1])
    return tuple(Group(title, opened, tuple(entries)) for (title, opened), entries in ordered)


def _placed(
    definitions: Mapping[str, Parameter], names: Sequence[str]
) -> Iterator[tuple[str, bool, Entry]]:
    for parameter in sorted(definitions.values(), key=_rank):
        is_open = _is_main(parameter)
        label = knob_label(parameter, definitions, names)
        yield _title(parameter.key, is_open, names), is_open, Entry(parameter, label)
        if parameter.kind == "number-or-list":
            each = key_words(parameter.key.partition(".")[2], names) + ", each"
            entry = Entry(parameter, each + unit_words(parameter.unit), as_text=True)
            yield _title(parameter.key, False, names), False, entry


def _rank(parameter: Parameter) -> int:
    head = parameter.key.partition(".")[0]
    return _MAIN.index(head) if head in _MAIN else len(_MAIN)


def _is_main(parameter: Parameter) -> bool:
    return parameter.changeable and parameter.key.rpartition(".")[2] not in _DETAILS


def _title(key: str, is_open: bool, names: Sequence[str]) -> str:
    head, _, rest = key.partition(".")
    if head == "fingers":
        finger = f"{names[int(rest.partition('.')[0])].capitalize()} finger"
        return finger if is_open else f"Build of the {finger.lower()}"
    if not is_open:
        return _FOLDED_TITLES[head]
    return _BELIEFS if head == "estimates" else head.capitalize()


def knob_label(
    parameter: Parameter, definitions: Mapping[str, Parameter], names: Sequence[str]
) -> str:
    """What a knob is called inside its group, with its unit.

    Args:
        parameter: What it sets.
        definitions: Every parameter by key.
        names: What the fingers are called.
    """
    parts = parameter.key.split(".")
    if parts[0] == "estimates":
        if parts[2] == "parameter":
            return f"unknown {int(parts[1]) + 1}"
        target = definitions.get(str(definitions[f"estimates.{parts[1]}.parameter"].value))
        words = key_words(target.key, names) if target else f"unknown {int(parts[1]) + 1}"
        which = "" if parts[2] == "initial" else f", {parts[2]}"
        return words + which + unit_words(target.unit if target else "")
    inside = parts[2:] if parts[0] == "fingers" else parts[1:]
    return key_words(".".join(inside or parts), names) + unit_words(parameter.unit)


def value_words(scenario: Scenario, key: str, value: str) -> str:
    """A parameter and a value of it, such as ``object mass 1.4 kg``.

    Args:
        scenario: Whose parameter.
        key: Its key.
        value: The value, in the unit of the parameter.
    """
    template = template_keys().get(template_key(key))
    unit = template.unit if template else ""
    return f"{key_words(key, scenario.finger_names)} {value}{unit_after(unit)}"
