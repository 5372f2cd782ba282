"""Validation of timed changes: changeable parameters and allowed values."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.chosen_laws import custom_kind_in, is_of_unknown_law
from slipgrasp.core.scenario.field_errors import nearest, shortened
from slipgrasp.core.scenario.parameters import describe, find_parameter
from slipgrasp.core.scenario.scenario import FreeScenario


def check_changes(
    scenario: Scenario, apply: Callable[[Scenario, Mapping[str, object]], Scenario]
) -> None:
    """Checks that each timed change names a changeable parameter and gives it an allowed value.

    Args:
        scenario: The scenario.
        apply: Returns a scenario with parameters set by dotted key, if they are allowed.

    Raises:
        ScenarioError: With one item per wrong change.
    """
    if not scenario.changes:
        return
    errors = dict(_unchangeable(scenario, _with_custom_law(scenario)))
    present = replace(scenario, changes=())
    order = sorted(set(range(len(scenario.changes))) - set(errors), key=_time_of(scenario))
    for _, due in groupby(order, key=_time_of(scenario)):
        # Allowed values may depend on earlier and simultaneous changes.
        indices = list(due)
        try:
            present = apply(present, _values_of(scenario, indices))
        except ScenarioError as error:
            errors |= dict(_misfits(scenario, indices, error))
    if errors:
        raise ScenarioError([errors[i] for i in sorted(errors)])


def _with_custom_law(scenario: Scenario) -> Scenario:
    """The scenario without its changes, with the law whose parameters they may change."""
    if isinstance(scenario, FreeScenario):
        return replace(scenario, changes=())
    kind = custom_kind_in(scenario) or scenario.controller.kind
    return replace(scenario, changes=(), controller=replace(scenario.controller, kind=kind))


def _time_of(scenario: Scenario) -> Callable[[int], float]:
    return lambda index: scenario.changes[index].time


def _values_of(scenario: Scenario, indices: Iterable[int]) -> dict[str, object]:
    changes = [scenario.changes[i] for i in indices]
    return {c.parameter: list(c.value) if isinstance(c.value, tuple) else c.value for c in changes}


def _unchangeable(scenario: Scenario, whole: Scenario) -> Iterator[tuple[int, FieldError]]:
    """Changes of parameters unknown in the whole scenario, or unchangeable, by index."""
    for i, change in enumerate(scenario.changes):
        key = f"changes.{i}.parameter"
        parameter = find_parameter(whole, change.parameter)
        if parameter is None and not (
            _is_list_gain(change.parameter, whole) or is_of_unknown_law(scenario, change.parameter)
        ):
            near, name = nearest(change.parameter, describe(whole)), shortened(change.parameter)
            yield i, FieldError(key, name, None, f"{key}: unknown parameter '{name}'{near}")
        elif parameter is not None and not parameter.changeable:
            name, limit = change.parameter, "a parameter that can change during a run"
            words = f"{key}: '{name}' cannot change during a run; set it for the whole run instead"
            yield i, FieldError(key, name, limit, words)


def _misfits(
    scenario: Scenario, indices: Sequence[int], error: ScenarioError
) -> Iterator[tuple[int, FieldError]]:
    """Errors of the values that change at one instant, by index."""
    for e in error.errors:
        named = [i for i in indices if scenario.changes[i].parameter == e.field]
        index = named[0] if named else indices[-1]
        key = f"changes.{index}.value"
        yield index, replace(e, field=key, message=f"{key}: {e.message}")


def _is_list_gain(key: str, whole: Scenario) -> bool:
    parent = find_parameter(whole, key.rpartition(".")[0])
    return parent is not None and parent.kind == "number-or-list" and parent.changeable
