"""`python -m benchmarks.mujoco_replay`: torques in MuJoCo, finer steps and stiffer contacts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

from benchmarks.replay import (
    DURATION,
    STEPS,
    Differences,
    Replay,
    compare,
    extrapolate,
    print_differences,
    record_case,
)
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
    contacts = contacts_of(result.scenario)
    pose = slice(model.nu, model.nu + result.trace.object_pose.shape[1])
    poses, slips = [], []
    for torques in mean_torques(result, step):
        data.ctrl[:] = torques
        mujoco.mj_step(model, data)
        mujoco.mj_kinematics(model, data)
        poses.append(data.qpos[pose].copy())
        slips.append(slips_in(data, contacts, data.site_xpos))
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


def slips_in(data: mujoco.MjData, contacts: Sequence[Mapping[str, Any]], sites: Floats) -> Floats:
    """Slip of each fingertip from its position in MuJoCo, as in a row of the trace."""
    body = data.body(OBJECT)
    turn = body.xmat.reshape(3, 3)
    return np.concatenate(
        [
            np.array(contact["tangents"]) @ (turn.T @ (tip - body.xpos) - contact["anchor"])
            for contact, tip in zip(contacts, sites, strict=True)
        ]
    )


def measure_differences(
    name: str, steps: Sequence[float] = STEPS, duration: float = DURATION
) -> list[Differences]:
    """The table of differences of a preset: one row per step, and one for the limit.

    Args:
        name: Preset, or path of a scenario.
        steps: MuJoCo's time steps [s]; the last one is half of the previous one.
        duration: Simulated time [s].
    """
    result = record_case(name, duration)
    replays = [replay_in_mujoco(result, step) for step in steps]
    rows = [compare(result, replay, step) for replay, step in zip(replays, steps, strict=True)]
    return [*rows, compare(result, extrapolate(*replays[-2:]), 0.0)]


if __name__ == "__main__":
    print_differences("MuJoCo", measure_differences)
