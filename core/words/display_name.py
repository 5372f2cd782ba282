"""Names of runs in lists: the preset, and the differences from it.

The title of a preset describes its behaviour, which may not apply to a modified run, so that the
name consists of facts of the scenario: ``paper-case-2 · composite · mass 1.4 kg``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from functools import cache, lru_cache
from itertools import groupby
from typing import Any, NamedTuple

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario import Change, Estimate, Patch, Scenario
from slipgrasp.core.scenario.field_errors import template_key, template_keys
from slipgrasp.core.scenario.law_choice import with_law
from slipgrasp.core.scenario.loading import all_preset_names, load_scenario, preset_names
from slipgrasp.core.scenario.scenario import AnyPatch, AnyPulse, without_events
from slipgrasp.core.scenario.space import SPACES
from slipgrasp.core.words.parameter_words import estimate_words, key_words, value_words

SEPARATOR = " · "
MOST_FACTS = 4
MOST_FACTS_FROM_NEAREST = 8
"""Largest number of differences of a scenario that counts as based on a preset."""

LONGEST_TITLE = 48
LONGEST_FILE_STEM = 60
MOST_NUMBERS = 3
OWN = "own scenario"

_UNNAMED = ("title", "fingers", "estimates", "pulses", "patches", "changes")
_INSIDE = re.compile(
    r"^(object|controller(?!\.parameters)|trajectory|sensing|actuation|simulation|support|rail|motion)\."
)

_THINGS = ("object.", "support.", "rail.", "finger.", "motion.")


class _Fact(NamedTuple):
    """A difference of a run; the most informative ones have the lowest rank."""

    rank: int
    words: str


_LAW, _THING, _EVENT, _DETAIL = range(4)


@lru_cache(maxsize=64)
def name_run(scenario: Scenario) -> str:
    """Returns the name of every run of a scenario, on one line.

    Args:
        scenario: The simulated scenario.

    Returns:
        The preset and the differences from it, with units; a custom title in place of the preset;
        the first facts and the number of further ones.
    """
    base, facts = _compare_with_presets(scenario)
    words = [fact.words for fact in sorted(facts, key=lambda fact: fact.rank)]
    if len(words) > MOST_FACTS:
        words = [*words[: MOST_FACTS - 1], f"+{len(words) - MOST_FACTS + 1} more"]
    return SEPARATOR.join([base, *words])


def file_stem(name: str) -> str:
    """Converts a name to a portable file name: ``paper-case-2-composite-mass-1.4-kg``."""
    plain = name.replace("²", "2").replace("³", "3")
    stem = re.sub(r"[^A-Za-z0-9._]+", "-", plain).strip("-.")
    if len(stem) <= LONGEST_FILE_STEM:
        return stem
    # Cut between words, because half a number would be a different one.
    whole = stem[: LONGEST_FILE_STEM + 1].rpartition("-")[0]
    return whole or stem[:LONGEST_FILE_STEM]


@cache
def preset_titles() -> dict[str, str]:
    """Names of the presets by title."""
    return {load_scenario(name).title: name for name in all_preset_names()}


def _compare_with_presets(scenario: Scenario) -> tuple[str, list[_Fact]]:
    """The basis of the run, and its differences."""
    preset = preset_titles().get(scenario.title)
    if preset is not None and load_scenario(preset).space is scenario.space:
        return preset, _facts(load_scenario(preset), scenario)
    presets = preset_names(scenario.space)
    facts = {name: _facts(load_scenario(name), scenario) for name in presets}
    nearest = min(facts, key=lambda name: len(facts[name]))
    title = _shortened(scenario.title)
    if len(facts[nearest]) <= MOST_FACTS_FROM_NEAREST:
        return title or nearest, facts[nearest]
    return title or OWN, list(_plain_facts(scenario))


def _shortened(title: str) -> str:
    shown = "".join(c if c.isprintable() else " " for c in title).strip()
    return shown if len(shown) <= LONGEST_TITLE else f"{shown[: LONGEST_TITLE - 1].rstrip()}…"


def _plain_facts(scenario: Scenario) -> Iterator[_Fact]:
    """Facts about a scenario that is not based on a preset."""
    if scenario.space.has_hand:
        yield _Fact(_LAW, scenario.controller.kind)
        yield _Fact(_THING, f"{len(scenario.fingers)} fingers")
    else:
        yield _Fact(_THING, f"friction {value_words(scenario.fingers[0].friction, '1')}")
    yield _Fact(_THING, f"mass {value_words(scenario.object.mass, 'kg')}")
    yield from _events(without_events(scenario), scenario)


def _facts(preset: Scenario, scenario: Scenario) -> list[_Fact]:
    """Differences of a scenario from a preset; settings that come with another law belong to it."""
    found, kind = list(_all_facts(preset, scenario)), scenario.controller.kind
    if kind == preset.controller.kind:
        return found
    beside = set(_all_facts(_with_law(preset, kind), scenario))
    return [fact for fact in found if fact.rank == _LAW or fact in beside]


def _all_facts(preset: Scenario, scenario: Scenario) -> Iterator[_Fact]:
    for key, value in _differences(preset, scenario):
        rank = _THING if key.startswith(_THINGS) else _DETAIL
        yield _Fact(_LAW if key == "controller.kind" else rank, _value_fact(scenario, key, value))
    if scenario.space.has_hand:
        yield from (_Fact(_THING, words) for words in _finger_facts(preset, scenario))
    yield from _events(preset, scenario)
    yield from (_Fact(_DETAIL, words) for words in _estimate_facts(preset, scenario))


def _with_law(preset: Scenario, kind: str) -> Scenario:
    try:
        return with_law(preset, kind)
    except ScenarioError:  # the preset excludes the law
        return replace(preset, controller=replace(preset.controller, kind=kind))


def _differences(old: Any, new: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Keys and new values of the differences, with lists of numbers as one value."""
    for field in fields(new):
        if not prefix and field.name in _UNNAMED:
            continue
        before, after = getattr(old, field.name), getattr(new, field.name)
        key = f"{prefix}{field.name}"
        if before == after:
            continue
        if is_dataclass(after):
            yield from _differences(before, after, f"{key}.")
        elif isinstance(after, Mapping):
            yield from ((f"{key}.{name}", v) for name, v in after.items() if before.get(name) != v)
        elif isinstance(after, tuple) and field.name.startswith("link_"):
            pairs = enumerate(zip(before, after, strict=True))
            yield from ((f"{key}.{i}", own) for i, (was, own) in pairs if was != own)
        else:
            yield key, after


def _value_fact(scenario: Scenario, key: str, value: Any) -> str:
    """A parameter and its value, such as ``grip safety 1.05``."""
    words = _INSIDE.sub("", key)
    if key == "controller.kind":
        return str(value)
    if key == "trajectory.kind":
        return f"{value} motion"
    name = key_words(words, scenario.finger_names, scenario.space)
    return _said(name, value, _unit_of(key))


def _said(words: str, value: Any, unit: str) -> str:
    if isinstance(value, bool):
        return f"{'with' if value else 'without'} {words}"
    if value is None or value == ():
        return f"no {words}"
    if isinstance(value, tuple) and not _is_short(value):
        return f"other {words}"
    colon = ":" if words[-1:].isdigit() else ""
    return f"{words}{colon} {value_words(value, unit)}"


def _is_short(value: tuple[Any, ...]) -> bool:
    return len(value) <= MOST_NUMBERS and all(isinstance(each, (int, float)) for each in value)


def _unit_of(key: str) -> str:
    # Planar and spatial hands have the same units for common parameters.
    for space in SPACES:
        known = template_keys(space)
        for each in (key, f"{key}.0"):
            parameter = known.get(template_key(each, space))
            if parameter is not None:
                return parameter.unit
    return ""


def _finger_facts(preset: Scenario, scenario: Scenario) -> Iterator[str]:
    """Differences of the fingers; common ones appear once."""
    if len(preset.fingers) != len(scenario.fingers):
        yield f"{len(scenario.fingers)} fingers"
        return
    pairs = zip(preset.fingers, scenario.fingers, strict=True)
    found = [
        (key, value, i)
        for i, (old, new) in enumerate(pairs)
        for key, value in _differences(old, new)
    ]
    yield from _grouped(found, scenario, lambda key, name: f"{name} {key_words(key, ())}".strip())


def _grouped(
    found: list[tuple[str, Any, int]], scenario: Scenario, words: Callable[[str, str], str]
) -> Iterator[str]:
    """Facts of single fingers, or of all fingers if they have the same value.

    Args:
        found: Key within the finger, value, and index of the finger.
        scenario: The scenario of the fingers.
        words: Returns the text for a key and the name of a finger, which is empty for all fingers.
    """
    for key, members in groupby(sorted(found, key=lambda each: each[0]), lambda each: each[0]):
        values = {finger: value for _, value, finger in members}
        unit = _unit_of(f"fingers.0.{key.rpartition(':')[2]}")
        if len(values) == len(scenario.fingers) and len(set(values.values())) == 1:
            yield _said(words(key, ""), values[0], unit)
        else:
            for finger, value in values.items():
                yield _said(words(key, scenario.finger_names[finger]), value, unit)


def _estimate_facts(preset: Scenario, scenario: Scenario) -> Iterator[str]:
    """Changed estimates, and parameters that became known or unknown."""
    before = {estimate.parameter: estimate for estimate in preset.estimates}
    after = {estimate.parameter: estimate for estimate in scenario.estimates}
    for target in (key for key in before if key not in after):
        yield f"{_target_words(preset, target)} not estimated"
    for target in (key for key in after if key not in before):
        yield f"{_target_words(scenario, target)} estimated"
    of_fingers: list[tuple[str, Any, int]] = []
    for target in (key for key in after if key in before):
        for field, value in _differences(before[target], after[target]):
            place = re.fullmatch(r"fingers\.(\d+)\.(.+)", target)
            if place is not None:
                of_fingers.append((f"{field}:{place[2]}", value, int(place[1])))
            else:
                words = estimate_words(field, _target_words(scenario, target))
                yield _said(words, value, _unit_of(target))
    yield from _grouped(of_fingers, scenario, _estimate_words)


def _estimate_words(key: str, name: str) -> str:
    field, _, own = key.partition(":")
    return estimate_words(field, f"{name} {key_words(own, ())}".strip())


def _target_words(scenario: Scenario, key: str) -> str:
    return key_words(_INSIDE.sub("", key), scenario.finger_names)


def _events(preset: Scenario, scenario: Scenario) -> Iterator[_Fact]:
    """New and missing pushes, patches and timed changes."""
    own = [*scenario.pulses, *scenario.patches, *scenario.changes]
    others = [*preset.pulses, *preset.patches, *preset.changes]
    new = [event for event in own if event not in others]
    gone = [event for event in others if event not in own]
    for event in sorted(new, key=_time_of):
        yield _Fact(_EVENT, _event_words(scenario, event))
    replaced = [_kind_of(event) for event in new]
    for event in gone:
        if _kind_of(event) in replaced:
            replaced.remove(_kind_of(event))
        else:
            yield _Fact(_EVENT, f"no {_event_words(scenario, event)}")


_Event = AnyPulse | AnyPatch | Change


def _time_of(event: _Event) -> float:
    return event.start_time if isinstance(event, AnyPatch) else event.time


def _kind_of(event: _Event) -> str:
    return event.parameter if isinstance(event, Change) else type(event).__name__


def _event_words(scenario: Scenario, event: _Event) -> str:
    if isinstance(event, AnyPulse):
        return _push_words(event)
    if isinstance(event, AnyPatch):
        return _patch_words(event)
    words = _changed_words(scenario, event)
    return f"{words} at {value_words(event.time, 's')}"


def _push_words(push: AnyPulse) -> str:
    """A push; values equal to those of a click are omitted."""
    usual = type(push)(time=push.time)
    parts = [
        value_words(push.force, "N") if push.force != usual.force else "",
        value_words(push.moment, "N m") if push.moment != usual.moment else "",
        f"for {value_words(push.duration, 's')}" if push.duration != usual.duration else "",
    ]
    return " ".join(["push", *filter(None, parts), f"at {value_words(push.time, 's')}"])


def _patch_words(patch: AnyPatch) -> str:
    """A patch; values equal to those of a click are omitted."""
    same = patch.friction_factor == Patch(face="left").friction_factor
    parts = [
        "low-friction patch" if patch.friction_factor < 1.0 else "high-friction patch",
        f"on {patch.face.replace('-', ' ')}",
        "" if same else f"× {value_words(patch.friction_factor)}",
        f"at {value_words(patch.start_time, 's')}" if patch.start_time > 0.0 else "",
        "" if patch.end_time is None else f"until {value_words(patch.end_time, 's')}",
    ]
    return " ".join(filter(None, parts))


def _changed_words(scenario: Scenario, change: Change) -> str:
    head, _, rest = change.parameter.partition(".")
    index, _, field = rest.partition(".")
    if head == "estimates" and index.isdigit() and int(index) < len(scenario.estimates):
        estimate: Estimate = scenario.estimates[int(index)]
        words = estimate_words(field, _target_words(scenario, estimate.parameter))
        return _said(words, change.value, _unit_of(estimate.parameter))
    return _value_fact(scenario, change.parameter, change.value)
