"""Onset of slip of a sticking contact, at an instant known in closed form.

Two fingers turn the object of weight m g at a constant speed, from an angle at which its weight
presses it against finger 1. Both carry m g cos(theta) / 2 by friction; the smallest internal force
keeps finger 0, which the weight unloads, on the friction cone of the estimate mu^, and presses
finger 1 with an additional -m g sin(theta). So finger 1, whose friction mu_1 is smaller than mu^,
leaves its cone where tan(theta) = (1 / mu^ - 1 / mu_1) / 2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from benchmarks.mujoco_replay import scene_of
from benchmarks.report import Table, met
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.engines.expected import mean_torques

ESTIMATE, FRICTION = 0.5, 0.45
INERTIA = 0.001  # [kg m^2]
SPIN, SPEEDING_UP = 100.0, 0.05  # [rad/s^2], [s]
AFTER = 0.02  # duration of a run after the onset [s]

# Distributed over a step by the golden ratio, because an onset on the grid would be luck.
COASTING = tuple(0.05 + 1e-3 * (k * 0.6180339887 % 1.0) for k in range(10))  # [s]

_DENSE = 1e4  # [Hz], for replaying
_SETTLING = 0.02  # MuJoCo's contacts close during the first steps [s]
_ON_CONE = 1e-9  # a margin below this is zero; MuJoCo's no-slip solver gives 1e-16 [N]
_TARGET = 1e-9  # [s]


def turning_hand(coasting: float) -> tuple[Scenario, float]:
    """A hand whose finger 1 starts to slip at a known instant, with that instant [s].

    Args:
        coasting: Time for which the object turns at constant speed before [s].
    """
    angle = math.atan(0.5 * (1.0 / ESTIMATE - 1.0 / FRICTION))
    start = angle - SPIN * SPEEDING_UP * (0.5 * SPEEDING_UP + coasting)
    values = {
        "object.inertia": INERTIA,
        "fingers.0.friction": 0.9,
        "fingers.1.friction": FRICTION,
        "estimates.0.initial": ESTIMATE,
        "estimates.1.initial": ESTIMATE,
        "estimates.2.initial": 1.0,
        "estimates.3.initial": INERTIA,
        # The estimates do not change.
        "controller.lyapunov_weight": 0.0,
        "controller.estimate_norm_bound": 1e3,
        "trajectory.start": [1.466, 0.366, start],
        "trajectory.acceleration": [0.0, 0.0, SPIN],
        "trajectory.acceleration_time": SPEEDING_UP,
        "simulation.duration": SPEEDING_UP + coasting + AFTER,
    }
    return with_values(load_scenario("paper-case-2"), values), SPEEDING_UP + coasting


def our_onset(scenario: Scenario) -> float:
    """Time of the first phase change of our run [s]."""
    return simulate(scenario).phase_changes[0].time


def mujoco_onset(scenario: Scenario, step: float) -> tuple[float, float]:
    """The onset in MuJoCo with the torques of our run.

    Args:
        scenario: A `turning_hand`.
        step: MuJoCo's time step [s].

    Returns:
        End of the first step in which finger 1 lies on its cone, and the zero of the line through
        the margins of the two previous steps [s].
    """
    result = simulate(with_values(scenario, {"simulation.output_rate": _DENSE}))
    model, data = scene_of(result, step)
    times, margin = [], []
    for torques in mean_torques(result, step):
        data.ctrl[:] = torques
        mujoco.mj_step(model, data)
        times.append(data.time)
        margin.append(_margin(model, data))
    is_on_cone = (np.array(times) > _SETTLING) & (np.array(margin) < _ON_CONE)
    first = int(np.flatnonzero(is_on_cone)[0])
    before, last = margin[first - 2], margin[first - 1]
    return times[first], times[first - 1] + step * last / (before - last)


def _margin(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    """Mu F_n - |F_x| of finger 1 [N]; NaN if it is open."""
    force = np.empty(6)
    for index, contact in enumerate(data.contact):
        # The fingertips are first in the scene, the object is last.
        if min(contact.geom1, contact.geom2) == 1:
            mujoco.mj_contactForce(model, data, index, force)
            return contact.friction[0] * force[0] - float(np.hypot(force[1], force[2]))
    return np.nan


def run(coasting: Sequence[float] = COASTING, steps: Sequence[float] = (1e-3, 1e-4)) -> list[Table]:
    """The table ``onset``: errors of the onset against the closed form.

    Args:
        coasting: Coasting times, one onset each [s].
        steps: MuJoCo's time steps [s].
    """
    hands = [turning_hand(time) for time in coasting]
    truth = np.array([onset for _, onset in hands])
    ours = np.array([our_onset(scenario) for scenario, _ in hands]) - truth
    rows = [("slipgrasp, default tolerance", *_errors(ours))]
    for step in steps:
        found = np.array([mujoco_onset(scenario, step) for scenario, _ in hands])
        told, extrapolated = (found - truth[:, None]).T
        rows.append((f"MuJoCo, {1e3 * step:g} ms, step that shows it", *_errors(told)))
        rows.append((f"MuJoCo, {1e3 * step:g} ms, extrapolated", *_errors(extrapolated)))
    worst = float(np.abs(ours).max())
    note = f"Ours is wrong by at most {worst:.1e} s; target {_TARGET:g} s: {met(worst <= _TARGET)}."
    heads = (f"{len(truth)} onsets", "mean error [s]", "rms [s]", "worst [s]")
    return [Table("onset", heads, tuple(rows), (note,))]


def _errors(errors: NDArray[np.float64]) -> tuple[str, ...]:
    rms = math.sqrt(float(np.mean(errors**2)))
    return f"{errors.mean():.1e}", f"{rms:.1e}", f"{np.abs(errors).max():.1e}"
