"""``KEY=VALUE`` from the command line as plain values for the scenario."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from slipgrasp.cli.status import CommandError

if TYPE_CHECKING:
    from slipgrasp.core.scenario.parameters import Parameter

NONE = "none"


def parse_assignments(texts: Iterable[str], definitions: Mapping[str, Parameter]) -> dict[str, Any]:
    """Reads assignments; of several to one key the last holds.

    Args:
        texts: Such as ``object.mass=1.4``.
        definitions: The parameters by dotted key; what they cannot say is left to
            the validation of the scenario.

    Raises:
        CommandError: If one is not of the form KEY=VALUE.
    """
    values = {}
    for text in texts:
        key, equals, value = text.partition("=")
        if not equals or not key.strip():
            raise CommandError(f"--set needs KEY=VALUE, such as object.mass=1.4, not '{text[:80]}'")
        key = key.strip()
        values[key] = parse_value(value.strip(), definitions.get(key))
    return values


def parse_value(text: str, parameter: Parameter | None) -> Any:
    """Reads one value: TOML where it is TOML, else a number, else the text as it stands.

    Args:
        text: What stands behind the equals sign.
        parameter: What is assigned to, if known: ``none`` removes an optional one.
    """
    if text == NONE and parameter is not None and parameter.optional:
        return None
    if parameter is not None and parameter.kind == "boolean":
        text = text.lower()
    value = _parse_toml(text)
    if parameter is not None and parameter.kind in ("text", "choice"):
        return value if isinstance(value, str) else text
    return value


def _parse_toml(text: str) -> bool | int | float | str | list[Any]:
    try:
        document = tomllib.loads(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return _parse_number(text)
    value = document["value"]
    plain = len(document) == 1 and isinstance(value, (bool, int, float, str, list))
    return value if plain else text


def _parse_number(text: str) -> float | str:
    """Numbers as people and other programs write them, such as ``.5``."""
    try:
        return float(text)
    except ValueError:
        return text
