"""A box that turns between two soft fingertips: our runs, MuJoCo's and a body on rigid tips.

The last one is independent of hands and controllers (`tests.references.box_on_rigid_tips`); ours
and MuJoCo's tips are on slides that springs hold.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from benchmarks import mujoco_torsion
from benchmarks.report import Table
from slipgrasp.core.run.simulator import simulate
from tests.references.box_on_rigid_tips import RigidTips
from tests.soft_box import soft_box

PAGE = "verification.md"
ECCENTRICITY = 0.01  # [m]
STIFFNESSES = (1e3, 1e4, 1e5)  # [N/m]
PERIODS = (2e-4, 1e-4)  # of control [s]
STEPS = (1e-3, 5e-4, 2.5e-4, 1.25e-4, 6.25e-5)  # [s]
TIMES = (0.34581, 0.64581, 1.3)  # [s]


class Ending(NamedTuple):
    """How the box has turned: angle [rad], time of its stop [s], path of a tip on its face [m]."""

    angle: float
    time: float
    path: float


def run() -> list[Table]:
    """The tables ``torsion`` and ``torsion-mujoco``."""
    return [measure_stiffness(), measure_mujoco()]


def measure_stiffness(stiffnesses: tuple[float, ...] = STIFFNESSES) -> Table:
    """Runs whose tips are held ever more stiffly, and the body on rigid tips.

    Args:
        stiffnesses: Of the springs [N/m].
    """
    rigid = RigidTips(eccentricity=ECCENTRICITY).turn()
    endings = {f"{stiffness:g} N/m": end_of_turn(stiffness) for stiffness in stiffnesses}
    endings["rigid, independent"] = Ending(rigid.angle, rigid.time, rigid.path)
    rows = tuple(
        (name, f"{end.angle:.6f}", f"{end.time:.6f}", f"{1e3 * end.path:.5f}")
        for name, end in endings.items()
    )
    heads = ("a box that turns between soft tips on springs", "turn [rad]", "stop [s]", "path [mm]")
    return Table("torsion", heads, rows, page=PAGE)


def end_of_turn(stiffness: float) -> Ending:
    """Of our run, with the error of sampled control, linear in its period, extrapolated to 0.

    Args:
        stiffness: Of the springs [N/m].
    """
    fine, finer = (_ending(stiffness, period) for period in PERIODS)
    return Ending(*(2.0 * np.array(finer) - np.array(fine)))


def _ending(stiffness: float, period: float) -> Ending:
    result = simulate(soft_box(ECCENTRICITY, period, 1.2, "slides", stiffness))
    stop = max(change.time for change in result.phase_changes if change.to_phase == 0)
    metrics = result.metrics
    return Ending(abs(metrics.spin_end[0]), stop, metrics.slip_path[0])


def measure_mujoco(steps: tuple[float, ...] = STEPS) -> Table:
    """Deviation of the turn in MuJoCo from the body on rigid tips, at some times.

    Args:
        steps: MuJoCo's time steps [s]; each is half of the one before.
    """
    rigid = RigidTips(eccentricity=ECCENTRICITY).turn(TIMES).angles
    found = [mujoco_torsion.turn(ECCENTRICITY, step, TIMES) for step in steps]
    found.append(2.0 * found[-1] - found[-2])
    names = (*(f"{1e3 * step:g} ms" for step in steps), "0, by the last two")
    rows = tuple(
        (name, *(f"{100.0 * value:.3f}" for value in turned / rigid - 1.0))
        for name, turned in zip(names, found, strict=True)
    )
    heads = ("turn of the box in MuJoCo, step", *(f"at {time:g} s [%]" for time in TIMES))
    return Table("torsion-mujoco", heads, rows, page=PAGE)
