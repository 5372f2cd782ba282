"""`python -m benchmarks.mujoco_replay`: torques in MuJoCo, finer steps and stiffer contacts."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

from benchmarks.replay import Replay, print_differences, slips_of
from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.engines.bodies import OBJECT, contacts_of
from slipgrasp.recordings.engines.expected import mean_torques
from slipgrasp.recordings.engines.mjcf import (
    describe_contact,
    describe_scene,
    motors,
    start_coordinates,
)

Floats = NDArray[np.float64]


def scene_of(result: RunResult, step: float) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The scene of a run in MuJoCo, at its start.

    Args:
        result: A run that starts from rest, densely stored.
        step: MuJoCo's time step [s].
    """
    scenario, angles = result.scenario, result.trace.joint_position[0]
    text = describe_scene(scenario, angles, step, motors(scenario), describe_contact(step))
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:] = start_coordinates(scenario, angles)
    return model, data


def replay_in_mujoco(result: RunResult, step: float) -> Replay:
    """Replays the torques of a run in MuJoCo.

    Args:
        result: A run that starts from rest, densely stored.
        step: MuJoCo's time step [s].
    """
    model, data = scene_of(result, step)
    contacts, body = contacts_of(result.scenario), data.body(OBJECT)
    pose = slice(model.nu, model.nu + result.trace.object_pose.shape[1])
    poses, slips = [], []
    for torques in mean_torques(result, step):
        data.ctrl[:] = torques
        mujoco.mj_step(model, data)
        mujoco.mj_kinematics(model, data)
        poses.append(data.qpos[pose].copy())
        slips.append(slips_of(contacts, body.xpos, body.xmat.reshape(3, 3), data.site_xpos))
    return Replay.at_steps(step, poses, slips)


def stepping(result: RunResult, step: float) -> Callable[[], object]:
    """The replay of a run as one call for timing: all steps without Python in between.

    Args:
        result: A run that starts from rest, densely stored.
        step: MuJoCo's time step [s].
    """
    model, data = scene_of(result, step)
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, start, kind)
    torques = mean_torques(result, step)
    return lambda: rollout.rollout(model, data, start[None], torques[None])


if __name__ == "__main__":
    print_differences("MuJoCo", replay_in_mujoco)
