"""A scenario as one flat table of numbers, for compiled code and other languages.

The annotated fields of the parts of a scenario, in their order, determine the layout; every number
is a float64:

    number              the number; NaN if omitted
    true or false       1 or 0
    choice              index of the choice, from 0; a custom law is the last
    text                index in this table of the parameter with this key; NaN if none
    number or list      the list; a single number fills the list
    list of any length  number of items, then space for the largest number of items

The table describes a scenario at an instant: it excludes pulses, patches and timed changes.
"""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from itertools import groupby
from operator import attrgetter
from typing import Any, Literal, NamedTuple

import annotated_types
import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario import CONTROL_LAWS, MAX_UNKNOWNS, PlanarScenario
from slipgrasp.core.scenario.custom_laws import law_number
from slipgrasp.core.scenario.parameters import alternatives_of, hints_of, is_tuple, split_hint

PARTS = (
    "object",
    "fingers",
    "trajectory",
    "controller",
    "estimates",
    "sensing",
    "actuation",
    "simulation",
)
NUMBER = np.dtype(np.float64)
_NAN = float("nan")

Writer = Callable[[Any], Sequence[float]]


def _layout(hint: Any) -> np.dtype:
    """Layout of a value with this annotation."""
    _, extras, base = split_hint(hint)
    if dataclasses.is_dataclass(base):
        fields = _numbers_of(typing.cast(type, base)).items()
        return np.dtype([(name, _layout(inner)) for name, inner in fields])
    if is_tuple(base):
        inner = typing.get_args(base)
        if Ellipsis not in inner:
            return np.dtype((_layout(inner[0]), (len(inner),)))
        return np.dtype([("count", NUMBER), ("entries", (_layout(inner[0]), (_most(extras),)))])
    room = _length_of_list(base)
    return np.dtype((NUMBER, (room,))) if room else NUMBER


def _numbers_of(part: type) -> dict[str, Any]:
    """Fields of a part that are in the table: all except parameters of custom laws."""
    return {
        name: hint
        for name, hint in hints_of(part).items()
        if typing.get_origin(split_hint(hint)[2]) is not dict
    }


def _most(extras: Sequence[Any]) -> int:
    """Largest number of items of a list."""
    bounds = [extra.max_length for extra in extras if isinstance(extra, annotated_types.Len)]
    return bounds[0] or MAX_UNKNOWNS if bounds else MAX_UNKNOWNS


def _length_of_list(base: Any) -> int:
    """Largest length of a value that may be a list; 0 if it cannot be one."""
    for alternative in alternatives_of(base):
        _, extras, kind = split_hint(alternative)
        if is_tuple(kind):
            return _most(extras)
    return 0


TABLE = np.dtype([(name, _layout(hints_of(PlanarScenario)[name])) for name in PARTS])


class Place(NamedTuple):
    """Position of the numbers of a key in a table of float64 numbers.

    Attributes:
        first: Index of the first number.
        shape: Largest number of items along every index of the key; empty for a single number.
        strides: Distance of items along every index.
    """

    first: int
    shape: tuple[int, ...]
    strides: tuple[int, ...]


@cache
def places() -> dict[str, Place]:
    """Positions of all numbers, by dotted key with ``*`` for indices: ``fingers.*.base.*``."""
    return dict(_places(TABLE, "", Place(0, (), ())))


def _places(layout: np.dtype, key: str, at: Place) -> Iterator[tuple[str, Place]]:
    if layout.subdtype is not None:
        inner, (count,) = layout.subdtype
        step = inner.itemsize // NUMBER.itemsize
        along = Place(at.first, (*at.shape, count), (*at.strides, step))
        yield from _places(inner, f"{key}.*", along)
    elif layout.names is None:
        yield key, at
    else:
        for name, (inner, offset, *_) in (layout.fields or {}).items():
            place = at._replace(first=at.first + offset // NUMBER.itemsize)
            own = key if name == "entries" else f"{key}.{name}".lstrip(".")
            yield from _places(inner, own, place)


def place_of(key: str) -> int | None:
    """Index of the number of a dotted key such as ``fingers.0.friction``; None if not in it."""
    parts = key.split(".")
    indices = [int(part) for part in parts if part.isdigit()]
    place = places().get(".".join("*" if part.isdigit() else part for part in parts))
    if place is None or any(i >= n for i, n in zip(indices, place.shape, strict=True)):
        return None
    return place.first + sum(i * step for i, step in zip(indices, place.strides, strict=True))


def choices_of(part: type, name: str) -> tuple[str, ...]:
    """Choices of a field, in the order of their numbers in the table."""
    quantity, _, base = split_hint(hints_of(part)[name])
    # Custom laws share the next number.
    return tuple(CONTROL_LAWS) if quantity and quantity.choices else _choices(base)


def choice_fields() -> dict[str, tuple[str, ...]]:
    """Choices of all fields with choices, by dotted key with ``*`` for indices."""
    found = {}
    for name in PARTS:
        _, _, base = split_hint(hints_of(PlanarScenario)[name])
        part, prefix = (typing.get_args(base)[0], f"{name}.*") if is_tuple(base) else (base, name)
        for field in hints_of(part):
            if choices := choices_of(part, field):
                found[f"{prefix}.{field}"] = choices
    return found


def write_table(scenario: PlanarScenario, table: NDArray[np.float64]) -> None:
    """Writes the numbers of a scenario to an all-zero table.

    Args:
        scenario: The scenario.
        table: ``(TABLE.itemsize // 8,)``.
    """
    for block in _blocks():
        block(scenario, table)


@cache
def _blocks() -> tuple[Callable[[PlanarScenario, NDArray[np.float64]], None], ...]:
    """Functions that write the table: one per block of adjacent numbers, and one per list."""
    hints = hints_of(PlanarScenario)
    blocks = []
    for name in PARTS:
        _, _, base = split_hint(hints[name])
        if is_tuple(base):
            blocks.append(_list_block(name, hints[name]))
            continue
        fields = _numbers_of(base)
        for is_list, group in groupby(fields, lambda field: _is_list(fields[field])):  # noqa: B023
            if is_list:
                blocks += [_list_block(f"{name}.{field}", fields[field]) for field in group]
            else:
                blocks.append(_plain_block(name, base, list(group)))
    return tuple(blocks)


def _is_list(hint: Any) -> bool:
    _, _, base = split_hint(hint)
    return is_tuple(base) and Ellipsis in typing.get_args(base)


def _plain_block(
    name: str, part: type, fields: list[str]
) -> Callable[[PlanarScenario, NDArray[np.float64]], None]:
    """Creates the function that writes adjacent numbers of a part."""
    first = [at for key, at in places().items() if key.split(".")[:2] == [name, fields[0]]]
    start = first[0].first
    get, write = attrgetter(name), _part_writer(part, fields)

    def block(scenario: PlanarScenario, table: NDArray[np.float64]) -> None:
        numbers = write(get(scenario))
        table[start : start + len(numbers)] = numbers

    return block


def _list_block(key: str, hint: Any) -> Callable[[PlanarScenario, NDArray[np.float64]], None]:
    """Creates the function that writes a list of any length."""
    start = places()[f"{key}.count"].first
    get, write = attrgetter(key), _writer(typing.get_args(split_hint(hint)[2])[0])
    assert write is not None, f"{key} is a list of plain numbers"

    def block(scenario: PlanarScenario, table: NDArray[np.float64]) -> None:
        entries = get(scenario)
        if not entries:
            return
        numbers = [float(len(entries))]
        for entry in entries:
            numbers += write(entry)
        table[start : start + len(numbers)] = numbers

    return block


def _part_writer(part: type, fields: list[str]) -> Writer:
    """Creates the function that returns the numbers of fields of a part."""
    hints, get = hints_of(part), attrgetter(*fields)
    special = [(k, w) for k, name in enumerate(fields) if (w := _writer(hints[name])) is not None]
    # In reverse order, so that inserted numbers do not shift the following fields.
    special.reverse()

    def write(node: Any) -> list[float]:
        numbers = list(get(node))
        for k, write_one in special:
            numbers[k : k + 1] = write_one(numbers[k])
        return numbers

    return write


def _writer(hint: Any) -> Writer | None:
    """Function that returns the numbers of a value with this annotation; None for a number."""
    quantity, extras, base = split_hint(hint)
    if quantity is not None and quantity.choices is not None:
        return lambda kind: (float(law_number(kind)),)
    if dataclasses.is_dataclass(base):
        return _part_writer(typing.cast(type, base), list(_numbers_of(typing.cast(type, base))))
    if is_tuple(base):
        if Ellipsis in typing.get_args(base):
            return _list_writer(typing.get_args(base)[0], _most(extras))
        return lambda value: value
    if room := _length_of_list(base):
        return lambda value: _fill(value, room)
    if choices := _choices(base):
        numbered = {choice: (float(k),) for k, choice in enumerate(choices)}
        return numbered.__getitem__
    if str in alternatives_of(base):
        return _number_of_text
    if type(None) in alternatives_of(base):
        return lambda value: (_NAN if value is None else value,)
    return None


def _list_writer(hint: Any, most: int) -> Writer:
    """Creates the function that returns the numbers of a list within a part."""
    write, room = _writer(hint), _layout(hint).itemsize // NUMBER.itemsize

    def write_list(value: Any) -> list[float]:
        numbers = value if write is None else [x for entry in value for x in write(entry)]
        return [len(value), *numbers, *[0.0] * (room * (most - len(value)))]

    return write_list


def _fill(value: float | tuple[float, ...] | None, room: int) -> Sequence[float]:
    if isinstance(value, tuple):
        return [*value, *[0.0] * (room - len(value))]
    return [_NAN if value is None else value] * room


def _choices(base: Any) -> tuple[str, ...]:
    kinds = alternatives_of(base)
    literals = [kind for kind in kinds if typing.get_origin(kind) is Literal]
    return tuple(choice for kind in literals for choice in typing.get_args(kind))


@cache
def _number_of_text(key: str) -> tuple[float]:
    place = place_of(key)
    return (_NAN if place is None else float(place),)
