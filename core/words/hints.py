"""Suggestions: only settings that the control law uses and that are not already made.

A hint is a list of options. Each option names parameters by their dotted keys, with the current
value if a larger or smaller one is suggested. If no option remains, the hint names changes outside
the controller.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import lru_cache

import numpy as np

from slipgrasp.core.scenario import ControlLaw, HandScenario, Scenario
from slipgrasp.core.scenario.custom_laws import law_of
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.scenario.scenario import AnyController, of_hand
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.words.options import Option
from slipgrasp.core.words.phrases import joined

_OFFERED = 3
_RISK = "which can also make it worse"
_OUTSIDE = "no other setting of this law can help: make the object lighter or its faces rougher"


class Goal(StrEnum):
    """Purpose of a hint."""

    HOLD = "hold the object"
    LESS_SLIP = "reduce the slip"
    NEARER = "bring the object nearer to its target"
    MARGIN = "find how little is enough"


@dataclass(frozen=True, slots=True)
class Hint:
    """A suggestion.

    Attributes:
        options: Alternatives, the most successful first; without trials only the first few that
            set specific values are shown, with trials all of them.
        purpose: Purpose, such as ``for less slip``; empty if it is obvious.
        instead: Changes outside the controller; empty if there are none.
        goal: Criterion of success.
        risky: Further options that made some runs worse; only offered after a trial.
    """

    options: tuple[Option, ...]
    purpose: str = ""
    instead: str = ""
    goal: Goal = Goal.HOLD
    risky: tuple[Option, ...] = ()

    def __str__(self) -> str:
        """The hint as a sentence without capital letter and full stop."""
        settable = [option for option in self.options if option.values]
        offered = [option for option in settable if not _repeats(option, settable)][:_OFFERED]
        offered += [option for option in self.options if not option.values]
        is_risky = bool(self.risky) and not offered and not self.instead
        offered += self.risky[:_OFFERED] * is_risky
        options = joined([option.words for option in offered], "or")
        told = ", ".join(filter(None, [options, self.purpose, _RISK * is_risky]))
        return "; or ".join(filter(None, [told, self.instead]))

    @property
    def trials(self) -> tuple[Option, ...]:
        """Every option with specific values, once."""
        options = (*self.options, *self.risky)
        return tuple({option.words: option for option in options if option.values}.values())

    @property
    def rest(self) -> Hint:
        """The parts of the hint other than the tried options and their purpose."""
        return Hint(tuple(option for option in self.options if not option.values), "", self.instead)


def _repeats(option: Option, options: Sequence[Option]) -> bool:
    """Whether an earlier option includes everything that this one sets."""
    before = options[: options.index(option)]
    return any(option.values.items() <= other.values.items() for other in before)


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """State of a run for which a hint is made.

    Attributes:
        start: The initial scenario.
        scenario: The scenario with the timed changes so far.
        last: Last row of the trace.
    """

    start: HandScenario
    scenario: HandScenario
    last: Trace

    @property
    def controller(self) -> AnyController:
        """The controller at that time."""
        return of_hand(self.scenario).controller

    @property
    def law(self) -> ControlLaw:
        """Facts about the control law."""
        return law_of(self.controller.kind)

    @property
    def exhausted(self) -> tuple[int, str, float] | None:
        """A saturated joint with key and value of its limit; None if there is none."""
        torques = np.abs(self.last.joint_torque[0])
        for k, (key, limit) in enumerate(self.scenario.torque_limits):
            if limit is not None and torques[k] >= limit:
                return k, key, limit
        return None


@lru_cache(maxsize=16)
def scenario_at(scenario: Scenario, time: float) -> Scenario:
    """Returns a scenario with the timed changes before a time [s], and without later ones.

    Cached, because a description of a run needs it several times.
    """
    due = sorted((c for c in scenario.changes if c.time < time), key=lambda change: change.time)
    values = {c.parameter: list(c.value) if isinstance(c.value, tuple) else c.value for c in due}
    return with_values(replace(scenario, changes=()), values, with_law=False)


def any_of(
    *options: Iterable[Option],
    otherwise: str = _OUTSIDE,
    purpose: str = "",
    instead: str = "",
    goal: Goal = Goal.HOLD,
    risky: Iterable[Option] = (),
) -> Hint:
    """Returns a hint with the given options, each once.

    Args:
        options: Groups of options, which may be empty.
        otherwise: Hint if there are no options.
        purpose: Purpose of the options.
        instead: Changes outside the controller.
        goal: Criterion of success.
        risky: Further options that are only offered after a trial.
    """
    found = tuple({option.words: option for several in options for option in several}.values())
    others = tuple(risky)
    if not found and not others and not instead:
        found = (Option(otherwise),)
    return Hint(found, purpose if found or others else "", instead, goal, others)
