"""Text about the known and unknown parameters of a controller."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.knowledge import Knowledge, knowledge_of
from slipgrasp.core.scenario.unknowns import mass_keys, name_unknown
from slipgrasp.core.words.phrases import joined, some_of

_KINDS = (
    ("friction", re.compile(r"fingers\.\d+\.friction")),
    ("mass", re.compile(r"object\.mass")),
    ("inertia", re.compile(r"object\.inertia(s\.\d)?")),
    ("link masses", re.compile(r"fingers\.\d+\.(link_masses\.\d+|joints\.\d\.mass|mass)")),
    ("link lengths", re.compile(r"fingers\.\d+\.link_lengths\.\d+")),
    ("static friction", re.compile(r"fingers\.\d+\.static_friction")),
    ("joint friction", re.compile(r"fingers\.\d+\.joint_(damping|friction)")),
)
_MASSES = {"mass", "inertia", "link masses"}
_MOST_LINKS = 2


def describe_knowledge(scenario: Scenario, known: Knowledge | None = None) -> str:
    """The known and unknown parameters of the controller of a run; empty without a hand.

    Args:
        scenario: The scenario of the run, or the base of a study.
        known: Knowledge of the controller; that of the scenario if None.
    """
    if not scenario.space.has_hand:
        return ""
    known = known or knowledge_of(scenario)
    given, always = given_words(known), "at every instant" + _through(scenario, known)
    unused = "" if known.uses_friction else ", but its law uses no friction"
    unused = unused if known.uses_object else ", but its law uses no parameter of the object"
    if known.told:
        return f"The controller was given {given} {always}{unused}; nothing was unknown to it."
    unknown = [*_names(scenario, known.estimated), *_mistakes(scenario, known)]
    return f"Unknown to the controller: {joined(unknown)}; it was given {given} {always}{unused}."


def describe_comparison(scenario: Scenario, known: Knowledge, what: str) -> str:
    """Knowledge of the controllers of several runs, and whether adaptation is compared.

    Args:
        scenario: The common scenario.
        known: Parameters that are unknown in at least one of them.
        what: Name of the group, such as ``study``.
    """
    told = describe_knowledge(scenario, known)
    return told if not told or known.estimated else f"{told} This {what} compares no adaptation."


def list_unknowns(keys: Sequence[str]) -> str:
    """Unknown parameters by their kinds: ``unknown: friction, mass``, or ``nothing unknown``."""
    kinds = list(_by_kind(keys))
    return f"unknown: {', '.join(kinds)}" if kinds else "nothing unknown"


def _by_kind(keys: Sequence[str]) -> dict[str, list[str]]:
    """Keys grouped by kind, without empty kinds."""
    found = {kind: [key for key in keys if form.fullmatch(key)] for kind, form in _KINDS}
    return {kind: members for kind, members in found.items() if members}


def given_words(known: Knowledge) -> str:
    """The known parameters; friction and mass each by name if all of them are known."""
    unknown = _by_kind(known.unknowns).keys()
    friction = ["friction"] * (known.uses_friction and "friction" not in unknown)
    mass = ["mass"] * (not unknown & _MASSES)
    if not friction and not mass:
        return "the true value of every other parameter"
    others = "" if len(friction) >= known.uses_friction and mass else " and every other parameter"
    return f"the true {joined([*friction, *mass])}{others}"


def _through(scenario: Scenario, known: Knowledge) -> str:
    """A clause about values that change during the run."""
    changed = {change.parameter for change in scenario.changes} - {*known.unknowns}
    what = ["timed changes"] * any(key.startswith(("object.", "fingers.")) for key in changed)
    friction = {f"fingers.{i}.friction" for i in range(len(scenario.fingers))}
    on_patches = scenario.patches and known.uses_friction and friction - {*known.unknowns}
    what += ["patches"] * bool(on_patches)
    return f", {joined(what)} included" if what else ""


def _names(scenario: Scenario, keys: Sequence[str]) -> Iterator[str]:
    """Unknown parameters as text, grouped by kind."""
    names, count = scenario.finger_names, len(scenario.fingers)
    found = _by_kind(keys)
    axes = len(scenario.space.inertias)
    has_both = "mass" in found and len(found.get("inertia", ())) == axes
    for kind, members in found.items():
        fingers = sorted({int(key.split(".")[1]) for key in members if key.startswith("fingers.")})
        which = [names[i] for i in fingers]
        if kind in ("friction", "static friction"):
            yield f"the {kind} of {some_of(which, count, 'fingertip')}"
        elif kind == "joint friction":
            yield f"the friction of the joints of {some_of(which, count, 'finger')}"
        elif kind == "link lengths":
            yield "the lengths of the links"
        elif kind == "link masses":
            yield from _link_masses(scenario, members)
        elif has_both:
            yield from ["the mass and inertia of the object"] * (kind == "mass")
        else:
            yield from (name_unknown(scenario, key) for key in members)


def _link_masses(scenario: Scenario, keys: Sequence[str]) -> Iterator[str]:
    total = sum(len(mass_keys(scenario, i)) for i in range(len(scenario.fingers)))
    what = "fingers" if scenario.slides else "links"
    if len(keys) == total:
        yield f"the masses of the {what}"
    elif len(keys) > _MOST_LINKS:
        yield f"the masses of {len(keys)} of {total} {what}"
    else:
        yield from (name_unknown(scenario, key) for key in keys)


def _mistakes(scenario: Scenario, known: Knowledge) -> Iterator[str]:
    """Yields the parameters that are wrong in the model, or missing from it."""
    for kind, members in _by_kind(known.mistaken).items():
        how = "wrong in its model" if kind.startswith("link") else "not in its model"
        yield from (f"{name} ({how})" for name in _names(scenario, members))
