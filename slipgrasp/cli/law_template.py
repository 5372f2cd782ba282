"""Template of ``slipgrasp laws new``: a working law and its test."""

from __future__ import annotations

from string import Template

LAW = Template('''"""A custom control law; docs/laws.md describes its inputs and outputs.

    slipgrasp run composite-case-2 --law $file:$name
"""

import numpy as np

from slipgrasp import LawParameter


class $name:
    """Tracks the motion, compensates the weight, and grips harder while a contact slips."""

    name = "$kind"
    version = "1"
    parameters = {
        "grip": LawParameter(
            value=30.0, unit="N", minimum=0.0, maximum=500.0, text="Initial normal force."
        ),
        "growth": LawParameter(
            value=400.0, unit="N/s", minimum=0.0, maximum=1e4, text="Growth of the grip in slip."
        ),
    }
    diagnostics = {"grip": ("N", "Commanded normal force.")}
    memory = {"added": 1}

    def command(self, seen, memory, out):
        """Computes the torque of every joint at every control tick."""
        n, model = len(seen.slip), seen.model
        if seen.believed_phase.any():
            memory.added[0] += seen.parameters.growth * seen.period
        grip = seen.parameters.grip + memory.added[0]
        error, rate = seen.desired_pose - seen.pose, seen.desired_velocity - seen.velocity
        inertia = np.array([model.object_mass, model.object_mass, model.object_inertia])
        wrench = inertia * (seen.position_gain * error + seen.velocity_gain * rate)
        wrench[1] += model.object_mass * model.gravity
        # The fingertips grip; the smallest additional forces produce the rest of the wrench.
        force = grip * seen.contact_normal
        x, y = seen.contact_arm.T
        grasp = np.zeros((3, 2 * n))
        grasp[0, 0::2], grasp[1, 1::2] = 1.0, 1.0
        grasp[2, 0::2], grasp[2, 1::2] = -y, x
        left = wrench - grasp @ force.ravel()
        force = force + (np.linalg.pinv(grasp) @ left).reshape(n, 2)
        out.torque[:] = np.einsum("nij,ni->nj", seen.jacobian, force) + link_weight(seen)
        out.grip[0] = grip


def link_weight(seen):
    """Torque of every joint that balances the weight of the links, (n, 2)."""
    model, across = seen.model, seen.link_direction[:, :, 0]
    outer = model.link_masses[:, 1] * model.link_centres[:, 1] * across[:, 1]
    lever = model.link_masses[:, 0] * model.link_centres[:, 0]
    lever = lever + model.link_masses[:, 1] * model.link_lengths[:, 0]
    return model.gravity * np.stack([lever * across[:, 0] + outer, outer], axis=1)
''')

TEST = Template('''"""The law of $file holds its object; run with: python -m pytest $test"""

from pathlib import Path

from slipgrasp import load_law, load_scenario, simulate, verify, with_law, with_values

LAW = load_law(f"{Path(__file__).parent / '$file'}:$name")
SCENARIO = with_law(load_scenario("composite-case-2"), LAW.name)


def test_the_object_is_held():
    result = simulate(SCENARIO)
    assert result.outcome == "completed", result.reason
    assert result.metrics.held


def test_the_grip_starts_at_its_parameter():
    result = simulate(with_values(SCENARIO, {"controller.parameters.grip": 40.0}))
    assert result.ticks.diagnostics[0, 0] >= 40.0


def test_the_run_is_reproduced_from_its_commands():
    assert verify(simulate(SCENARIO)).same
''')
