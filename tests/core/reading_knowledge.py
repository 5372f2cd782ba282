"""Holds the sentence about what a controller was given against the scenario.

It shares no code with the sentence; see `tests.core.reading_words`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.knowledge import Knowledge
from slipgrasp.core.scenario.loading import with_values


def check_knowledge(scenario: Scenario, known: Knowledge, found: re.Match[str]) -> None:
    """What was unknown and what was given are what the scenario says, at every time of it."""
    unknown = unknown_at_some_time(scenario)
    assert set(known.unknowns) == unknown and known.told == (not unknown)
    assert ("unknown" in found.groupdict()) == bool(unknown)
    changed = {change.parameter: change.value for change in scenario.changes}
    kinds = {scenario.controller.kind, changed.get("controller.kind", scenario.controller.kind)}
    uses_friction = not kinds <= {"pd-gravity", "grip-reflex", "gripper"}
    assert (found["unused"] is not None) == (not uses_friction)
    assert ("no parameter of the object" in (found["unused"] or "")) == (kinds == {"gripper"})
    friction = any(key.endswith(".friction") for key in unknown)
    mass = any("mass" in key or "inertia" in key for key in unknown)
    given = set(re.findall(r"friction|mass|every other parameter", found["given"]))
    assert ("friction" in given) == (uses_friction and not friction)
    assert ("mass" in given) == (not mass)
    assert ("every other parameter" in given) == ((uses_friction and friction) or mass)
    body = any(key.split(".")[0] in ("object", "fingers") for key in changed.keys() - unknown)
    assert ("timed changes" in (found["through"] or "")) == body
    told_all = {f"fingers.{i}.friction" for i in range(len(scenario.fingers))} <= unknown
    on_patches = bool(scenario.patches) and uses_friction and not told_all
    assert ("patches" in (found["through"] or "")) == on_patches


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


GIVEN = (
    r"given the true (?P<given>[a-z ]+) at every instant"
    r"(?P<through>, (?:timed changes)?(?: and )?(?:patches)? included)?"
    r"(?P<unused>, but its law uses (?:no friction|no parameter of the object))?"
)
FORMS = (
    rf"The controller was {GIVEN}; nothing was unknown to it\.",
    rf"Unknown to the controller: (?P<unknown>.+); it was {GIVEN}\.",
)
KNOWLEDGE: tuple[tuple[str, Callable[[RunResult, re.Match[str]], None]], ...] = tuple(
    (form, lambda result, found: check_knowledge(result.scenario, result.knowledge, found))
    for form in FORMS
)
"""The sentence in both its forms."""
