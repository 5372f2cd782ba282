"""The kernel of spatial hands against the NumPy reference: every phase, n = 2, 3, 4.

Neither was written with the other in sight. Both compute in double precision by unlike
algorithms: the kernel eliminates contact by contact, the reference assembles and inverts.
"""

import numpy as np
import pytest

from slipgrasp.core.kernel.compilation.compiler import call
from slipgrasp.core.kernel.compilation.records import make_record
from slipgrasp.core.kernel.loop.status import RUNNING, TORQUE_NOT_FINITE
from slipgrasp.core.kernel.spatial.command import spatial_command
from slipgrasp.core.kernel.spatial.contact_problem import (
    FEW_STARTS,
    MANY_STARTS,
    SELECTION_ROOM,
)
from slipgrasp.core.kernel.spatial.contact_solution import NONE_CONSISTENT, SELECTED, spatial_answer
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from tests.references.hands import general_gains
from tests.references.spatial_contact import Problem, moving_directions, select
from tests.references.spatial_hands import (
    at_rest_where_stuck,
    cone_phases,
    pyramid_phases,
    random_state,
)
from tests.references.spatial_law import regressor, tracking_errors
from tests.references.spatial_plant import Phase, all_stick, finger_dynamics
from tests.references.spatial_run import Simulator
from tests.references.spatial_scenarios import random_spatial_scenario, world_of
from tests.spatial_evaluation import SpatialEvaluation

pytestmark = pytest.mark.slow

FRICTIONS = pytest.mark.parametrize("friction", ["cone", "pyramid"])
HANDS = [(n, seed) for n in (2, 3, 4) for seed in range(3)]
TOLERANCE = 1e-10


def sample(n, seed, unknown="masses", **values):
    rng = np.random.default_rng([n, seed])
    scenario = with_values(random_spatial_scenario(rng, n, unknown), values)
    return rng, scenario, world_of(scenario), random_state(rng, n)


def phases_of(scenario, rng, state):
    """All phases of the cone, each along its slip velocity; some of the pyramid."""
    if scenario.friction_cone == "pyramid":
        return pyramid_phases(rng, len(state.slip), 8)
    return cone_phases(state)


def assert_close(actual, wanted):
    np.testing.assert_allclose(actual, wanted, atol=TOLERANCE * (1.0 + np.abs(wanted).max()))


@FRICTIONS
@pytest.mark.parametrize(("n", "seed"), HANDS)
def test_plant_agrees_in_every_phase(n, seed, friction):
    rng, scenario, world, state = sample(n, seed, **{"simulation.friction": friction})
    for phase in phases_of(scenario, rng, state):
        torques = rng.uniform(-20.0, 20.0, (n, 3))
        at = at_rest_where_stuck(state, phase)
        kin, spin = world.hand.kinematics(at), at.velocity[3:]
        wanted = world.hand.solve_all_unknowns(kin, world.truth, phase, torques, spin=spin)
        motion = SpatialEvaluation(scenario, at, phase, world.estimates).plant(torques)
        assert_close(motion.arms, kin.arms)
        assert_close(motion.joint_rates, kin.qd)
        assert_close(motion.acceleration, wanted.acceleration)
        assert_close(motion.forces, wanted.forces)
        reduced = world.hand.reduced_form(kin, world.truth, phase, spin)
        assert_close(motion.determinant, np.linalg.det(reduced.M))


@pytest.mark.parametrize(("n", "seed"), HANDS)
def test_friction_in_the_joints_is_a_torque_against_each_rate(n, seed):
    rng, scenario, world, state = sample(n, seed)
    damping, dry = rng.uniform(0.1, 1.0, n), rng.uniform(0.1, 1.0, n)
    rough = with_values(
        scenario,
        {f"fingers.{i}.joint_damping": float(damping[i]) for i in range(n)}
        | {f"fingers.{i}.joint_friction": float(dry[i]) for i in range(n)},
    )
    for phase in cone_phases(state):
        torques = rng.uniform(-20.0, 20.0, (n, 3))
        at = at_rest_where_stuck(state, phase)
        kin, spin = world.hand.kinematics(at), at.velocity[3:]
        rates = kin.qd
        rubbing = damping[:, None] * rates + dry[:, None] * rates / np.sqrt(rates**2 + 0.01**2)
        wanted = world.hand.solve_all_unknowns(
            kin, world.truth, phase, torques - rubbing, spin=spin
        )
        motion = SpatialEvaluation(rough, at, phase, world.estimates).plant(torques)
        assert_close(motion.acceleration, wanted.acceleration)
        assert_close(motion.forces, wanted.forces)


@FRICTIONS
@pytest.mark.parametrize(("n", "seed"), HANDS)
def test_selection_finds_the_same_phases_directions_and_forces(n, seed, friction):
    rng, scenario, world, state = sample(n, seed, **{"simulation.friction": friction})
    compared = 0
    for phase in phases_of(scenario, rng, state):
        at = at_rest_where_stuck(state, phase)
        kin = world.hand.kinematics(at)
        for _ in range(4):
            pressed = rng.uniform([-6.0, -6.0, 2.0], [6.0, 6.0, 30.0], (n, 3))
            tips = kin.frames @ pressed[:, :, None]
            torques = (kin.jacobians.transpose(0, 2, 1) @ tips)[:, :, 0]
            torques += (world.truth.link_masses.T[:, :, None] * kin.bias_per_mass).sum(axis=0)
            G, c = world.hand.contact_space(kin, at, world.truth, torques)
            moving, directions = moving_directions(at.slip_velocity, friction)
            none = np.zeros((n, 2), bool)
            problem = Problem(G, c, world.truth.friction, moving, directions, none, friction)
            found = select(problem)
            own, motion = SpatialEvaluation(scenario, at, phase, world.estimates).select(torques)
            assert (own is None) == (found.phase is None)
            if own is None or found.phase is None:
                continue
            compared += 1
            np.testing.assert_array_equal(own.sticks, found.phase.sticks)
            np.testing.assert_allclose(own.directions, found.phase.directions, atol=1e-8)
            scale = 1.0 + np.abs(found.forces).max()
            np.testing.assert_allclose(motion.forces, found.forces, atol=1e-8 * scale)
    assert compared > 4


def test_newtons_method_begins_anew_until_it_has_the_forces_of_the_pyramid():
    """Three contacts, the first of which slips along its second tangent.

    From the forces of stick and from the first ten random ones the method goes round in circles.
    """
    G = np.array(
        [
            [9.61, -0.53, 0.29, 4.54, 0.51, 0.19, 2.91, 0.42, -0.34],
            [-0.53, 8.29, -0.88, -0.41, 0.0, 4.91, 0.33, 0.09, -3.79],
            [0.29, -0.88, 5.96, 0.18, -4.93, -2.65, 0.35, 3.73, -2.54],
            [4.54, -0.41, 0.18, 7.78, 0.16, 0.16, 3.99, -0.36, -0.27],
            [0.51, 0.0, -4.93, 0.16, 8.07, 0.96, -0.47, 0.1, 4.72],
            [0.19, 4.91, -2.65, 0.16, 0.96, 7.31, 0.11, -3.74, -2.37],
            [2.91, 0.33, 0.35, 3.99, -0.47, 0.11, 8.19, 0.0, 1.35],
            [0.42, 0.09, 3.73, -0.36, 0.1, -3.74, 0.0, 9.94, 0.36],
            [-0.34, -3.79, -2.54, -0.27, 4.72, -2.37, 1.35, 0.36, 7.14],
        ]
    )
    c = np.array([20.65, -5.61, -14.55, 16.99, 12.69, -22.3, -2.2, -5.61, 1.17])
    stick = [[-2.29, -5.26, 5.26], [-1.96, -0.91, 10.9], [1.4, 2.68, 2.56]]
    moving = np.array([[False, True], [False, False], [False, False]])
    values = {"simulation.friction": "pyramid"}
    values |= {f"fingers.{i}.friction": 1.0 for i in range(3)}
    _, scenario, world, state = sample(3, 0, **values)
    evaluation = SpatialEvaluation(scenario, state, all_stick(3), world.estimates)
    evaluation.work.forces[:3] = stick
    evaluation.discrete.slips[:3] = evaluation.discrete.directions[:3, :2] = moving
    room = make_record(SELECTION_ROOM)
    room.mobility[:9, :9], room.offset[:9] = G, c
    room.free[:3], room.bounds[:3] = ~moving, 1.0
    record = evaluation.model, evaluation.discrete, evaluation.work, room
    assert call(spatial_answer, *record, 0, FEW_STARTS) == NONE_CONSISTENT
    assert call(spatial_answer, *record, 0, MANY_STARTS) == SELECTED

    forces = room.force[:9].reshape(3, 3)
    opening = (G @ forces.ravel() + c).reshape(3, 3)
    np.testing.assert_allclose(opening[:, 2], 0.0, atol=1e-10)
    np.testing.assert_allclose(forces[0, 1], -forces[0, 2], rtol=1e-12)
    for i, axis in np.argwhere(~moving):
        force, normal, along = forces[i, axis], forces[i, 2], opening[i, axis]
        slips = evaluation.discrete.slips[i, axis] != 0.0
        assert force == pytest.approx(-np.sign(along) * normal) if slips else abs(force) < normal
        assert slips == (abs(along) > 1e-9)


def assert_least_excess(evaluation, wanted):
    """Where no force is inside all cones: as little beyond them, by forces that are no larger."""
    discrete, n = evaluation.discrete, evaluation.n
    assert discrete.violation == pytest.approx(wanted.violation, rel=1e-6, abs=1e-7)
    forces = evaluation.work.grasp.force[: 3 * n]
    assert np.linalg.norm(forces) < np.linalg.norm(wanted.forces) * (1.0 + 1e-4)


LAWS = {
    "hold": {"controller.distribution": "hold", "controller.grip_safety": 1.05},
    "exact": {"controller.distribution": "exact", "controller.grip_safety": 1.05},
    "floor": {"controller.distribution": "hold", "controller.minimum_normal_force": 3.0},
    "general": {"controller.distribution": "hold"},  # with gains of the slips and a full Q
}


@FRICTIONS
@pytest.mark.parametrize("unknown", ["masses", "friction"])
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(("n", "seed"), HANDS[::2])
def test_the_law_commands_the_same_torques_and_learns_at_the_same_rates(
    n, seed, law, unknown, friction
):
    values = {**LAWS[law], "simulation.friction": friction}
    if law == "general":
        values |= general_gains(np.random.default_rng(seed), 6, 2 * n)
    rng, scenario, world, state = sample(n, seed, unknown, **values)
    state = state._replace(
        position=world.position,
        quaternion=np.array(world.quaternion),
        velocity=0.1 * state.velocity,
        slip_velocity=0.1 * state.slip_velocity,
    )
    for phase in phases_of(scenario, rng, state):
        at = at_rest_where_stuck(state, phase)
        kin, spin, desired = world.hand.kinematics(at), at.velocity[3:], world.desired(0.0)
        believed = world.unknowns.fill(world.estimates)
        errors = tracking_errors(at, kin.rotation, desired).in_phase(phase)
        v = world.law.commanded_acceleration(errors, phase, desired)
        wanted = world.law.command(world.hand, kin, believed, phase, v, spin)
        evaluation = SpatialEvaluation(scenario, at, phase, world.estimates)
        torques = evaluation.command()
        if wanted.violation > 1e-7:
            assert_least_excess(evaluation, wanted)
            continue
        size = 1.0 + np.abs(wanted.torques).max()
        np.testing.assert_allclose(torques, wanted.torques, atol=1e-8 * size)
        own, motion = evaluation.select(torques)
        if own is None:
            continue
        reduced = world.hand.reduced_form(kin, believed, phase, spin).M
        U, _ = regressor(world.hand, kin, world.unknowns, phase, motion.acceleration, spin)
        gradient = U.T @ world.law.weighted_errors(reduced, errors)
        pull = world.law.leakage(world.estimates) * world.estimates
        assert_close(evaluation.learn(), world.law.adaptation_gain * gradient - pull)


@pytest.mark.parametrize(("n", "seed"), HANDS)
def test_pd_control_takes_the_forces_nearest_to_its_grip_and_carries_the_links(n, seed):
    """F = F_g + W^+ (d - W F_g) by NumPy's pseudoinverse, d = M_o (K_p e + K_v e') + weight."""
    grip = 25.0
    values = {"controller.kind": "pd-gravity", "controller.grip_force": grip}
    rng, scenario, world, state = sample(n, seed, **values)
    turned = world.quaternion + rng.uniform(-0.05, 0.05, 4)
    state = state._replace(
        position=world.position + rng.uniform(-0.01, 0.01, 3),
        quaternion=turned / np.linalg.norm(turned),
    )
    believed, gravity = world.unknowns.fill(world.estimates), world.hand.gravity
    for phase in cone_phases(state):
        at = at_rest_where_stuck(state, phase)
        still = at._replace(velocity=np.zeros(6), slip_velocity=np.zeros((n, 2)))
        kin = world.hand.kinematics(at)
        errors = tracking_errors(at, kin.rotation, world.desired(0.0))
        feedback = world.law.position_gain * errors.e + world.law.velocity_gain * errors.rate
        M_o, _ = world.hand.object_dynamics(kin, believed, np.zeros(3))
        wrench = M_o @ feedback[:6] + [0.0, 0.0, believed.object_mass * gravity, 0.0, 0.0, 0.0]
        squeeze = np.tile([0.0, 0.0, grip], n)
        forces = squeeze + np.linalg.pinv(kin.W, rcond=1e-9) @ (wrench - kin.W @ squeeze)
        _, weights = finger_dynamics(world.hand.kinematics(still), believed)
        tips = kin.frames @ forces.reshape(n, 3, 1)
        wanted = (kin.jacobians.transpose(0, 2, 1) @ tips)[:, :, 0] + weights
        assert_close(SpatialEvaluation(scenario, at, phase, world.estimates).command(), wanted)


RUNS = [
    ("spatial-prism", "cone", 0.004),
    ("spatial-composite", "cone", 0.009),
    ("spatial-composite", "pyramid", 0.009),
    ("spatial-unknown-friction", "cone", 0.02),
]


@pytest.mark.parametrize(("preset", "friction", "duration"), RUNS)
def test_runs_agree_through_events_and_ticks(preset, friction, duration):
    """Slips to 1e-11 m, ends of slips to 1e-9 s, estimates to 1e-8."""
    values = {
        "simulation.duration": duration,
        "simulation.output_rate": 1000.0,
        "simulation.friction": friction,
    }
    scenario = with_values(load_scenario(preset), values)
    simulator = Simulator(world_of(scenario)._replace(tolerance=1e-9))
    reference = simulator.simulate(duration)
    result = simulate(scenario)
    assert result.outcome.value == reference.outcome
    np.testing.assert_allclose(result.trace.slip[-1], reference.slip.ravel(), atol=1e-11)
    np.testing.assert_allclose(result.metrics.slip_path, reference.slip_path, atol=1e-11)
    # The reference's last tick has learnt already.
    before = result.trace.estimates[-1]
    assert np.all(np.isfinite(before))
    ends = [change.time for change in result.phase_changes if change.to_phase == 0]
    wanted = np.sort(reference.slip_ends[~np.isnan(reference.slip_ends)])
    np.testing.assert_allclose(ends, wanted, atol=1e-9)


@FRICTIONS
@pytest.mark.parametrize("latency", [0.0, 0.003])
def test_a_slip_is_asked_to_stop_until_the_next_torque_acts(latency, friction):
    """On the cone a contact brakes along its slip, in the pyramid each tangent by itself."""
    period, most, n = 0.002, 2.0, 3
    rng, scenario, world, state = sample(
        n,
        0,
        **{
            "simulation.friction": friction,
            "controller.kind": "composite",
            "controller.slip_stop": most,
            "controller.control_period": period,
            "controller.latency": latency,
        },
    )
    state.slip_velocity[:] = rng.uniform(-1.5, 1.5, (n, 2)) * most * period
    state.slip[:] = 0.0
    _, directions = moving_directions(state.slip_velocity, friction)
    phase = Phase(np.zeros((n, 2), bool), directions)
    evaluation = SpatialEvaluation(scenario, state, phase, world.estimates)
    evaluation.command()
    if friction == "pyramid":
        speeds = np.abs(state.slip_velocity)
    else:
        speeds = np.repeat(np.linalg.norm(state.slip_velocity, axis=1)[:, None], 2, axis=1)
    brake = np.minimum(most, speeds / (period + latency) + 0.01 * most)
    gains = np.broadcast_to(scenario.controller.velocity_gain, 6 + 2 * n)[6:].reshape(n, 2)
    wanted = -gains * state.slip_velocity - brake * directions
    assert_close(evaluation.work.room.slip_demand[:n], wanted)


def test_a_law_whose_torque_is_not_finite_says_so():
    """That is another fault than an estimate of the inertia that is singular."""
    _, scenario, world, state = sample(3, 0)
    phase = next(iter(cone_phases(state)))
    for estimates, wanted in (
        (world.estimates, RUNNING),
        (np.full_like(world.estimates, np.inf), TORQUE_NOT_FINITE),
        (np.full_like(world.estimates, np.nan), TORQUE_NOT_FINITE),
    ):
        evaluation = SpatialEvaluation(scenario, state, phase, estimates)
        parts = evaluation.model, evaluation.discrete, 0.0, evaluation.senses, evaluation.work
        assert call(spatial_command, *parts) == wanted
