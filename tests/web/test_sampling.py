"""One instant of a run."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.scene.states import states_of
from slipgrasp.web.model.sampling import Sampler, locate


def test_a_stored_time_gives_the_very_bits_of_the_stored_row(case_2: RunResult) -> None:
    trace, sampler = case_2.trace, Sampler(case_2.trace)
    last_rows = np.searchsorted(trace.times, np.unique(trace.times), side="right") - 1
    for row in last_rows[::7]:
        sample = sampler.at(float(trace.times[row]))
        assert sample.time == trace.times[row]
        for shown, stored in zip(sample.states, states_of(trace[row : row + 1]), strict=True):
            assert shown.tobytes() == stored.tobytes()
        assert sample.estimates.tobytes() == trace.estimates[row].tobytes()


def test_a_negative_zero_stays_one() -> None:
    values = np.array([[-0.0], [1.0]])
    assert np.signbit(locate(np.array([0.0, 1.0]), 0.0).read(values))[0]


def test_the_reach_of_slip_is_that_of_all_rows_so_far(case_1: RunResult) -> None:
    trace, sampler = case_1.trace, Sampler(case_1.trace)
    for row in (0, 40, len(trace) - 1):
        time = float(trace.times[row])
        so_far = trace.slip[trace.times <= time]
        trails = np.stack(sampler.at(time).trails)[:, :, 0]
        assert (trails[:, 0] == so_far.min(axis=0)).all()
        assert (trails[:, 1] == 0.0).all()
        assert (trails[:, 2] == so_far.max(axis=0)).all()


def test_between_two_rows_lies_the_straight_line(case_2: RunResult) -> None:
    times, slip = case_2.trace.times, case_2.trace.slip
    sample = Sampler(case_2.trace).at(float(0.25 * times[5] + 0.75 * times[6]))
    np.testing.assert_allclose(sample.states.slip.ravel(), 0.25 * slip[5] + 0.75 * slip[6])


def test_at_an_event_the_side_after_it_is_shown(case_2: RunResult) -> None:
    last = case_2.metrics.last_slip_time
    assert last is not None
    assert not Sampler(case_2.trace).at(last).states.phases.any()
    just_before = Sampler(case_2.trace).at(last - 1e-6)
    assert just_before.states.phases.all()


def test_times_outside_the_run_are_moved_into_it(case_2: RunResult) -> None:
    assert Sampler(case_2.trace).at(-1.0).time == 0.0
    assert Sampler(case_2.trace).at(99.0).time == pytest.approx(7.0)


def test_the_reach_of_slip_never_shrinks(case_1: RunResult) -> None:
    sampler = Sampler(case_1.trace)
    reaches = [np.stack(sampler.at(t).trails)[:, ::2, 0] for t in np.linspace(0.0, 1.0, 50)]
    for earlier, later in itertools.pairwise(reaches):
        assert (later[:, 0] <= earlier[:, 0] + 1e-15).all()
        assert (later[:, 1] >= earlier[:, 1] - 1e-15).all()
