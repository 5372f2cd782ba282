"""A sample of the fits that are counted by ``python -m benchmarks fit-stick``."""

import pytest

from benchmarks import fit_stick
from slipgrasp.core.fit.fit import FitOptions, fit


@pytest.mark.slow
@pytest.mark.parametrize("case", fit_stick.CASES, ids=lambda case: case.preset)
def test_a_friction_without_slip_is_bounded_by_its_use_although_the_best_run_slips(kernel, case):
    stuck = case.simulate()
    reports = [fit(twin, FitOptions(starts=1)) for twin in fit_stick.twins_of(stuck, 1, 4)]

    # Without such a twin there would be nothing to show.
    assert any(contact.slip_time > 0.0 for report in reports for contact in report.contacts)
    for report in reports:
        for key, used in zip(fit_stick.FRICTIONS, fit_stick.used_friction(stuck), strict=True):
            found = report.parameters[key]
            assert (found.value, found.kind, found.high) == (None, "only below", None)
            assert found.low == pytest.approx(used, rel=1e-9)
