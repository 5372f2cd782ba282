"""Trials of hints: each option in a separate run; only successful options are reported.

The budget counts runs and chunks of computation, not time, so that the same run gives the same
hints. Callers can stop the trials at any time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from typing import NamedTuple

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.result import RunResult, RunSummary
from slipgrasp.core.run.simulator import summarise
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.custom_laws import law_of
from slipgrasp.core.scenario.law_choice import LAW, with_law
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.trace.types import Outcome
from slipgrasp.core.words.hints import Goal, Hint
from slipgrasp.core.words.options import Option
from slipgrasp.core.words.phrases import joined, length_words, milliseconds

AnyRun = RunResult | RunSummary
Stop = Callable[[], bool]
Simulate = Callable[[Scenario, Stop], AnyRun]
Follow = Callable[[Option], Scenario]

_BETTER = 0.8
"""Fraction below which a slip or an error counts as reduced."""
_SAME = 1.05
"""Fraction up to which a slip or an error counts as unchanged."""
_SLIP, _OFFSET, _ANGLE = 1e-4, 1e-3, 1e-2
"""Slips, distances and angles below these count as zero [m, m, rad]."""
_NOISE = 1e-6
"""Difference of slip and distance below which no option is preferred [m]."""
_LEAST_DURATION = 0.5
"""Shortest run that shows whether its object is held [s]."""
_FORCE = 1.5
"""Smallest relative increase of the normal force that is reported."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """Budget of trials.

    Attributes:
        runs: Largest number of options.
        pieces: Largest number of chunks of at most 1000 steps, in all runs together.
        pieces_per_run: The same for one run; longer runs are abandoned.
        enough: Number of successful options after which trials end.
    """

    runs: int = 14
    pieces: int = 300
    pieces_per_run: int = 60
    enough: int = 3


@dataclass(frozen=True, slots=True)
class TriedOption:
    """A successful option.

    Attributes:
        option: The option.
        effect: Its effect, as a clause: ``held instead of lost at 0.31 s``.
    """

    option: Option
    effect: str


@dataclass(frozen=True, slots=True)
class TriedHint:
    """The result of trying a hint.

    Attributes:
        hint: The hint.
        helpful: The successful options, the best first.
        count: Number of completed trials.
    """

    hint: Hint
    helpful: tuple[TriedOption, ...] = ()
    count: int = 0

    def __str__(self) -> str:
        """The hint as a clause, without capital letter and full stop."""
        if not self.count:
            return str(self.hint)
        options = [f"{each.option.words} ({each.effect})" for each in self.helpful]
        told = joined(options, "or") or self.failure
        return "; or ".join(filter(None, [told, str(self.hint.rest)]))

    @property
    def failure(self) -> str:
        """A clause if no option helps; else empty."""
        if self.helpful or not self.count:
            return ""
        changes = f"none of {self.count} changes" if self.count > 1 else "the one change"
        return f"{changes} tried {_FAILED[self.hint.goal]}"


_FAILED = {
    Goal.HOLD: "holds the object",
    Goal.LESS_SLIP: "reduces the slip without other disadvantages",
    Goal.NEARER: "brings the object nearer to its target without other disadvantages",
}


def follow(scenario: Scenario, option: Option) -> Scenario:
    """Returns the scenario with an option applied to the whole run.

    Raises:
        ScenarioError: If the scenario does not allow the option.
    """
    values = {key: value for key, value in option.values.items() if key != LAW}
    if LAW in option.values:
        scenario = with_law(scenario, str(option.values[LAW]))
    kept = tuple(change for change in scenario.changes if change.parameter not in values)
    return with_values(replace(scenario, changes=kept), values)


def try_hint(
    before: AnyRun,
    hint: Hint,
    *,
    budget: Budget = Budget(),
    follow_option: Follow | None = None,
    simulate: Simulate | None = None,
    should_stop: Stop = lambda: False,
) -> TriedHint:
    """Tries the options of a hint one after the other, and ranks the successful ones.

    Options that would run a custom law are not tried, because such a law may have side effects.

    Args:
        before: The run of the hint.
        hint: The hint.
        budget: Budget of trials.
        follow_option: Returns the scenario with an option applied.
        simulate: Returns the run of a scenario, ``stopped`` on request.
        should_stop: Called after every chunk; True ends the trials.
    """
    found: list[_Found] = []
    count, meter = 0, _Meter(budget, should_stop)
    for option, scenario in islice(_runnable(before.scenario, hint, follow_option), budget.runs):
        if meter.is_over or len(_without_more(found)) >= budget.enough:
            break
        if _adds(option, found):
            continue
        after = (simulate or summarise)(scenario, meter.begin())
        if after.outcome in (Outcome.STOPPED, Outcome.LIMIT):
            continue
        count += 1
        judgement = judge(before, after, hint.goal)
        if judgement.helps:
            found.append((judgement, TriedOption(option, judgement.effect)))
    ranked = sorted(_without_more(found), key=lambda each: each[0].cost)
    return TriedHint(hint, tuple(tried for _, tried in ranked), count)


def _without_more(found: list[_Found]) -> list[_Found]:
    """Successful options, without those that extend another successful one."""
    return [each for each in found if not _adds(each[1].option, found)]


def _adds(option: Option, found: list[_Found]) -> bool:
    """True if an option includes everything that another successful option sets."""
    values = option.values.items()
    return any(tried.option.values.items() < values for _, tried in found)


class Judgement(NamedTuple):
    """Comparison of a run with another one with respect to a goal.

    Attributes:
        helps: True if it is better.
        cost: Value for ranking; smaller is better.
        effect: The difference as a clause.
    """

    helps: bool
    cost: float
    effect: str


def judge(before: AnyRun, after: AnyRun, goal: Goal) -> Judgement:
    """Compares a run with an option applied to the run before.

    If the goal is to hold the object, it must be held. Otherwise the slip or the distance from the
    target, depending on the goal, must decrease by a fifth; the object must stay held, and neither
    the other quantity nor the angle may increase.
    """
    old, new = _measure(before), _measure(after)
    effect = _effect(old, new)
    if goal is Goal.HOLD:
        told = (f"held instead of {_ending(before)}", *_prices(old, new))
        cost = max(new.slip, _NOISE) + max(new.offset, _NOISE)
        return Judgement(new.held and not old.held, cost, ", ".join(told))
    if not new.held or new.angle > max(_SAME * old.angle, _ANGLE):
        return Judgement(False, math.inf, effect)
    slips_less, is_nearer = new.slip <= _BETTER * old.slip, new.offset <= _BETTER * old.offset
    if goal is Goal.LESS_SLIP:
        helps = slips_less and new.offset <= max(_SAME * old.offset, _OFFSET)
        return Judgement(helps, max(new.slip, _NOISE), effect)
    helps = is_nearer and new.slip <= max(_SAME * old.slip, _SLIP)
    return Judgement(helps, max(new.offset, _NOISE), effect)


_Found = tuple[Judgement, TriedOption]


class _Measures(NamedTuple):
    """Quantities for comparing runs: slip and distance [m], angle [rad], normal force [N]."""

    held: bool
    slip: float
    offset: float
    angle: float
    force: float


def _measure(run: AnyRun) -> _Measures:
    metrics, ways = run.metrics, run.scenario.space.num_positions
    error = metrics.final_tracking_error
    return _Measures(
        bool(metrics.held),
        max(metrics.slip_path),
        math.hypot(*error[:ways]),
        math.hypot(*error[ways:]),
        max(metrics.peak_normal_force),
    )


def _effect(old: _Measures, new: _Measures) -> str:
    """Describes the reductions for a held object, and the increase of the force."""
    told = []
    if new.slip <= _BETTER * old.slip and old.slip >= _NOISE:
        told.append(f"slip {length_words(new.slip)} instead of {length_words(old.slip)}")
    if new.offset <= _BETTER * old.offset and old.offset >= _OFFSET:
        told.append(f"{length_words(new.offset)} off instead of {length_words(old.offset)}")
    if new.force >= _FORCE * old.force:
        told.append(f"normal force up to {new.force:.3g} N instead of {old.force:.3g} N")
    return ", ".join(told)


def _prices(old: _Measures, new: _Measures) -> Iterator[str]:
    """Describes the slip and forces with which a previously lost object is held."""
    if new.slip >= _OFFSET:
        yield f"slip {length_words(new.slip)}"
    if new.offset >= _OFFSET:
        yield f"{length_words(new.offset)} off"
    # A lost object may have been lost before it was grasped firmly.
    if new.force >= _FORCE * old.force:
        yield f"normal force up to {new.force:.3g} N"


def _ending(run: AnyRun) -> str:
    """Describes the end of a run that did not hold its object, as a clause."""
    if run.outcome is Outcome.COMPLETED:
        return "still slipping" if run.metrics.slipping_at_end else "not yet at rest"
    lost = run.outcome in (Outcome.SEPARATED, Outcome.LEFT_FACE)
    return f"{'lost' if lost else 'ended'} at {milliseconds(run.end_time)}"


def _runnable(
    before: Scenario, hint: Hint, follow_option: Follow | None
) -> Iterator[tuple[Option, Scenario]]:
    """Options that can be tried, each with its scenario; none if the run is too short."""
    known = [before]
    for option in hint.trials:
        try:
            scenario = follow_option(option) if follow_option else follow(before, option)
        except ScenarioError:
            continue
        is_told = scenario.simulation.duration >= _LEAST_DURATION
        if is_told and scenario not in known and not _runs_custom_law(scenario):
            known.append(scenario)
            yield option, scenario


def _runs_custom_law(scenario: Scenario) -> bool:
    kinds = [change.value for change in scenario.changes if change.parameter == LAW]
    return any(law_of(str(kind)).is_own for kind in (scenario.controller.kind, *kinds))


class _Meter:
    """Counts the chunks of computation of trials.

    Args:
        budget: Budget of trials.
        should_stop: Called after every chunk.
    """

    def __init__(self, budget: Budget, should_stop: Stop) -> None:
        self._budget, self._should_stop = budget, should_stop
        self._pieces = 0
        self._is_stopped = False

    @property
    def is_over(self) -> bool:
        """True if the trials should end."""
        return self._is_stopped or self._pieces >= self._budget.pieces or self._should_stop()

    def begin(self) -> Stop:
        """Returns the stop condition of another run, checked after every chunk."""
        last = min(self._pieces + self._budget.pieces_per_run, self._budget.pieces)

        def should_stop() -> bool:
            self._pieces += 1
            self._is_stopped = self._is_stopped or self._should_stop()
            return self._is_stopped or self._pieces >= last

        return should_stop
