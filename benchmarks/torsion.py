"""A box that turns between two soft fingertips: our runs, MuJoCo's and a body on rigid tips.

The last one is independent of hands and controllers (`tests.references.box_on_rigid_tips`); ours
and MuJoCo's tips are on slides that springs hold. MuJoCo bounds force and moment by the same
ellipsoid (elliptic cones, ``condim`` 4). Its contacts creep, and its tips are spheres, while ours
are points.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from benchmarks.report import Table
from slipgrasp.core.run.simulator import simulate
from tests.references.box_on_rigid_tips import RigidTips
from tests.soft_box import GRIP, JAW_MASS, OFFSET, SLIDE_STIFFNESS, soft_box

PAGE = "verification.md"
ECCENTRICITY = 0.01  # [m]
STIFFNESSES = (1e3, 1e4, 1e5)  # [N/m]
PERIODS = (2e-4, 1e-4)  # of control [s]
STEPS = (1e-3, 5e-4, 2.5e-4, 1.25e-4, 6.25e-5)  # [s]
TIMES = (0.34581, 0.64581, 1.3)  # [s]

Floats = NDArray[np.float64]

FRICTION = 0.5
# Time constant of a contact in steps: stiffer ones bounce, and the box then turns 3 % less.
CONTACT_TIME = 20.0
SETTLING = 0.2  # [s]


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
    found = [turn(ECCENTRICITY, step, TIMES) for step in steps]
    found.append(2.0 * found[-1] - found[-2])
    names = (*(f"{1e3 * step:g} ms" for step in steps), "0, by the last two")
    rows = tuple(
        (name, *(f"{100.0 * value:.3f}" for value in turned / rigid - 1.0))
        for name, turned in zip(names, found, strict=True)
    )
    heads = ("turn of the box in MuJoCo, step", *(f"at {time:g} s [%]" for time in TIMES))
    return Table("torsion-mujoco", heads, rows, page=PAGE)


def build_model(eccentricity: float, step: float) -> mujoco.MjModel:
    """The box between the tips.

    Args:
        eccentricity: Of both contacts [m].
        step: MuJoCo's time step [s].
    """
    spec = mujoco.MjSpec.from_file(str(Path(__file__).with_suffix(".xml")))
    spec.option.timestep = step
    spec.body("box").pos = [0.0, -OFFSET, 0.0]
    for name in ("left", "right"):
        spec.body(name).mass = JAW_MASS
    for pair in spec.pairs:
        pair.friction = [FRICTION, FRICTION, eccentricity * FRICTION, 0.0, 0.0]
        pair.solref = [CONTACT_TIME * step, 1.0]
    return spec.compile()


def turn(eccentricity: float, step: float, times: Sequence[float]) -> Floats:
    """Turn of the box about x at some times [rad], held by the law `tests.soft_box.SlideSprings`.

    Args:
        eccentricity: Of both contacts [m].
        step: MuJoCo's time step [s].
        times: In ascending order [s].
    """
    model = build_model(eccentricity, step)
    data, found = _gripped(model), []
    start = data.qpos[7:13].reshape(2, 3).copy()
    damping = 2.0 * np.sqrt(SLIDE_STIFFNESS * JAW_MASS)
    for _ in range(round(times[-1] / step)):
        place, rate = data.qpos[7:13].reshape(2, 3), data.qvel[6:12].reshape(2, 3)
        force = SLIDE_STIFFNESS * (start - place) - damping * rate
        force[:, 0] = GRIP, -GRIP
        force[:, 2] += (0.5 + JAW_MASS) * 9.81
        data.qfrc_applied[6:12] = force.ravel()
        mujoco.mj_step(model, data)
        found.append(2.0 * np.arctan2(data.qpos[4], data.qpos[3]))
    return np.interp(times, step * (1.0 + np.arange(len(found))), found)


def _gripped(model: mujoco.MjModel) -> mujoco.MjData:
    """The box at rest between the pressed tips, without weight until now."""
    data, gravity = mujoco.MjData(model), model.opt.gravity.copy()
    model.opt.gravity[:] = 0.0
    data.qfrc_applied[6], data.qfrc_applied[9] = GRIP, -GRIP
    mujoco.mj_step(model, data, nstep=round(SETTLING / model.opt.timestep))
    model.opt.gravity[:] = gravity
    data.qvel[:], data.time = 0.0, 0.0
    return data
