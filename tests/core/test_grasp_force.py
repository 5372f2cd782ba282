"""The grasp force of hands with two to six fingers against a library, and what it promises."""

from itertools import product

import numpy as np
import pytest

from slipgrasp.core.scenario.loading import with_values
from tests.each_case import each_case
from tests.references.closed_loop import ClosedLoop
from tests.references.grasp import Limits, least_violation
from tests.references.hand import friction_rows
from tests.references.hands import random_estimates, random_scenario, random_state
from tests.state_evaluation import evaluate_state

pytestmark = pytest.mark.slow

SIZES = (2, 3, 4, 5, 6)


class Grasp:
    """A random hand in a random phase, and the contact forces it asks for."""

    def __init__(self, seed, n, phase=None, **values):
        rng = np.random.default_rng([*np.ravel(seed), n])
        self.scenario = random_scenario(
            rng,
            n,
            "friction",
            polygon=n > 4 or rng.random() < 0.5,
            grasp_force="minimum",
            minimum_normal_force=rng.uniform(0.0, 5.0),
            **values,
        )
        self.limit(rng)
        self.phase = tuple(rng.choice([0, 0, 1, -1], n).tolist()) if phase is None else phase
        self.loop = ClosedLoop.from_scenario(self.scenario)
        self.state = random_state(rng, self.scenario, self.phase)
        self.estimates = random_estimates(rng, self.scenario)

    def limit(self, rng):
        """Half of the hands have limits that may bind."""
        values = {}
        if rng.random() < 0.5:
            values["controller.maximum_normal_force"] = float(rng.uniform(20.0, 100.0))
        if rng.random() < 0.5:
            values["actuation.torque_limit"] = float(rng.uniform(20.0, 100.0))
            values["controller.control_period"] = 1e-3
        self.scenario = with_values(self.scenario, values)

    def has_freedom(self):
        return 3 + np.count_nonzero(self.phase) < 2 * len(self.phase)

    def kernel_torques(self):
        return evaluate_state(self.scenario, 0.4, *self.state, self.phase, self.estimates).torques

    def reference(self):
        kin = self.loop.hand.kinematics(self.state)
        believed = self.loop.unknowns.fill(self.estimates)
        desired = self.loop.trajectory.desired(0.4)
        v = self.loop.law.commanded_acceleration(self.state, self.phase, desired)
        return self.loop.law.command(self.loop.hand, kin, believed, self.phase, v)

    def commanded_forces(self, torques):
        """F^ that the torques ask for, ``(n, 2)``, and the cones they should lie in."""
        kin = self.loop.hand.kinematics(self.state)
        believed = self.loop.unknowns.fill(self.estimates)
        desired = self.loop.trajectory.desired(0.4)
        v = self.loop.law.commanded_acceleration(self.state, self.phase, desired)
        n = len(self.phase)
        M, h = self.loop.hand.finger_dynamics(kin, believed)
        qdd = np.linalg.solve(kin.A_q, kin.b - kin.A_o @ v[:3] - kin.A_s @ v[3:])
        forces = np.linalg.solve(kin.J.T, torques - h - M @ qdd)
        return forces.reshape(n, 2), believed.friction / self.scenario.controller.grip_safety


@pytest.mark.parametrize("n", SIZES)
@each_case("seed", range(40))
def test_torques_agree_with_a_library(seed, n):
    grasp = Grasp(seed, n)
    expected = grasp.reference()
    scale = max(1.0, np.abs(expected.torques).max())
    np.testing.assert_allclose(
        grasp.kernel_torques(), expected.torques, rtol=0.0, atol=1e-9 * scale
    )


def test_the_samples_hold_grasps_that_can_and_that_cannot_keep_their_limits():
    violations = [Grasp(seed, n).reference().violation for seed in range(20) for n in SIZES]
    assert 10 <= np.count_nonzero(violations) <= 90


@pytest.mark.parametrize("n", [n for n in SIZES if n > 2])
@each_case("seed", range(20))
def test_forces_are_inside_their_cones_and_limits_wherever_they_can_be(seed, n):
    grasps = (Grasp([seed, k], n) for k in range(100))
    grasp = next(g for g in grasps if g.has_freedom() and g.reference().violation == 0.0)
    torques = grasp.kernel_torques()
    forces, cones = grasp.commanded_forces(torques)
    controller, limit = grasp.scenario.controller, grasp.scenario.actuation.torque_limit
    stuck = np.array(grasp.phase) == 0
    margin = cones * forces[:, 1] - np.abs(forces[:, 0])
    assert margin[stuck].min(initial=0.0) > -1e-8
    assert forces[:, 1].min() > controller.minimum_normal_force - 1e-8
    assert forces[:, 1].max() < (controller.maximum_normal_force or np.inf) + 1e-8
    assert np.abs(torques).max() < (limit or np.inf) + 1e-8


@pytest.mark.parametrize("n", SIZES)
def test_the_grasp_force_moves_nothing(n):
    """It changes the torques and the contact forces, but not the accelerations they give."""
    for phase in product((0, 1), repeat=n):
        if 3 + sum(phase) > 2 * n:
            continue
        grasp = Grasp(1, n, phase)
        known = with_values(grasp.scenario, {"controller.grasp_force": "minimum"})
        free = with_values(grasp.scenario, {"controller.grasp_force": "none"})
        truth = [
            grasp.scenario.fingers[int(e.parameter.split(".")[1])].friction
            if e.parameter.startswith("fingers")
            else getattr(grasp.scenario.object, e.parameter.split(".")[1])
            for e in grasp.scenario.estimates
        ]
        one, other = (
            evaluate_state(scenario, 0.4, *grasp.state, phase, truth) for scenario in (known, free)
        )
        np.testing.assert_allclose(one.acceleration, other.acceleration, atol=1e-8)


@pytest.mark.parametrize("n", [3, 4, 6])
def test_a_violation_is_as_small_as_it_can_be(n):
    """Checked by a linear program that looks at the largest violation alone."""
    grasps = [Grasp(seed, n) for seed in range(40)]
    found = [(g, g.reference().violation) for g in grasps]
    for grasp, violation in [(g, v) for g, v in found if v > 0.0]:
        G, d, limits = _problem(grasp)
        assert violation == pytest.approx(least_violation(G, d, *limits.rows()), rel=1e-5)


def _problem(grasp):
    kin = grasp.loop.hand.kinematics(grasp.state)
    believed = grasp.loop.unknowns.fill(grasp.estimates)
    sticks = np.array(grasp.phase) == 0
    forces, cones = grasp.commanded_forces(grasp.reference().torques)
    _, D = friction_rows(grasp.phase, believed.friction)
    G = np.vstack((kin.W, D[~sticks]))
    own = grasp.reference().torques - kin.J.T @ forces.ravel()
    law = grasp.loop.law
    limits = Limits(
        np.where(sticks, cones, np.nan), *law.normal_forces, kin.J.T, own, law.torque_limit
    )
    return G, G @ forces.ravel(), limits
