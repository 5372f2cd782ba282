"""What torques can do in each phase: rank and shares against NumPy, and full tracking by three."""

from itertools import product

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario
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


def test_the_trace_says_what_is_controllable_in_its_phases():
    trace = simulate(load_scenario("paper-case-2")).trace
    slipping = np.count_nonzero(trace.phase, axis=1)
    np.testing.assert_array_equal(trace.input_rank, np.minimum(3 + slipping, 4))
    np.testing.assert_array_equal(trace.controllability[slipping < 2], 1.0)
    assert (trace.controllability[slipping == 2].min(axis=1) < 0.5).all()


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
