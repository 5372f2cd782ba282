"""A sample of the twins whose intervals are counted by ``python -m benchmarks fit-coverage``."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks import fit_coverage
from slipgrasp.core.fit.fit import FitOptions, fit
from slipgrasp.core.fit.objective import Objective
from slipgrasp.core.fit.optimiser import minimise


@pytest.mark.slow
def test_nearly_all_intervals_of_twins_hold_the_truth(kernel):
    case = fit_coverage.CASES[0]
    problem = fit_coverage.make_problem(case)
    report = fit(problem, FitOptions(starts=1, seed=2, twins=12))

    assert report.coverage is not None
    for key, value in case.truth.items():
        assert report.best[key] == pytest.approx(value, rel=1e-6)
        # Fewer than 9 of 12 have a probability of 0.2 %.
        assert report.coverage.covered[key] >= 9


@pytest.mark.slow
def test_linear_signals_have_intervals_that_hold_the_truth_in_95_percent(kernel):
    problem = fit_coverage.make_problem(fit_coverage.CASES[0])
    report = fit(problem, FitOptions(starts=1))
    covered = fit_coverage.cover_linear(problem, report, seed=2, twins=4000)

    # Four standard deviations.
    assert covered / 4000 == pytest.approx(0.95, abs=0.014)


@pytest.mark.slow
def test_a_fit_leaves_the_minimum_between_two_jumps_for_a_lower_one(kernel):
    case = fit_coverage.Case(preset="spatial-prism", truth={"fingers.0.friction": 0.35})
    problem = fit_coverage.make_problem(case)
    noise = np.random.default_rng([1, 1]).standard_normal(problem.data.values.shape)
    values = problem.data.values + problem.data.sigmas * noise
    problem = problem.with_data(replace(problem.data, values=values))
    near = minimise(Objective(problem), problem.start)
    report = fit(problem, FitOptions(starts=1))

    assert report.chi_squared < near.chi_squared - 1.0
    found = report.parameters["fingers.0.friction"]
    assert min(rise for _, rise in found.profile) > -1e-9
