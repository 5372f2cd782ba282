"""Fits: intervals against closed forms, classes, twins, nuisances, and what is refused."""

import re
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from slipgrasp.core.fit.fit import FitOptions, fit, sampled_at
from slipgrasp.core.fit.objective import (
    EVENT_WEIGHT,
    OUTLIER_SIGMAS,
    Objective,
    evaluate_here,
    event_weights,
    huber,
    run_at,
)
from slipgrasp.core.fit.optimiser import minimise, start_points
from slipgrasp.core.fit.problem import (
    MISSING_SIGMAS,
    FitError,
    FitProblem,
    Observations,
)
from slipgrasp.core.fit.profile import THRESHOLD_95, BetterMinimumError, profile
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.trace import rows_from_start
from tests.core.formula_fits import evaluation_of, formula_problem

SIGMA = 0.1


def noisy_problem(model, count, samples=50, seed=0, truth=None):
    """A problem whose model is a formula of the parameters, and how it is evaluated."""
    truth = np.full(count, 0.5) if truth is None else np.asarray(truth)
    starts = np.full(count, 0.4) if truth[-1] == 0.5 else truth
    noise = SIGMA * np.random.default_rng(seed).standard_normal(samples)
    return formula_problem(starts, model(truth) + noise, SIGMA), evaluation_of(model)


def linear(count, samples=50):
    matrix = np.random.default_rng(7).normal(0.0, 1.0, (samples, count))
    return matrix, lambda values: matrix @ values


def interval_of(problem, evaluate, index):
    objective = Objective(problem, evaluate)
    best = minimise(objective, problem.start)
    while True:
        try:
            return best, profile(objective, best, index, THRESHOLD_95)
        except BetterMinimumError as better:
            best = minimise(objective, better.minimum.shares)


@pytest.mark.parametrize("index", [0, 1, 2])
def test_the_interval_of_a_linear_model_is_that_of_its_closed_form(index):
    matrix, model = linear(3)
    problem, evaluate = noisy_problem(model, 3)
    best, found = interval_of(problem, evaluate, index)
    covariance = SIGMA**2 * np.linalg.inv(matrix.T @ matrix)
    estimate = np.linalg.solve(matrix.T @ matrix, matrix.T @ problem.data.values[:, 0])
    half = np.sqrt(THRESHOLD_95 * covariance[index, index])

    assert best.shares == pytest.approx(estimate, abs=1e-6)
    assert found.kind == "bounded"
    # The rise at an end is within 3 % of the threshold, so the end is within half of that.
    assert found.low == pytest.approx(estimate[index] - half, abs=0.02 * half)
    assert found.high == pytest.approx(estimate[index] + half, abs=0.02 * half)


@pytest.mark.parametrize(
    ("model", "kind"),
    [
        (lambda v: np.full(50, v[0]), "bounded"),
        (lambda v: np.full(50, max(0.0, v[0] - 0.7)), "only above"),
        (lambda v: np.full(50, max(0.0, 0.3 - v[0])), "only below"),
        (lambda v: np.zeros(50), "flat"),
    ],
)
def test_a_parameter_is_classed_by_the_sides_that_the_data_bound(model, kind):
    problem, evaluate = noisy_problem(model, 1)
    _, found = interval_of(problem, evaluate, 0)

    assert found.kind == kind
    # The edges of the flat parts are at 0.7 and 0.3, and 50 samples have a mean within 0.03.
    assert found.high is None or 0.5 < found.high < 0.8
    assert found.low is None or 0.2 < found.low < 0.5


def test_the_profile_follows_a_narrow_curved_valley():
    times = np.linspace(0.0, 1.0, 50)

    def model(values):
        return 1e4 * (values[1] - values[0] ** 2) + values[0] * times

    problem, evaluate = noisy_problem(model, 2, truth=[0.5, 0.25])
    _, found = interval_of(problem, evaluate, 0)
    # The valley is v1 = v0² + b: two unknowns, an offset and a slope over time.
    spread = times - times.mean()
    half = np.sqrt(THRESHOLD_95) * SIGMA / np.linalg.norm(spread)
    assert (found.high - found.low) / 2.0 == pytest.approx(half, rel=0.05)


def test_the_loss_is_a_square_with_tangents_beyond_the_limit():
    inside = np.linspace(-OUTLIER_SIGMAS, OUTLIER_SIGMAS, 9)
    outside = np.array([OUTLIER_SIGMAS, 5.0, 50.0])

    assert huber(inside) == pytest.approx(inside**2)
    slope = np.diff(huber(outside)) / np.diff(outside)
    assert slope == pytest.approx(2.0 * OUTLIER_SIGMAS)


def test_starts_begin_with_the_scenario_and_fill_the_ranges_evenly():
    points = start_points(np.array([0.1, 0.2, 0.3]), 17, seed=3)

    assert points.shape == (17, 3)
    assert points[0].tolist() == [0.1, 0.2, 0.3]
    # Of 16 points of a Sobol sequence each half of each range has 8.
    assert ((points[1:] < 0.5).sum(axis=0) == 8).all()
    assert np.array_equal(points, start_points(points[0], 17, seed=3))
    assert not np.array_equal(points, start_points(points[0], 17, seed=4))


def columns_at(run, rate):
    """The columns of a run at even times."""
    times = run.trace.times
    even = np.abs(times * rate - np.rint(times * rate)) < 1e-9
    even &= np.append(np.diff(times) > 0.0, True)
    columns = {c.name: (c.unit, np.asarray(c.values, float)[even]) for c in columns_of(run.trace)}
    return times[even], columns


def measured(run, noise, *, seed=0, delay=0.0, bias=0.0, rate=200.0):
    """What sensors give of a run: noise, a delay in whole samples, a bias of forces."""
    times, columns = columns_at(run, rate)
    late = round(delay * rate)
    shifted = {
        name: (unit, np.concatenate([np.repeat(values[:1], late), values[: len(values) - late]]))
        for name, (unit, values) in columns.items()
    }
    data = Observations.choose(times, shifted, noise)
    forces = np.array([unit == "N" for unit in data.units])
    values = data.values + bias * forces
    random = np.random.default_rng(seed).standard_normal(values.shape)
    return replace(data, values=values + data.sigmas * random)


TRUTH = {"object.mass": 1.13, "fingers.0.friction": 0.27, "fingers.1.friction": 0.23}
FREE = ("object.mass", "fingers.*.friction")
NOISE = {"object_pose": 2e-4, "slip": 2e-4}


@pytest.fixture(scope="module")
def base(kernel):
    return with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.3})


@pytest.fixture(scope="module")
def true_run(base):
    return simulate(with_values(base, TRUTH))


@pytest.mark.slow
def test_mass_and_frictions_of_a_run_are_found_and_their_intervals_hold_the_truth(base, true_run):
    report = fit(
        FitProblem.make(base, FREE, measured(true_run, NOISE, seed=2)), FitOptions(starts=4)
    )

    assert list(report.parameters) == list(TRUTH)
    for key, truth in TRUTH.items():
        found = report.parameters[key]
        assert found.kind == "bounded"
        assert found.low < truth < found.high
        assert found.value == pytest.approx(truth, rel=0.03)
    assert report.explains
    assert report.on_limit == ()
    assert all(abs(each.autocorrelation) < 0.5 for each in report.residuals)
    assert [contact.slip_time > 0.05 for contact in report.contacts] == [True, True]
    mapping = report.to_mapping()
    assert {"parameters", "starts", "evaluations", "held_out"} <= mapping.keys()
    assert {"value", "low", "high", "class"} <= mapping["parameters"]["object.mass"].keys()


@pytest.mark.slow
def test_friction_and_radius_of_a_body_that_spins_and_slides_are_found(kernel):
    true = load_scenario("spinning-slide")
    data = measured(simulate(true), {"object_pose": 5e-4}, seed=3, rate=100.0)
    start = with_values(true, {"support.friction": 0.3, "support.radius": 0.02})
    free = {"support.friction": 0.21, "support.radius": 0.036}
    report = fit(FitProblem.make(start, [*free], data), FitOptions(starts=2))
    for key, truth in free.items():
        found = report.parameters[key]
        assert found.kind == "bounded"
        assert found.low < truth < found.high < 1.01 * found.low
    assert report.explains


@pytest.mark.slow
def test_delay_and_bias_of_forces_are_found_with_the_parameters(base, true_run):
    data = measured(true_run, NOISE | {"normal_force": 0.02}, delay=0.01, bias=0.5)
    problem = FitProblem.make(base, ["object.mass"], data, ("delay", "force_bias"))
    true = replace(problem, scenario=with_values(problem.scenario, TRUTH))

    @lru_cache(maxsize=4)
    def run_with(mass):
        return simulate(with_values(true.scenario, {"object.mass": mass}))

    def evaluate(problem, values):
        """As `evaluate_here`, with one run for all delays and biases of a mass."""
        return problem.sample(run_with(problem.scenario_values(values)["object.mass"]), values)

    report = fit(true, FitOptions(starts=1), evaluate=evaluate)
    assert run_with.cache_info().misses < 0.7 * report.evaluations

    assert report.parameters["delay"].value == pytest.approx(0.01, abs=5e-4)
    for key in ("force_bias.normal_force_0", "force_bias.normal_force_1"):
        assert report.parameters[key].value == pytest.approx(0.5, abs=0.05)
    assert report.parameters["object.mass"].value == pytest.approx(1.13, rel=0.02)


def test_a_slip_too_small_for_the_data_is_allowed_for_in_the_bound_of_a_friction(kernel):
    """The contact slips by 0.4 um at a friction below what it would use in stick."""
    values = {"fingers.0.friction": 0.35, "simulation.duration": 0.12}
    true = with_values(load_scenario("spatial-prism"), values)
    run = simulate(true)
    assert 0.0 < run.metrics.slip_path[0] < 1e-6
    data = measured(run, {"object_pose": 2e-4, "slip": 2e-4})
    report = fit(FitProblem.make(true, ["fingers.0.friction"], data), FitOptions(starts=1))

    found = report.parameters["fingers.0.friction"]
    assert found.kind == "only below" and found.low > 0.35
    told = re.search(r"force, (\S+), or (\S+) if it slipped by less than the data", found.note)
    assert float(told[1]) == pytest.approx(found.low, rel=1e-3)
    assert float(told[2]) < 0.35


def test_of_contacts_that_never_slipped_only_a_lower_bound_is_given(kernel):
    scenario = load_scenario("paper-case-2")
    gripping = {"simulation.duration": 0.5, "fingers.0.friction": 5.0, "fingers.1.friction": 5.0}
    run = simulate(with_values(scenario, gripping))
    assert not run.trace[rows_from_start(run.trace)].phase.any()
    data = measured(run, {"object_pose": 2e-4})
    free = [f"fingers.{k}.friction=0.05..10" for k in (0, 1)]
    stuck = with_values(scenario, gripping)
    report = fit(FitProblem.make(stuck, free, data), FitOptions(starts=1))

    trace = run.trace[rows_from_start(run.trace)]
    used = np.max(np.abs(trace.tangential_force) / trace.normal_force, axis=0)
    for k in (0, 1):
        found = report.parameters[f"fingers.{k}.friction"]
        assert (found.value, found.kind, found.high) == (None, "only below", None)
        assert found.low == pytest.approx(used[k], rel=1e-9)
        assert "never slipped" in found.note


@pytest.mark.slow
def test_a_composite_run_with_poses_alone_bounds_a_friction_only_above(kernel):
    truth = {"object.mass": 1.13, "fingers.0.friction": 0.27, "fingers.1.friction": 0.23}
    base = with_values(load_scenario("composite-case-2"), {"simulation.duration": 1.0})
    data = measured(simulate(with_values(base, truth)), {"object_pose": 2e-4})
    near = with_values(base, truth)
    report = fit(FitProblem.make(near, FREE, data), FitOptions(starts=1))

    kinds = [found.kind for found in report.parameters.values()]
    assert "only above" in kinds
    assert report.explains
    for key, value in truth.items():
        found = report.parameters[key]
        assert found.low is None or found.low < value
        assert found.high is None or value < found.high
        assert (found.value is None) == (found.kind != "bounded")


def test_a_run_that_ends_before_the_data_is_far_from_them(base, true_run):
    problem = FitProblem.make(base, FREE, measured(true_run, NOISE))
    sampled = evaluate_here(problem, tuple(TRUTH.values()))
    sampled[30:] = np.nan
    found = Objective(problem, lambda _, values: sampled).residuals(problem.start)
    missing = found.reshape(sampled.shape)[30:]

    assert (np.abs(missing) >= MISSING_SIGMAS).all()
    assert (np.abs(found.reshape(sampled.shape)[:30]) < 6.0).all()


def test_parameters_that_are_not_allowed_together_are_infinitely_far(base, true_run):
    free = ["fingers.0.friction=0.1..1", "fingers.0.static_friction=0.1..1"]
    problem = FitProblem.make(base, free, measured(true_run, NOISE))

    assert np.isnan(evaluate_here(problem, (0.5, 0.2))).all()
    assert np.isfinite(Objective(problem).chi_squared(np.array([0.5, 0.1])))


def test_samples_near_events_count_little_where_signals_jump(true_run):
    data = measured(true_run, {"object_pose": 1e-4, "normal_force": 0.1})
    weights = event_weights(data, [0.1])
    near = np.abs(data.times - 0.1) <= 0.01 + 1e-12

    assert near.sum() == 5
    assert (weights[:, :3] == 1.0).all()
    assert (weights[near, 3:] == EVENT_WEIGHT).all()
    assert (weights[~near, 3:] == 1.0).all()


def test_the_prediction_of_held_out_data_is_that_of_the_best_run(base, true_run):
    other = simulate(with_values(base, TRUTH | {"object.mass": 1.2}))
    held_out = measured(other, NOISE, seed=9)
    problem = FitProblem.make(base, ["object.mass"], measured(true_run, NOISE))
    options = FitOptions(starts=1, held_out=(("other", held_out),))
    report = fit(problem, options)
    (predicted,) = report.held_out

    best = run_at(problem, [report.best["object.mass"]])
    columns = {c.name: c.values for c in columns_of(best.trace)}
    for k, signal in enumerate(predicted.signals):
        model = np.interp(held_out.times, best.trace.times, columns[signal.name])
        difference = model - held_out.values[:, k]
        assert signal.rms == pytest.approx(np.sqrt(np.mean(difference**2)), rel=1e-9)
        assert predicted.final[signal.name] == pytest.approx(difference[-1], rel=1e-6)


@pytest.mark.slow
def test_a_model_with_more_parameters_is_never_further_from_the_data(base, true_run):
    problem = FitProblem.make(base, FREE, measured(true_run, NOISE))
    options = FitOptions(starts=1, added=(("fingers.0.joint_damping=0..0.5",),))
    fitted, larger = fit(problem, options).models

    assert (fitted.added, larger.added) == ((), ("fingers.0.joint_damping",))
    assert larger.chi_squared <= fitted.chi_squared + 0.1
    assert larger.values["fingers.0.joint_damping"] < 0.1


@pytest.mark.slow
def test_equal_fits_give_equal_reports_and_the_sampled_best_run_is_the_model(base, true_run):
    problem = FitProblem.make(base, FREE, measured(true_run, NOISE))
    options = FitOptions(starts=2, twins=1)
    first, second = fit(problem, options), fit(problem, options)

    assert first.to_mapping() == second.to_mapping()
    residuals = (sampled_at(problem, first) - problem.data.values) / problem.data.sigmas
    assert float(huber(residuals).sum()) == pytest.approx(first.chi_squared, rel=1e-6)
    assert first.coverage.twins == 1
    assert set(first.coverage.covered) == set(TRUTH)


@pytest.mark.parametrize(
    ("free", "noise", "nuisance", "words"),
    [
        (["object.mas"], NOISE, (), ["object.mas", "no parameter", "object.mass"]),
        (["controller.kind"], NOISE, (), ["controller.kind", "a choice"]),
        (["object.mass=2..1"], NOISE, (), ["object.mass=2..1", "not a range"]),
        (["object.mass=1"], NOISE, (), ["LOW..HIGH"]),
        (["object.mass", "object.mass"], NOISE, (), ["free twice"]),
        ([], NOISE, (), ["0 parameters", "1 … 12"]),
        (["object.mass"], {"slop": 1e-3}, (), ["'slop'", "not measured", "slip_0"]),
        (["object.mass"], {"slip": 0.0}, (), ["slip:0", "above 0"]),
        (["object.mass"], {}, (), ["no signal"]),
        (["object.mass"], NOISE, ("force_bias",), ["force_bias", "needs a force"]),
    ],
)
def test_a_fit_that_cannot_be_asked_for_is_refused_in_a_sentence(
    base, true_run, free, noise, nuisance, words
):
    with pytest.raises(FitError) as caught:
        FitProblem.make(base, free, measured(true_run, noise), nuisance)

    assert [word for word in words if word not in str(caught.value)] == []


@pytest.mark.parametrize("options", [{"starts": 0}, {"twins": -1}, {"seed": -1}])
def test_numbers_of_starts_and_twins_have_limits(base, true_run, options):
    problem = FitProblem.make(base, FREE, measured(true_run, NOISE))
    with pytest.raises(FitError, match="allowed"):
        fit(problem, FitOptions(**options))
