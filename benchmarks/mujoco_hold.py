"""MuJoCo holding the object of a scenario at rest, for all comparisons of speed.

Holding is the cheapest task of the scene, and favours MuJoCo: pose, grip and gravity compensation
come from our run, without adaptation or output.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.recordings.engines.mjcf import (
    Contact,
    describe_scene,
    joint_names,
    motors,
    start_coordinates,
)

Floats = NDArray[np.float64]

STIFFNESS, DAMPING = 2000.0, 120.0

# MuJoCo's defaults, with a visible tip.
DEFAULT_CONTACT = Contact(tip_radius=0.005, attributes="", friction_hardness=1.0)
STEP = 1e-3
"""MuJoCo's time step in all comparisons of speed [s]."""


class Hold(NamedTuple):
    """MuJoCo with a held object, and the controller in Python, if there is one.

    Attributes:
        model: The scene.
        data: Its state.
        start: Initial coordinates of every run.
        steps: Number of steps of a run.
        law: The controller; None if MuJoCo's actuators hold the object.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    start: Floats
    steps: int
    law: PdLaw | None = None

    def run(self) -> None:
        """One run from the start; without a law, it does not call Python between steps."""
        model, data, law = self.model, self.data, self.law
        data.qpos[:], data.qvel[:] = self.start, 0.0
        if law is None:
            mujoco.mj_step(model, data, nstep=self.steps)
            return
        joints = model.nu
        for _ in range(self.steps):
            data.ctrl[:] = law.torques(data.qpos[:joints], data.qvel[:joints])
            mujoco.mj_step(model, data)

    def sinking(self) -> float:
        """Distance of the object below its initial position [m]."""
        # MuJoCo's height is the second of our two coordinates, the last of three.
        height = self.model.nu + (1 if self.model.nq == self.model.nv else 2)
        return float(self.start[height] - self.data.qpos[height])


class PdLaw:
    """Compensation of gravity and grip, and a PD law about the start pose, in NumPy.

    A minimal controller: one joint-space law for all fingers, precomputed constants, no Jacobian,
    no adaptation.
    """

    def __init__(self, scenario: Scenario) -> None:
        """Reads the grip from the end of our run."""
        fingers = scenario.fingers
        masses = np.array([finger.link_masses for finger in fingers])
        lengths = np.array([finger.link_lengths for finger in fingers])
        centres = lengths * np.array([finger.link_centre_fractions for finger in fingers])
        weights = scenario.simulation.gravity * masses
        self._inner = weights[:, 0] * centres[:, 0] + weights[:, 1] * lengths[:, 0]  # [N m]
        self._outer = weights[:, 1] * centres[:, 1]  # [N m]
        trace = simulate(scenario).trace
        # For spatial hands, the first joint is a yaw about the vertical, which carries no weight.
        joints = trace.shape.joints_per_finger
        self._pitches = slice(joints - 2, None, joints), slice(joints - 1, None, joints)
        self.goal = trace.joint_position[0]
        self._grip = trace.joint_torque[-1] - self._gravity(trace.joint_position[-1])

    def torques(self, angles: Floats, speeds: Floats) -> Floats:
        """Joint torques, shape ``(joints,)`` [N m]."""
        feedback = STIFFNESS * (self.goal - angles) - DAMPING * speeds
        return self._gravity(angles) + self._grip + feedback

    def _gravity(self, angles: Floats) -> Floats:
        first, second = self._pitches
        outer = self._outer * np.cos(angles[first] + angles[second])
        torques = np.zeros_like(angles)
        torques[first] = self._inner * np.cos(angles[first]) + outer
        torques[second] = outer
        return torques


def hold_by_actuators(scenario: Scenario, duration: float) -> Hold:
    """PD laws around the final torque of our run as MuJoCo's actuators, without Python in steps."""
    trace = simulate(scenario).trace
    angles = trace.joint_position[0]
    gain = f'gainprm="{STIFFNESS}" biastype="affine" biasprm="0 {-STIFFNESS} {-DAMPING}"'
    actuators = "".join(f'<general joint="{name}" {gain}/>' for name in joint_names(scenario))
    hold = _hold(scenario, angles, actuators, duration)
    hold.data.ctrl[:] = angles + trace.joint_torque[-1] / STIFFNESS
    mujoco.mj_forward(hold.model, hold.data)
    return hold


def hold_by_numpy(scenario: Scenario, duration: float) -> Hold:
    """The law in NumPy, called at every step."""
    law = PdLaw(scenario)
    return _hold(scenario, law.goal, motors(scenario), duration, law)


def _hold(
    scenario: Scenario, angles: Floats, actuators: str, duration: float, law: PdLaw | None = None
) -> Hold:
    text = describe_scene(scenario, angles, STEP, actuators, DEFAULT_CONTACT)
    model = mujoco.MjModel.from_xml_string(text)
    data, start = mujoco.MjData(model), start_coordinates(scenario, angles)
    data.qpos[:] = start
    return Hold(model, data, start, round(duration / STEP), law)
