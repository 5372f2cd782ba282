"""`python -m benchmarks.mujoco_replay`: our torques in MuJoCo, ever finer and ever stiffer."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from benchmarks import mujoco_space
from benchmarks.mujoco_scene import Contact, describe_scene, motors, start_coordinates
from benchmarks.replay import (
    CASES,
    DURATION,
    STEPS,
    Differences,
    Replay,
    compare,
    extrapolate,
    format_table,
    mean_torques,
    record_case,
    slip_of,
)
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.spatial import SpatialScenario

Floats = NDArray[np.float64]

_OSCILLATION_PER_STEP = 0.3  # natural frequency of a contact times the step [rad]


def replay_in_mujoco(result: RunResult, step: float) -> Replay:
    """Plays the torques of a run into MuJoCo.

    Args:
        result: A run that starts from rest, densely stored.
        step: MuJoCo's time step [s].
    """
    scenario, trace = result.scenario, result.trace
    angles = trace.joint_position[0]
    joints = len(angles)
    text = describe_scene(scenario, angles.tolist(), step, motors(scenario), describe_contact(step))
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:] = start_coordinates(scenario, angles)
    pose, poses, slips = slice(joints, joints + trace.object_pose.shape[1]), [], []
    for torques in mean_torques(result, step):
        data.ctrl[:] = torques
        mujoco.mj_step(model, data)
        mujoco.mj_kinematics(model, data)
        poses.append(data.qpos[pose].copy())
        slips.append(_slip_of(scenario, poses[-1], data.site_xpos))
    times = np.linspace(step, step * len(poses), len(poses))
    return Replay(times, np.array(poses), np.array(slips))


def _slip_of(scenario: Scenario, pose: Floats, tips: Floats) -> Floats:
    """Slip of each fingertip from its position in MuJoCo, as in a row of the trace."""
    if isinstance(scenario, SpatialScenario):
        return mujoco_space.slips_of(scenario, pose, tips)
    return slip_of(scenario, pose, tips[:, [0, 2]])


def measure_differences(
    name: str, steps: Sequence[float] = STEPS, duration: float = DURATION
) -> list[Differences]:
    """The table of differences of a preset: one row per step, and one for the limit.

    Args:
        name: Preset, or path of a scenario.
        steps: MuJoCo's time steps [s]; the last one is half of the one before.
        duration: How long to play [s].
    """
    result = record_case(name, duration)
    replays = [replay_in_mujoco(result, step) for step in steps]
    rows = [compare(result, replay, step) for replay, step in zip(replays, steps, strict=True)]
    return [*rows, compare(result, extrapolate(*replays[-2:]), 0.0)]


def describe_contact(step: float) -> Contact:
    """A contact whose compliance falls with the square of the step.

    The contact is a spring and damper per unit of apparent mass: stiffness (0.3 / step)^2,
    half critically damped, which the step still resolves. MuJoCo's convex contact model ties
    friction to the normal direction: a sliding tip is lifted off until it hops, unless the
    friction is soft in the main solve (``impratio`` far below 1). The no-slip solver then
    restores Coulomb's law exactly. A tip of 10 um rolls by nanometres only.
    """
    frequency = _OSCILLATION_PER_STEP / step
    return Contact(
        tip_radius=1e-5,
        attributes=f'solref="{-(frequency**2)} {-frequency}" solimp="0.5 0.5 0.001 0.5 2"',
        friction_hardness=1e-3,
    )


def main() -> None:
    """Prints the differences of both cases."""
    for name in CASES:
        print(format_table(f"{name} in MuJoCo, {DURATION} s", measure_differences(name)))


if __name__ == "__main__":
    main()
