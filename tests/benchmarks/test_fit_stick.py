"""A sample of the fits that are counted by ``python -m benchmarks fit-stick``."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks import fit_coverage, fit_stick
from slipgrasp.core.fit.fit import FitOptions, fit

# Noise makes the best run of each slip so much that the profile of a friction has two ends.
MISLEADING = (("paper-case-1", 22), ("paper-case-1", 36), ("gripper-lift", 6))


@pytest.mark.slow
@pytest.mark.parametrize(("preset", "number"), MISLEADING)
def test_a_friction_without_slip_is_bounded_by_its_use_although_the_best_run_slips(
    kernel, preset, number
):
    stuck = fit_coverage.simulate_briefly(preset, fit_stick.CASES[preset])
    *_, twin = fit_stick.twins_of(stuck, 1, number + 1)
    report = fit(twin, FitOptions(starts=1))

    # Without such a twin there would be nothing to show.
    assert any(contact.slip_time > 0.0 for contact in report.contacts)
    for key, used in zip(fit_stick.FRICTIONS, fit_stick.used_friction(stuck), strict=True):
        found = report.parameters[key]
        assert any(rise > report.threshold for value, rise in found.profile if value < used)
        assert (found.value, found.kind, found.high) == (None, "only below", None)
        assert found.low == pytest.approx(used, rel=1e-9)
        assert "never slipped (without slip chi-squared rises by" in found.note


@pytest.mark.slow
def test_of_a_contact_that_slips_beside_one_that_sticks_the_friction_is_a_number(kernel):
    slipping, sticking = fit_stick.FRICTIONS
    changes = fit_stick.CASES["paper-case-1"] | {slipping: 0.13, sticking: 0.3}
    run = fit_coverage.simulate_briefly("paper-case-1", changes)
    assert run.trace.phase.any(axis=0).tolist() == [True, False]
    (twin,) = fit_stick.twins_of(run, 1, 1)
    report = fit(twin, FitOptions(starts=1))
    found, stuck = (report.parameters[key] for key in fit_stick.FRICTIONS)

    assert found.kind == "bounded"
    assert found.low < 0.13 < found.high
    assert (stuck.kind, stuck.value, stuck.high) == ("only below", None, None)
    used = np.abs(run.trace.tangential_force / run.trace.normal_force)[:, 1].max()
    assert stuck.low == pytest.approx(used, rel=0.01)


@pytest.mark.slow
def test_a_slip_that_data_hardly_show_does_not_raise_the_bound_above_the_true_friction(kernel):
    problem = fit_coverage.make_problem(
        next(case for case in fit_coverage.CASES if case.preset == "tilted-object")
    )
    noise = np.random.default_rng([1, 0]).standard_normal(problem.data.values.shape)
    data = replace(problem.data, values=problem.data.values + problem.data.sigmas * noise)
    report = fit(problem.with_data(data), FitOptions(starts=1))
    found = report.parameters["fingers.0.friction"]

    # A run without slip, and with another mass, has nearly the same chi-squared and uses 0.74.
    assert (found.kind, found.value) == ("only below", None)
    assert found.low < 0.42
