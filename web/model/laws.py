"""Selection of a control law while editing, with its settings, as one step."""

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
    """The draft with a law and its recommended settings.

    Settings of the previous law are removed, so that returning to the original law restores its
    scenario; the user's settings are kept.

    Args:
        draft: The draft.
        kind: Name of the law.
        time: Start time, until the next law [s]; None for the whole run.
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
    """The draft without a change of law at a time [s], with the settings of the previous law."""
    return _without_orphans(_with_needs(_without_laws(draft, lambda each: each == time)))


def main_changes(draft: Draft) -> tuple[TimedEdit, ...]:
    """The timed changes without settings of a law, which belong to its change."""
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
    """Settings that came with a law between two drafts, at a time [s]; may be empty."""
    return describe_settings(
        [
            SettingChange(key, before.value_at(time, key), after.value_at(time, key))
            for key in law_keys(before.base)
        ]
    )


def _begun_with(draft: Draft, kind: str) -> Draft:
    """The draft with a law from the start."""
    draft = replace(draft, edits=_own_edits(draft))
    if draft.value_at(0.0, LAW) == kind:
        return draft
    present = _present(draft, 0.0)
    settings = {**law_settings(present, kind), **foreign_parameters(draft.base, kind)}
    return replace(draft, edits={**draft.edits, LAW: kind, **settings})


def _own_edits(draft: Draft) -> Mapping[str, Value]:
    """The user's initial values, without the law and its settings."""
    kind = draft.edits.get(LAW)
    if kind not in law_names():
        return draft.edits
    of_laws = (LAW, *law_keys(draft.base))
    others = {key: value for key, value in draft.edits.items() if key not in of_laws}
    came = {LAW: kind, **law_settings(_present(replace(draft, edits=others), 0.0), str(kind))}
    return {key: v for key, v in draft.edits.items() if key not in came or came[key] != v}


def _is_of_law(draft: Draft) -> Callable[[TimedEdit], bool]:
    """Whether a timed change sets the law, or one of its settings."""
    times = {each.time for each in draft.changes if each.key == LAW}
    keys = {LAW, *law_keys(draft.base)}
    return lambda change: change.time in times and change.key in keys


def _without_laws(draft: Draft, at: Callable[[float], bool]) -> Draft:
    """The draft without the changes of law at some times, and without their settings."""
    is_of_law = _is_of_law(draft)
    kept = (each for each in draft.changes if not (at(each.time) and is_of_law(each)))
    return replace(draft, changes=tuple(kept))


def _without_orphans(draft: Draft) -> Draft:
    """The draft without settings of custom laws that it no longer uses."""

    def is_kept(key: str, value: Value, kinds: Iterable[Value]) -> bool:
        names = {name for kind in kinds for name in law_parameters(str(kind))}
        return not is_of_law(key) or value is None or key.rpartition(".")[2] in names

    kinds = [draft.value_at(0.0, LAW), *(each.value for each in draft.changes if each.key == LAW)]
    edits = {key: value for key, value in draft.edits.items() if is_kept(key, value, kinds)}
    changes = (c for c in draft.changes if is_kept(c.key, c.value, [draft.value_at(c.time, LAW)]))
    return replace(draft, edits=edits, changes=tuple(changes))


def _with_needs(draft: Draft) -> Draft:
    """The draft with sampled control for later laws that need it."""
    for change in draft.changes:
        is_sampled = change.key == LAW and law_of(str(change.value)).sampled
        if is_sampled and draft.value_at(change.time, SAMPLED_CONTROL.key) == 0.0:
            draft = draft.edited_from(change.time, SAMPLED_CONTROL.key, SAMPLED_CONTROL.value)
    return draft


def _present(draft: Draft, time: float) -> Scenario:
    """The scenario at a time [s], with later changes.

    If other parts of the draft are invalid, its base scenario.
    """
    try:
        scenario = draft.scenario()
        now = {each.key: each.value for each in draft.changes if each.time <= time}
        present = with_values(replace(scenario, changes=()), now)
    except ScenarioError:
        return replace(draft.base, changes=())
    return replace(present, changes=tuple(c for c in scenario.changes if c.time > time))
