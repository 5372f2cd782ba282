"""Torsional friction beside MuJoCo's contacts with four dimensions: the box of `tests.soft_box`.

MuJoCo's contacts creep and give way: its error is linear in its step (`benchmarks.torsion`).
"""

import numpy as np
import pytest

from benchmarks.torsion import turn
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.custom_laws import forget
from tests.soft_box import SlideSprings, soft_box

pytestmark = pytest.mark.slow

STEP = 2e-4  # [s]
ECCENTRICITY = 0.01  # [m]
TIMES = (0.34581, 0.64581, 1.3)


def our_angles(eccentricity):
    trace = simulate(soft_box(eccentricity, 5e-4, TIMES[-1] + 0.01, "slides")).trace
    turns = 2.0 * np.arctan2(trace.object_pose[:, 4], trace.object_pose[:, 3])
    forget(SlideSprings.name)
    return np.interp(TIMES, trace.times, turns)


def test_a_box_turns_between_two_soft_tips_as_in_mujoco():
    np.testing.assert_allclose(
        our_angles(ECCENTRICITY), turn(ECCENTRICITY, STEP, TIMES), rtol=0.004
    )


def test_it_turns_less_than_half_as_far_where_the_pad_is_a_tenth_larger():
    ours, theirs = our_angles(1.1 * ECCENTRICITY)[-1], turn(1.1 * ECCENTRICITY, STEP, TIMES)[-1]
    assert ours < 0.4 and theirs < 0.4
    assert ours == pytest.approx(theirs, rel=0.002)
