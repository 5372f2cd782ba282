"""MuJoCo holding the start pose of a scenario with its actuators."""

from __future__ import annotations

import mujoco

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.recordings.engines.mjcf import (
    Contact,
    describe_scene,
    joint_names,
    start_coordinates,
)

STIFFNESS, DAMPING = 2000.0, 120.0

# MuJoCo's defaults, with a visible tip.
DEFAULT_CONTACT = Contact(tip_radius=0.005, attributes="", friction_hardness=1.0)


def build_model(scenario: Scenario, step: float) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The scenario in its start pose, held by PD laws around the final torque of our run.

    The PD laws are MuJoCo's actuators, so that no Python runs between the steps.
    """
    trace = simulate(scenario).trace
    angles = trace.joint_position[0]
    gain = f'gainprm="{STIFFNESS}" biastype="affine" biasprm="0 {-STIFFNESS} {-DAMPING}"'
    actuators = "".join(f'<general joint="{name}" {gain}/>' for name in joint_names(scenario))
    text = describe_scene(scenario, angles, step, actuators, DEFAULT_CONTACT)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:] = start_coordinates(scenario, angles)
    data.ctrl[:] = angles + trace.joint_torque[-1] / STIFFNESS
    mujoco.mj_forward(model, data)
    return model, data
