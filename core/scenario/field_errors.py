"""Error messages for the fields of a scenario: field, value, limit and correction."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pydantic

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.scenario import PLANAR, Scenario, Space
from slipgrasp.core.scenario.custom_laws import LAW, law_names
from slipgrasp.core.scenario.parameters import Parameter, describe
from slipgrasp.core.scenario.scenario import full_scenario
from slipgrasp.core.scenario.space import SPACES

_LENGTHS = {"too_long": ("at most", "max_length"), "too_short": ("at least", "min_length")}


def unknown_key(scenario: Scenario, key: str) -> FieldError:
    """Returns the error for an unknown key, with the most similar one, or the parts there are."""
    every = template_keys(scenario.space)
    parts = ", ".join(dict.fromkeys(each.partition(".")[0] for each in every))
    near = nearest(key, describe(scenario)) or f"; a {scenario.space.name} scenario has {parts}"
    return _unknown(key, near)


def _unknown(key: str, near: str) -> FieldError:
    message = f"unknown parameter '{shortened(key)}'{near}"
    return FieldError(shortened(key), None, None, message)


def nearest(word: str, words: Iterable[str]) -> str:
    """Returns a suggestion of the most similar word as the end of a sentence; may be empty."""
    close = difflib.get_close_matches(word[:200], list(words), n=1, cutoff=0.4)
    return f"; did you mean '{close[0]}'?" if close else ""


def field_errors(error: pydantic.ValidationError, space: Space) -> list[FieldError]:
    """Converts the errors of Pydantic to field errors, one per field, with unit and limit."""
    found: dict[str, FieldError] = {}
    for item in error.errors(include_url=False):
        path = [str(part) for part in item["loc"] if not _is_type_label(str(part))]
        key = ".".join(path)
        if key not in found:
            found[key] = _field_error(key, item, space)
    # A wrong item also makes its list seem too short; only the item is reported.
    parents = {key[:i] for key in found for i, letter in enumerate(key) if letter == "."}
    return [error for key, error in found.items() if key not in parents]


def _is_type_label(part: str) -> bool:
    return part in ("float", "str", "int") or part.startswith(
        ("tuple[", "constrained", "function-")
    )


def _field_error(key: str, item: Any, space: Space) -> FieldError:
    kind, value = item["type"], item["input"]
    if kind == "unexpected_keyword_argument":
        siblings = [
            k.rpartition(".")[2]
            for k in template_keys(space)
            if k.rpartition(".")[0] == template_key(key, space).rpartition(".")[0]
        ]
        near = nearest(key.rpartition(".")[2], siblings or template_keys(space))
        return _unknown(key, near)
    if kind in _LENGTHS:
        return _length_error(key, item)
    parameter = template_keys(space).get(template_key(key, space))
    limit = parameter.limit if parameter else None
    shown = echo(value)
    if kind in ("missing", "missing_argument", "missing_keyword_only_argument"):
        return FieldError.at(key, None, limit, "is missing")
    quoted = f"'{shown}'" if isinstance(value, str) else shown
    told = "" if shown is None else f" is {quoted}"
    # The limit of a choice already lists its words.
    is_choice = kind == "literal_error" and limit
    problem = "" if is_choice else f": {item['msg'][:1].lower()}{item['msg'][1:]}"
    allowed = f"; allowed: {limit}" if limit else ""
    return FieldError(key, shown, limit, f"{key or 'the scenario'}{told}{problem}{allowed}")


def _length_error(key: str, item: Any) -> FieldError:
    """The error of a list with too many or too few items."""
    words, bound = _LENGTHS[item["type"]]
    count = item["ctx"]["actual_length"]
    has = "is empty" if count == 0 else f"has {count} item{'s' if count > 1 else ''}"
    limit = f"{words} {item['ctx'][bound]}"
    return FieldError.at(key, None, limit, f"{has}; allowed: {limit}")


def template_keys(
    space: Space = PLANAR, laws: tuple[str, ...] | None = None
) -> dict[str, Parameter]:
    """Parameters by template key: with 0 for every index of a list.

    A component that differs from the first one of its list, such as the angle of a pose, has a
    separate key.

    Args:
        space: Kind of hand.
        laws: Allowed control laws; the available ones if None.
    """
    return _template_keys(space, law_names() if laws is None else laws)


@cache
def _template_keys(space: Space, laws: tuple[str, ...]) -> dict[str, Parameter]:
    found: dict[str, Parameter] = {}
    for key, parameter in describe(full_scenario(space)).items():
        first, own = _with_zeros(key), key_of_first(key)
        same = found.setdefault(first, replace(parameter, key=first))
        if (parameter.unit, parameter.limit) != (same.unit, same.limit):
            found.setdefault(own, replace(parameter, key=own))
    if space.has_hand:
        found[LAW] = replace(found[LAW], choices=laws)
    return found


def template_key(key: str, space: Space = PLANAR) -> str:
    """Returns the key in `template_keys` for a key of a scenario."""
    own = key_of_first(key)
    return own if own in template_keys(space) else _with_zeros(key)


def find_template(key: str) -> Parameter | None:
    """Returns the parameter for a key, of planar or else of spatial hands; None if unknown."""
    found = (template_keys(each).get(template_key(key, each)) for each in SPACES)
    return next((parameter for parameter in found if parameter is not None), None)


def _with_zeros(key: str) -> str:
    return ".".join("0" if part.isdigit() else part for part in key.split("."))


def key_of_first(key: str) -> str:
    """Returns the key of the same component in the first item of every list."""
    head, _, last = key.rpartition(".")
    return f"{_with_zeros(head)}.{last}" if head else last


def echo(value: Any) -> float | int | bool | str | None:
    """Values that may be shown to the user: finite numbers and short printable text."""
    if isinstance(value, bool):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, int):
        return value if abs(value) < 10**15 else "a huge integer"
    return shortened(value) if isinstance(value, str) else None


def shortened(text: str) -> str:
    """The beginning of a text, short enough to show."""
    return "".join(c if c.isprintable() else "?" for c in text[:80])


def single_error(field: str, value: Any, limit: str | None, message: str) -> ScenarioError:
    """A scenario error with one item."""
    return ScenarioError([FieldError(field, echo(value), limit, message)])


def refuse_other_types(given: object) -> None:
    """Raises an error if the argument is not a scenario but, for example, a preset name."""
    if isinstance(given, Scenario):
        return
    way = f"load_scenario({given!r:.80})" if isinstance(given, str | Path) else "load_scenario"
    if isinstance(given, Mapping):
        way = "scenario_from_mapping"
    message = f"a Scenario is needed, not a {type(given).__name__}; use {way}"
    raise single_error("", None, "a Scenario", message)
