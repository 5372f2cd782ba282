"""Validation of a study against its base: keys, ranges and the number of runs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.run.metrics import single_metrics
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.chosen_laws import is_of_unknown_law
from slipgrasp.core.scenario.custom_laws import LAW
from slipgrasp.core.scenario.law_choice import SettingChange, describe_settings, law_settings
from slipgrasp.core.scenario.laws import law_kind
from slipgrasp.core.scenario.loading import parameter_definitions, with_values
from slipgrasp.core.scenario.parameters import Parameter
from slipgrasp.core.study.definition import Study, expand_key
from slipgrasp.core.study.document import AxisDocument, StudyDocument, plain_value
from slipgrasp.core.study.knowledge import find_nothing_to_adapt
from slipgrasp.core.study.limits import check_limits, components


def check_document(
    document: StudyDocument, base: Scenario, definitions: Mapping[str, Parameter]
) -> Iterator[FieldError]:
    """Yields the errors of a study, except those that depend on single runs.

    Args:
        document: The study as in its file.
        base: The base scenario.
        definitions: The parameters of the base by dotted key.
    """
    yield from _check_axes(document, base, definitions)
    yield from _check_sampling(document)
    yield from check_limits(document.limits, base)


def find_warnings(study: Study) -> Iterator[str]:
    """Yields warnings about a study before its runs are simulated."""
    yield from find_overruled(study)
    yield from find_nothing_to_adapt(study)
    yield from find_bare_laws(study)
    yield from find_mixed_limits(study)


def find_overruled(study: Study) -> Iterator[str]:
    """Yields varied parameters that a timed change of the base overrides."""
    for key in study.keys:
        members = expand_key(study.base, key)
        times = [change.time for change in study.base.changes if change.parameter in members]
        if times:
            yield (
                f"{key} varies only until {min(times):g} s: a timed change of the scenario sets it "
                "from then on"
            )


def find_bare_laws(study: Study) -> Iterator[str]:
    """Yields varied laws whose recommended settings neither the base nor the study sets."""
    before = parameter_definitions(study.base)
    varied = {one for key in study.keys for one in expand_key(study.base, key)}
    described = {
        kind: describe_settings(
            [
                SettingChange(key, before[key].value, new)
                for key, new in law_settings(study.base, law_kind(kind)).items()
                if key not in varied
            ]
        )
        for kind in study.varied_laws
    }
    lacking = [f"{kind}: {words}" for kind, words in described.items() if words]
    if lacking:
        yield (
            f"{LAW} varies without the recommended settings that --law adds "
            f"({'; '.join(lacking)}); to add them, list each law with its settings as [[runs]]"
        )


def find_mixed_limits(study: Study) -> Iterator[str]:
    """Yields limits of metrics whose components have different units."""
    singles = single_metrics(len(study.base.fingers), study.base.space)
    units = {one.name: one.unit for one in singles}
    for name, limit in study.limits.items():
        by_unit = {units[one]: one for one in reversed(components(name, units))}
        if len(by_unit) > 1:
            single = " or ".join(by_unit[unit] for unit in sorted(by_unit))
            yield (
                f"limits.{name} is {limit:g} {' and '.join(sorted(by_unit))}: it applies to "
                f"distances and angles alike; to limit one component, use for example {single}"
            )


def _check_axes(
    document: StudyDocument, base: Scenario, definitions: Mapping[str, Parameter]
) -> Iterator[FieldError]:
    for key, axis in document.vary.items():
        field = f"vary.{key}"
        unknown = next((k for k in expand_key(base, key) if k not in definitions), None)
        if unknown is not None and is_of_unknown_law(base, unknown):
            continue  # A study from another machine, whose law is not available here.
        if unknown is not None:
            yield from _unknown(base, field, unknown, axis)
        elif axis.values is not None:
            if (axis.min, axis.max, axis.count) != (None, None, None):
                yield _error(field, "values, or min and max", "has values as well as a range")
        else:
            parameter = definitions[expand_key(base, key)[0]]
            yield from _check_range(field, axis, parameter, document.sampling.method)
    yield from _check_overlaps(document, base)


def _check_overlaps(document: StudyDocument, base: Scenario) -> Iterator[FieldError]:
    """Yields errors for keys that set the same parameter, which would leave values unused."""
    yield from _conflicts(base, "set", document.set, {})
    for index, run in enumerate(document.runs):
        yield from _conflicts(base, f"runs.{index}", run, {})
    listed = {key for run in document.runs for key in run}
    taken = {one: "the listed runs do" for key in listed for one in expand_key(base, key)}
    yield from _conflicts(base, "vary", document.vary, taken)


def _conflicts(
    base: Scenario, field: str, keys: Iterable[str], taken: dict[str, str]
) -> Iterator[FieldError]:
    """Keys that conflict with another key or with used ones."""
    for key in keys:
        for one in expand_key(base, key):
            other = _overlapping(one, taken)
            if other is not None:
                finding = f"sets {one}, as {other}; remove one of them"
                yield _error(f"{field}.{key}", "one of both", finding)
                break
            taken[one] = f"{field}.{key} does"


def _overlapping(key: str, taken: Mapping[str, str]) -> str | None:
    """The key that sets this parameter, a list that contains it, or an item of this list."""
    parts = key.split(".")
    wholes = (".".join(parts[:length]) for length in range(1, len(parts) + 1))
    found = next((taken[whole] for whole in wholes if whole in taken), None)
    entries = (other for one, other in taken.items() if one.startswith(f"{key}."))
    return found or next(entries, None)


def _unknown(base: Scenario, field: str, key: str, axis: AxisDocument) -> Iterator[FieldError]:
    """Checks a key that only some bases have, such as a list of gains, with its first value."""
    value = axis.values[0] if axis.values else axis.min
    try:
        with_values(base, {key: plain_value(value)})
    except ScenarioError as error:
        for finding in error.errors:
            yield replace(finding, field=field, message=f"{field}: {finding.message}")


def _check_range(
    field: str, axis: AxisDocument, parameter: Parameter, method: str
) -> Iterator[FieldError]:
    if axis.min is None or axis.max is None:
        yield _error(field, "values, or min and max", "needs 'values', or both 'min' and 'max'")
        return
    if parameter.kind not in ("number", "integer", "number-or-list"):
        yield _error(field, parameter.limit, f"is a {parameter.kind}; give its 'values'")
        return
    if axis.min > axis.max:
        yield _error(field, "min below max", f"has min {axis.min:g} above max {axis.max:g}")
    if method == "list":
        yield _error(field, "values", "has a range, which a list does not sample; give 'values'")
    if method == "grid" and axis.count is None:
        yield _error(f"{field}.count", "1 or more", "is missing; a grid needs min, max and count")
    if axis.scale == "log" and axis.min <= 0.0:
        yield _error(f"{field}.min", "above 0", f"is {axis.min:g}; a log scale starts above 0")
    for name, value in (("min", axis.min), ("max", axis.max)):
        if not _is_allowed(value, parameter):
            yield FieldError(
                field=f"{field}.{name}",
                value=value,
                limit=parameter.limit,
                message=f"{field}.{name} is {value:g}; allowed: {parameter.limit}",
            )


def _is_allowed(value: float, parameter: Parameter) -> bool:
    low, high = parameter.minimum, parameter.maximum
    if low is not None and (value < low or (parameter.exclusive_minimum and value == low)):
        return False
    if parameter.kind == "integer" and not float(value).is_integer():
        return False
    return high is None or value <= high


def _check_sampling(document: StudyDocument) -> Iterator[FieldError]:
    sampling, method = document.sampling, document.sampling.method
    ranges = [key for key, axis in document.vary.items() if axis.values is None]
    if method in ("random", "latin-hypercube"):
        if sampling.runs is None:
            yield _error("sampling.runs", "1 or more", f"is missing; {method} needs their number")
        if not ranges:
            yield _error("vary", "a range", f"has no range to sample; {method} needs min and max")
    elif method == "list":
        if not document.runs:
            yield _error("runs", "1 or more", "is empty; a list needs [[runs]] of key = value")
        if sampling.runs not in (None, len(document.runs)):
            yield _error(
                "sampling.runs",
                f"{len(document.runs)}",
                f"is {sampling.runs}, but {len(document.runs)} are listed; remove it",
            )
    elif not document.vary:
        yield _error("vary", "1 or more", "is empty; a grid needs parameters that vary")
    if document.runs and method != "list":
        yield _error("runs", "none", f"lists runs, but sampling.method is '{method}'")


def _error(field: str, limit: str, finding: str) -> FieldError:
    return FieldError(field=field, value=None, limit=limit, message=f"{field} {finding}")
