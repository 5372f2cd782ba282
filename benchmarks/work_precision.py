"""Accuracy and cost of the slip of the paper's cases and its end, here and in other engines.

Other engines use the torques of our run (`benchmarks.replay`), so that their cost is that of
stepping alone; ours includes the controller, its adaptation and the trace. Their event is not
rounded to a step but extrapolated: the zero of the line through the slip speeds of two late steps.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.mujoco_replay import replay_in_mujoco
from benchmarks.mujoco_torques import stepping
from benchmarks.replay import (
    CASES,
    DURATION,
    Replay,
    extrapolated_ends,
    record_case,
    slip_ends,
)
from benchmarks.report import Table
from benchmarks.timing import MILLISECONDS, median_seconds
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values

ROUNDS = 9
OUR_ROUNDS = 45  # a run takes a millisecond or two
TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11)
MUJOCO_STEPS = (1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5)  # [s]
DRAKE_STEPS = (1e-3, 5e-4, 2e-4, 1e-4, 5e-5)  # [s]

OURS, MUJOCO, DRAKE = "slipgrasp", "MuJoCo", "Drake"

_TIGHTEST = 1e-12
_ABSOLUTE_PER_RELATIVE = 1e-2  # as in the default tolerances


class Point(NamedTuple):
    """One engine at one setting.

    Attributes:
        engine: Its name.
        case: The preset.
        setting: Relative tolerance, or time step [s].
        seconds: CPU time [s].
        event: Larger error of the times at which the contacts stop [s].
        state: Error of the end state: largest error of a displacement of object or fingertip [m].
    """

    engine: str
    case: str
    setting: float
    seconds: float
    event: float
    state: float


class Reference:
    """The run with the tightest tolerance, and deviations of others from it."""

    def __init__(self, case: str, duration: float = DURATION) -> None:
        """Simulates it, and a second time for the replay.

        Args:
            case: The preset.
            duration: Simulated time [s].
        """
        self.case = case
        self.duration = duration
        self.result = simulate(self.scenario(_TIGHTEST))
        self.torques = record_case(case, duration)
        self.slip_ends = slip_ends(self.result)
        self._half_width = self.result.scenario.object.half_width

    def scenario(self, tolerance: float) -> Scenario:
        """The case with continuous control and another tolerance."""
        values = {
            "controller.control_period": 0.0,
            "simulation.duration": self.duration,
            "simulation.relative_tolerance": tolerance,
            "simulation.absolute_tolerance": _ABSOLUTE_PER_RELATIVE * tolerance,
        }
        return with_values(load_scenario(self.case), values)

    def judge_run(self, result: RunResult) -> tuple[float, float]:
        """Errors of the event [s] and of the end state [m] of one of our runs."""
        event = float(np.abs(slip_ends(result) - self.slip_ends).max())
        return event, self._state_error(result.trace.object_pose[-1], result.trace.slip[-1])

    def judge_replay(self, replay: Replay) -> tuple[float, float]:
        """Errors of the event [s] and of the end state [m] of another engine."""
        ends = extrapolated_ends(replay, len(self.slip_ends))
        event = float(np.abs(ends - self.slip_ends).max())
        return event, self._state_error(replay.object_pose[-1], replay.slip[-1])

    def _state_error(self, pose: np.ndarray, slip: np.ndarray) -> float:
        x, y, angle = np.abs(pose - self.result.trace.object_pose[-1])
        slips = np.abs(slip - self.result.trace.slip[-1])
        return float(max(x, y, self._half_width * angle, slips.max()))


def run(docs: Path | None = None) -> list[Table]:
    """The table ``work-precision`` and its diagram."""
    references = [Reference(case) for case in CASES]
    points, notes = [], []
    for reference in references:
        points += measure_ours(reference) + measure_mujoco(reference)
        difference = oracle_difference(reference)
        notes.append(
            f"{reference.case}: SciPy's DOP853 at 1e-9 on independent equations ends the slip "
            f"within {difference:.0e} s of the reference."
        )
    if find_spec("pydrake") is None:
        notes.append("Drake is not installed (pip install drake), so it is not here.")
    else:
        points += [point for reference in references for point in measure_drake(reference)]
    if docs is not None:
        from benchmarks.charts import draw_work_precision, save

        save(draw_work_precision(points), docs / "images" / "work-precision.svg")
    return [_tabulate(points, notes)]


def measure_ours(
    reference: Reference, tolerances: Sequence[float] = TOLERANCES, rounds: int = OUR_ROUNDS
) -> list[Point]:
    """Our runs, one per relative tolerance."""
    scenarios = {f"{t:g}": reference.scenario(t) for t in tolerances}
    works = {name: lambda s=scenario: simulate(s) for name, scenario in scenarios.items()}
    seconds = median_seconds(works, rounds)
    return [
        Point(
            OURS,
            reference.case,
            float(name),
            seconds[name],
            *reference.judge_run(simulate(scenario)),
        )
        for name, scenario in scenarios.items()
    ]


def measure_mujoco(
    reference: Reference, steps: Sequence[float] = MUJOCO_STEPS, rounds: int = ROUNDS
) -> list[Point]:
    """MuJoCo with our torques, one replay per time step."""
    works = {f"{step:g}": stepping(reference.torques, step) for step in steps}
    seconds = median_seconds(works, rounds)
    points = []
    for step in steps:
        errors = reference.judge_replay(replay_in_mujoco(reference.torques, step))
        points.append(Point(MUJOCO, reference.case, step, seconds[f"{step:g}"], *errors))
    return points


def measure_drake(
    reference: Reference, steps: Sequence[float] = DRAKE_STEPS, rounds: int = 3
) -> list[Point]:
    """Drake with our torques, one replay per time step; its Python binding steps it."""
    from benchmarks.drake_replay import replay_in_drake

    replay_in_drake(reference.torques, steps[0])  # imports are not counted
    points = []
    for step in steps:
        times, errors = [], (0.0, 0.0)
        for _ in range(rounds):
            start = time.process_time()
            replay = replay_in_drake(reference.torques, step)
            times.append(time.process_time() - start)
            errors = reference.judge_replay(replay)
        points.append(Point(DRAKE, reference.case, step, statistics.median(times), *errors))
    return points


def oracle_difference(reference: Reference) -> float:
    """Deviation of the reference from the tests' oracle in the end of slip [s]."""
    from tests.references.continuous import run_continuous
    from tests.references.world import World

    world = World.from_scenario(load_scenario(reference.case))
    oracle = run_continuous(world, reference.duration, [])
    contacts = range(len(reference.slip_ends))
    return max(abs(oracle.slip_end(i) - reference.slip_ends[i]) for i in contacts)


def _tabulate(points: list[Point], notes: list[str]) -> Table:
    heads = ("0.3 s of", "setting", "CPU [ms]", "end of slip [s]", "end state [m]")
    rows = tuple(
        (
            f"{point.case}, {point.engine}",
            f"{point.setting:g}" if point.engine == OURS else f"{1e3 * point.setting:g} ms",
            f"{MILLISECONDS * point.seconds:.2f}",
            f"{point.event:.0e}",
            f"{point.state:.0e}",
        )
        for point in points
    )
    return Table("work-precision", heads, rows, tuple(notes))
