"""Reads the sentence about what a controller was given, and holds it against the scenario.

It shares no code with the sentence; see `tests.core.reading_words`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import with_values


def check_knowledge(result: RunResult, found: re.Match[str]) -> None:
    """What was unknown and what was given are what the scenario says, at every time of it."""
    scenario, named = result.scenario, set()
    left = found.groupdict().get("unknown") or ""
    for pattern, keys in UNKNOWNS:
        for each in re.finditer(pattern, left):
            named |= set(keys(scenario, each))
        left = re.sub(pattern, "", left)
    assert not re.sub(r"\band\b|[, ]", "", left), left
    unknown = unknown_at_some_time(scenario)
    assert named == unknown and (found.groupdict().get("unknown") is None) == (not unknown)
    assert result.summary()["told"] == (not unknown)
    assert set(result.summary()["unknowns"]) == unknown
    kinds = {scenario.controller.kind, *values_of(scenario, "controller.kind")}
    uses_friction = not kinds <= {"pd-gravity", "grip-reflex", "gripper"}
    assert (found["unused"] is not None) == (not uses_friction)
    assert ("no parameter of the object" in (found["unused"] or "")) == (kinds == {"gripper"})
    friction = any(key.endswith(".friction") for key in unknown)
    mass = any("mass" in key or "inertia" in key for key in unknown)
    given = set(re.findall(r"friction|mass|every other parameter", found["given"]))
    assert ("friction" in given) == (uses_friction and not friction)
    assert ("mass" in given) == (not mass)
    assert ("every other parameter" in given) == ((uses_friction and friction) or mass)
    changed = {change.parameter for change in scenario.changes} - unknown
    body = any(key.split(".")[0] in ("object", "fingers") for key in changed)
    assert ("timed changes" in (found["through"] or "")) == body
    told_all = {f"fingers.{i}.friction" for i in range(len(scenario.fingers))} <= unknown
    on_patches = bool(scenario.patches) and uses_friction and not told_all
    assert ("patches" in (found["through"] or "")) == on_patches


def values_of(scenario: Scenario, key: str) -> list[Any]:
    return [change.value for change in scenario.changes if change.parameter == key]


def unknown_at_some_time(scenario: Scenario) -> set[str]:
    """Keys of what the controller estimates, has wrong, or lacks, at some time of a run."""
    found = {estimate.parameter for estimate in scenario.estimates}
    ends = [change.time for change in scenario.changes]
    for time in (0.0, *ends):
        due = [change for change in scenario.changes if change.time <= time]
        now = replace(scenario, changes=())
        for change in sorted(due, key=lambda each: each.time):
            value = list(change.value) if isinstance(change.value, tuple) else change.value
            now = with_values(now, {change.parameter: value}, with_law=False)
        for i, finger in enumerate(now.fingers):
            if now.controller.link_mass_ratio != 1.0:
                found |= {f"fingers.{i}.link_masses.{k}" for k in (0, 1)}
            if now.controller.link_length_ratio != 1.0:
                found |= {f"fingers.{i}.link_lengths.{k}" for k in (0, 1)}
            for name in ("joint_damping", "joint_friction"):
                found |= {f"fingers.{i}.{name}"} if getattr(finger, name) > 0.0 else set()
            if finger.static_friction is not None and finger.static_friction != finger.friction:
                found.add(f"fingers.{i}.static_friction")
    return found


def of_fingers(*names: str) -> Callable[[Scenario, re.Match[str]], list[str]]:
    """Keys of the fingers that a phrase names, at whose end they stand: both, all, or some."""

    def keys(scenario: Scenario, found: re.Match[str]) -> list[str]:
        who = found["who"]
        here = scenario.finger_names
        every = who.startswith(("both", "all"))
        assert not every or who.startswith("both") == (len(here) == 2)
        which = [i for i, name in enumerate(here) if every or re.search(rf"\b{name}\b", who)]
        known = {*unknown_at_some_time(scenario)}
        return [key for i in which for name in names if (key := f"fingers.{i}.{name}") in known]

    return keys


def of_links(parts: str) -> Callable[[Scenario, re.Match[str]], list[str]]:
    def keys(scenario: Scenario, found: re.Match[str]) -> list[str]:
        unknown = unknown_at_some_time(scenario)
        total = [f"fingers.{i}.{parts}.{k}" for i in range(len(scenario.fingers)) for k in (0, 1)]
        some = found.groupdict().get("count")
        if some is None:
            return total
        assert int(found["total"]) == len(total)
        estimated = {estimate.parameter for estimate in scenario.estimates}
        meant = (unknown - estimated if "wrong" in found[0] else estimated) & set(total)
        assert int(some) == len(meant) < len(total)
        return sorted(meant)

    return keys


def of_one_link(scenario: Scenario, found: re.Match[str]) -> list[str]:
    finger = scenario.finger_names.index(found["finger"])
    return [f"fingers.{finger}.link_masses.{int(found['link']) - 1}"]


def of_inertia(scenario: Scenario, found: re.Match[str]) -> list[str]:
    axis = found.groupdict().get("axis")
    every = [*scenario.space.inertias]
    mass = ["object.mass"] if "mass" in found[0] else []
    return [*mass, *(every if axis is None else [f"object.inertias.{'xyz'.index(axis)}"])]


WRONG, LACKING = r"(?: \(wrong in its model\))", r" \(not in its model\)"
WHO = r"(?P<who>(?:both|all) {0}s|the [\w ,]+? {0}s?)"
UNKNOWNS: tuple[tuple[str, Callable[[Scenario, re.Match[str]], list[str]]], ...] = (
    (
        rf"the friction of the joints of {WHO.format('finger')}{LACKING}",
        of_fingers("joint_damping", "joint_friction"),
    ),
    (
        rf"the static friction of {WHO.format('fingertip')}{LACKING}",
        of_fingers("static_friction"),
    ),
    (rf"the friction of {WHO.format('fingertip')}", of_fingers("friction")),
    (r"the mass and inertia of the object", of_inertia),
    (r"the moment of inertia of the object(?: about its (?P<axis>[xyz]) axis)?", of_inertia),
    (r"the mass of the object", lambda _scenario, _found: ["object.mass"]),
    (rf"the mass of link (?P<link>\d) of the (?P<finger>[\w ]+?) finger{WRONG}?", of_one_link),
    (rf"the masses of (?P<count>\d+) of (?P<total>\d+) links{WRONG}?", of_links("link_masses")),
    (rf"the masses of the links{WRONG}?", of_links("link_masses")),
    (rf"the lengths of the links{WRONG}", of_links("link_lengths")),
)
"""How unknown parameters are called, and their keys."""

GIVEN = (
    r"given the true (?P<given>[a-z ]+) at every instant"
    r"(?P<through>, (?:timed changes)?(?: and )?(?:patches)? included)?"
    r"(?P<unused>, but its law uses (?:no friction|no parameter of the object))?"
)

KNOWLEDGE: tuple[tuple[str, Callable[[RunResult, re.Match[str]], None]], ...] = (
    (
        rf"The controller was {GIVEN}; nothing was unknown to it\.",
        check_knowledge,
    ),
    (rf"Unknown to the controller: (?P<unknown>.+); it was {GIVEN}\.", check_knowledge),
)
"""The sentence in both its forms."""
