"""Accuracy and cost of the slip of the paper's cases and its end, here and in other engines.

Other engines use the torques of our run (`benchmarks.replay`), so that their cost is that of
stepping alone; ours includes the controller, its adaptation and the trace. Their event is not
rounded to a step but extrapolated: the zero of the line through the slip speeds of two late steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from importlib.util import find_spec

import numpy as np

from benchmarks.mujoco_replay import replay_in_mujoco, stepping
from benchmarks.replay import CASES, DURATION, Replay, extrapolated_ends, record_case, slip_ends
from benchmarks.report import Table
from benchmarks.timing import MILLISECONDS, median_seconds
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.trace import Trace
from tests.references.continuous import run_continuous
from tests.references.world import World

TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11)
MUJOCO_STEPS = (1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5)  # [s]
DRAKE_STEPS = (1e-3, 5e-4, 2e-4, 1e-4, 5e-5)  # [s]

OURS = "slipgrasp"

_TIGHTEST = 1e-12
_ABSOLUTE_PER_RELATIVE = 1e-2  # as in the default tolerances


Row = tuple[str, ...]


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

    def judge(self, motion: Trace | Replay, ends: np.ndarray) -> tuple[float, float]:
        """Errors of the event [s] and of the end state [m].

        Args:
            motion: Our motion, or that of another engine.
            ends: Times at which its contacts stop [s].
        """
        x, y, angle = np.abs(motion.object_pose[-1] - self.result.trace.object_pose[-1])
        slips = np.abs(motion.slip[-1] - self.result.trace.slip[-1])
        state = max(x, y, self._half_width * angle, slips.max())
        return float(np.abs(ends - self.slip_ends).max()), float(state)

    def judge_replay(self, replay: Replay) -> tuple[float, float]:
        """The same for another engine, whose event is extrapolated."""
        return self.judge(replay, extrapolated_ends(replay, len(self.slip_ends)))


def run() -> list[Table]:
    """The table ``work-precision``."""
    references = [Reference(case) for case in CASES]
    rows, notes = [], []
    for reference in references:
        rows += measure_ours(reference) + measure_mujoco(reference)
        difference = oracle_difference(reference)
        notes.append(
            f"{reference.case}: SciPy's DOP853 at 1e-9 on independent equations ends the slip "
            f"within {difference:.0e} s of the reference."
        )
    if find_spec("pydrake") is None:
        notes.append("Drake is not installed (pip install drake), so it is not here.")
    else:
        rows += [row for reference in references for row in measure_drake(reference)]
    heads = ("0.3 s of", "setting", "CPU [ms]", "end of slip [s]", "end state [m]")
    return [Table("work-precision", heads, tuple(rows), tuple(notes))]


def measure_ours(
    reference: Reference, tolerances: Sequence[float] = TOLERANCES, rounds: int = 45
) -> list[Row]:
    """Our runs, one row per relative tolerance; a run takes a millisecond or two."""
    works = {f"{t:g}": partial(simulate, reference.scenario(t)) for t in tolerances}
    seconds = median_seconds(works, rounds)
    runs = ((name, work()) for name, work in works.items())
    return [
        _row(reference, OURS, name, seconds[name], reference.judge(run.trace, slip_ends(run)))
        for name, run in runs
    ]


def measure_mujoco(
    reference: Reference, steps: Sequence[float] = MUJOCO_STEPS, rounds: int = 9
) -> list[Row]:
    """MuJoCo with our torques, one replay per time step."""
    works = {f"{1e3 * step:g} ms": stepping(reference.torques, step) for step in steps}
    seconds = median_seconds(works, rounds)
    replays = (replay_in_mujoco(reference.torques, step) for step in steps)
    return [
        _row(reference, "MuJoCo", name, own, reference.judge_replay(replay))
        for (name, own), replay in zip(seconds.items(), replays, strict=True)
    ]


def measure_drake(
    reference: Reference, steps: Sequence[float] = DRAKE_STEPS, rounds: int = 3
) -> list[Row]:
    """Drake with our torques, one replay per time step; its Python binding steps it."""
    from benchmarks.drake_replay import replay_in_drake

    rows = []
    for step in steps:
        work = partial(replay_in_drake, reference.torques, step)
        (seconds,) = median_seconds({"": work}, rounds).values()
        errors = reference.judge_replay(work())
        rows.append(_row(reference, "Drake", f"{1e3 * step:g} ms", seconds, errors))
    return rows


def _row(
    reference: Reference, engine: str, setting: str, seconds: float, errors: tuple[float, float]
) -> Row:
    cells = (f"{MILLISECONDS * seconds:.2f}", *(f"{error:.0e}" for error in errors))
    return f"{reference.case}, {engine}", setting, *cells


def oracle_difference(reference: Reference) -> float:
    """Deviation of the reference from the tests' oracle in the end of slip [s]."""
    world = World.from_scenario(load_scenario(reference.case))
    oracle = run_continuous(world, reference.duration, [])
    contacts = range(len(reference.slip_ends))
    return max(abs(oracle.slip_end(i) - reference.slip_ends[i]) for i in contacts)
