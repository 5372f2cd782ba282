"""The draft: a base scenario, and the user's edits, changes and disturbances."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.custom_laws import LAW, LAW_PARAMETERS, law_names, law_parameters
from slipgrasp.core.scenario.loading import (
    all_preset_names,
    load_scenario,
    parameter_definitions,
    with_values,
)
from slipgrasp.core.scenario.parameters import Parameter, ParameterValue
from slipgrasp.core.scenario.scenario import without_events
from slipgrasp.core.scenario.supported import NO_CONTROLLER
from slipgrasp.web.model.disturbances import (
    Disturbance,
    disturbance_values,
    disturbances_of,
    is_of_disturbance,
)
from slipgrasp.web.model.replay import Replay
from slipgrasp.web.model.row_text import row_parameters, rows_of

Value = float | int | str | list[Any] | None

_DECIMALS_OF_TIME = 6
_PLACE_OF_CHANGE = re.compile(r"changes\.\d+\.(?P<what>value: |time)")


def change_time(play_head: float) -> float:
    """The time of a change at the play head, rounded to a microsecond [s]."""
    return round(play_head, _DECIMALS_OF_TIME)


@dataclass(frozen=True, slots=True)
class TimedEdit:
    """A parameter that changes during the run; the value may be out of bounds.

    Attributes:
        time: Time of the change [s].
        key: Dotted key of the parameter.
        value: Its new value.
    """

    time: float
    key: str
    value: Value


@dataclass(frozen=True, slots=True)
class Draft:
    """A base scenario, and the user's edits.

    Attributes:
        origin: Name of the preset, the recording, or the file.
        base: Its scenario.
        edits: Values of the user for the whole run, by dotted key; they may be out of bounds.
        changes: Timed changes, in order of time.
        disturbances: Pushes, then low-friction patches.
    """

    origin: str
    base: Scenario
    edits: Mapping[str, Value] = field(default_factory=dict)
    changes: tuple[TimedEdit, ...] = ()
    disturbances: tuple[Disturbance, ...] = ()

    @classmethod
    def starting_from(cls, origin: str, scenario: Scenario) -> Draft:
        """A scenario without edits, with its own timed changes and disturbances."""
        return cls(
            origin,
            scenario,
            changes=tuple(_timed_edits(scenario)),
            disturbances=disturbances_of(scenario),
        )

    @classmethod
    def from_preset(cls, name: str) -> Draft:
        """A preset without edits.

        Raises:
            ScenarioError: If the preset does not exist.
        """
        if name not in all_preset_names():
            # A name from a browser must not be opened as a path.
            known = ", ".join(all_preset_names())
            message = f"there is no preset of that name; presets: {known}"
            raise ScenarioError(
                [FieldError(field="scenario", value=None, limit=known, message=message)]
            )
        return cls.starting_from(name, load_scenario(name))

    @classmethod
    def from_replay(cls, replay: Replay) -> Draft:
        """The scenario of a recording."""
        return cls.starting_from(replay.label, replay.result.scenario)

    @property
    def is_touched(self) -> bool:
        """Whether it has edits."""
        return self != self.reset()

    @property
    def touched(self) -> frozenset[str]:
        """The edited parameters: for the whole run, from a time on, or of disturbances."""
        of_disturbances = (key for key, _ in disturbance_values(self.disturbances))
        return frozenset((*self.edits, *(change.key for change in self.changes), *of_disturbances))

    def reset(self) -> Draft:
        """The draft without edits."""
        return Draft.starting_from(self.origin, self.base)

    def edited(self, key: str, value: Value) -> Draft:
        """The draft with a value for the whole run."""
        kept = tuple(change for change in self.changes if change.key != key)
        if is_of_disturbance(key):
            return replace(self, changes=kept)._with_disturbance_edited(key, value)
        return replace(self, edits={**self.edits, key: value}, changes=kept)

    def edited_from(self, time: float, key: str, value: Value) -> Draft:
        """The draft with a value from a time on, until the next change of the parameter.

        If the parameter already has the value, no change is added; a change of the same parameter
        at the same time is replaced.

        Args:
            time: Start of the value [s]; at 0 the run starts with it.
            key: Dotted key; parameters that cannot change during a run are set for the whole run.
            value: The value.
        """
        if not self.is_changeable(key):
            return self.edited(key, value)
        if time <= 0.0:
            return replace(self, edits={**self.edits, key: value})
        others = tuple(c for c in self.changes if (c.time, c.key) != (time, key))
        draft = replace(self, changes=others)
        if draft.value_at(time, key) == value:
            return draft
        timed = sorted((*others, TimedEdit(time, key, value)), key=lambda change: change.time)
        return replace(draft, changes=tuple(timed))

    def without_change(self, time: float, key: str) -> Draft:
        """The draft without one of its timed changes."""
        kept = tuple(c for c in self.changes if (c.time, c.key) != (time, key))
        return replace(self, changes=kept)

    def without_changes(self) -> Draft:
        """The draft without timed changes and disturbances."""
        return replace(self, changes=(), disturbances=())

    def with_disturbance(self, disturbance: Disturbance) -> Draft:
        """The draft with one more disturbance."""
        same = [each for each in self.disturbances if each.place == disturbance.place]
        others = [each for each in self.disturbances if each.place != disturbance.place]
        grown = [*same, disturbance]
        ordered = [*grown, *others] if disturbance.place == "pulses" else [*others, *grown]
        return replace(self, disturbances=tuple(ordered))

    def without_disturbance(self, index: int) -> Draft:
        """The draft without one of its disturbances; unchanged if it does not exist."""
        kept = tuple(each for i, each in enumerate(self.disturbances) if i != index)
        return replace(self, disturbances=kept)

    def is_changeable(self, key: str) -> bool:
        """Whether a parameter may change during the run; disturbances change as a whole."""
        if is_of_disturbance(key):
            return False
        if is_of_law(key):
            return True
        parameter = _definitions(self.base).get(key)
        return parameter is not None and parameter.changeable

    def value_at(self, time: float, key: str) -> Value:
        """The value of a parameter at a time [s]."""
        latest = [c.value for c in self.changes if c.key == key and c.time <= time]
        if latest:
            return latest[-1]
        if is_of_disturbance(key):
            return dict(disturbance_values(self.disturbances)).get(key)
        if key in self.edits:
            return self.edits[key]
        if key == LAW and not self.base.space.has_control:
            return NO_CONTROLLER
        if is_of_law(key):
            return self._law_parameter(time, key)
        if key in row_parameters(self.base.space):
            return rows_of(self.base, key)
        return _plain(_definitions(self.base)[key].value)

    def _law_parameter(self, time: float, key: str) -> Value:
        """The declared default of a parameter of a custom law."""
        name, given = key.removeprefix(f"{LAW_PARAMETERS}."), self.base.controller.parameters
        if name in given:
            return given[name]
        kinds = (str(self.value_at(time, LAW)), *law_names())
        declared = (law_parameters(kind).get(name) for kind in kinds)
        return next((parameter.value for parameter in declared if parameter is not None), None)

    def num_changes_until(self, time: float) -> int:
        """The number of its changes up to a time [s]."""
        return sum(change.time <= time for change in self.changes)

    def scenario(self) -> Scenario:
        """The scenario of the draft.

        Raises:
            ScenarioError: With every invalid value, and its limit.
        """
        happening = dict(disturbance_values(self.disturbances))
        changing = dict(self._change_entries())
        return with_values(_calm(self.base), {**happening, **self.edits, **changing})

    def key_of(self, error: FieldError) -> str:
        """The parameter of an error in the draft; for a change the parameter that it sets."""
        head, _, rest = error.field.partition(".")
        index = rest.partition(".")[0]
        if head == "changes" and index.isdecimal() and int(index) < len(self.changes):
            return self.changes[int(index)].key
        return error.field

    def _with_disturbance_edited(self, key: str, value: Value) -> Draft:
        place, index, own = key.split(".", 2)
        same = [i for i, disturbance in enumerate(self.disturbances) if disturbance.place == place]
        if not index.isdecimal() or int(index) >= len(same):
            return self
        edited = list(self.disturbances)
        edited[same[int(index)]] = edited[same[int(index)]].edited(own, value)
        return replace(self, disturbances=tuple(edited))

    def _change_entries(self) -> Iterator[tuple[str, Value]]:
        for i, change in enumerate(self.changes):
            yield f"changes.{i}.time", change.time
            yield f"changes.{i}.parameter", change.key
            yield f"changes.{i}.value", change.value


def is_of_law(key: str) -> bool:
    """Whether a key belongs to a parameter of a custom law."""
    return key.startswith(f"{LAW_PARAMETERS}.")


def error_words(error: FieldError) -> str:
    """The error of a value that the user set, anywhere in the scenario."""
    place = _PLACE_OF_CHANGE.match(error.message)
    if place is None:
        return error.message
    rest = error.message[place.end() :]
    return rest if place["what"] == "value: " else f"the time of the change{rest}"


@lru_cache(maxsize=32)
def _definitions(base: Scenario) -> dict[str, Parameter]:
    """All parameters of a base scenario."""
    return parameter_definitions(base)


@lru_cache(maxsize=32)
def _calm(base: Scenario) -> Scenario:
    """A scenario without timed changes and disturbances."""
    return without_events(base)


def _timed_edits(scenario: Scenario) -> Iterator[TimedEdit]:
    for change in sorted(scenario.changes, key=lambda change: change.time):
        yield TimedEdit(change.time, change.parameter, _plain(change.value))


def _plain(value: ParameterValue) -> Value:
    return list(value) if isinstance(value, tuple) else value
