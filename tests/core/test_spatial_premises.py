"""Premises and bounds of the theorems for spatial hands, against the second implementation."""

import numpy as np
import pytest

from slipgrasp.core.run.premises import WINDOW, find_premises, has_premises
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from tests.references.hands import general_gains
from tests.references.spatial_plant import State, all_stick
from tests.references.spatial_scenarios import world_of

pytestmark = pytest.mark.slow

DURATION = 0.02  # all fingertips slip [s]


def off(period, **values):
    """How far Eq. 52, summed over the ticks, is from what V falls by, as a share of that."""
    asked = {
        "controller.control_period": period,
        "simulation.output_rate": 1.0 / period,
        "simulation.duration": DURATION,
        **values,
    }
    run = simulate(with_values(load_scenario("spatial-unknown-friction"), asked))
    trace, premises = run.trace, find_premises(run)
    assert premises.disturbance.max() > 1.0
    times = period * np.arange(round(DURATION / period))
    ticks = np.searchsorted(trace.times, times + 1e-9, side="right") - 1
    fallen = trace.lyapunov_value[-1] - trace.lyapunov_value[ticks[0]]
    return period * premises.decrease[ticks].sum() / fallen - 1.0


SETTINGS = {
    "free": {},
    "pulled back": {"controller.estimate_norm_bound": 1.0},
    "gains of the slips, full Q": general_gains(np.random.default_rng(0), 6, 6),
}


@pytest.mark.parametrize("values", SETTINGS.values(), ids=SETTINGS)
def test_the_lyapunov_value_falls_by_what_the_bound_is_made_of(values):
    """Torques and rates are held from tick to tick, so the sum is right to first order."""
    coarse, fine = off(2e-4, **values), off(1e-4, **values)
    assert abs(fine) < 0.03
    assert coarse / fine == pytest.approx(2.0, rel=0.05)


def test_eq_20_of_an_object_at_rest_is_the_square_of_one_matrix():
    values = {"trajectory.acceleration": (0.0,) * 6, "simulation.duration": 0.15}
    still = with_values(load_scenario("spatial-prism"), values)
    run, world = simulate(still), world_of(still)
    n, pose = len(still.fingers), np.array(still.trajectory.start)
    zeros = np.zeros((n, 2))
    kin = world.hand.kinematics(State(pose[:3], pose[3:], np.zeros(6), zeros, zeros))
    matrix = world.hand.reduced_form(kin, world.truth, all_stick(n), np.zeros(3)).M
    squares = np.linalg.svd(matrix, compute_uv=False) ** 2
    premises, ready = find_premises(run), run.trace.times >= WINDOW
    assert ready.any()
    np.testing.assert_allclose(premises.least_excitation[ready], WINDOW * squares[-1], rtol=1e-9)
    np.testing.assert_allclose(premises.greatest_excitation[ready], WINDOW * squares[0], rtol=1e-9)


def test_in_the_pyramid_the_theorems_speak_of_every_tangent_by_itself():
    values = {"simulation.friction": "pyramid", "simulation.duration": 0.02}
    run = simulate(with_values(load_scenario("spatial-unknown-friction"), values))
    assert has_premises(run.scenario)
    assert (find_premises(run).disturbance[1:-1] > 1.0).all()
