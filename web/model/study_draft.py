"""The draft of a study: two parameters, their ranges, and an optional comparison."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.chosen_laws import kinds_in
from slipgrasp.core.scenario.custom_laws import LAW
from slipgrasp.core.scenario.field_errors import template_key, template_keys
from slipgrasp.core.scenario.loading import (
    all_preset_names,
    load_scenario,
    parameter_definitions,
    with_values,
)
from slipgrasp.core.scenario.parameters import Parameter
from slipgrasp.core.study.definition import Study, expand_key
from slipgrasp.core.study.loading import study_from_mapping
from slipgrasp.core.words.parameter_words import key_words
from slipgrasp.web.model.parameter_groups import kind_key
from slipgrasp.web.model.parameter_names import ParameterNames, names_of
from slipgrasp.web.model.slider_range import slider_range

MIN_STEPS, MAX_STEPS = 2, 60
_STEPS = 15

NO_COMPARISON = "nothing"
COMPARISONS: Mapping[str, tuple[str, tuple[float | str | bool, ...]]] = {
    "adapting slowly (Q = 1) and fast (Q = 20)": ("controller.lyapunov_weight", (1.0, 20.0)),
    "control continuous and every 1 ms": ("controller.control_period", (0.0, 0.001)),
    "theorem 3 and theorem 4": ("controller.kind", ("theorem-3", "theorem-4")),
    "grip safety 1 and 1.5": ("controller.grip_safety", (1.0, 1.5)),
    "every control law, other settings unchanged": (
        "controller.kind",
        template_keys()["controller.kind"].choices,
    ),
    **{
        f"without and with {key_words(key.partition('.')[2], ())}": (key, (False, True))
        for key, parameter in template_keys().items()
        if parameter.kind == "boolean" and parameter.changeable
    },
}
"""Comparisons by name: the key of a setting, and its values."""

_FIRST_CHOICES = ("object.mass", "fingers.*.friction", "support.friction")
_ALSO_OFFERED = (
    "simulation.gravity",
    "pulses.0.force.0",
    "pulses.0.force.1",
    "pulses.0.moment",
    "pulses.0.moment.0",
)
"""Template keys of parameters that cannot change during a run."""


@dataclass(frozen=True, slots=True)
class AxisDraft:
    """One of the two varied parameters, in its unit; not validated yet.

    Attributes:
        key: Its dotted key; ``*`` stands for all fingers.
        low: Its first value.
        high: Its last value.
        count: Number of values, with both ends.
        is_log: Whether the values are spaced logarithmically.
    """

    key: str
    low: float
    high: float
    count: int = _STEPS
    is_log: bool = False


@dataclass(frozen=True, slots=True)
class Offer:
    """A parameter that can be varied.

    Attributes:
        key: Its dotted key; ``*`` stands for all fingers.
        label: Its name, with its unit.
        text: A sentence about it, with its bounds.
        low: Default start of its range.
        high: Default end of its range.
    """

    key: str
    label: str
    text: str
    low: float
    high: float

    def axis(self, count: int = _STEPS) -> AxisDraft:
        """The parameter over its own range."""
        return AxisDraft(self.key, self.low, self.high, count)


@dataclass(frozen=True, slots=True)
class StudyDraft:
    """The variations of a study.

    Attributes:
        axes: The parameters of the horizontal and the vertical axis of the map.
        comparison: Name of the comparison (`COMPARISONS`), or `NO_COMPARISON`.
    """

    axes: tuple[AxisDraft, AxisDraft]
    comparison: str = NO_COMPARISON

    @property
    def num_runs(self) -> int:
        """The number of runs."""
        combinations = len(COMPARISONS[self.comparison][1]) if self.compares else 1
        return self.axes[0].count * self.axes[1].count * combinations

    @property
    def compares(self) -> bool:
        """Whether a setting is compared."""
        return self.comparison in COMPARISONS

    def with_axis(self, place: int, axis: AxisDraft) -> StudyDraft:
        """The draft with another axis, whose number of values is within the bounds."""
        bounded = replace(axis, count=min(max(axis.count, MIN_STEPS), MAX_STEPS))
        first, second = self.axes
        return replace(self, axes=(bounded, second) if place == 0 else (first, bounded))


@lru_cache(maxsize=8)
def offers_of(scenario: Scenario) -> tuple[Offer, ...]:
    """The parameters of a scenario that can be varied; those of all fingers together first.

    Parameters that are invalid at an end of their range, such as noise with continuous
    control, and parameters that the laws of the scenario do not use are left out.
    """
    names, laws = names_of(scenario), set(kinds_in(scenario))
    definitions = names.definitions

    def is_used(parameter: Parameter) -> bool:
        kind = definitions.get(kind_key(parameter.key))
        kinds = laws if kind is None or kind.key == LAW else {str(kind.value)}
        return not parameter.used_by or bool(kinds & set(parameter.used_by))

    keys = [key for key, each in definitions.items() if _may_vary(each) and is_used(each)]
    of_all = dict.fromkeys(
        f"fingers.*.{key.split('.', 2)[2]}" for key in keys if key.startswith("fingers.")
    )
    first = [key for key in _FIRST_CHOICES if key in keys or key in of_all]
    ordered = dict.fromkeys((*first, *of_all, *keys))
    offers = (_offer(scenario, key, names) for key in ordered)
    return tuple(offer for offer in offers if _is_possible(scenario, offer))


def _may_vary(parameter: Parameter) -> bool:
    has_range = isinstance(parameter.value, float) or _is_left_out(parameter)
    return has_range and (parameter.changeable or template_key(parameter.key) in _ALSO_OFFERED)


def _is_left_out(parameter: Parameter) -> bool:
    """Whether it is an omitted optional number with a typical range."""
    is_number = parameter.kind == "number" and parameter.typical is not None
    return is_number and parameter.value is None


def _is_possible(scenario: Scenario, offer: Offer) -> bool:
    """Whether both ends of its range give a valid scenario."""
    steady = replace(scenario, changes=())
    try:
        for end in (offer.low, offer.high):
            with_values(steady, dict.fromkeys(expand_key(scenario, offer.key), end))
    except ScenarioError:
        return False
    return True


def _offer(scenario: Scenario, key: str, names: ParameterNames) -> Offer:
    parameter = names.definitions[expand_key(scenario, key)[0]]
    low, high = _range_of(parameter, names)
    label = names.label(key)
    text = f"{parameter.text} {key}, {parameter.limit}."
    return Offer(key, f"{label[:1].upper()}{label[1:]}", text, low, high)


def _range_of(parameter: Parameter, names: ParameterNames) -> tuple[float, float]:
    """The default range of a parameter."""
    if isinstance(parameter.value, float):
        return slider_range(parameter, names.definitions, parameter.value)[:2]
    assert parameter.typical is not None
    # Static friction is at least kinetic friction.
    sibling = names.definitions.get(parameter.key.replace("static_friction", "friction"))
    least = sibling.value if sibling and isinstance(sibling.value, float) else -math.inf
    low, high = parameter.typical
    return max(low, least), max(high, 2.0 * least)


def comparisons_in(scenario: Scenario) -> tuple[str, ...]:
    """The comparisons whose settings a scenario has; a body on a support has no controller."""
    known = parameter_definitions(scenario)
    return tuple(name for name, (key, _) in COMPARISONS.items() if key in known)


def fitted(
    draft: StudyDraft | None, offers: tuple[Offer, ...], compared: tuple[str, ...]
) -> StudyDraft:
    """The draft with parameters of a scenario; missing ones are replaced by the first on offer.

    Args:
        draft: The user's choice; None if there is none yet.
        offers: The parameters on offer, at least two.
        compared: The comparisons on offer.
    """
    if draft is None:
        return StudyDraft((offers[0].axis(), offers[1].axis()))
    known = {offer.key for offer in offers}
    taken = [axis.key for axis in draft.axes]
    free = (offer for offer in offers if offer.key not in taken)
    first, second = (axis if axis.key in known else next(free).axis() for axis in draft.axes)
    comparison = draft.comparison if draft.comparison in compared else NO_COMPARISON
    return StudyDraft((first, second), comparison)


def comparisons_for(draft: StudyDraft, compared: tuple[str, ...]) -> tuple[str, ...]:
    """The comparisons on offer whose settings no axis varies."""
    taken = {axis.key for axis in draft.axes}
    return (NO_COMPARISON, *(name for name in compared if COMPARISONS[name][0] not in taken))


def study_of(draft: StudyDraft, scenario: Scenario, origin: str) -> Study:
    """The study of a draft and a scenario.

    Args:
        draft: The draft.
        scenario: The base.
        origin: Name of the origin of the base.

    Raises:
        ScenarioError: With one entry per wrong field, in the words of the page.
    """
    names = names_of(scenario)
    first, second = draft.axes
    if first.key == second.key:
        raise _twice(names.words(first.key))
    is_preset = origin in all_preset_names() and load_scenario(origin) == scenario
    vary: dict[str, Any] = {axis.key: _range(axis) for axis in draft.axes}
    if draft.compares:
        key, values = COMPARISONS[draft.comparison]
        if key in vary:
            raise _twice(names.words(key))
        vary[key] = {"values": list(values)}
    words = " and ".join(names.words(axis.key) for axis in draft.axes)
    document = {
        "title": f"{origin[:80]}: {words}{_besides(scenario, is_preset=is_preset)}",
        "base": origin if is_preset else "",
        "vary": vary,
        "recordings": "none",
    }
    try:
        return study_from_mapping(document, lambda _: scenario)
    except ScenarioError as error:
        raise ScenarioError(
            [_in_words(finding, names, draft) for finding in error.errors]
        ) from error


def _besides(scenario: Scenario, *, is_preset: bool) -> str:
    """The differences between the base and its origin."""
    return ", with timed changes" if scenario.changes and not is_preset else ""


def _range(axis: AxisDraft) -> dict[str, Any]:
    scale = "log" if axis.is_log else "linear"
    return {"min": axis.low, "max": axis.high, "count": axis.count, "scale": scale}


def _twice(words: str) -> ScenarioError:
    message = f"{words} is chosen twice; choose another parameter for one of them"
    return ScenarioError([FieldError(field="vary", value=None, limit=None, message=message)])


def _in_words(finding: FieldError, names: ParameterNames, draft: StudyDraft) -> FieldError:
    message = finding.message
    for axis in draft.axes:
        words = names.words(axis.key)
        for field, end in ((".min", ", from"), (".max", ", to"), ("", "")):
            message = message.replace(f"vary.{axis.key}{field}", f"{words}{end}")
    return replace(finding, message=message)
