"""How far a parameter can go before the object is not held any more: a border, by bracketing."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.run.batch import simulate_many
from slipgrasp.core.run.metrics import HOLD_WINDOW
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.field_errors import single_error
from slipgrasp.core.study.parameter_range import ParameterRange
from slipgrasp.core.trace.types import Outcome
from slipgrasp.core.words.phrases import length_words

DEFAULT_TOLERANCE = 1e-3
_LEAST_TOLERANCE = 1e-12
_LARGEST_TOLERANCE = 0.1
_SCANNED_STEPS = 16

Border = tuple[float, float]
"""Two values of the parameter: the object is held at the first of them, not at the other."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Margin:
    """Two values of a parameter near each other: at one the object is held, at the other not.

    Attributes:
        key: Dotted key of the parameter.
        unit: Its SI unit, "1" for pure numbers.
        held_at: Where the object is still held.
        lost_at: Where it is not.
        held: The run at ``held_at``.
        lost: The run at ``lost_at``.
        others: Further borders that the scan of the range met, coarsely, in the order in which
            they come beyond this one; empty if there is only one.
        runs: How many runs it took.
    """

    key: str
    unit: str
    held_at: float
    lost_at: float
    held: RunResult
    lost: RunResult
    others: tuple[Border, ...]
    runs: int

    @property
    def outcome(self) -> Outcome:
        """How the run at ``lost_at`` ended."""
        return self.lost.outcome

    @property
    def reason(self) -> str:
        """Why the object is not held at ``lost_at``, in words."""
        if self.lost.reason is not None:
            return self.lost.reason.message
        if self.lost.metrics.held:
            return f"a fingertip slipped {length_words(max(self.lost.metrics.slip_path))}"
        slipping = self.lost.metrics.slipping_at_end
        return "still slipping at the end" if slipping else "only just stopped slipping at the end"

    @property
    def beyond(self) -> str:
        """What becomes of the object beyond the border, in a word or two: lost, or what else."""
        if self.outcome.ended_by_physics:
            return "lost"
        if self.outcome is not Outcome.COMPLETED:
            return "not finished"
        if self.lost.metrics.held:
            return "slips too far"
        return "still slipping" if self.lost.metrics.slipping_at_end else "not settled"

    def to_mapping(self) -> dict[str, Any]:
        """The answer without its runs, as plain values for JSON."""
        return {
            "key": self.key,
            "unit": self.unit,
            "held_at": self.held_at,
            "lost_at": self.lost_at,
            "outcome": self.outcome.value,
            "reason": self.reason,
            "crossings": 1 + len(self.others),
            "others": [list(border) for border in self.others],
            "runs": self.runs,
            **self.held.knowledge.to_mapping(),
        }


class MarginError(SlipgraspError):
    """Both ends of the range agree, so that no border between them can be bracketed.

    Attributes:
        ends: Both ends.
        held: Whether the object is held at both, or at neither.
        between: The first scanned value between them where it is otherwise, None if nowhere.
        runs: How many runs it took to find out.
    """

    def __init__(
        self, ends: tuple[float, float], *, held: bool, between: float | None, runs: int
    ) -> None:
        self.ends, self.held, self.between, self.runs = ends, held, between, runs
        start, stop = ends
        found = f"held at {'both ends' if held else 'neither end'}, {start:.6g} and {stop:.6g}"
        if between is None:
            super().__init__(f"{found}: widen the range")
        else:
            word = "not held" if held else "held"
            super().__init__(f"{found}, but {word} at {between:.6g}: begin or end the range there")

    def to_mapping(self) -> dict[str, Any]:
        """The finding as plain values for JSON, with the names of `Margin.to_mapping`."""
        return {
            "held_at": None,
            "lost_at": None,
            "outcome": None,
            "reason": str(self),
            "runs": self.runs,
        }


def find_margin(
    scenario: Scenario,
    key: str,
    start: float,
    stop: float,
    *,
    tolerance: float = DEFAULT_TOLERANCE,
    most_slip: float = math.inf,
    progress: Callable[[float], None] | None = None,
) -> Margin:
    """Finds how far a parameter can go before the object is not held any more.

    Both ends and 15 values between them are simulated on all processors, so that more than one
    border is noticed; that next to the end that holds is then bisected. The answer does not
    depend on the number of processors.

    Args:
        scenario: What to simulate.
        key: Dotted key of a number; ``fingers.*.friction`` sets all fingers alike.
        start: One end of the range, in the unit of the parameter; rounded for whole numbers.
        stop: The other end, above or below.
        tolerance: How near the two values are to be, as a share of the range; whole numbers
            end up next to each other at most.
        most_slip: An object that slips further than this on any fingertip counts as not held [m].
        progress: Called with the share that is done, 0 to 1, after every run.

    Raises:
        ScenarioError: If there is no such number, or it is not allowed to be so, or runs are too
            short to decide whether the object is held.
        MarginError: If both ends hold, or neither.
    """
    span = ParameterRange.of(scenario, key, start, stop)
    _check_tolerance(tolerance)
    if not most_slip >= 0.0:
        message = f"the most slip is {most_slip:g} m; it must be 0 or more"
        raise single_error("most_slip", most_slip, ">= 0", message)
    values = span.divided(_SCANNED_STEPS)
    halvings = max(0, math.ceil(-math.log2(tolerance * _SCANNED_STEPS)))
    probe = _Probe(span, most_slip, len(values) + halvings + 2, progress)
    border, *others = _scan(probe, values)
    held_at, lost_at = _bisect(probe, border, tolerance * span.width)
    return Margin(
        key=key,
        unit=span.unit,
        held_at=held_at,
        lost_at=lost_at,
        held=probe.simulate(held_at),
        lost=probe.simulate(lost_at),
        others=tuple(others),
        runs=probe.runs,
    )


def _check_tolerance(tolerance: float) -> None:
    if not _LEAST_TOLERANCE <= tolerance <= _LARGEST_TOLERANCE:
        limit = f"{_LEAST_TOLERANCE:g} … {_LARGEST_TOLERANCE:g}"
        message = f"tolerance is {tolerance:g}, a share of the range; allowed: {limit}"
        raise single_error("tolerance", tolerance, limit, message)


class _Probe:
    """Simulates at values of a range, and reports its progress.

    Args:
        span: The range.
        most_slip: How far a fingertip of a held object may slip [m].
        planned: How many runs there will be, about.
        progress: Called with the share that is done after every run.
    """

    def __init__(
        self,
        span: ParameterRange,
        most_slip: float,
        planned: int,
        progress: Callable[[float], None] | None,
    ) -> None:
        self.span = span
        self._most_slip = most_slip
        self.runs = 0
        self._planned = planned
        self._progress = progress

    def hold(self, values: Sequence[float]) -> list[bool]:
        """Whether the object is held at each of these values.

        Raises:
            ScenarioError: If one is not allowed, then nothing was simulated; or if its run is too
                short to decide.
        """
        scenarios = [self.span.scenario_at(value) for value in values]
        flags: list[bool] = []
        # Closed at once when interrupted: runs that nobody waits for end then.
        with closing(simulate_many(scenarios)) as runs:
            for run in runs:
                held = _known(run.metrics.held, run.scenario)
                flags.append(held and max(run.metrics.slip_path) <= self._most_slip)
                self._count_run()
        return flags

    def simulate(self, value: float) -> RunResult:
        """The whole run at a value."""
        result = simulate(self.span.scenario_at(value))
        self._count_run()
        return result

    def _count_run(self) -> None:
        self.runs += 1
        if self._progress is not None:
            self._progress(min(self.runs / self._planned, 1.0))


def _known(held: bool | None, scenario: Scenario) -> bool:
    """Whether the object is held.

    Raises:
        ScenarioError: If the run is too short to decide.
    """
    if held is None:
        key, duration, limit = "simulation.duration", scenario.simulation.duration, HOLD_WINDOW
        message = (
            f"{key} is {duration:g} s; at least {limit:g} s are needed to decide whether the "
            "object is held"
        )
        raise single_error(key, duration, f">= {limit:g}", message)
    return held


def _scan(probe: _Probe, values: list[float]) -> list[Border]:
    """The borders between neighbours, from the end that holds on.

    Raises:
        MarginError: If both ends hold, or neither.
    """
    flags = probe.hold(values)
    if flags[0] == flags[-1]:
        differing = (v for v, held in zip(values, flags, strict=True) if held != flags[0])
        ends, between = (values[0], values[-1]), next(differing, None)
        raise MarginError(ends, held=flags[0], between=between, runs=probe.runs)
    found = list(zip(values, flags, strict=True))
    return list(_borders(found if flags[0] else found[::-1]))


def _borders(found: list[tuple[float, bool]]) -> Iterator[Border]:
    for (value, held), (following, held_there) in pairwise(found):
        if held != held_there:
            yield value, following


def _bisect(probe: _Probe, border: Border, width: float) -> Border:
    """Narrows a border down to a width, or to neighbouring numbers: held at, lost at."""
    held_at, lost_at = border
    while abs(lost_at - held_at) > width:
        middle = probe.span.between(held_at, lost_at)
        if middle in (held_at, lost_at):
            break
        if probe.hold([middle])[0]:
            held_at = middle
        else:
            lost_at = middle
    return held_at, lost_at
