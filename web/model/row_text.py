"""Lists of rows of numbers, such as the corners of an object, as one line of text.

Semicolons separate rows, commas separate numbers: ``-0.1, 0; 0.1, 0; 0, 0.2``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from functools import cache
from typing import Any

from slipgrasp.core.scenario import PLANAR, Scenario, Space
from slipgrasp.core.scenario.parameters import Parameter, iterate_lists
from slipgrasp.core.scenario.scenario import AnySetPoint, full_scenario
from slipgrasp.core.scenario.space import SPACES


@cache
def row_parameters(space: Space = PLANAR) -> dict[str, Parameter]:
    """The lists of rows in scenarios of a kind of hand, by dotted key."""
    return {parameter.key: parameter for parameter in iterate_lists(full_scenario(space))}


def is_of_rows(key: str) -> bool:
    """Whether a dotted key belongs to an item of such a list."""
    return any(key.startswith(f"{rows}.") for rows in row_parameters())


def rows_of(scenario: Scenario, key: str) -> list[Any]:
    """The rows of a list, as plain values.

    Args:
        scenario: The scenario.
        key: Its dotted key, one of `row_parameters`.
    """
    part: Any = scenario
    for name in key.split("."):
        part = getattr(part, name)
    return [asdict(row) if isinstance(row, AnySetPoint) else list(row) for row in part]


def numbers_of(row: Any) -> list[Any]:
    """The numbers of a row, in the order of its fields."""
    return list(_flat(row))


def parse_rows(key: str, text: str) -> Any:
    """Parses rows from text, as plain values; returns invalid text unchanged.

    Args:
        key: Dotted key of the list.
        text: Text by the user.
    """
    try:
        rows = [[float(number) for number in row.split(",")] for row in _parts(text)]
    except ValueError:
        return text
    for space in SPACES:
        if key not in row_parameters(space):
            continue
        example = rows_of(full_scenario(space), key)[0]
        if isinstance(example, list):
            return rows
        if all(len(row) == len(numbers_of(example)) for row in rows):
            return [_like(example, iter(row)) for row in rows]
    return text


def _parts(text: str) -> list[str]:
    return [row for row in text.split(";") if row.strip()]


def _flat(value: Any) -> Iterator[Any]:
    if isinstance(value, dict):
        for item in value.values():
            yield from _flat(item)
    elif isinstance(value, (list, tuple)):
        for item in value:
            yield from _flat(item)
    else:
        yield value


def _like(example: Any, numbers: Iterator[float]) -> Any:
    """Numbers in the structure of an example."""
    if isinstance(example, dict):
        return {name: _like(item, numbers) for name, item in example.items()}
    if isinstance(example, (list, tuple)):
        return [_like(item, numbers) for item in example]
    return next(numbers)
