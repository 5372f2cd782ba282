"""Choosing a control law while editing: its settings come and go with it, as one step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario import SAMPLED_CONTROL, Scenario
from slipgrasp.core.scenario.custom_laws import law_names, law_of, law_parameters
from slipgrasp.core.scenario.law_choice import (
    LAW,
    SettingChange,
    describe_settings,
    foreign_parameters,
    law_keys,
    law_settings,
)
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.web.model.draft import Draft, TimedEdit, Value, is_of_law


def with_law(draft: Draft, kind: str, time: float | None) -> Draft:
    """The draft with a law and the settings it is meant for.

    What came with the law before it goes again, so that the law a scenario began with finds the
    scenario as it was; what the user set stays.

    Args:
        draft: What is asked for.
        kind: Name of the law.
        time: From when on, until the next law [s]; None is from start to end.
    """
    if time is None:
        return _without_orphans(_begun_with(_without_laws(draft, lambda _: True), kind))
    if time <= 0.0:
        return _without_orphans(_with_needs(_begun_with(draft, kind)))
    draft = _without_laws(draft, lambda each: each == time)
    for key, value in {LAW: kind, **law_settings(_present(draft, time), kind)}.items():
        draft = draft.edited_from(time, key, value)
    return _without_orphans(_with_needs(draft))


def without_law_change(draft: Draft, time: float) -> Draft:
    """The draft in which the law stays at some time [s], with the settings of the one before."""
    return _without_orphans(_with_needs(_without_laws(draft, lambda each: each == time)))


def main_changes(draft: Draft) -> tuple[TimedEdit, ...]:
    """The timed changes without what was set with a law: that is one thing with it."""
    is_of_law = _is_of_law(draft)
    return tuple(each for each in draft.changes if each.key == LAW or not is_of_law(each))


def law_change_words(draft: Draft, change: TimedEdit) -> str:
    """A timed change of the law with its settings: ``composite: control every 1 ms, …``."""
    is_of_law = _is_of_law(draft)
    settings = [
        SettingChange(each.key, None, each.value)
        for each in draft.changes
        if each.time == change.time and each.key != LAW and is_of_law(each)
    ]
    return ": ".join(filter(None, (str(change.value), describe_settings(settings))))


def set_words(before: Draft, after: Draft, time: float) -> str:
    """What was set with a law, from one draft to the next, at some time [s]; empty if nothing."""
    return describe_settings(
        [
            SettingChange(key, before.value_at(time, key), after.value_at(time, key))
            for key in law_keys(before.base)
        ]
    )


def _begun_with(draft: Draft, kind: str) -> Draft:
    """The draft with a law from the start on."""
    draft = replace(draft, edits=_own_edits(draft))
    if draft.value_at(0.0, LAW) == kind:
        return draft
    present = _present(draft, 0.0)
    settings = {**law_settings(present, kind), **foreign_parameters(draft.base, kind)}
    return replace(draft, edits={**draft.edits, LAW: kind, **settings})


def _own_edits(draft: Draft) -> Mapping[str, Value]:
    """What the user set from the start on: without the law, and what came with it."""
    kind = draft.edits.get(LAW)
    if kind not in law_names():
        return draft.edits
    of_laws = (LAW, *law_keys(draft.base))
    others = {key: value for key, value in draft.edits.items() if key not in of_laws}
    came = {LAW: kind, **law_settings(_present(replace(draft, edits=others), 0.0), str(kind))}
    return {key: v for key, v in draft.edits.items() if key not in came or came[key] != v}


def _is_of_law(draft: Draft) -> Callable[[TimedEdit], bool]:
    """Whether a timed change sets the law, or a parameter that was set with it then."""
    times = {each.time for each in draft.changes if each.key == LAW}
    keys = {LAW, *law_keys(draft.base)}
    return lambda change: change.time in times and change.key in keys


def _without_laws(draft: Draft, at: Callable[[float], bool]) -> Draft:
    """The draft without the changes of law at some times, and without what was set with them."""
    is_of_law = _is_of_law(draft)
    kept = (each for each in draft.changes if not (at(each.time) and is_of_law(each)))
    return replace(draft, changes=tuple(kept))


def _without_orphans(draft: Draft) -> Draft:
    """The draft without what was set of custom laws that it has no more."""

    def is_kept(key: str, value: Value, kinds: Iterable[Value]) -> bool:
        names = {name for kind in kinds for name in law_parameters(str(kind))}
        return not is_of_law(key) or value is None or key.rpartition(".")[2] in names

    kinds = [draft.value_at(0.0, LAW), *(each.value for each in draft.changes if each.key == LAW)]
    edits = {key: value for key, value in draft.edits.items() if is_kept(key, value, kinds)}
    changes = (c for c in draft.changes if is_kept(c.key, c.value, [draft.value_at(c.time, LAW)]))
    return replace(draft, edits=edits, changes=tuple(changes))


def _with_needs(draft: Draft) -> Draft:
    """The draft in which no later law lacks the sampled control that one before it brought."""
    for change in draft.changes:
        is_sampled = change.key == LAW and law_of(str(change.value)).sampled
        if is_sampled and draft.value_at(change.time, SAMPLED_CONTROL.key) == 0.0:
            draft = draft.edited_from(change.time, SAMPLED_CONTROL.key, SAMPLED_CONTROL.value)
    return draft


def _present(draft: Draft, time: float) -> Scenario:
    """The scenario as it is at some time [s], and what changes after it.

    While something else in the draft is wrong, that is the scenario it started from.
    """
    try:
        scenario = draft.scenario()
        now = {each.key: each.value for each in draft.changes if each.time <= time}
        present = with_values(replace(scenario, changes=()), now)
    except ScenarioError:
        return replace(draft.base, changes=())
    return replace(present, changes=tuple(c for c in scenario.changes if c.time > time))
