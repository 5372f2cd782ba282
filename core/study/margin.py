"""The range of a parameter over which the grasp holds, by bracketing of its boundary."""

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
"""Two values of the parameter: the object is held at the first one only."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Margin:
    """Two close values of a parameter: the object is held at one only.

    Attributes:
        key: Dotted key of the parameter.
        unit: Its SI unit, "1" for pure numbers.
        held_at: Value at which the object is held.
        lost_at: Value at which it is not.
        held: The run at ``held_at``.
        lost: The run at ``lost_at``.
        others: Further boundaries in the range, located coarsely, the nearest first; empty if there
            is only one.
        runs: Number of runs.
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
        """The outcome of the run at ``lost_at``."""
        return self.lost.outcome

    @property
    def reason(self) -> str:
        """Reason why the object is not held at ``lost_at``."""
        if self.lost.reason is not None:
            return self.lost.reason.message
        if self.lost.metrics.held:
            return f"a fingertip slipped {length_words(max(self.lost.metrics.slip_path))}"
        slipping = self.lost.metrics.slipping_at_end
        return "still slipping at the end" if slipping else "only just stopped slipping at the end"

    @property
    def beyond(self) -> str:
        """Outcome beyond the boundary in one or two words."""
        if self.outcome.ended_by_physics:
            return "lost"
        if self.outcome is not Outcome.COMPLETED:
            return "not finished"
        if self.lost.metrics.held:
            return "slips too far"
        return "still slipping" if self.lost.metrics.slipping_at_end else "not settled"

    def to_mapping(self) -> dict[str, Any]:
        """The result without its runs, as plain values for JSON."""
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
    """Both ends of the range agree, so that no boundary can be bracketed.

    Attributes:
        ends: Both ends of the range.
        held: Whether the object is held at both ends.
        between: The first scanned value with a different outcome, None if there is none.
        runs: Number of runs.
        are_equal: Whether the metrics of all runs are equal.
    """

    def __init__(
        self,
        ends: tuple[float, float],
        *,
        held: bool,
        between: float | None,
        runs: int,
        are_equal: bool = False,
    ) -> None:
        self.ends, self.held, self.between, self.runs = ends, held, between, runs
        start, stop = ends
        found = f"held at {'both ends' if held else 'neither end'}, {start:.6g} and {stop:.6g}"
        if are_equal:
            super().__init__(f"{found}, and makes no difference: all metrics are equal")
        elif between is None:
            super().__init__(f"{found}: widen the range")
        else:
            word = "not held" if held else "held"
            super().__init__(
                f"{found}, but {word} at {between:.6g}: use it as one end of the range"
            )

    def to_mapping(self) -> dict[str, Any]:
        """The result as plain values for JSON, with the names of `Margin.to_mapping`."""
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
    """Finds the boundary of the range of a parameter over which the grasp holds.

    Both ends and 15 values between them are simulated on all processors, so that several boundaries
    are noticed; the one closest to the end that holds is then bisected. The result does not depend
    on the number of processors.

    Args:
        scenario: Base scenario.
        key: Dotted key of a number; ``fingers.*.friction`` sets all fingers equally.
        start: One end of the range, in the unit of the parameter; rounded for integers.
        stop: The other end, larger or smaller.
        tolerance: Largest distance of the two values, as a fraction of the range; at least 1 for
            integers.
        most_slip: An object that slips further on any fingertip counts as not held [m].
        progress: Called with the completed fraction, 0 to 1, after every run.

    Raises:
        ScenarioError: If the parameter does not exist, a value is not allowed, or runs are too
            short to decide whether the object is held.
        MarginError: If the object is held at both ends or at neither.
    """
    span = ParameterRange.of(scenario, key, start, stop)
    _check_tolerance(tolerance)
    if not most_slip >= 0.0:
        message = f"the slip limit is {most_slip:g} m; it must be 0 or more"
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
        message = f"tolerance is {tolerance:g}, as a fraction of the range; allowed: {limit}"
        raise single_error("tolerance", tolerance, limit, message)


class _Probe:
    """Simulates at values of a range, and reports the progress.

    Args:
        span: The range.
        most_slip: Largest slip of a held object on any fingertip [m].
        planned: Approximate number of runs.
        progress: Called with the completed fraction after every run.
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
        self._metrics: set[str] = set()
        self._planned = planned
        self._progress = progress

    def hold(self, values: Sequence[float]) -> list[bool]:
        """Whether the object is held at each of the values.

        Raises:
            ScenarioError: If a value is not allowed (before any simulation), or if its run is too
                short to decide.
        """
        scenarios = [self.span.scenario_at(value) for value in values]
        flags: list[bool] = []
        # Closed immediately after an interrupt, so that unneeded runs end.
        with closing(simulate_many(scenarios)) as runs:
            for run in runs:
                held = _known(run.metrics.held, run.scenario)
                flags.append(held and max(run.metrics.slip_path) <= self._most_slip)
                self._metrics.add(repr(run.metrics))
                self._count_run()
        return flags

    @property
    def are_equal(self) -> bool:
        """Whether all runs so far have equal metrics."""
        return len(self._metrics) == 1

    def simulate(self, value: float) -> RunResult:
        """The complete run at a value."""
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
    """The boundaries between neighbouring values, from the end at which the object is held.

    Raises:
        MarginError: If the object is held at both ends or at neither.
    """
    flags = probe.hold(values)
    if flags[0] == flags[-1]:
        differing = (v for v, held in zip(values, flags, strict=True) if held != flags[0])
        ends, between = (values[0], values[-1]), next(differing, None)
        raise MarginError(
            ends, held=flags[0], between=between, runs=probe.runs, are_equal=probe.are_equal
        )
    found = list(zip(values, flags, strict=True))
    return list(_borders(found if flags[0] else found[::-1]))


def _borders(found: list[tuple[float, bool]]) -> Iterator[Border]:
    for (value, held), (following, held_there) in pairwise(found):
        if held != held_there:
            yield value, following


def _bisect(probe: _Probe, border: Border, width: float) -> Border:
    """Bisects a boundary to a width, or to neighbouring integers: held at, lost at."""
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
