"""What is wrong with the fields of a scenario, in words: field, value, limit and the way out."""

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


def unknown_key(scenario: Scenario, key: str) -> FieldError:
    """The error for a key that no parameter has, with the nearest one that there is."""
    keys = list(describe(scenario))
    message = f"unknown parameter '{shortened(key)}'{nearest(key, keys)}"
    return FieldError(field=shortened(key), value=None, limit=None, message=message)


def nearest(word: str, words: Iterable[str]) -> str:
    """What was perhaps meant, as the end of a sentence; empty if nothing is near."""
    close = difflib.get_close_matches(word[:200], list(words), n=1, cutoff=0.4)
    return f"; did you mean '{close[0]}'?" if close else ""


def field_errors(error: pydantic.ValidationError, space: Space) -> list[FieldError]:
    """Pydantic's findings as field errors, one per field, with unit and limit in words."""
    found: dict[str, FieldError] = {}
    for item in error.errors(include_url=False, include_context=False):
        path = [str(part) for part in item["loc"] if not _is_type_label(str(part))]
        key = ".".join(path)
        if key not in found:
            found[key] = _field_error(key, item, space)
    # A wrong entry makes its list look too short as well; only the entry is worth telling.
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
        return FieldError(
            field=shortened(key),
            value=None,
            limit=None,
            message=f"unknown parameter '{shortened(key)}'{near}",
        )
    parameter = template_keys(space).get(template_key(key, space))
    limit = parameter.limit if parameter else None
    shown = echo(value)
    if kind in ("missing", "missing_argument", "missing_keyword_only_argument"):
        return FieldError(field=key, value=None, limit=limit, message=f"{key} is missing")
    told = (
        "" if shown is None else f" is {shown}" if not isinstance(value, str) else f" is '{shown}'"
    )
    # The limit of a choice lists its words already.
    is_choice = kind == "literal_error" and limit
    problem = "" if is_choice else f": {item['msg'][:1].lower()}{item['msg'][1:]}"
    allowed = f"; allowed: {limit}" if limit else ""
    return FieldError(
        field=key,
        value=shown,
        limit=limit,
        message=f"{key or 'the scenario'}{told}{problem}{allowed}",
    )


def template_keys(
    space: Space = PLANAR, laws: tuple[str, ...] | None = None
) -> dict[str, Parameter]:
    """Parameters by template key: with 0 for every index of a list.

    A component that may be something else than the first of its list, such as the angle of a
    pose, has a key of its own.

    Args:
        space: Of what kind of hand.
        laws: The control laws to choose from; those that are known here if None.
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
    found[LAW] = replace(found[LAW], choices=laws)
    return found


def template_key(key: str, space: Space = PLANAR) -> str:
    """The key in `template_keys` of what a key of some scenario stands for."""
    own = key_of_first(key)
    return own if own in template_keys(space) else _with_zeros(key)


def find_template(key: str) -> Parameter | None:
    """What a key stands for, of planar or else of spatial hands; None for nothing."""
    found = (template_keys(each).get(template_key(key, each)) for each in SPACES)
    return next((parameter for parameter in found if parameter is not None), None)


def _with_zeros(key: str) -> str:
    return ".".join("0" if part.isdigit() else part for part in key.split("."))


def key_of_first(key: str) -> str:
    """The key of the same component in the first entry of every list: 0 for all other indices."""
    head, _, last = key.rpartition(".")
    return f"{_with_zeros(head)}.{last}" if head else last


def echo(value: Any) -> float | int | bool | str | None:
    """What may be repeated to the user: finite numbers and short printable text."""
    if isinstance(value, bool):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, int):
        return value if abs(value) < 10**15 else "a huge integer"
    return shortened(value) if isinstance(value, str) else None


def shortened(text: str) -> str:
    """The beginning of a text, as it may be repeated to the user."""
    return "".join(c if c.isprintable() else "?" for c in text[:80])


def single_error(field: str, value: Any, limit: str | None, message: str) -> ScenarioError:
    """A scenario error with one entry."""
    return ScenarioError([FieldError(field=field, value=echo(value), limit=limit, message=message)])


def refuse_other_types(given: object) -> None:
    """Raises if something is given where a scenario belongs, such as the name of a preset."""
    if isinstance(given, Scenario):
        return
    way = f"load_scenario({given!r:.80})" if isinstance(given, str | Path) else "load_scenario"
    if isinstance(given, Mapping):
        way = "scenario_from_mapping"
    message = f"a Scenario belongs here, no {type(given).__name__}; {way} makes one"
    raise single_error("", None, "a Scenario", message)
