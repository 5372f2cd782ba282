"""Messages of the server to a viewer, as plain values of a page."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import viser
from viser import _messages

from slipgrasp.web.scene.close_ups import CLOCK, PACKET
from slipgrasp.web.standalone.kernel_data import encoded

_UUID = re.compile(r"[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}")
_RUN_ID = re.compile(r'"run_id":"[0-9a-f]+"')


def sent(server: viser.ViserServer) -> list[Any]:
    """Messages sent to a new viewer, as plain values; charts without their lines."""
    buffer = server._websock_server._broadcast_buffer
    messages = []
    for message in list(buffer.message_from_id.values()):
        arrays: list[memoryview] = []
        plain = message.as_serializable_dict(arrays)
        # The page computes the content of close-ups itself.
        if plain.get("name") not in (PACKET, CLOCK):
            messages.append(_with_arrays(plain, arrays))
    return _ordered(messages)


def _ordered(messages: list[Any]) -> list[Any]:
    """Renumbers the elements in messages from 0; viser counts those of all servers."""
    elements = [m["props"] for m in messages if "order" in m.get("props", ())]
    ranks = {order: k for k, order in enumerate(sorted(each["order"] for each in elements))}
    for each in elements:
        each["order"] = ranks[each["order"]]
    return messages


def _with_arrays(value: Any, arrays: Sequence[memoryview]) -> Any:
    """Replaces references to arrays in plain values by the arrays."""
    if isinstance(value, dict):
        if "__binary_index" in value:
            array = np.frombuffer(arrays[value["__binary_index"]], value["dtype"])
            return encoded(array)
        return {
            key: _empty(inner) if key == "data" else _with_arrays(inner, arrays)
            for key, inner in value.items()
        }
    if isinstance(value, bytes | memoryview):
        return encoded(np.frombuffer(value, np.uint8))
    if isinstance(value, list | tuple):
        return [_with_arrays(each, arrays) for each in value]
    return value


def _empty(columns: Any) -> Any:
    """Columns of a chart without their values."""
    return [encoded(np.empty(0)) for _ in columns]


def of_panels(messages: Sequence[Any]) -> list[Any]:
    """The messages that arrange panels."""
    return [message for message in messages if message["type"].startswith("GuiSetPanel")]


def templates() -> dict[str, Any]:
    """For each property of a node, the message that sets it, and its field with the value."""
    name, none = "", (0.0, 0.0, 0.0)
    made = {
        "position": ("position", _messages.SetPositionMessage(name, none)),
        "wxyz": ("wxyz", _messages.SetOrientationMessage(name, (1.0, *none))),
        "visible": ("visible", _messages.SetSceneNodeVisibilityMessage(name, True)),
        "updates": ("updates", _messages.SceneNodeUpdateMessage(name, {})),
    }
    return {
        key: {"field": field, "message": message.as_serializable_dict([])}
        for key, (field, message) in made.items()
    }


def difference(first: Any, second: Any) -> Any:
    """Replacements that turn plain values into others, by key or index; None if equal."""
    if isinstance(first, list) and isinstance(second, list) and len(first) == len(second):
        first, second = dict(enumerate(first)), dict(enumerate(second))
    if not (isinstance(first, dict) and isinstance(second, dict)) or first.keys() != second.keys():
        return None if first == second else {"": second}
    found = {str(key): difference(inner, second[key]) for key, inner in first.items()}
    return {key: inner for key, inner in found.items() if inner is not None} or None


def named(value: Any, messages: Sequence[Any]) -> Any:
    """Replaces random identifiers in plain values, so that pages are reproducible."""
    names: dict[str, str] = {}
    for found in _UUID.findall(json.dumps(messages)):
        names.setdefault(found, f"sg-{len(names)}")
    text = json.dumps(value, separators=(",", ":"))
    text = _UUID.sub(lambda found: names.get(found[0], found[0]), text)
    return json.loads(_RUN_ID.sub('"run_id":"page"', text))
