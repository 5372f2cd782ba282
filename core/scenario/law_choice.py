"""Selection of a control law for a scenario, with required and recommended settings.

Setting ``controller.kind`` alone keeps the settings of the previous law. The functions here apply
the settings of the new law (`slipgrasp.core.scenario.laws`); suitable values are not changed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from slipgrasp.core.scenario import (
    CONTROL_LAWS,
    SAMPLED_CONTROL,
    Change,
    ControlLaw,
    Estimate,
    LawSetting,
    Scenario,
)
from slipgrasp.core.scenario.custom_laws import (
    LAW,
    LAW_PARAMETERS,
    law_names,
    law_of,
    law_parameters,
)
from slipgrasp.core.scenario.field_errors import (
    nearest,
    refuse_other_types,
    shortened,
    single_error,
)
from slipgrasp.core.scenario.laws import LAW_ALIASES, law_kind
from slipgrasp.core.scenario.loading import parameter_definitions, with_values
from slipgrasp.core.scenario.scenario import need_hand, of_hand
from slipgrasp.core.scenario.unknowns import PHYSICAL_BOUNDS, unknown_of

_GRIP_FORCE = "controller.grip_force"
_FIRMNESS = 1.5
_LARGEST_GRIP = 1e4


class SettingChange(NamedTuple):
    """A parameter that was set with a law: dotted key, old value and new value."""

    key: str
    old: Any
    new: Any


@dataclass(frozen=True, slots=True)
class LawChoice:
    """A scenario with another law.

    Attributes:
        scenario: The scenario.
        settings: The settings that came with the law.
    """

    scenario: Scenario
    settings: tuple[SettingChange, ...] = ()


def with_law(scenario: Scenario, kind: str) -> Scenario:
    """Returns the scenario with a control law for the whole run, and its recommended settings.

    Args:
        scenario: The base; unchanged if it already has the law.
        kind: Name of the law, such as ``composite``.

    Raises:
        ScenarioError: If the law does not exist or the scenario excludes it.
    """
    return choose_law(scenario, kind).scenario


def choose_law(scenario: Scenario, kind: str) -> LawChoice:
    """Returns the scenario with a control law for the whole run, and the changed settings.

    Args:
        scenario: The base; unchanged if it already has the law.
        kind: Name of the law, such as ``composite``.

    Raises:
        ScenarioError: If the law does not exist or the scenario excludes it.
    """
    refuse_other_types(scenario)
    kind, names = law_kind(kind), (*LAW_ALIASES, *law_names())
    if kind not in names:
        known = ", ".join(names)
        near = nearest(kind, names)
        message = f"'{shortened(kind)}' is not a control law{near}; laws: {known}"
        raise single_error(LAW, kind, f"one of {known}", message)
    need_hand(scenario, "a control law", "omit the law")
    constant = replace(scenario, changes=tuple(_apart_from_laws(scenario)))
    if constant == scenario and kind == scenario.controller.kind:
        return LawChoice(scenario)
    settings = law_settings(constant, kind)
    before = parameter_definitions(constant)
    changes = tuple(SettingChange(key, before[key].value, new) for key, new in settings.items())
    values = {LAW: kind, **settings, **foreign_parameters(constant, kind)}
    return LawChoice(with_values(constant, values), changes)


def law_settings(scenario: Scenario, kind: str) -> dict[str, float | str | bool]:
    """Settings that a law needs, by dotted key, without those that the scenario already has.

    Args:
        scenario: The scenario for the law.
        kind: Name of the law.
    """
    if kind == scenario.controller.kind:
        return {}
    law = law_of(kind)
    unsuitable = {
        setting.key: setting.value
        for setting in _settings_of(law, scenario)
        if not setting.suits(getattr(scenario.controller, setting.key.rpartition(".")[2]))
    }
    bounds = dict(missing_bounds(scenario)) if law.bounded else {}
    return {**unsuitable, **dict(_grip(law, scenario)), **bounds}


def foreign_parameters(scenario: Scenario, kind: str) -> dict[str, None]:
    """Keys of parameters of another custom law that the new law does not have."""
    known = law_parameters(kind)
    names = (name for name in scenario.controller.parameters if name not in known)
    return {f"{LAW_PARAMETERS}.{name}": None for name in names}


def law_keys(scenario: Scenario) -> tuple[str, ...]:
    """Dotted keys of all settings that may come with any law."""
    settings = (SAMPLED_CONTROL, *(each for law in CONTROL_LAWS.values() for each in law.settings))
    bounds = (
        f"estimates.{i}.{bound}"
        for i in range(len(scenario.estimates))
        for bound in ("minimum", "maximum")
    )
    return tuple(dict.fromkeys((*(setting.key for setting in settings), _GRIP_FORCE, *bounds)))


def describe_settings(changes: Sequence[SettingChange]) -> str:
    """The settings as text: ``control every 1 ms, grip safety 1.05``; empty if there are none."""
    words = dict.fromkeys(_words_of(change) for change in changes if change.old != change.new)
    return ", ".join(words)


def _apart_from_laws(scenario: Scenario) -> Iterator[Change]:
    """The timed changes without those of the law and of its settings at the same times."""
    times = {change.time for change in scenario.changes if change.parameter == LAW}
    own = {LAW, *law_keys(scenario)}
    for change in scenario.changes:
        if not (change.time in times and change.parameter in own):
            yield change


def _settings_of(law: ControlLaw, scenario: Scenario) -> Iterator[LawSetting]:
    """The settings of a law that matter with its kind of control."""
    if law.sampled:
        yield SAMPLED_CONTROL
    is_sampled = law.sampled or scenario.controller.control_period > 0.0
    yield from (each for each in law.settings if is_sampled or not each.when_sampled)


def _grip(law: ControlLaw, scenario: Scenario) -> Iterator[tuple[str, float]]:
    """A grip force within its limit that, if required, supports the object."""
    if law.uses_friction:
        return
    controller = of_hand(scenario).controller
    present, most = controller.grip_force, controller.maximum_normal_force
    wanted = max(present, _carrying_grip(scenario)) if law.firm else present
    wanted = min(wanted, _LARGEST_GRIP if most is None else most)
    if wanted != present:
        yield _GRIP_FORCE, wanted


def _carrying_grip(scenario: Scenario) -> float:
    """Normal force whose friction supports 1.5 times the weight of the object [N].

    F_n = 1.5 m_o g / (n mu): each of n fingertips supports an equal part of the weight m_o g with
    the smallest friction mu.
    """
    friction = min(finger.friction for finger in scenario.fingers)
    weight = scenario.object.mass * scenario.simulation.gravity
    if friction == 0.0:
        return 0.0
    return float(math.ceil(_FIRMNESS * weight / (len(scenario.fingers) * friction)))


def missing_bounds(scenario: Scenario) -> Iterator[tuple[str, float]]:
    """Physical bounds for the estimates without bounds.

    True values and initial estimates of unusual size stay well within the bounds. Unphysical
    initial estimates have no bounds.
    """
    for i, estimate in enumerate(scenario.estimates):
        low, high = PHYSICAL_BOUNDS[unknown_of(scenario, estimate.parameter).kind]
        values = tuple(_values_met(scenario, i, estimate))
        least, most = min(values), max(values)
        if least <= 0.0:
            continue
        if estimate.minimum is None:
            yield f"estimates.{i}.minimum", low if low < least else 0.5 * least
        if estimate.maximum is None:
            yield f"estimates.{i}.maximum", high if most < high else 2.0 * most


def _values_met(scenario: Scenario, index: int, estimate: Estimate) -> Iterator[float]:
    """All known values of an estimate and of its parameter during a run."""
    keys = (estimate.parameter, f"estimates.{index}.initial")
    definitions = parameter_definitions(scenario)
    for value in (
        *(definitions[key].value for key in keys),
        *(change.value for change in scenario.changes if change.parameter in keys),
    ):
        assert isinstance(value, (float, int)), "validated scenarios have numbers there"
        yield value


def _words_of(change: SettingChange) -> str:
    """A setting as text, with identical text for all bounds."""
    head, _, name = change.key.rpartition(".")
    if head != "controller":
        within = "within physical bounds" if change.new is not None else "without bounds"
        return f"estimates {within}"
    if change.key == SAMPLED_CONTROL.key:
        period = f"every {1e3 * change.new:g} ms"
        return f"control {period}" if change.new > 0.0 else "continuous control"
    unit = {"slip_stop": " m/s²", "grip_force": " N"}.get(name, "")
    value = change.new if isinstance(change.new, str) else f"{change.new:g}"
    is_carrying = change.key == _GRIP_FORCE and change.new > change.old  # `_carrying_grip`
    origin = " for the true mass and friction" if is_carrying else ""
    return f"{name.replace('_', ' ')} {value}{unit}{origin}"
