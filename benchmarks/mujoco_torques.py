"""MuJoCo with the torques of one of our runs: its forces, and its cost without Python."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.engines.expected import mean_torques
from slipgrasp.recordings.engines.mjcf import (
    describe_contact,
    describe_scene,
    motors,
    start_coordinates,
)

Floats = NDArray[np.float64]


def stepping(result: RunResult, step: float) -> Callable[[], object]:
    """The replay of a run as one call for timing: all steps without Python in between.

    Args:
        result: A run that starts from rest, densely stored.
        step: MuJoCo's time step [s].
    """
    model, data = _scene(result, step)
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, start, kind)
    torques = mean_torques(result, step)
    return lambda: rollout.rollout(model, data, start[None], torques[None])


def friction_margins(result: RunResult, step: float) -> tuple[Floats, Floats]:
    """Times at the ends of MuJoCo's steps [s] and mu F_n - |F_x| in each step [N].

    Args:
        result: A run that starts from rest, densely stored.
        step: MuJoCo's time step [s].

    Returns:
        ``(steps,)`` and ``(steps, n)``; NaN if a contact is open.
    """
    model, data = _scene(result, step)
    times, margins = [], []
    for torques in mean_torques(result, step):
        data.ctrl[:] = torques
        mujoco.mj_step(model, data)
        row = np.full(len(result.scenario.fingers), np.nan)
        for finger, margin in _margins(model, data):
            row[finger] = margin
        times.append(data.time)
        margins.append(row)
    return np.array(times), np.array(margins)


def _scene(result: RunResult, step: float) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The scene of `replay_in_mujoco`, at the start."""
    scenario, trace = result.scenario, result.trace
    angles = trace.joint_position[0]
    contact = describe_contact(step)
    text = describe_scene(scenario, angles, step, motors(scenario), contact)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:] = start_coordinates(scenario, angles)
    return model, data


def _margins(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[tuple[int, float]]:
    """Finger and margin of every closed contact."""
    force = np.empty(6)
    for index in range(data.ncon):
        contact = data.contact[index]
        mujoco.mj_contactForce(model, data, index, force)
        # The fingertips are first in the scene, the object is last.
        finger = int(min(contact.geom1, contact.geom2))
        yield finger, contact.friction[0] * force[0] - float(np.hypot(force[1], force[2]))
