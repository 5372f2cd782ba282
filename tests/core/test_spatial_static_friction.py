"""Fingertips in space that hold with more friction than they slip with."""

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import ContactPhase, Outcome
from tests.references.spatial_contact import Problem, answers, forces_in, moving_directions
from tests.references.spatial_hands import at_rest_where_stuck, cone_phases, random_state
from tests.references.spatial_plant import State, all_stick
from tests.references.spatial_scenarios import random_spatial_scenario, world_of
from tests.spatial_evaluation import SpatialEvaluation

FRICTIONS = pytest.mark.parametrize("friction", ["cone", "pyramid"])
STATIC = 0.3
# Correct beliefs and a squeeze that leaves a tenth: nothing slips until the object is pushed.
HELD = with_values(
    load_scenario("spatial-prism"),
    {
        **{f"estimates.{k}.initial": 1.0 for k in range(7)},
        **{f"fingers.{i}.static_friction": STATIC for i in range(3)},
        "controller.grip_safety": 1.1,
        "simulation.duration": 0.2,
        "trajectory.acceleration.2": 0.0,
    },
)


def largest_push():
    """The force down at which all contacts reach mu_s F_n: in stick all is linear in it."""
    world, none = world_of(HELD), np.zeros((3, 2), bool)
    rest = np.zeros((3, 2))
    state = State(world.position, np.array(world.quaternion), np.zeros(6), rest, rest)
    kin = world.hand.kinematics(state)
    torques = simulate(HELD).trace.joint_torque[1].reshape(3, 3)

    def margin(push):
        load = np.array([0.0, 0.0, -push, 0.0, 0.0, 0.0])
        G, c = world.hand.contact_space(kin, state, world.truth, torques, load)
        problem = Problem(G, c, world.truth.friction, none, rest, none)
        forces = forces_in(problem, all_stick(3))
        spare = STATIC * forces[:, 2] - np.linalg.norm(forces[:, :2], axis=1)
        assert np.ptp(spare) < 1e-9
        return spare[0]

    return margin(0.0) / (margin(0.0) - margin(1.0))


def pushed(force, friction):
    push = {"pulses.0.time": 0.1, "pulses.0.duration": 0.001}
    return with_values(
        HELD,
        {**push, "pulses.0.force": (0.0, 0.0, -force), "simulation.friction": friction},
    )


@FRICTIONS
def test_contacts_hold_up_to_static_friction(friction):
    trace = simulate(pushed(largest_push() * (1.0 - 1e-6), friction)).trace
    at = int(np.flatnonzero(trace.times == 0.1)[-1])
    assert np.all(trace.phase == ContactPhase.STICK)
    assert np.all(trace.friction_coefficient == STATIC)
    assert np.all((trace.friction_margin[at] >= 0.0) & (trace.friction_margin[at] < 1e-4))


@FRICTIONS
def test_what_is_overcome_slides_with_the_friction_of_slip_and_holds_again(friction):
    result = simulate(pushed(largest_push() * (1.0 + 1e-6), friction))
    trace, metrics = result.trace, result.metrics
    assert {(change.time, change.contact) for change in result.phase_changes[:3]} == {
        (0.1, contact) for contact in range(3)
    }
    at = int(np.flatnonzero(trace.times == 0.1)[-1])
    assert np.all(trace.friction_coefficient[at] == 0.25)
    across = np.linalg.norm(trace.tangential_force[at].reshape(3, 2), axis=1)
    np.testing.assert_allclose(across, 0.25 * trace.normal_force[at], rtol=1e-12)
    # The force does not fall below what holds by a little: it falls to mu_k at once.
    assert np.all(np.abs(trace.slip_acceleration[at]).max() > 1.0)
    assert result.outcome is Outcome.COMPLETED
    assert np.all(trace.phase[-1] == ContactPhase.STICK)
    assert np.all(trace.friction_coefficient[-1] == STATIC)
    assert min(metrics.slip_path) > 1e-6
    assert np.abs(trace.energy_residual).max() < 2e-9
    assert np.all(np.diff(trace.dissipated_energy) >= 0.0)


@FRICTIONS
def test_a_force_that_grows_breaks_loose_where_it_reaches_static_friction(friction):
    """No jump of the torque: the force reaches its bound inside a stretch, then drops."""
    period = 0.01
    shaken = {
        "trajectory.kind": "shake",
        "trajectory.amplitude": (0.0, 0.0, 0.02, 0.0, 0.0, 0.0),
        "trajectory.period": 0.15,
        "trajectory.acceleration_time": 0.1,
        "controller.grip_safety": 1.0,
        "controller.control_period": period,
        "simulation.friction": friction,
        "pulses.0.time": 0.05,
        "pulses.0.duration": 0.1,
        "pulses.0.force": (0.0, 0.6, 0.0),
    }
    result = simulate(with_values(HELD, shaken))
    trace = result.trace
    onsets = [
        change
        for change in result.phase_changes
        if change.from_phase == ContactPhase.STICK
        and abs(change.time / period - round(change.time / period)) > 1e-6
    ]
    assert onsets
    size = np.linalg.norm if friction == "cone" else lambda force: np.abs(force).max()
    for change in onsets:
        before, after = np.flatnonzero(trace.times == change.time)[[0, -1]]
        forces = trace.tangential_force.reshape(len(trace), 3, 2)
        reached = [size(force) for force in forces[before]] / trace.normal_force[before]
        assert reached.max() == pytest.approx(STATIC, rel=1e-7)
        i = change.contact
        assert trace.friction_coefficient[after, i] == 0.25
        assert size(forces[after, i]) == pytest.approx(
            0.25 * trace.normal_force[after, i], rel=1e-9
        )
    assert np.abs(trace.energy_residual).max() < 2e-9


@FRICTIONS
@pytest.mark.parametrize("n", [2, 3])
def test_selection_finds_one_of_the_answers_of_a_search_over_all_frictions(n, friction):
    """A contact with more friction in stick is tried with either; all sticks where it may."""
    compared = loosened = 0
    for seed in range(12):
        rng = np.random.default_rng([n, seed])
        static = {f"fingers.{i}.static_friction": 0.6 * rng.uniform(1.0, 1.6) for i in range(n)}
        static.pop(f"fingers.{seed % n}.static_friction")
        scenario = with_values(
            random_spatial_scenario(rng, n, "masses"), {**static, "simulation.friction": friction}
        )
        world, state = world_of(scenario), random_state(rng, n)
        held = [f.friction if f.static_friction is None else f.static_friction for f in
                scenario.fingers]  # fmt: skip
        for phase in list(cone_phases(state))[: 2 ** (n - 1)]:
            at = at_rest_where_stuck(state, phase)
            kin = world.hand.kinematics(at)
            pressed = rng.uniform([-9.0, -9.0, 2.0], [9.0, 9.0, 30.0], (n, 3))
            tips = kin.frames @ pressed[:, :, None]
            torques = (kin.jacobians.transpose(0, 2, 1) @ tips)[:, :, 0]
            torques += (world.truth.link_masses.T[:, :, None] * kin.bias_per_mass).sum(axis=0)
            G, c = world.hand.contact_space(kin, at, world.truth, torques)
            moving, directions = moving_directions(at.slip_velocity, friction)
            none, bounds = np.zeros((n, 2), bool), np.repeat(np.array(held)[:, None], 2, axis=1)
            found = list(
                answers(Problem(G, c, world.truth.friction, moving, directions, none, friction,
                                bounds))
            )  # fmt: skip
            own, motion = SpatialEvaluation(scenario, at, phase, world.estimates).select(torques)
            if own is None:
                assert not found
                continue
            compared += 1
            scale = 1e-8 * (1.0 + np.abs(motion.forces).max())
            same = [
                np.array_equal(other.phase.sticks, own.sticks)
                and np.allclose(other.phase.directions, own.directions, atol=1e-8)
                and np.allclose(other.forces, motion.forces, rtol=0.0, atol=scale)
                for other in found
            ]
            assert any(same)
            if any((other.phase.sticks == ~moving).all() for other in found):
                assert (own.sticks == ~moving).all()
            loosened += len(found) > 1
    assert compared > 20 and loosened > 3


def test_a_patch_multiplies_both_frictions():
    wet = {"patches.0.face": "side-1", "patches.0.radius": 0.1, "patches.0.friction_factor": 0.9}
    trace = simulate(with_values(HELD, {**wet, "simulation.duration": 0.01})).trace
    assert trace.friction_coefficient[-1].tolist() == [STATIC, 0.9 * STATIC, STATIC]
