"""One instant of a run."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from core.result import RunResult
from core.types import ContactPhase
from web.sampling import sample_at


def test_a_stored_time_gives_the_stored_row(case_2: RunResult) -> None:
    row = 700
    sample = sample_at(case_2.trace, float(case_2.trace.times[row]))
    np.testing.assert_allclose(sample.object_pose, case_2.trace.object_pose[row])
    np.testing.assert_allclose(sample.desired_pose, case_2.trace.desired_pose[row])
    np.testing.assert_allclose(sample.joint_positions.ravel(), case_2.trace.joint_position[row])


def test_between_two_rows_lies_the_straight_line(case_2: RunResult) -> None:
    times, slip = case_2.trace.times, case_2.trace.slip
    sample = sample_at(case_2.trace, float(0.25 * times[5] + 0.75 * times[6]))
    np.testing.assert_allclose(sample.slip, 0.25 * slip[5] + 0.75 * slip[6])


def test_at_an_event_the_side_after_it_is_shown(case_2: RunResult) -> None:
    last = case_2.metrics.last_slip_time
    assert last is not None
    assert sample_at(case_2.trace, last).phases == (ContactPhase.STICK, ContactPhase.STICK)
    just_before = sample_at(case_2.trace, last - 1e-6)
    assert ContactPhase.STICK not in just_before.phases


def test_times_outside_the_run_are_moved_into_it(case_2: RunResult) -> None:
    assert sample_at(case_2.trace, -1.0).time == 0.0
    assert sample_at(case_2.trace, 99.0).time == pytest.approx(7.0)


def test_the_reach_of_slip_never_shrinks(case_1: RunResult) -> None:
    reaches = [sample_at(case_1.trace, t).slip_reach for t in np.linspace(0.0, 1.0, 50)]
    for earlier, later in itertools.pairwise(reaches):
        assert (later[:, 0] <= earlier[:, 0] + 1e-15).all()
        assert (later[:, 1] >= earlier[:, 1] - 1e-15).all()
