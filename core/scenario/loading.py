"""Conversion of names, files and plain values to a validated scenario, and back to TOML."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, lru_cache, partial
from importlib import resources
from pathlib import Path
from typing import Any

import pydantic

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario import PLANAR, Scenario, Space
from slipgrasp.core.scenario.assignment import assign, replaced
from slipgrasp.core.scenario.custom_laws import LAW_PARAMETERS, law_parameters
from slipgrasp.core.scenario.field_errors import (
    field_errors,
    nearest,
    refuse_other_types,
    single_error,
)
from slipgrasp.core.scenario.hand_file import fill_in_hand, refuse_hand_name
from slipgrasp.core.scenario.motion_file import fill_in_table, refuse_table_name
from slipgrasp.core.scenario.motion_kind import with_motion_kind
from slipgrasp.core.scenario.parameters import Parameter, describe
from slipgrasp.core.scenario.scenario import SCENARIOS, AnyScenario, full_scenario, space_of
from slipgrasp.core.scenario.space import SPACES
from slipgrasp.core.scenario.timed_changes import check_changes
from slipgrasp.core.scenario.validation import check_scenario

_MAX_FILE_BYTES = 1_000_000


def preset_names(space: Space = PLANAR) -> tuple[str, ...]:
    """Names of the presets of a kind of hand, the paper's first."""
    return tuple(name for name in all_preset_names() if _space_of(name) is space)


@cache
def all_preset_names() -> tuple[str, ...]:
    """Names of all presets, those of spatial hands last."""
    folder = resources.files("slipgrasp.core.scenario") / "presets"
    names = [f.name[:-5] for f in folder.iterdir() if f.name.endswith(".toml")]
    return tuple(sorted(names, key=_rank))


def _rank(name: str) -> tuple[int, bool, str]:
    return SPACES.index(_space_of(name)), not name.startswith("paper-"), name


@cache
def _space_of(preset: str) -> Space:
    """The kind of hand of a preset."""
    return space_of(tomllib.loads(preset_text(preset)))


@cache
def _load_preset(name: str) -> Scenario:
    return scenario_from_mapping(tomllib.loads(preset_text(name)))


def preset_text(name: str) -> str:
    """The original TOML text of a preset."""
    file = resources.files("slipgrasp.core.scenario") / "presets" / f"{name}.toml"
    return file.read_text(encoding="utf-8")


def load_scenario(source: str | Path) -> Scenario:
    """Loads a preset by name or a TOML file by path.

    Args:
        source: Preset name, or path of a scenario file.

    Returns:
        The validated scenario.

    Raises:
        ScenarioError: If the preset or file does not exist or is not valid.
    """
    name = str(source)
    if name in all_preset_names():
        return _load_preset(name)
    path, known = Path(source), ", ".join(all_preset_names())
    if not path.suffix and not path.exists():
        near = nearest(name, all_preset_names())
        raise _refused(name, known, f"no preset or file '{name}'{near}; presets: {known}")
    if not path.is_file():
        raise _refused(name, None, f"no scenario file '{name}'; presets: {known}")
    with path.open("rb") as file:
        mapping = _parse_toml(file.read(_MAX_FILE_BYTES + 1), name)
    fill_in_hand(mapping, path.parent)
    fill_in_table(mapping, path.parent)
    return scenario_from_mapping(mapping)


def scenario_from_toml(content: bytes, name: str) -> Scenario:
    """Reads a scenario from the content of a TOML file.

    Args:
        content: Content of the file; it cannot refer to other files.
        name: Name of the file, for messages.

    Raises:
        ScenarioError: If it is too large, not TOML, or not a valid scenario.
    """
    return scenario_from_mapping(_parse_toml(content, name))


def _parse_toml(content: bytes, name: str) -> dict[str, Any]:
    if len(content) > _MAX_FILE_BYTES:
        message = f"'{name}' is larger than 1 MB; a scenario is a small TOML file"
        raise _refused(name, "1 MB", message)
    try:
        return tomllib.loads(content.decode("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise _refused(name, "TOML", f"'{name}' is not valid TOML: {error}") from error


def _refused(name: str, limit: str | None, message: str) -> ScenarioError:
    return single_error("scenario", name, limit, message)


def scenario_from_mapping(mapping: Any, *, with_law: bool = True) -> Scenario:
    """Validates nested plain values (from JSON or TOML) into a scenario.

    Args:
        mapping: The values.
        with_law: Whether its laws must be loaded; a recording can be read without them.

    Raises:
        ScenarioError: With one item per wrong field.
    """
    refuse_table_name(mapping)
    refuse_hand_name(mapping)
    space = space_of(mapping) if isinstance(mapping, dict) else PLANAR
    mapping = with_motion_kind(mapping, space)
    try:
        text = json.dumps(mapping, default=repr)
        scenario = _adapter(space).validate_json(text)
    except pydantic.ValidationError as error:
        raise ScenarioError(field_errors(error, space)) from error
    except (ValueError, RecursionError, TypeError) as error:
        message = f"the scenario cannot be read: {type(error).__name__}"
        raise single_error("", None, None, message) from error
    check_scenario(scenario, with_law=with_law)
    check_changes(scenario, partial(with_values, with_law=with_law))
    return scenario


def with_values(
    scenario: AnyScenario, values: Mapping[str, Any], *, with_law: bool = True
) -> AnyScenario:
    """Returns the scenario with parameters set by dotted key.

    Args:
        scenario: The base.
        values: Dotted key to plain value, such as ``{"object.mass": 1.4}``.
        with_law: Whether its laws must be loaded; a recording can be simulated without them.

    Raises:
        ScenarioError: For an unknown key (with the most similar one) or a value out of bounds.
    """
    refuse_other_types(scenario)
    quick = _with_plain_values(scenario, values, with_law)
    if quick is not None:
        return quick
    mapping = json.loads(json.dumps(scenario.to_mapping()))
    # Parameters of a law come after the law that declares them.
    ordered = sorted(values.items(), key=lambda item: item[0].startswith(f"{LAW_PARAMETERS}."))
    errors = [e for key, value in ordered if (e := assign(scenario, mapping, key, value))]
    if errors:
        raise ScenarioError(errors)
    changed = scenario_from_mapping(mapping, with_law=with_law)
    assert isinstance(changed, type(scenario)), "no key makes a hand another kind of hand"
    return changed


def parameter_definitions(scenario: Scenario | None = None) -> dict[str, Parameter]:
    """Every parameter of a scenario by dotted key; of the first preset if None."""
    scenario = load_scenario(preset_names()[0]) if scenario is None else scenario
    # A custom law may change its declared parameters.
    is_kept = not law_parameters(scenario.controller.kind)
    return dict(_described(scenario)) if is_kept else describe(scenario)


@lru_cache(maxsize=16)
def _described(scenario: Scenario) -> dict[str, Parameter]:
    """The parameters of a scenario, cached because a page needs them often."""
    return describe(scenario)


def settable_parameters(scenario: Scenario) -> dict[str, Parameter]:
    """Every parameter by dotted key; of an empty list, those of one item, without values."""
    definitions = parameter_definitions(scenario)
    for key, parameter in describe(full_scenario(scenario.space)).items():
        if not key.startswith("fingers."):
            definitions.setdefault(key, replace(parameter, value=None))
    return definitions


def scenario_to_toml(scenario: Scenario) -> str:
    """Writes the scenario as TOML that loads to an equal scenario."""
    mapping = scenario.to_mapping()
    lines = [f"title = {_toml(mapping['title'])}"]
    for name, tables in mapping.items():
        if name != "title":
            lines += _toml_lines(name, tables)
    return "\n".join(lines) + "\n"


def fingers_to_toml(fingers: Sequence[Mapping[str, Any]]) -> str:
    """Writes fingers as the tables of a TOML file."""
    return "\n".join(_toml_lines("fingers", fingers)) + "\n"


def _toml_lines(name: str, tables: Mapping[str, Any] | Sequence[Mapping[str, Any]]) -> list[str]:
    """Writes one table, or several with one name."""
    header = f"[{name}]" if isinstance(tables, Mapping) else f"[[{name}]]"
    lines = list[str]()
    for table in [tables] if isinstance(tables, Mapping) else tables:
        lines += ["", header, *(f"{key} = {_toml(value)}" for key, value in table.items())]
    return lines


@cache
def _adapter(space: Space) -> pydantic.TypeAdapter[Scenario]:
    return pydantic.TypeAdapter(SCENARIOS[space])


def _toml(value: Any) -> str:
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value)


def _with_plain_values(
    scenario: AnyScenario, values: Mapping[str, Any], with_law: bool
) -> AnyScenario | None:
    """Returns the scenario with replaced numbers and words, without a conversion to plain values.

    Four times as fast as `scenario_from_mapping`.

    Returns:
        None if that is not possible or a value is invalid.
    """
    if scenario.changes:
        return None
    changed: Any = scenario
    try:
        for key, value in values.items():
            changed = replaced(changed, key.split("."), value)
            if changed is None:
                return None
    except pydantic.ValidationError:
        return None
    check_scenario(changed, with_law=with_law)
    return changed
