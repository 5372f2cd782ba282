"""Sets parameters by dotted key, in a scenario or in its plain values."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import MISSING, fields, is_dataclass, replace
from functools import cache, partial
from typing import Any

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario import Scenario, Space
from slipgrasp.core.scenario.chosen_laws import is_of_unknown_law, kinds_in
from slipgrasp.core.scenario.custom_laws import LAW, LAW_PARAMETERS, law_parameters
from slipgrasp.core.scenario.field_errors import (
    key_of_first,
    template_key,
    template_keys,
    unknown_key,
)
from slipgrasp.core.scenario.parameters import describe
from slipgrasp.core.scenario.scenario import full_scenario

_PLAIN_TYPES = (float, int, bool, str, list, tuple)


def replaced(node: Any, path: list[str], value: Any) -> Any:
    """Returns a part of a scenario with one value replaced, None if the path does not exist."""
    if not path:
        return tuple(value) if isinstance(value, list) else value
    head, rest = path[0], path[1:]
    if isinstance(node, tuple):
        if not _is_index(head, len(node)):
            return None
        index = int(head)
        inner = replaced(node[index], rest, value)
        return None if inner is None else (*node[:index], inner, *node[index + 1 :])
    if head not in getattr(node, "__dataclass_fields__", ()) or type(value) not in _PLAIN_TYPES:
        return None
    inner = replaced(getattr(node, head), rest, value)
    return None if inner is None else replace(node, **{head: inner})


def assign(scenario: Scenario, mapping: dict[str, Any], key: str, value: Any) -> FieldError | None:
    """Sets one dotted key in plain values; returns an error if the key is invalid."""
    *parents, last = key.split(".")
    keys = _all_keys(scenario.space)
    if scenario.space.has_hand and ".".join(parents) == LAW_PARAMETERS:
        return _assign_law_parameter(scenario, mapping, last, value)
    node: Any = mapping
    for i, part in enumerate(parents):
        node = _child(node, part, ".".join(parents[: i + 1]), scenario.space)
        if node is None:
            return unknown_key(scenario, key)
    if isinstance(node, list) and _is_index(last, len(node)):
        node[int(last)] = value
    elif isinstance(node, list) and last == str(len(node)) and key_of_first(key) in keys:
        node.append(value)
    elif isinstance(node, dict) and (last in node or _is_field(key, scenario.space)):
        parameter = template_keys(scenario.space).get(template_key(key, scenario.space))
        if value is None and parameter is not None and parameter.optional:
            node.pop(last, None)
        else:
            node[last] = value
    else:
        return unknown_key(scenario, key)
    return None


def _assign_law_parameter(
    scenario: Scenario, mapping: dict[str, Any], name: str, value: Any
) -> FieldError | None:
    """Sets a parameter of a custom law; None restores its declared default."""
    later = [each["value"] for each in mapping["changes"] if each["parameter"] == LAW]
    controller, key = mapping["controller"], f"{LAW_PARAMETERS}.{name}"
    kinds = map(str, (controller["kind"], *later, *kinds_in(scenario)))
    is_known = any(name in law_parameters(kind) for kind in kinds)
    parameters = controller.setdefault("parameters", {})
    if not (is_known or name in parameters or is_of_unknown_law(scenario, key)):
        return unknown_key(scenario, key)
    if value is None:
        parameters.pop(name, None)
    else:
        parameters[name] = value
    return None


@cache
def _all_keys(space: Space) -> frozenset[str]:
    """Keys of all numbers in a scenario with one item in every list."""
    return frozenset(describe(full_scenario(space)))


def _is_field(key: str, space: Space) -> bool:
    """Whether some scenario has a value, or a list of values, with this key."""
    keys = template_key(key, space), template_key(f"{key}.0", space)
    return not template_keys(space).keys().isdisjoint(keys)


def _child(node: Any, part: str, key: str, space: Space) -> Any:
    """Returns a child of plain values; appends a new item to a list if the index is its length.

    Args:
        node: A table or a list.
        part: Key or index of the child.
        key: Dotted key of the child.
        space: Kind of hand of the scenario.
    """
    if isinstance(node, list):
        place = key.rpartition(".")[0]
        new_entries = _new_entries(space)
        if place in new_entries and part == str(len(node)):
            node.append(new_entries[place]())
        return node[int(part)] if _is_index(part, len(node)) else None
    if not isinstance(node, dict):
        return None
    if part not in node and key_of_first(f"{key}.0") in _all_keys(space):
        node[part] = []
    return node.get(part)


@cache
def _new_entries(space: Space) -> dict[str, Callable[[], dict[str, Any] | list[Any]]]:
    """Returns functions that create a new item of each extensible list, by the key of the list."""
    lists = dict(_lists_in(full_scenario(space), ""))
    return {
        key: partial(_defaults, type(first)) if is_dataclass(first) else list
        for key, first in lists.items()
    }


def _lists_in(part: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    """Key and first item of every list of parts or rows, except for the fixed list of fingers."""
    for field in fields(part):
        key, value = f"{prefix}{field.name}", getattr(part, field.name)
        if is_dataclass(value):
            yield from _lists_in(value, f"{key}.")
        elif isinstance(value, tuple) and key != "fingers" and not isinstance(value[0], float):
            yield key, value[0]


def _defaults(kind: Any) -> dict[str, Any]:
    """Default values of a new item of a list, as plain values."""
    defaults = {field.name: field.default for field in fields(kind)}
    return {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in defaults.items()
        if value is not MISSING and value is not None
    }


def _is_index(part: str, length: int) -> bool:
    return part.isascii() and part.isdigit() and len(part) < 5 and int(part) < length
