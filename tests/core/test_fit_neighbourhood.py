"""Fits across jumps of chi-squared, against closed forms of signals with steps and slopes."""

from itertools import pairwise

import numpy as np
import pytest

from slipgrasp.core.fit.neighbourhood import explore
from slipgrasp.core.fit.objective import Objective
from slipgrasp.core.fit.optimiser import DIFFERENCE_STEP, minimise
from slipgrasp.core.fit.profile import BETTER, THRESHOLD_95, contains, profile
from tests.core.formula_fits import evaluation_of, formula_problem

SAMPLES = 50
SLOPE = 100.0
"""Change of the signals with a parameter, in standard deviations: that of an estimate is 0.01."""

JUMPS = np.array([0.4887, 0.4985, 0.5078, 0.5171])
STEP = np.array([-1.25, 1.35])
"""Jump of the signals, along the slope against it and across it, in standard deviations."""

TRUTH = np.array([0.5, 0.5])
BASIS, _ = np.linalg.qr(np.random.default_rng(3).standard_normal((SAMPLES, 3)))


def signals(values):
    """Linear in the first value, with a sawtooth of the second one; whitened."""
    first, second = SLOPE * values
    along, across = STEP * np.count_nonzero(values[1] >= JUMPS)
    return BASIS @ [first + 0.3 * second, second + along, across]


def formula_objective(model, truth=TRUTH):
    return Objective(formula_problem(truth, model(truth)), evaluation_of(model))


def explored(objective):
    """The minimum of an objective, with runs around it."""
    best = minimise(objective, objective.problem.start)
    found = [profile(objective, best, k, THRESHOLD_95) for k in range(len(best.shares))]
    return best, explore(objective, best, found, THRESHOLD_95)


def twin_of(objective, number):
    """Other data, and their noise along and across the slope of the second parameter."""
    noise = np.random.default_rng([11, number]).standard_normal(SAMPLES)
    data = objective.model(TRUTH) + noise[:, None]
    return objective.with_data(data), noise @ BASIS


def lowest(noise, low=-np.inf, high=np.inf):
    """Smallest chi-squared for second values within limits, without what no value changes.

    Between two jumps it is the squared distance of the noise from a line segment.
    """
    edges = np.concatenate([[-np.inf], JUMPS, [np.inf]])
    here = np.count_nonzero(TRUTH[1] >= JUMPS)
    heights = []
    for number, (start, end) in enumerate(pairwise(edges)):
        start, end = max(start, low), min(end, high)
        if start <= end:
            along, across = noise[1:] - STEP * (number - here)
            ends = SLOPE * (np.array([start, end]) - TRUTH[1])
            heights.append((along - np.clip(along, *ends)) ** 2 + across**2)
    return min(heights)


def without_noise(twin, noise):
    """The part of chi-squared that no value changes."""
    return float(np.sum(twin.residuals(TRUTH) ** 2) - np.sum(noise**2))


def holds_truth(noise):
    """Whether values with a rise up to the threshold are on both sides of the truth, or there."""
    sides = lowest(noise, low=TRUTH[1]), lowest(noise, high=TRUTH[1])
    return max(sides) - lowest(noise) <= THRESHOLD_95


@pytest.fixture(scope="module")
def objective():
    return formula_objective(signals)


@pytest.fixture(scope="module")
def around(objective):
    return explored(objective)[1]


def test_the_minimum_of_50_twins_is_the_lowest_between_any_two_jumps(objective, around):
    missed = 0
    for number in range(50):
        twin, noise = twin_of(objective, number)
        expected = lowest(noise) + without_noise(twin, noise)
        assert around.minimise(twin, TRUTH).chi_squared == pytest.approx(expected, abs=BETTER)
        missed += minimise(twin, TRUTH).chi_squared > expected + BETTER
    # Least squares stay between the jumps around the truth.
    assert missed > 10


def test_the_minimum_with_a_fixed_parameter_is_also_the_lowest_of_all(objective, around):
    for number in range(20):
        twin, noise = twin_of(objective, number)
        found = around.minimise(twin, TRUTH, {1: 0.51})
        expected = lowest(noise, 0.51, 0.51) + without_noise(twin, noise)
        assert found.shares[1] == 0.51
        assert found.chi_squared == pytest.approx(expected, abs=0.05)


@pytest.mark.slow
def test_as_many_intervals_hold_the_truth_as_the_closed_form_says(objective, around):
    count, inside, expected = 100, 0, 0
    for number in range(count):
        twin, noise = twin_of(objective, number)
        found = around.minimise(twin, TRUTH)
        inside += contains(twin, found, 1, THRESHOLD_95, TRUTH, around.minimise)
        expected += holds_truth(noise)
    draws = np.random.default_rng(0).standard_normal((5000, 3))
    exact = np.mean([holds_truth(noise) for noise in draws])

    assert abs(inside - expected) <= 0.02 * count
    assert 0.92 < exact < 0.98
    # Four standard deviations.
    assert inside / count == pytest.approx(exact, abs=4.0 * np.sqrt(exact * (1.0 - exact) / count))


def test_the_slope_is_that_between_jumps_also_where_a_difference_crosses_one():
    truth = np.array([0.5, JUMPS[1] - 0.5 * DIFFERENCE_STEP])
    objective = formula_objective(signals, truth)
    best, around = explored(objective)
    slopes = np.linalg.norm(around.jacobian, axis=0)

    assert np.linalg.norm(best.jacobian[:, 1]) > 10.0 * SLOPE
    assert slopes == pytest.approx([SLOPE, SLOPE * np.hypot(1.0, 0.3)], rel=1e-3)


@pytest.mark.parametrize("steepness", [1.0, 60.0])
def test_signals_without_jumps_leave_the_minimum_and_its_search_as_they_are(steepness):
    def model(values):
        steep = np.clip(steepness * SLOPE * (values[1] - 0.505), 0.0, 2.0)
        return BASIS @ [SLOPE * values[0], SLOPE * values[1], steep]

    objective = formula_objective(model)
    _, around = explored(objective)
    twin, _ = twin_of(objective, 0)
    found, plain = around.minimise(twin, TRUTH), minimise(twin, TRUTH)

    assert around.lines == ()
    assert np.array_equal(found.shares, plain.shares)
    assert np.array_equal(found.jacobian, plain.jacobian)
