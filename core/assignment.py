"""Setting a parameter by its dotted key, in a scenario or in the plain values of one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from core.exceptions import FieldError
from core.field_errors import template_key, template_keys, unknown_key
from core.scenario import Scenario

__all__ = ["assign", "replaced"]

_PLAIN_TYPES = (float, int, bool, str, list, tuple)
_GROWABLE = ("estimates", "pulses", "patches", "changes")


def replaced(node: Any, path: list[str], value: Any) -> Any:
    """A part of a scenario with one value set, None if it has no such place."""
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
    """Sets one dotted key in plain values; returns what is wrong with the key, if anything."""
    *parents, last = key.split(".")
    node: Any = mapping
    for part in parents:
        node = _child(node, part, growable=any(node is items for items in _growable(mapping)))
        if node is None:
            return unknown_key(scenario, key)
    if isinstance(node, list) and _is_index(last, len(node)):
        node[int(last)] = value
    elif isinstance(node, dict) and (last in node or template_key(key) in template_keys()):
        parameter = template_keys().get(template_key(key))
        if value is None and parameter is not None and parameter.optional:
            node.pop(last, None)
        else:
            node[last] = value
    else:
        return unknown_key(scenario, key)
    return None


def _growable(mapping: dict[str, Any]) -> Iterator[Any]:
    """The lists to which a key may add the next entry."""
    yield from (mapping.get(name) for name in _GROWABLE)
    trajectory = mapping.get("trajectory")
    yield trajectory.get("set_points") if isinstance(trajectory, dict) else None


def _child(node: Any, part: str, growable: bool) -> Any:
    """Steps into plain values; the entry after the last of a growable list is made on the way."""
    if isinstance(node, list):
        if growable and part == str(len(node)):
            node.append({})
        return node[int(part)] if _is_index(part, len(node)) else None
    return node.get(part) if isinstance(node, dict) else None


def _is_index(part: str, length: int) -> bool:
    return part.isascii() and part.isdigit() and len(part) < 5 and int(part) < length
