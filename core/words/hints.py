"""What to try next: only what the control law uses and what is not so already.

Every hint is a list of options, each of which names parameters by their dotted keys, with the
present value where a larger or a smaller one is meant. Where a scenario leaves none of them open,
the hint says what is left outside the controller.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from slipgrasp.core.scenario import ControlLaw, Scenario
from slipgrasp.core.scenario.custom_laws import law_of
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.scenario.scenario import AnyController
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.words.options import Option
from slipgrasp.core.words.phrases import joined

_OFFERED = 3
_RISK = "which lost some held objects"
_OUTSIDE = "no setting of this law is left to try: make the object lighter or its faces rougher"


class Goal(StrEnum):
    """What a hint is for."""

    HOLD = "hold the object"
    LESS_SLIP = "lessen the slip"
    NEARER = "bring the object nearer to its target"
    MARGIN = "find how little is enough"


@dataclass(frozen=True, slots=True)
class Hint:
    """What to try next.

    Attributes:
        options: Any of them, the most successful first; the first few that can be followed as
            they stand are offered where nothing can be tried, and all that cannot.
        purpose: What they are for, such as ``for less slip``; empty if that is plain.
        instead: What could be done outside the controller; empty if there is nothing else.
        goal: The criterion by which one of them helps.
        risky: More of them, each of which made some run worse: only for those who try it first.
    """

    options: tuple[Option, ...]
    purpose: str = ""
    instead: str = ""
    goal: Goal = Goal.HOLD
    risky: tuple[Option, ...] = ()

    def __str__(self) -> str:
        """The hint as a sentence without its capital letter and full stop."""
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
        """Every option that can be followed as it stands, once."""
        options = (*self.options, *self.risky)
        return tuple({option.words: option for option in options if option.values}.values())

    @property
    def rest(self) -> Hint:
        """What it says besides the trials and their purpose."""
        return Hint(tuple(option for option in self.options if not option.values), "", self.instead)


def _repeats(option: Option, options: Sequence[Option]) -> bool:
    """Whether an option before this one sets all that this one sets, and more."""
    before = options[: options.index(option)]
    return any(option.values.items() <= other.values.items() for other in before)


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """Where a run stands when something is to be tried.

    Attributes:
        start: The scenario as the run began.
        scenario: The scenario with the timed changes so far.
        last: Trace of the last row.
    """

    start: Scenario
    scenario: Scenario
    last: Trace

    @property
    def controller(self) -> AnyController:
        """The controller of that time."""
        return self.scenario.controller

    @property
    def law(self) -> ControlLaw:
        """Facts about its law."""
        return law_of(self.controller.kind)

    @property
    def exhausted(self) -> tuple[int, str, float] | None:
        """A joint that gives all that it may, and key and value of its limit; None if none does."""
        torques = np.abs(self.last.joint_torque[0])
        limits = [("actuation.torque_limit", self.scenario.actuation.torque_limit)] * len(torques)
        if isinstance(self.scenario, SpatialScenario):
            limits = self.scenario.torque_limits
        for k, (key, limit) in enumerate(limits):
            if limit is not None and torques[k] >= limit:
                return k, key, limit
        return None


def scenario_at(scenario: Scenario, time: float) -> Scenario:
    """A scenario with the timed changes before some time, and without those to come [s]."""
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
    """A hint to try any of some options, each once.

    Args:
        options: Each of them none, one or several.
        otherwise: The hint where there is none.
        purpose: What they are for.
        instead: What could be done besides.
        goal: The criterion by which one of them helps.
        risky: More of them, only for those who try them first.
    """
    found = tuple({option.words: option for several in options for option in several}.values())
    others = tuple(risky)
    if not found and not others and not instead:
        found = (Option(otherwise),)
    return Hint(found, purpose if found or others else "", instead, goal, others)
