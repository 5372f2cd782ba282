"""The hard places of a hybrid run: simultaneous, grazing and repeated events, and Zeno's."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import root_scalar

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import ContactPhase, Outcome
from tests.core.test_closed_forms import change

CASE_1 = load_scenario("paper-case-1")
CASE_2 = load_scenario("paper-case-2")
GRAVITY = 9.81

OPEN_LOOP = {"controller.position_gain": 0.0, "controller.velocity_gain": 1e-12}
PHASES = {-1: ContactPhase.SLIP_BACKWARD, 0: ContactPhase.STICK, 1: ContactPhase.SLIP_FORWARD}


def told(result):
    return [(c.contact, c.to_phase) for c in result.phase_changes]


@pytest.mark.parametrize("period", [0.0, 0.001])
def test_both_sides_of_a_symmetric_hand_change_at_one_instant_in_the_order_of_fingers(period):
    """Slip velocities that reach zero in an order that rounding decides end one slip together."""
    values = {"controller.control_period": period, "simulation.duration": 0.3}
    result = simulate(with_values(CASE_2, values))
    assert told(result) == [(0, PHASES[1]), (1, PHASES[-1]), (0, PHASES[0]), (1, PHASES[0])]
    start, other_start, stop, other_stop = [c.time for c in result.phase_changes]
    assert start == other_start == 0.0
    assert stop == other_stop > 0.1
    # One event, hence one pair of rows: just before and just after.
    assert np.count_nonzero(result.trace.times == stop) == 2


@pytest.mark.parametrize("offset", [-1e-9, -1e-12, 0.0, 1e-12, 1e-9])
def test_timed_change_at_the_instant_of_an_event_makes_no_second_event(offset):
    """The run is interrupted at (or rounding away from) its event and starts at its root."""
    plain = simulate(with_values(CASE_2, {"simulation.duration": 0.3}))
    stop = plain.phase_changes[-1].time
    same_mass = change(0, stop + offset, "object.mass", 1.0)
    result = simulate(with_values(CASE_2, {"simulation.duration": 0.3, **same_mass}))
    assert told(result) == told(plain)
    assert result.phase_changes[-1].time == pytest.approx(stop, abs=2e-9)
    # The events differ by their location only: 1e-10 s times speeds of 0.5 m/s.
    np.testing.assert_allclose(result.trace.slip[-1], plain.trace.slip[-1], atol=1e-9)


def test_contacts_exactly_on_their_cones_stay_there_through_every_corner():
    """True estimates and safety 1 put both contacts on the cone: each restart is at a root."""
    exact = {f"estimates.{i}.initial": 1.0 for i in range(5)}
    result = simulate(with_values(CASE_1, exact))
    assert result.outcome is Outcome.COMPLETED
    assert result.phase_changes == ()
    assert result.warnings == ()
    # On the cone but for the tracking error, which the tolerance leaves near 1e-11.
    np.testing.assert_allclose(result.trace.friction_margin, 0.0, atol=1e-8)


# The object held by half its weight slides under constant forces: 1 kg makes it faster and
# 0.25 kg brakes it at twice the rate.
SAG = 0.5 * GRAVITY
BRAKE_TIME = 0.1
STOP_TIME = 1.5 * BRAKE_TIME
TOUCH = {
    **OPEN_LOOP,
    "controller.lyapunov_weight": 0.0,
    "trajectory.acceleration": [0.0, 0.0, 0.0],
    "simulation.duration": 0.2,
    **{f"estimates.{i}.initial": 1.0 for i in range(4)},
    "estimates.4.initial": 0.5,
    **change(0, BRAKE_TIME, "object.mass", 0.25),
}


def slip_after(restart):
    """Slip at 0.2 s when it is heavy again from ``restart`` on, and the speed left then."""
    braked = min(restart, STOP_TIME) - BRAKE_TIME
    top = SAG * BRAKE_TIME
    left = top - 2.0 * SAG * braked
    rest = 0.2 - restart
    before = 0.5 * top * BRAKE_TIME + top * braked - SAG * braked**2
    return before + left * rest + 0.5 * SAG * rest**2


@pytest.mark.parametrize("offset", [-1e-6, -1e-9, 0.0, 1e-9, 1e-6])
def test_slip_velocity_that_only_touches_zero(offset):
    """Braked to zero at the instant it is pushed on: one slip, or two with a rest between."""
    restart = STOP_TIME + offset
    result = simulate(with_values(CASE_1, {**TOUCH, **change(1, restart, "object.mass", 1.0)}))
    assert result.outcome is Outcome.COMPLETED
    late = [c.time for c in result.phase_changes if c.time > 0.0]
    assert len(late) in {-1: (0,), 0: (0, 4), 1: (4,)}[int(np.sign(offset))]
    expected = [STOP_TIME, STOP_TIME, restart, restart][: len(late)]
    np.testing.assert_allclose(late, expected, rtol=0.0, atol=1e-10)
    slip = result.trace.slip[-1]
    np.testing.assert_allclose(np.abs(slip), slip_after(restart), atol=1e-9)


# An object of 1 kg that turns ever faster past the pose in which the friction that finger 0
# needs is largest. The least squeeze keeps finger 1 on the cone it believes in.
BELIEVED, START, SPIN, INERTIA, HALF_WIDTH = 0.5, -0.4, 6.74, 0.1, 0.1
MOMENT = INERTIA * SPIN / HALF_WIDTH


def margin(friction, angle):
    """Mu F_n - |F_x| of finger 0 at an angle of the object [N]; exact while both stick."""
    across, along = GRAVITY * np.sin(angle), GRAVITY * np.cos(angle)
    normal = 0.5 * (along + MOMENT) / BELIEVED + across
    return friction * normal - 0.5 * (along - MOMENT)


def tightest(friction):
    """Angle at which the margin is least: where its derivative is zero."""
    return np.arctan(-2.0 * friction / (1.0 - friction / BELIEVED))


# The friction with which the margin falls to zero exactly, and rises again.
TOUCHING = root_scalar(lambda mu: margin(mu, tightest(mu)), bracket=(0.05, 0.2), xtol=1e-15).root


def turning(friction, values):
    return with_values(
        CASE_2,
        {
            **OPEN_LOOP,
            "controller.lyapunov_weight": 0.0,
            "controller.estimate_norm_bound": 1e3,
            "fingers.0.friction": friction,
            "fingers.1.friction": 0.9,
            "object.inertia": INERTIA,
            "estimates.0.initial": BELIEVED,
            "estimates.1.initial": BELIEVED,
            "estimates.2.initial": 1.0,
            "estimates.3.initial": INERTIA,
            "trajectory.start": [1.466, 0.366, START],
            "trajectory.acceleration": [0.0, 0.0, SPIN],
            "simulation.duration": 0.3,
            **values,
        },
    )


@pytest.mark.parametrize("excess", [0.0, 1e-9, 1e-6, 1e-3])
def test_contact_that_grazes_its_cone_without_leaving_it_sticks(excess):
    friction = TOUCHING + excess
    result = simulate(turning(friction, {"simulation.output_rate": 5000.0}))
    assert result.outcome is Outcome.COMPLETED
    assert result.phase_changes == ()
    trace = result.trace
    assert trace.object_pose[0, 2] < tightest(friction) < trace.object_pose[-1, 2]
    expected = margin(friction, trace.object_pose[:, 2])
    np.testing.assert_allclose(trace.friction_margin[:, 0], expected, atol=1e-10)
    # At 5 kHz a row lies within 0.1 ms of the least margin, whose curvature is 9 N/s².
    least = margin(friction, tightest(friction))
    assert trace.friction_margin[:, 0].min() == pytest.approx(least, abs=1e-6)


@pytest.mark.parametrize("lack", [1e-5, 1e-4, 1e-3])
def test_contact_that_leaves_its_cone_for_a_moment_slips_at_the_exact_instant(lack):
    """The margin is negative for 11, 36 and 110 ms, longer than the steps taken here."""
    friction = TOUCHING - lack
    bracket = (START, tightest(friction))
    angle = root_scalar(lambda angle: margin(friction, angle), bracket=bracket, xtol=1e-15).root
    onset = np.sqrt(2.0 * (angle - START) / SPIN)
    result = simulate(turning(friction, {"simulation.max_step": 0.002}))
    first = result.phase_changes[0]
    assert first.contact == 0
    assert first.time == pytest.approx(onset, abs=1e-9)


@pytest.mark.parametrize("limit", [5, 20, 100])
def test_endless_phase_changes_end_the_run_at_their_limit(limit):
    """Without grasp force every contact that stopped slips again at once."""
    values = {"controller.grasp_force": "none", "simulation.chatter_changes": limit}
    result = simulate(with_values(CASE_1, values))
    assert result.outcome is Outcome.CHATTERING
    times = np.array([c.time for c in result.phase_changes])
    window = CASE_1.simulation.chatter_window
    # The contacts that change together at the last instant are all told.
    assert limit < len(times) <= limit + 4
    assert times[-1] - times[-1 - limit] < window
    earlier = times[times < times[-1]]
    assert np.all(earlier[limit:] - earlier[:-limit] >= window)


def test_no_contact_changes_twice_in_one_direction_at_one_instant():
    """Where a window allows it the same run goes on to its end, without a heap of events."""
    values = {"controller.grasp_force": "none", "simulation.chatter_window": 1e-3}
    result = simulate(with_values(CASE_1, {**values, "simulation.duration": 1.0}))
    assert result.outcome is Outcome.COMPLETED
    assert len(result.phase_changes) > 500
    counted = Counter((c.time, c.contact, c.to_phase) for c in result.phase_changes)
    assert max(counted.values()) == 1
    for contact in (0, 1):
        mine = [c for c in result.phase_changes if c.contact == contact]
        assert all(b.from_phase is a.to_phase for a, b in pairwise(mine))
