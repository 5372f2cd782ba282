"""Conversion of a file or plain values to a study, and back."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.custom_laws import law_names
from slipgrasp.core.scenario.field_errors import echo, nearest, shortened, single_error
from slipgrasp.core.scenario.law_choice import with_law
from slipgrasp.core.scenario.law_loading import load_law
from slipgrasp.core.scenario.laws import law_kind
from slipgrasp.core.scenario.loading import (
    all_preset_names,
    load_scenario,
    parameter_definitions,
    scenario_from_mapping,
    with_values,
)
from slipgrasp.core.scenario.parameters import Parameter
from slipgrasp.core.study.checks import check_document
from slipgrasp.core.study.definition import (
    MAX_RUNS,
    Axis,
    KeptRecordings,
    Sampling,
    Study,
    expand_key,
)
from slipgrasp.core.study.document import (
    AxisDocument,
    StudyDocument,
    flatten,
    plain_value,
)

MAX_FILE_BYTES = 20_000_000
MAX_RUNS_RECORDED_BY_DEFAULT = 1000
MAX_FINDINGS = 10
_MOST_WRONG = 100


def load_study(path: str | Path) -> Study:
    """Loads a study file; its base is a preset or a scenario file relative to the study's folder.

    ``law`` sets the law of all its runs, ``laws`` loads several: ``FILE.py:Name``, relative to the
    study's folder, or the name of an installed law.

    Raises:
        LawError: If a law is not available.
        ScenarioError: With one item per wrong field.
    """
    file = Path(path)
    if not file.is_file():
        raise single_error("study", str(path), None, f"there is no study file '{path}'")
    if file.stat().st_size > MAX_FILE_BYTES:
        raise single_error("study", str(path), "20 MB", f"'{path}' is larger than 20 MB")
    try:
        mapping = tomllib.loads(file.read_bytes().decode("utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        message = f"'{path}' is not valid TOML: {error}"
        raise single_error("study", str(path), "TOML", message) from error
    if {"object", "fingers"} <= mapping.keys():
        message = f"'{path}' is a scenario; write a study file with base = \"{file.name}\""
        raise single_error("study", str(path), "a study file", message)
    for specification in _texts(mapping.pop("laws", []), "laws"):
        _know(specification, file.parent)
    laws = _texts([mapping.pop("law")] if "law" in mapping else [], "law")

    def find_base(base: Any) -> Scenario:
        found = _base_from_file(base, file.parent)
        return with_law(found, _know(laws[0], file.parent)) if laws else found

    return study_from_mapping(mapping, find_base)


def _texts(values: Any, field: str) -> list[str]:
    if isinstance(values, list) and all(isinstance(value, str) for value in values):
        return values
    message = f"{field} must name control laws: FILE.py:Name, or a name"
    raise single_error(field, echo(values), None, message)


def _know(specification: str, folder: Path) -> str:
    """Name of a law that is built in, loaded, installed or in a file."""
    if law_kind(specification) in law_names():
        return law_kind(specification)
    return load_law(specification, folder).name


def study_from_mapping(mapping: Any, find_base: Callable[[Any], Scenario]) -> Study:
    """Validates a study given as plain values; its runs are counted but not created.

    Args:
        mapping: The content of a study file.
        find_base: Returns the scenario for ``base``.

    Raises:
        ScenarioError: With one item per wrong field, or if there are too many runs.
    """
    try:
        document = StudyDocument.model_validate(flatten(mapping))
    except ValidationError as error:
        raise ScenarioError(_field_errors(error)) from error
    base = find_base(document.base)
    if document.set:
        changed = {one: v for key, v in document.set.items() for one in expand_key(base, key)}
        base = with_values(base, changed)
    definitions = parameter_definitions(base)
    errors = [*check_document(document, base, definitions)]
    if errors:
        raise ScenarioError(errors)
    named = isinstance(document.base, str) and document.base in all_preset_names()
    study = Study(
        title=document.title,
        base=base,
        base_name=str(document.base) if named else "",
        axes=tuple(_axis(key, axis, base, definitions) for key, axis in document.vary.items()),
        sampling=document.sampling,
        listed=tuple({k: plain_value(v) for k, v in run.items()} for run in document.runs),
        limits=document.limits,
    )
    _check_count(study)
    return _keeping(study, document.recordings)


def study_to_mapping(study: Study) -> dict[str, Any]:
    """The study as plain values that `study_from_mapping` reads back to an equal study."""
    sampling = study.sampling
    return {
        "title": study.title,
        "base": study.base.to_mapping(),
        "sampling": {
            "method": sampling.method,
            "seed": sampling.seed,
            **({"runs": sampling.runs} if sampling.runs is not None else {}),
        },
        "vary": {axis.key: _axis_to_mapping(axis) for axis in study.axes},
        "runs": [{key: _listed(value) for key, value in run.items()} for run in study.listed],
        "recordings": study.recordings,
        **({"limits": dict(study.limits)} if study.limits else {}),
    }


def check_members(
    study: Study,
    progress: Callable[[float], None] | None = None,
    runs: Iterable[int] | None = None,
) -> None:
    """Creates and validates runs of a study.

    Args:
        study: The study.
        progress: Called occasionally with the checked fraction, 0 to 1.
        runs: Indices of the runs to check; all if None.

    Raises:
        ScenarioError: With the index of the first run of each kind of error.
    """
    errors: dict[str, FieldError] = {}
    num_wrong = 0
    for index in range(study.num_runs) if runs is None else runs:
        try:
            study.scenario_of(index)
        except ScenarioError as error:
            for finding in error.errors:
                errors.setdefault(finding.message, _of_member(index, finding))
            num_wrong += 1
            if len(errors) >= MAX_FINDINGS or num_wrong >= _MOST_WRONG:
                break
        if progress is not None and index % 256 == 0:
            progress(index / study.num_runs)
    if errors:
        raise ScenarioError([*errors.values()][:MAX_FINDINGS])


def _of_member(index: int, finding: FieldError) -> FieldError:
    field, message = f"runs.{index}.{finding.field}", f"run {index}: {finding.message}"
    return replace(finding, field=field, message=message)


def _base_from_file(base: Any, folder: Path) -> Scenario:
    if isinstance(base, dict):
        return scenario_from_mapping(base)
    path = folder / base
    return load_scenario(path if base not in all_preset_names() and path.is_file() else base)


def _check_count(study: Study) -> None:
    method, asked = study.sampling.method, study.num_runs
    if asked > MAX_RUNS:
        message = (
            f"the study has {asked} runs, at most {MAX_RUNS} are allowed; use fewer values, or "
            "several studies (random ones with different seeds)"
        )
        raise single_error("vary", asked, f"at most {MAX_RUNS} runs", message)
    if method == "grid" and study.sampling.runs not in (None, asked):
        message = f"sampling.runs is {study.sampling.runs}, but the grid has {asked}; remove it"
        raise single_error("sampling.runs", study.sampling.runs, str(asked), message)


def _axis(
    key: str, axis: AxisDocument, base: Scenario, definitions: Mapping[str, Parameter]
) -> Axis:
    parameter = definitions.get(expand_key(base, key)[0])
    return Axis(
        key=key,
        values=None if axis.values is None else tuple(plain_value(value) for value in axis.values),
        minimum=axis.min,
        maximum=axis.max,
        count=axis.count,
        scale=axis.scale,
        integer=parameter is not None and parameter.kind == "integer",
    )


def _axis_to_mapping(axis: Axis) -> dict[str, Any]:
    if axis.values is not None:
        return {"values": [_listed(value) for value in axis.values]}
    bounds = {"min": axis.minimum, "max": axis.maximum, "scale": axis.scale}
    return bounds if axis.count is None else {**bounds, "count": axis.count}


def _keeping(study: Study, recordings: KeptRecordings | None) -> Study:
    few = study.num_runs <= MAX_RUNS_RECORDED_BY_DEFAULT
    return replace(study, recordings=recordings or ("all" if few else "none"))


def _listed(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _field_errors(error: ValidationError) -> list[FieldError]:
    """Errors of pydantic, one per field; for a value with several possible types, one for all."""
    kinds: dict[str, list[Any]] = {}
    for item in error.errors(include_url=False):
        kinds.setdefault(_field_of(item), []).append(item)
    return [_field_error(field, items) for field, items in kinds.items()]


def _field_error(field: str, items: list[Any]) -> FieldError:
    wrong = next((item for item in items if not item["type"].endswith("_type")), items[0])
    finding = _finding(field, wrong, of_several_kinds=len(items) > 1)
    message = f"{field or 'the study'} {finding}"
    return FieldError(field=field, value=echo(wrong["input"]), limit=None, message=message)


def _finding(field: str, item: Any, *, of_several_kinds: bool) -> str:
    kind = item["type"]
    if field == "base" and kind.endswith("_type"):
        return "should be the name of a preset, or a complete scenario"
    if field.startswith("vary.") and kind in ("model_type", "dict_type"):
        return "should be a table: {values = [...]}, or {min = ..., max = ...} with count in a grid"
    if kind in ("model_type", "dict_type", "model_attributes_type"):
        return "should be a table"
    if kind == "extra_forbidden":
        parts = field.rpartition(".")
        known = {"": StudyDocument, "sampling": Sampling}.get(parts[0], AxisDocument)
        return f"is not known{nearest(parts[2], known.model_fields)}"
    if kind == "missing":
        return "is missing"
    if kind == "too_short":
        return "is empty; give at least one"
    if of_several_kinds and kind.endswith("_type"):
        return "should be a number, a word or a list of numbers"
    return f"is wrong: {item['msg'][:1].lower()}{item['msg'][1:]}"


def _field_of(item: Any) -> str:
    return shortened(".".join(str(part) for part in item["loc"] if _is_name(part)))


def _is_name(part: int | str) -> bool:
    """Whether a part of pydantic's path belongs to the document, not to a type."""
    return isinstance(part, int) or not (
        part in ("bool", "float", "int", "str")
        or part.startswith(("list[", "dict[", "constrained"))
    )
