"""The composite law: what it promises, and its estimates against least squares at one go."""

import numpy as np
import pytest
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import run_to_end, simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import Outcome
from tests.core.test_closed_loop_identities import state_of
from tests.references.closed_loop import ClosedLoop

CASE_2 = load_scenario("composite-case-2")
NOISY = load_scenario("composite-case-2-noisy")
MASSES = with_values(
    load_scenario("paper-case-1"),
    {
        "controller.kind": "composite",
        "controller.control_period": 0.001,
        "controller.grip_safety": 1.05,
    },
)
EVERY_TICK = {"simulation.output_rate": 1000.0}
LEAST_SQUARES_ONLY = {"controller.lyapunov_weight": 0.0, **EVERY_TICK}
# Forces of slipping contacts on their cones let a slip decay as slowly as is asked.
LASTING_SLIP = {"controller.distribution": "exact", "controller.velocity_gain": 10.0}
SEEDS = range(8)


def at_ticks(trace):
    """Rows after every tick, by index: the last of each time of the grid; none at the end."""
    times = trace.times
    on_grid = np.abs(times * 1000.0 - np.rint(times * 1000.0)) < 1e-6
    last = np.append(np.diff(times) > 0.0, [True])
    return np.flatnonzero(on_grid & last & (times < times[-1]))


def test_case_2_stops_within_30_ms_and_grips_as_little_as_friction_allows():
    result = simulate(CASE_2)
    trace = result.trace
    assert result.outcome is Outcome.COMPLETED
    assert result.metrics.held
    assert max(result.metrics.slip_path) <= 0.5e-3
    assert 0.0 < result.metrics.last_slip_time <= 0.030
    assert np.all(np.abs(trace.tracking_error[trace.times >= 1.0, :2]) < 1e-3)
    # |F_x| = mu F_n is the least grip; docs/model.md, Friction law.
    least = np.abs(trace.tangential_force) / trace.friction_coefficient
    excess = trace.normal_force / least
    assert np.all(excess[-1] > 1.0)
    assert np.all(excess[-1] < 1.1)
    # Friction is believed to be 1.2 at first: the grip was too weak, then it was found.
    assert np.all(excess[0] < 1.0)
    np.testing.assert_allclose(trace.estimates[-1, :3], trace.true_parameters[-1, :3], rtol=1e-4)


@pytest.mark.parametrize("latency", [0.0, 0.002])
def test_case_2_is_held_with_noise_whatever_the_seed(latency):
    values = {"controller.latency": latency, "simulation.duration": 2.0}
    paths = []
    for seed in SEEDS:
        result = simulate(with_values(NOISY, {**values, "simulation.seed": seed}))
        assert result.outcome is Outcome.COMPLETED, (seed, result.reason)
        assert result.metrics.held, seed
        paths.append(max(result.metrics.slip_path))
    assert max(paths) <= 5e-3
    assert len(set(paths)) == len(SEEDS)


@pytest.mark.parametrize(("left", "right"), [(0.25, 0.30), (0.45, 0.35), (0.2, 0.5)])
def test_unequal_friction_is_held(left, right):
    friction = {"fingers.0.friction": left, "fingers.1.friction": right}
    result = simulate(with_values(CASE_2, {**friction, "simulation.duration": 2.0}))
    assert result.metrics.held
    assert max(result.metrics.slip_path) < 1e-3


def test_the_grip_is_released_when_the_object_turns_out_light():
    heavy = {f"estimates.{i}.initial": v for i, v in enumerate([0.25, 0.25, 2.0])}
    result = simulate(with_values(CASE_2, heavy))
    force = result.trace.normal_force
    assert result.metrics.held
    assert np.all(force[0] > 1.5 * force[-1])
    np.testing.assert_allclose(force[-1], 1.05 * 0.5 * 9.81 / 0.25, rtol=0.01)


def residuals(loop, values, state, phase, torques, acceleration):
    """Force of the fingertips less what object and friction ask for; zero at the truth."""
    hand, kin = loop.hand, loop.hand.kinematics(state)
    believed = loop.unknowns.fill(values)
    M, h = hand.finger_dynamics(kin, believed)
    qdd = kin.A_q_inverse @ (kin.b - kin.A_o @ acceleration[:3] - kin.A_s @ acceleration[3:])
    forces = np.linalg.solve(kin.J.T, torques - h - M @ qdd)
    M_o, h_o = hand.object_dynamics(believed)
    body = kin.W @ forces - M_o @ acceleration[:3] - h_o
    sliding = [
        -fx - gamma * mu * fn
        for (fx, fn), gamma, mu in zip(forces.reshape(-1, 2), phase, believed.friction, strict=True)
        if gamma
    ]
    return np.append(body, sliding)


def rows_at(loop, trace, row):
    """Y and y of all equations at one row of a trace, and how inexact each is allowed to be."""
    state = state_of(trace, row)
    acceleration = np.append(trace.object_acceleration[row], trace.slip_acceleration[row])
    phase, torques = trace.phase[row].astype(int), np.ravel(trace.joint_torque[row])
    p = len(loop.unknowns.keys)

    def at(values):
        return residuals(loop, values, state, phase, torques, acceleration)

    y = at(np.zeros(p))
    arms = loop.hand.tip_positions(state.pose, state.slip) - state.pose[:2]
    scale = np.ones(len(y))
    scale[2] = np.sqrt(np.mean(np.sum(arms**2, axis=1)))
    return np.array([y - at(unit) for unit in np.eye(p)]).T, y, scale


def weighted_estimates(scenario, trace, ticks, deviation):
    """What weighted least squares make of the prior and the rows so far, after every tick."""
    loop, controller = ClosedLoop.from_scenario(scenario), scenario.controller
    keep = np.sqrt(controller.forgetting)
    matrix = np.diag(1.0 / deviation)
    right = loop.initial_estimates / deviation
    found = []
    for row in ticks:
        Y, y, scale = rows_at(loop, trace, row)
        matrix = np.vstack([matrix, Y / (controller.force_noise * scale)[:, None]])
        right = np.append(right, y / (controller.force_noise * scale))
        found.append(np.linalg.lstsq(matrix, right, rcond=None)[0])
        matrix, right = keep * matrix, keep * right
    return np.array(found)


@pytest.mark.parametrize(
    ("scenario", "duration"),
    [(CASE_2, 0.05), (MASSES, 0.1)],
    ids=["friction and object", "all masses"],
)
def test_without_forgetting_the_estimates_are_those_of_least_squares(scenario, duration):
    keys = [estimate.parameter for estimate in scenario.estimates]
    deviation = np.array([0.1 if key == "object.inertia" else 3.0 for key in keys])
    values = {"controller.forgetting": 1.0, "simulation.duration": duration}
    scenario = with_values(scenario, {**LEAST_SQUARES_ONLY, **values})
    trace = simulate(scenario).trace
    ticks = at_ticks(trace)
    expected = weighted_estimates(scenario, trace, ticks[:-1], deviation)
    np.testing.assert_allclose(trace.estimates[ticks[1:]], expected, rtol=1e-5, atol=1e-7)
    assert np.ptp(trace.estimates, axis=0).max() > 0.3


def test_with_forgetting_old_rows_count_less():
    """While both contacts slip all three are excited, and no variance is at its cap."""
    scenario = with_values(
        CASE_2,
        {
            **LEAST_SQUARES_ONLY,
            "controller.forgetting": 0.9,
            "controller.slip_stop": 0.0,
            **LASTING_SLIP,
            "controller.initial_deviation": [2.0, 2.0, 1.0, 1e-3],
            "estimates.3.initial": 0.01042,
            "simulation.duration": 0.02,
        },
    )
    trace = simulate(scenario).trace
    ticks = at_ticks(trace)
    assert np.all(trace.phase[ticks] != 0)
    deviation = np.array([2.0, 2.0, 1.0, 1e-3])
    expected = weighted_estimates(scenario, trace, ticks[:-1], deviation)
    np.testing.assert_allclose(trace.estimates[ticks[1:], :3], expected[:, :3], rtol=1e-5)


@pytest.mark.parametrize("scenario", [CASE_2, NOISY, MASSES], ids=["case 2", "noisy", "masses"])
def test_the_covariance_stays_symmetric_positive_and_below_its_start(scenario):
    simulation = Simulation(with_values(scenario, {"simulation.duration": 5.0}))
    prior = np.array([9.0 if "inertia" not in e.parameter else 0.01 for e in scenario.estimates])

    def check(simulation):
        p = len(prior)
        covariance = simulation._run.memory.covariance[:p, :p]
        assert np.array_equal(covariance, covariance.T)
        assert np.linalg.eigvalsh(covariance)[0] > 0.0
        assert np.all(np.diag(covariance) <= prior * (1.0 + 1e-12))

    run_to_end(simulation, check)
    assert simulation.result().metrics.held


def test_estimates_stay_within_their_bounds():
    trace = simulate(NOISY).trace
    low = [estimate.minimum for estimate in NOISY.estimates]
    high = [estimate.maximum for estimate in NOISY.estimates]
    assert np.all(trace.estimates >= low)
    assert np.all(trace.estimates <= high)


def test_one_that_knows_everything_holds_without_learning():
    known = {f"estimates.{i}.initial": v for i, v in enumerate([0.25, 0.25, 1.0, 0.01042])}
    oracle = simulate(with_values(CASE_2, {**known, "controller.probing": 0.0}))
    assert oracle.metrics.held
    assert oracle.metrics.slip_path == (0.0, 0.0)
    np.testing.assert_allclose(
        oracle.trace.estimates, oracle.trace.true_parameters, rtol=1e-6, atol=1e-9
    )


def test_a_reset_estimate_is_what_it_was_reset_to():
    reset = {"time": 0.02, "parameter": "estimates.2.initial", "value": 3.0}
    trace = simulate(
        with_values(CASE_2, {**EVERY_TICK, "simulation.duration": 0.1, "changes": [reset]})
    ).trace
    row = np.flatnonzero(trace.times == 0.02)[-1]
    assert trace.estimates[row, 2] == 3.0
    assert trace.estimates[-1, 2] < 1.2


def test_it_starts_as_any_other_law_in_mid_run():
    """The sampled law of the paper drops 0.25 / 0.30; composite takes over in time."""
    switch = {"time": 0.05, "parameter": "controller.kind", "value": "composite"}
    values = {"controller.kind": "theorem-4", "fingers.1.friction": 0.3, **LASTING_SLIP}
    assert simulate(with_values(CASE_2, values)).outcome is Outcome.SEPARATED
    result = simulate(with_values(CASE_2, {**values, "changes": [switch]}))
    assert result.metrics.held


@pytest.mark.parametrize("believed", [0.06, 0.1])
def test_probing_releases_a_grip_that_is_too_strong_for_less_than_a_micrometre(
    believed: float,
) -> None:
    low = {f"estimates.{i}.initial": believed for i in range(2)}
    stubborn = simulate(with_values(CASE_2, {**low, "controller.probing": 0.0}))
    probing = simulate(with_values(CASE_2, low))
    assert _grip_over_least(stubborn)[-1].min() > 2.5
    assert stubborn.metrics.slip_path == (0.0, 0.0)
    late = probing.trace.times > 3.0
    assert (_grip_over_least(probing)[late] < 1.1).all()
    assert max(probing.metrics.slip_path) < 1e-6


def test_a_friction_known_from_a_slip_is_probed_no_more() -> None:
    """After its first slip a belief that is set too low stays: no slip is sought again."""
    reset = {"time": 1.0, "parameter": "estimates.0.initial", "value": 0.1}
    trace = simulate(with_values(CASE_2, {"simulation.duration": 2.0, "changes": [reset]})).trace
    assert trace.estimates[-1, 0] == pytest.approx(0.1, rel=1e-3)


def _grip_over_least(run: RunResult) -> NDArray[np.float64]:
    """Normal force over the least that friction allows for the tangential force, ``(rows, 2)``."""
    trace = run.trace
    return trace.normal_force * trace.friction_coefficient / np.abs(trace.tangential_force)
