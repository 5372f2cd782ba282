"""What torques can do in each phase: rank and shares against NumPy, and full tracking by three."""

from itertools import product

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from tests.each_case import each_case
from tests.phases import PHASES
from tests.references.hands import random_scenario, random_state
from tests.state_evaluation import evaluate_state


def evaluation(phase, seed, **law):
    rng = np.random.default_rng([seed, *(g + 1 for g in phase)])
    scenario = random_scenario(rng, len(phase), "nothing", polygon=seed % 2 == 0, **law)
    state = random_state(rng, scenario, phase)
    return scenario, state, evaluate_state(scenario, 0.4, *state, phase, ())


@each_case("phase", PHASES)
def test_rank_and_shares_are_those_of_the_input_matrix(phase):
    for seed in range(4):
        _, _, found = evaluation(phase, seed)
        B = found.reduced_input
        assert found.input_rank == np.linalg.matrix_rank(B, rtol=1e-9)
        shares = np.diag(B @ np.linalg.pinv(B, rcond=1e-9))[:3]
        np.testing.assert_allclose(found.controllability, shares, atol=1e-8)


def test_only_two_slipping_fingers_lack_an_input():
    ranks = {phase: evaluation(phase, 0)[2].input_rank for phase in PHASES}
    lacking = [phase for phase, rank in ranks.items() if rank < 3 + np.count_nonzero(phase)]
    assert sorted(lacking) == sorted(product((1, -1), repeat=2))


@pytest.mark.slow
@pytest.mark.parametrize("grasp_force", ["minimum", "none"])
@each_case("phase", [p for p in PHASES if len(p) in (3, 4)])
def test_three_and_four_fingers_track_the_object_fully_in_every_phase(phase, grasp_force):
    """With true parameters e'' + K_v e' + K_p e = 0, for the object and for slipping contacts."""
    for seed in range(4):
        scenario, state, found = evaluation(phase, seed, grasp_force=grasp_force)
        assert found.input_rank == 3 + np.count_nonzero(phase)
        path, control, t = scenario.trajectory, scenario.controller, 0.4
        wanted = np.array(path.acceleration)
        error = np.array(path.start) + wanted * t**2 / 2 - state.pose
        rate = wanted * t - state.velocity
        residual = (
            wanted
            - found.acceleration[:3]
            + np.array(control.velocity_gain)[:3] * rate
            + np.array(control.position_gain) * error
        )
        scale = np.abs(found.acceleration).max()
        np.testing.assert_allclose(residual, 0.0, atol=1e-9 * scale)
        slowing = np.array(control.velocity_gain)[3:] * -state.slip_velocity * np.abs(phase)
        np.testing.assert_allclose(found.acceleration[3:], slowing, atol=1e-9 * scale)


def test_the_trace_says_what_is_controllable_in_its_phases():
    trace = simulate(load_scenario("paper-case-2")).trace
    slipping = np.count_nonzero(trace.phase, axis=1)
    np.testing.assert_array_equal(trace.input_rank, np.minimum(3 + slipping, 4))
    np.testing.assert_array_equal(trace.controllability[slipping < 2], 1.0)
    assert (trace.controllability[slipping == 2].min(axis=1) < 0.5).all()


def test_three_fingers_that_know_their_object_do_not_lose_track_of_it():
    known = {f"estimates.{i}.initial": 0.25 for i in range(3)}
    known |= {"estimates.3.initial": 1.0, "estimates.4.initial": 0.01042}
    result = simulate(with_values(load_scenario("three-fingers"), known))
    assert result.outcome.value == "completed"
    assert np.abs(result.trace.tracking_error).max() < 1e-4
    np.testing.assert_allclose(result.trace.energy_residual, 0.0, atol=1e-7)


@pytest.mark.parametrize(
    "name", ["three-fingers", "unequal-fingers", "wide-object", "tilted-object"]
)
def test_the_hands_that_come_with_it_hold_their_object(name):
    result = simulate(load_scenario(name))
    assert result.outcome.value == "completed"
    assert result.metrics.held
    assert 0.0 < sum(result.metrics.slip_path) < 1e-3
    assert np.abs(result.trace.tracking_error[-1, :2]).max() < 1e-4
    np.testing.assert_allclose(result.trace.energy_residual, 0.0, atol=1e-6)
