"""The paper's hand as a MuJoCo model: same bodies, gravity, friction and start pose.

The object carries a slide out of the plane, without which MuJoCo's no-slip solver has no
effect in a planar model. The fingers hold their joints with a PD law inside MuJoCo, so that
no Python runs between the steps.
"""

from __future__ import annotations

import math

import mujoco

from core.scenario import Scenario
from core.simulator import simulate

TIP_RADIUS = 0.005
STIFFNESS, DAMPING = 2000.0, 120.0


def build_model(scenario: Scenario, step: float) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The scenario in its start pose, held by PD laws around the torque our run ends with."""
    trace = simulate(scenario).trace
    angles = trace.joint_position[0]
    model = mujoco.MjModel.from_xml_string(_describe(scenario, angles.tolist(), step))
    data = mujoco.MjData(model)
    data.qpos[: len(angles)] = angles
    data.ctrl[:] = angles + trace.joint_torque[-1] / STIFFNESS
    mujoco.mj_forward(model, data)
    return model, data


def _describe(scenario: Scenario, angles: list[float], step: float) -> str:
    body, (x, y, _) = scenario.object, scenario.trajectory.start
    fingers = "".join(_finger(scenario, i, angles) for i in range(len(scenario.fingers)))
    gain = f'gainprm="{STIFFNESS}" biastype="affine" biasprm="0 {-STIFFNESS} {-DAMPING}"'
    motors = "".join(
        f'<general joint="q{i}{j}" {gain}/>' for i in range(len(scenario.fingers)) for j in range(2)
    )
    return f"""<mujoco><option timestep="{step}" gravity="0 0 -{scenario.simulation.gravity}"
      integrator="implicitfast" cone="elliptic" noslip_iterations="5" noslip_tolerance="1e-14"/>
      <worldbody>{fingers}<body pos="{x} 0 {y}">
        <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
        <joint type="hinge" axis="0 -1 0"/><joint type="slide" axis="0 1 0"/>
        <inertial pos="0 0 0" mass="{body.mass}"
          diaginertia="{body.inertia} {body.inertia} {body.inertia}"/>
        <geom type="box" size="{body.half_width} {body.half_width} {body.face_half_length}"
          friction="{scenario.fingers[0].friction} 0 0" condim="3" contype="2" conaffinity="1"/>
      </body></worldbody><actuator>{motors}</actuator></mujoco>"""


def _finger(scenario: Scenario, i: int, angles: list[float]) -> str:
    finger = scenario.fingers[i]
    (l1, l2), (m1, m2) = finger.link_lengths, finger.link_masses
    angle = angles[2 * i] + angles[2 * i + 1]
    side = -TIP_RADIUS if finger.face == "left" else TIP_RADIUS
    tip = f"{l2 + math.cos(angle) * side} 0 {-math.sin(angle) * side}"
    inertias = [m * length**2 / 12.0 for m, length in ((m1, l1), (m2, l2))]
    return f"""<body pos="{finger.base[0]} 0 {finger.base[1]}">
      <joint name="q{i}0" type="hinge" axis="0 -1 0"/>
      <inertial pos="{l1 / 2} 0 0" mass="{m1}" diaginertia="1e-4 {inertias[0]} {inertias[0]}"/>
      <body pos="{l1} 0 0"><joint name="q{i}1" type="hinge" axis="0 -1 0"/>
        <inertial pos="{l2 / 2} 0 0" mass="{m2}" diaginertia="1e-4 {inertias[1]} {inertias[1]}"/>
        <geom type="sphere" size="{TIP_RADIUS}" pos="{tip}" friction="{finger.friction} 0 0"
          condim="3" contype="1" conaffinity="2"/></body></body>"""
