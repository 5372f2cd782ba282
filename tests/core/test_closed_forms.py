"""Motions whose exact solution is known, through the whole simulator.

With the true friction, the true links and a wrong object mass, both tips of the sample
hand slide exactly on the cone that the controller expects, and the accelerations of tips
and object are constants: a slide under constant forces. A timed change of the true mass
then brakes it.
"""

import numpy as np
import pytest

from core.loading import load_scenario, with_values
from core.simulator import simulate
from core.types import ContactPhase, Outcome

GRAVITY = 9.81
BELIEVED_MASS = 0.5
HEAVY = 1.0
LIGHT = 0.25
CHANGE_TIME = 0.1

# No feedback and no adaptation: K_v is as small as the validation lets it be.
OPEN_LOOP = {
    "controller.position_gain": 0.0,
    "controller.velocity_gain": 1e-12,
    "controller.lyapunov_weight": 0.0,
    "trajectory.acceleration": [0.0, 0.0, 0.0],
    "simulation.duration": 1.0,
    "estimates.0.initial": 1.0,
    "estimates.1.initial": 1.0,
    "estimates.2.initial": 1.0,
    "estimates.3.initial": 1.0,
    "estimates.4.initial": BELIEVED_MASS,
}


def change(index, t, parameter, value):
    key = f"changes.{index}"
    return {f"{key}.time": t, f"{key}.parameter": parameter, f"{key}.value": value}


def case(values):
    return with_values(load_scenario("paper-case-1"), values)


def sag(true_mass):
    """Acceleration with which the tips move up the object: the force lifts m_believed g."""
    return (1.0 - BELIEVED_MASS / true_mass) * GRAVITY


@pytest.mark.parametrize("period", [0.0, 0.001])
def test_slide_under_constant_force_has_its_exact_acceleration(period):
    result = simulate(
        case({**OPEN_LOOP, "controller.control_period": period, "simulation.duration": 0.2})
    )
    trace = result.trace
    assert result.outcome is Outcome.COMPLETED
    slide = trace.phase[:, 0] == ContactPhase.SLIP_FORWARD
    assert slide.sum() > 30
    t = trace.times[slide]
    np.testing.assert_allclose(trace.slip_acceleration[slide, 0], sag(HEAVY), atol=1e-9)
    np.testing.assert_allclose(trace.slip_acceleration[slide, 1], -sag(HEAVY), atol=1e-9)
    np.testing.assert_allclose(trace.slip[slide, 0], 0.5 * sag(HEAVY) * t**2, atol=1e-10)
    np.testing.assert_allclose(trace.object_velocity[slide, 1], -sag(HEAVY) * t, atol=1e-9)


@pytest.mark.parametrize("period", [0.0, 0.001])
def test_slide_stops_at_its_exact_time_and_distance(period):
    lighter = change(0, CHANGE_TIME, "object.mass", LIGHT)
    result = simulate(case({**OPEN_LOOP, **lighter, "controller.control_period": period}))
    speed = sag(HEAVY) * CHANGE_TIME
    stop = CHANGE_TIME + speed / -sag(LIGHT)
    distance = 0.5 * speed * stop
    ends = [c for c in result.phase_changes if c.to_phase is ContactPhase.STICK]
    assert [c.time for c in ends] == pytest.approx([stop, stop], abs=1e-9)
    after = result.trace.times >= stop
    moved = np.abs(result.trace.slip[after][0])
    np.testing.assert_allclose(moved, distance, atol=1e-9)


def test_slip_velocity_decays_exponentially_once_the_estimates_are_exact():
    gain = 10.0
    exact = {
        **change(0, CHANGE_TIME, "object.mass", BELIEVED_MASS),
        **change(1, CHANGE_TIME, "controller.velocity_gain", gain),
    }
    trace = simulate(case({**OPEN_LOOP, **exact})).trace
    late = trace.times > CHANGE_TIME + 1e-6
    decay = np.exp(-gain * (trace.times[late] - CHANGE_TIME))
    speed = sag(HEAVY) * CHANGE_TIME
    np.testing.assert_allclose(trace.slip_velocity[late, 0], speed * decay, atol=1e-9)
    np.testing.assert_allclose(trace.object_velocity[late, 1], -speed * decay, atol=1e-9)
    start = 0.5 * speed * CHANGE_TIME
    path = start + speed * (1.0 - decay) / gain
    np.testing.assert_allclose(trace.slip[late, 0], path, atol=1e-9)


EXACT = {f"estimates.{i}.initial": 1.0 for i in range(5)}


@pytest.mark.parametrize("period", [0.0, 0.001])
def test_balanced_grasp_with_exact_parameters_does_not_move(period):
    still = {
        **EXACT,
        "trajectory.acceleration": [0.0, 0.0, 0.0],
        "controller.grip_safety": 1.1,
        "controller.control_period": period,
    }
    result = simulate(case(still))
    trace = result.trace
    assert result.outcome is Outcome.COMPLETED
    assert result.phase_changes == ()
    assert np.all(trace.slip == 0.0)
    start = np.broadcast_to(trace.object_pose[0], trace.object_pose.shape)
    np.testing.assert_allclose(trace.object_pose, start, atol=1e-12)
    np.testing.assert_allclose(trace.tracking_error, 0.0, atol=1e-12)
    np.testing.assert_allclose(trace.tangential_force.sum(axis=1), 0.0, atol=1e-8)
    np.testing.assert_allclose(trace.tangential_force[:, 1], 0.5 * GRAVITY, atol=1e-8)
    np.testing.assert_allclose(trace.normal_force, 1.1 * 0.5 * GRAVITY / 0.25, atol=1e-7)


def test_hand_with_exact_parameters_follows_the_trajectory():
    result = simulate(case({**EXACT, "controller.grip_safety": 1.2}))
    assert result.metrics.held
    assert result.metrics.last_slip_time is None
    np.testing.assert_allclose(result.trace.tracking_error, 0.0, atol=1e-9)
    lift = result.trace.object_pose[-1, 1] - result.trace.object_pose[0, 1]
    assert lift == pytest.approx(0.1536, abs=1e-9)


def test_error_of_a_hand_with_exact_parameters_obeys_its_own_equation():
    """e'' + K_v e' + K_p e = 0 in stick: a bad start is forgotten at the chosen rate."""
    wrong_gravity_free_start = {
        **EXACT,
        **change(0, 1.5, "object.mass", 0.9),
        **change(1, 1.6, "object.mass", 1.0),
        "controller.lyapunov_weight": 0.0,
        "controller.grip_safety": 1.5,
        "simulation.duration": 2.5,
    }
    trace = simulate(case(wrong_gravity_free_start)).trace
    after = trace.times > 1.6 + 1e-6
    t = trace.times[after] - trace.times[after][0]
    e0 = trace.tracking_error[after][0, 1]
    desired_speed = 0.0256
    v0 = desired_speed - trace.object_velocity[after][0, 1]
    assert abs(e0) > 1e-4
    rate, frequency = 5.0, np.sqrt(75.0)  # roots of s^2 + 10 s + 100
    expected = np.exp(-rate * t) * (
        e0 * np.cos(frequency * t) + (v0 + rate * e0) / frequency * np.sin(frequency * t)
    )
    np.testing.assert_allclose(trace.tracking_error[after, 1], expected, atol=1e-9)
