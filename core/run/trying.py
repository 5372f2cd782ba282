"""Hints that were tried: each option in a separate run; only options that help are reported.

Nothing here reads a clock: how much is tried is counted in runs and in pieces of computing, so
that the same run gives the same hints; a caller who has no more patience cuts the rest off.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from typing import NamedTuple

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.result import RunResult, RunSummary
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import run_to_end
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
"""Share of a slip or an error to which it must fall to be called less."""
_SAME = 1.05
"""Share of a slip or an error up to which it has not grown."""
_SLIP, _OFFSET, _ANGLE = 1e-4, 1e-3, 1e-2
"""Slip, distance and angle below these are as good as none [m, m, rad]."""
_NOISE = 1e-6
"""Slip and distance between which no hint is preferred to another [m]."""
_LEAST_DURATION = 0.5
"""Shortest run that shows whether its object is held [s]."""
_FORCE = 1.5
"""Smallest relative increase of the normal force that is reported."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """How much may be tried.

    Attributes:
        runs: Options at most.
        pieces: Pieces of at most 1000 steps, in all runs together.
        pieces_per_run: The same of one run; what takes longer is not tried.
        enough: Options that help, after which no more are tried.
    """

    runs: int = 14
    pieces: int = 300
    pieces_per_run: int = 60
    enough: int = 3


@dataclass(frozen=True, slots=True)
class TriedOption:
    """An option that helps.

    Attributes:
        option: What to set.
        effect: What that changes, as a part of a sentence: ``held instead of lost at 0.31 s``.
    """

    option: Option
    effect: str


@dataclass(frozen=True, slots=True)
class TriedHint:
    """What came of trying a hint.

    Attributes:
        hint: The hint.
        helpful: The options that help, the best first.
        count: How many were tried to their ends.
    """

    hint: Hint
    helpful: tuple[TriedOption, ...] = ()
    count: int = 0

    def __str__(self) -> str:
        """The hint as a sentence without its capital letter and full stop."""
        if not self.count:
            return str(self.hint)
        options = [f"{each.option.words} ({each.effect})" for each in self.helpful]
        told = joined(options, "or") or self.failure
        return "; or ".join(filter(None, [told, str(self.hint.rest)]))

    @property
    def failure(self) -> str:
        """That nothing tried helps, as a part of a sentence; else empty."""
        if self.helpful or not self.count:
            return ""
        changes = f"none of {self.count} changes" if self.count > 1 else "the one change"
        return f"{changes} tried {_FAILED[self.hint.goal]}"


_FAILED = {
    Goal.HOLD: "holds the object",
    Goal.LESS_SLIP: "lessens the slip without a loss elsewhere",
    Goal.NEARER: "brings the object nearer to its target without a loss elsewhere",
}


def follow(scenario: Scenario, option: Option) -> Scenario:
    """The scenario in which an option is followed, on the whole run.

    Raises:
        ScenarioError: If the scenario does not allow it.
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
    """Tries the options of a hint one after the other, and ranks those that help.

    Options that would run a custom law again, which may do anything, are not tried.

    Args:
        before: The run that the hint is about.
        hint: What may help.
        budget: How much may be tried.
        follow_option: Gives the scenario in which an option is followed.
        simulate: Gives the run of a scenario, ``stopped`` if it was asked to.
        should_stop: Asked after every piece whether nobody wants to know any more.
    """
    found: list[_Found] = []
    count, meter = 0, _Meter(budget, should_stop)
    for option, scenario in islice(_runnable(before.scenario, hint, follow_option), budget.runs):
        if meter.is_over or len(_without_more(found)) >= budget.enough:
            break
        if _adds(option, found):
            continue
        after = (simulate or _summarise)(scenario, meter.begin())
        if after.outcome in (Outcome.STOPPED, Outcome.LIMIT):
            continue
        count += 1
        judgement = judge(before, after, hint.goal)
        if judgement.helps:
            found.append((judgement, TriedOption(option, judgement.effect)))
    ranked = sorted(_without_more(found), key=lambda each: each[0].cost)
    return TriedHint(hint, tuple(tried for _, tried in ranked), count)


def _without_more(found: list[_Found]) -> list[_Found]:
    """What helps, without options that set more than another one that helps alone."""
    return [each for each in found if not _adds(each[1].option, found)]


def _adds(option: Option, found: list[_Found]) -> bool:
    """Whether an option sets all that another one sets that helps, and more."""
    values = option.values.items()
    return any(tried.option.values.items() < values for _, tried in found)


class Judgement(NamedTuple):
    """Whether a run is better than another for some goal.

    Attributes:
        helps: Whether it is.
        cost: The less of that the better.
        effect: What is different, as a part of a sentence.
    """

    helps: bool
    cost: float
    effect: str


def judge(before: AnyRun, after: AnyRun, goal: Goal) -> Judgement:
    """Compares the run in which an option is followed with the one before.

    A lost object is to be held. Of a held one the slip, or its distance from where it was
    wanted, is to fall by a fifth, while it stays held and neither the other nor its angle grows.
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
    """What runs are compared by: slip and distance [m], angle [rad], normal force [N]."""

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
    """What is less of a held object, and how much more force it takes, in words."""
    told = []
    if new.slip <= _BETTER * old.slip and old.slip >= _NOISE:
        told.append(f"slip {length_words(new.slip)} instead of {length_words(old.slip)}")
    if new.offset <= _BETTER * old.offset and old.offset >= _OFFSET:
        told.append(f"{length_words(new.offset)} off instead of {length_words(old.offset)}")
    if new.force >= _FORCE * old.force:
        told.append(f"normal force up to {new.force:.3g} N instead of {old.force:.3g} N")
    return ", ".join(told)


def _prices(old: _Measures, new: _Measures) -> Iterator[str]:
    """What holding an object costs that was not held before, in words."""
    if new.slip >= _OFFSET:
        yield f"slip {length_words(new.slip)}"
    if new.offset >= _OFFSET:
        yield f"{length_words(new.offset)} off"
    # A lost object may have been lost before it was pressed at all.
    if new.force >= _FORCE * old.force:
        yield f"normal force up to {new.force:.3g} N"


def _ending(run: AnyRun) -> str:
    """How a run that did not hold its object ended, as a part of a sentence."""
    if run.outcome is Outcome.COMPLETED:
        return "still slipping" if run.metrics.slipping_at_end else "not yet at rest"
    lost = run.outcome in (Outcome.SEPARATED, Outcome.LEFT_FACE)
    return f"{'lost' if lost else 'ended'} at {milliseconds(run.end_time)}"


def _runnable(
    before: Scenario, hint: Hint, follow_option: Follow | None
) -> Iterator[tuple[Option, Scenario]]:
    """The options that can be tried, each with its scenario; no run that is too short."""
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
    """Counts the pieces of computing that trials take.

    Args:
        budget: How many there may be.
        should_stop: Asked after every piece.
    """

    def __init__(self, budget: Budget, should_stop: Stop) -> None:
        self._budget, self._should_stop = budget, should_stop
        self._pieces = 0
        self._is_stopped = False

    @property
    def is_over(self) -> bool:
        """Whether nothing more is to be tried."""
        return self._is_stopped or self._pieces >= self._budget.pieces or self._should_stop()

    def begin(self) -> Stop:
        """What one more run asks after every piece."""
        last = min(self._pieces + self._budget.pieces_per_run, self._budget.pieces)

        def should_stop() -> bool:
            self._pieces += 1
            self._is_stopped = self._is_stopped or self._should_stop()
            return self._is_stopped or self._pieces >= last

        return should_stop


def _summarise(scenario: Scenario, should_stop: Stop) -> RunSummary:
    simulation = Simulation(scenario, keep_trace=False)
    run_to_end(simulation, lambda _: None, should_stop=should_stop)
    return simulation.summary()
