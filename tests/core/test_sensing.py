"""What the controller measures: noise, filtered accelerations, detected slip."""

from itertools import repeat

import numpy as np
import pytest

from slipgrasp.core.run.batch import simulate_many
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import run_to_end, simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from tests.core.test_composite import at_ticks
from tests.references.closed_loop import ClosedLoop
from tests.references.hand import State
from tests.references.noise import normal_numbers

CASE_2 = load_scenario("composite-case-2")
NOISY = load_scenario("composite-case-2-noisy")
PERIOD = 0.001
SHORT = {"simulation.duration": 0.6, "simulation.output_rate": 1000.0}
# PD control is linear in the measured velocity, so its torque tells the noise.
LISTENER = with_values(
    CASE_2,
    {
        **SHORT,
        "controller.kind": "pd-gravity",
        "controller.grip_force": 40.0,
        "estimates.2.initial": 1.0,
    },
)


def velocity_noise_in(scenario, trace):
    """Noise of the object's velocity at every tick, from the torque that was commanded."""
    loop, law = ClosedLoop.from_scenario(scenario), scenario.controller
    body = np.diag(loop.hand.object_dynamics(loop.unknowns.fill(loop.initial_estimates))[0])
    noise = []
    for row in at_ticks(trace):
        pose, velocity = trace.object_pose[row], trace.object_velocity[row]
        resting = State(pose, np.zeros(3), trace.slip[row], np.zeros(2))
        kin = loop.hand.kinematics(resting)
        _, weight = loop.hand.finger_dynamics(kin, loop.truth)
        forces = np.linalg.solve(kin.J.T, np.ravel(trace.joint_torque[row]) - weight)
        wrench = kin.W @ forces - [0.0, body[1] * 9.81, 0.0]
        desired = loop.trajectory.desired(trace.times[row])
        spring = law.position_gain * (desired[0] - pose)
        measured = desired[1] - (wrench / body - spring) / law.velocity_gain
        noise.append(measured - velocity)
    return np.array(noise)


def drawn(seed, num_ticks):
    """The normal numbers of docs/model.md, drawn anew."""
    return normal_numbers(seed, num_ticks, 15)


def delay_number(seed, contact, event):
    """One number of the stream of delays (docs/model.md, Sensing and actuation)."""
    return normal_numbers(seed, [event], 2 * contact + 1, stream=2)[0, 2 * contact]


def test_velocity_noise_is_as_strong_as_stated_and_drawn_from_the_seed():
    sigma = 2e-3
    scenario = with_values(LISTENER, {"sensing.velocity_noise": sigma, "simulation.seed": 7})
    trace = simulate(scenario).trace
    noise = velocity_noise_in(scenario, trace)
    assert len(noise) == 600
    assert noise[:, :2].std() == pytest.approx(sigma, rel=0.06)
    # Velocities stand behind the five positions of x, y, theta and both slips.
    np.testing.assert_allclose(noise, sigma * drawn(7, 600)[:, 5:8], atol=1e-9)


def test_noise_that_is_switched_on_in_mid_run_acts_at_once():
    change = {"time": 0.1, "parameter": "sensing.velocity_noise", "value": 1e-3}
    scenario = with_values(LISTENER, {"changes": [change]})
    noise = velocity_noise_in(scenario, simulate(scenario).trace)
    np.testing.assert_allclose(noise[:100], 0.0, atol=1e-9)
    np.testing.assert_allclose(noise[100:], 1e-3 * drawn(0, 600)[100:, 5:8], atol=1e-9)


def test_noise_is_the_same_however_the_run_is_cut(monkeypatch):
    scenario = with_values(NOISY, SHORT)
    whole = simulate(scenario)
    monkeypatch.setattr("slipgrasp.core.run.computation._STEPS_PER_PIECE", 7)
    pieces = Simulation(scenario)
    run_to_end(pieces, lambda _: None)
    assert np.array_equal(pieces.result().trace.to_rows(), whole.trace.to_rows())
    (summary,) = simulate_many([scenario])
    assert summary.metrics == whole.metrics


def filtered(velocities, torques, period, filter_time):
    """Differences and torques through one filter, which starts as the mean of what there is."""
    acceleration, torque = np.zeros(velocities.shape[1]), torques[0]
    for k in range(1, len(velocities)):
        share = max(period / (filter_time + period), 1.0 / k)
        slope = (velocities[k] - velocities[k - 1]) / period
        acceleration = acceleration + share * (slope - acceleration)
        torque = torque + (1.0 if k == 1 else share) * (torques[k - 1] - torque)
    return acceleration, torque


@pytest.mark.parametrize("begin", [0.0, 0.05])
def test_accelerations_are_filtered_differences(begin):
    """With true slip at the start, and in mid-run where the filter starts then."""
    values = {**SHORT, "simulation.duration": 0.1005, "sensing.acceleration_filter_time": 0.004}
    if begin == 0.0:
        values["sensing.true_accelerations"] = False
    else:
        change = {"time": begin, "parameter": "sensing.true_accelerations", "value": False}
        values["changes"] = [change]
    simulation = Simulation(with_values(CASE_2, values))
    run_to_end(simulation, lambda _: None)
    trace, senses = simulation.result().trace, simulation._run.senses
    ticks = at_ticks(trace)
    ticks = ticks[trace.times[ticks] > begin - 1e-9]
    velocities = np.hstack([trace.object_velocity, trace.slip_velocity])[ticks]
    torques = trace.joint_torque[ticks].reshape(len(ticks), -1)
    acceleration, torque = filtered(velocities, torques, PERIOD, 0.004)
    np.testing.assert_allclose(senses.acceleration[:5], acceleration, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(senses.torques[:2].ravel(), torque, rtol=1e-9)


def detected(velocities, times, threshold, delays):
    """Belief of one contact at every tick: a contradiction counts from the tick before it."""
    belief, agreed, beliefs, waiting = 0, times[0], [], iter(delays)
    delay = next(waiting)
    for t, velocity in zip(times, velocities, strict=True):
        seen = int(np.sign(velocity)) if abs(velocity) > threshold else 0
        if seen == belief:
            agreed = t
        elif t - agreed > delay - 1e-9:
            belief, agreed, delay = seen, t, next(waiting)
        beliefs.append(belief)
    return beliefs


@pytest.mark.parametrize("delay", [0.0, 0.002, 0.005])
@pytest.mark.parametrize("threshold", [0.002, 0.01])
def test_slip_is_detected_above_a_threshold_and_after_a_delay(threshold, delay):
    values = {
        **SHORT,
        "sensing.true_phases": False,
        "sensing.slip_threshold": threshold,
        "sensing.slip_delay": delay,
    }
    result = simulate(with_values(CASE_2, values))
    trace = result.trace
    ticks = at_ticks(trace)
    for contact in range(2):
        velocity, believed = trace.slip_velocity[ticks, contact], trace.believed_phase[ticks]
        expected = detected(velocity, trace.times[ticks], threshold, repeat(delay))
        assert np.array_equal(believed[:, contact], expected)
        assert np.any(believed[:, contact] != 0)
    assert np.any(trace.believed_phase != trace.phase)
    assert result.metrics.held


@pytest.mark.parametrize("seed", [3, 4])
def test_the_delay_of_every_detection_is_drawn_from_the_seed(seed):
    """Contact i, detection k: number i of the stream of delays, at its k-th draw."""
    mean, deviation = 4e-3, 3e-3
    values = {
        **SHORT,
        "sensing.true_phases": False,
        "sensing.slip_delay": mean,
        "sensing.slip_delay_deviation": deviation,
        "simulation.seed": seed,
    }
    trace = simulate(with_values(CASE_2, values)).trace
    ticks = at_ticks(trace)
    found = set()
    for contact in range(2):
        numbers = [delay_number(seed, contact, event) for event in range(200)]
        delays = np.maximum(0.0, mean + deviation * np.array(numbers))
        found |= set(delays[:2])
        expected = detected(trace.slip_velocity[ticks, contact], trace.times[ticks], 0.005, delays)
        assert np.array_equal(trace.believed_phase[ticks, contact], expected)
        assert np.any(np.array(expected) != 0)
    assert len(found) > 2


def summed(velocities, threshold, bound):
    """Belief of one contact at every tick by Page's test, written from docs/model.md."""
    level, belief, sums, beliefs = 0.5 * threshold, 0, np.zeros(2), []
    for velocity in velocities:
        against = np.array([velocity, -velocity]) - level
        if belief:
            against = np.full(2, level - belief * velocity)
        sums = np.maximum(0.0, sums + against)
        if sums.max() > bound:
            belief = 0 if belief else (1 if sums[0] > sums[1] else -1)
            sums = np.zeros(2)
        beliefs.append(belief)
    return beliefs


@pytest.mark.parametrize("expected_noise", [0.0, 2e-3])
def test_cumulative_sums_detect_slip_as_pages_test_does(expected_noise):
    values = {
        **SHORT,
        "sensing.true_phases": False,
        "sensing.slip_detector": "cumulative-sum",
        "controller.velocity_noise": expected_noise,
    }
    trace = simulate(with_values(CASE_2, values)).trace
    ticks = at_ticks(trace)
    bound = max(10.0 * expected_noise**2 / 0.0025, 0.0025 * 0.002 / PERIOD)
    for contact in range(2):
        believed = trace.believed_phase[ticks, contact]
        assert np.array_equal(believed, summed(trace.slip_velocity[ticks, contact], 0.005, bound))
        assert np.any(believed != 0)


def test_rows_are_weighed_by_the_noise_of_the_filtered_differences():
    """Variance of a filtered difference of white noise, by drawing it, against what is packed."""
    scenario = with_values(NOISY, {"controller.velocity_noise": 1e-3})
    packed = Simulation(scenario)._model.law.acceleration_variance
    velocities = np.random.default_rng(1).normal(0.0, 1e-3, (200_000, 1))
    acceleration, drawn_ones = 0.0, []
    share = PERIOD / (0.006 + PERIOD)
    for difference in np.diff(velocities[:, 0]) / PERIOD:
        acceleration += share * (difference - acceleration)
        drawn_ones.append(acceleration)
    assert packed == pytest.approx(np.var(drawn_ones[100:]), rel=0.02)
