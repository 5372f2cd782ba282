"""A sample of the twins whose intervals are counted by ``python -m benchmarks fit-coverage``."""

import pytest

from benchmarks import fit_coverage
from slipgrasp.core.fit.fit import FitOptions, fit


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
