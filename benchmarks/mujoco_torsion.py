"""MuJoCo with a box between two soft tips on slides, beside `tests.soft_box`.

MuJoCo bounds force and moment by the same ellipsoid (elliptic cones, ``condim`` 4). Its contacts
creep, and its tips are spheres, while ours are points.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from tests.soft_box import GRIP, JAW_MASS, OFFSET, SLIDE_STIFFNESS

Floats = NDArray[np.float64]

FRICTION = 0.5
# Time constant of a contact in steps: stiffer ones bounce, and the box then turns 3 % less.
CONTACT_TIME = 20.0
SETTLING = 0.2  # [s]


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
