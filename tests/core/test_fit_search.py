"""The search of a fit leaves false minima where a contact sticks."""

from dataclasses import replace

import numpy as np
import pytest

from slipgrasp.core.fit.fit import FitOptions, fit
from slipgrasp.core.fit.objective import Objective
from slipgrasp.core.fit.optimiser import minimise
from slipgrasp.core.fit.problem import FitProblem, Observations
from slipgrasp.core.fit.progress import ProgressReports
from slipgrasp.core.fit.report import StartReport
from slipgrasp.core.fit.search import SCAN_POINTS, scan_frictions, search_from_starts
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.columns import columns_of
from tests.core.formula_fits import formula_problem

SIGMA = 2e-4
SAMPLES = 50
TRUTH = {"object.mass": 1.13, "fingers.0.friction": 0.27}


def reports(problem):
    return ProgressReports(problem, lambda progress: None)


def formula_objective(model, key, start=0.8):
    """An objective of one parameter: its data are 0 with noise 1, its model is a formula."""
    problem = formula_problem([start], np.zeros(SAMPLES), key=key)
    return Objective(problem, lambda _, values: np.full((SAMPLES, 1), model(*values)))


def valley_beside_plateau(friction):
    """Zero at 0.41, and below the plateau only between two points of a scan."""
    return 1.0 if friction > 0.415 else (friction - 0.41) * 60.0


def test_a_scan_finds_a_valley_beside_a_plateau_that_none_of_its_points_is_below():
    objective = formula_objective(valley_beside_plateau, "fingers.0.friction")
    scan = (np.arange(SCAN_POINTS) + 0.5) / SCAN_POINTS
    assert min(abs(valley_beside_plateau(friction)) for friction in scan) == 1.0
    minima = search_from_starts(objective, 1, 0, reports(objective.problem))
    assert minima[0].chi_squared == pytest.approx(SAMPLES)

    found = scan_frictions(objective, minima, reports(objective.problem))
    assert found.shares[0] == pytest.approx(0.41, abs=1e-3)
    assert found.chi_squared < 1.0


def test_only_frictions_are_scanned():
    objective = formula_objective(valley_beside_plateau, "object.mass")
    minima = search_from_starts(objective, 1, 0, reports(objective.problem))

    assert scan_frictions(objective, minima, reports(objective.problem)) is minima[0]


def test_a_confined_search_stays_within_its_limits():
    objective = formula_objective(lambda friction: 10.0 * friction, "fingers.0.friction")
    found = minimise(objective, objective.problem.start, limits={0: (0.25, 0.9)})

    assert found.shares[0] == pytest.approx(0.25, abs=1e-6)


@pytest.fixture(scope="module")
def base(kernel):
    return with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.3})


@pytest.mark.parametrize("seed", [0, 1])
def test_the_minimum_is_no_higher_than_the_truth_where_least_squares_end_in_sticking(base, seed):
    run = simulate(with_values(base, TRUTH))
    columns = {c.name: (c.unit, np.asarray(c.values, float)) for c in columns_of(run.trace)}
    data = Observations.choose(run.trace.times, columns, {"object_pose": SIGMA})
    noise = SIGMA * np.random.default_rng(seed).standard_normal(data.values.shape)
    problem = FitProblem.make(base, [*TRUTH], replace(data, values=data.values + noise))
    objective = Objective(problem)
    true = objective.chi_squared(np.array([p.share_of(TRUTH[p.key]) for p in problem.parameters]))
    report = fit(problem, FitOptions(starts=1))

    assert min(report.starts.chi_squared) > 10.0 * true
    assert report.starts.same_minimum == 0
    assert report.chi_squared <= true
    for key, value in TRUTH.items():
        assert report.parameters[key].kind == "bounded"
        assert report.parameters[key].value == pytest.approx(value, rel=5e-3)


@pytest.mark.parametrize(
    ("same", "sentence"),
    [
        (3, "3 of 4 starts reached the minimum"),
        (0, "a scan over a friction reached the minimum, none of 4 starts did"),
    ],
)
def test_a_report_says_what_reached_the_minimum(same, sentence):
    assert StartReport(count=4, same_minimum=same, chi_squared=(1.0,)).sentence == sentence
