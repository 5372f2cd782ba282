"""What the joints make of commands: late, limited; and all of it off by default."""

import numpy as np
import pytest

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from tests.core.test_composite import at_ticks
from tests.state_evaluation import evaluate_state

CASE_2 = load_scenario("paper-case-2")
SPATIAL = load_scenario("spatial-composite")
BOTH = pytest.mark.parametrize("base", [CASE_2, SPATIAL], ids=["planar", "spatial"])
SAMPLED = {
    "controller.control_period": 0.001,
    "simulation.output_rate": 1000.0,
    "simulation.duration": 0.2,
}


def commands(scenario, trace):
    """Times of the ticks, and the torques that the law commands there."""
    ticks = at_ticks(trace)
    torques = [
        evaluate_state(
            scenario,
            trace.times[row],
            trace.object_pose[row],
            trace.object_velocity[row],
            trace.slip[row],
            trace.slip_velocity[row],
            trace.believed_phase[row].astype(int),
            trace.estimates[row],
        ).torques
        for row in ticks
    ]
    return trace.times[ticks], np.array(torques)


@BOTH
@pytest.mark.parametrize("latency", [0.0, 0.001, 0.002, 0.0025, 0.01])
def test_a_torque_acts_one_latency_after_its_tick_but_the_first_at_once(base, latency):
    run = simulate(with_values(base, {**SAMPLED, "controller.latency": latency}))
    rows = at_ticks(run.trace)
    due = run.ticks.times + latency
    due[0] = 0.0
    acting = np.searchsorted(due, run.trace.times[rows] + 1e-9, side="right") - 1
    given = run.trace.joint_torque[rows].reshape(len(rows), -1)
    np.testing.assert_array_equal(given, run.ticks.commands[acting])
    assert np.ptp(given, axis=0).max() > 1.0


def test_between_two_ticks_a_late_torque_acts_when_it_is_due():
    values = {**SAMPLED, "controller.latency": 0.0025, "simulation.output_rate": 4000.0}
    trace = simulate(with_values(CASE_2, values)).trace
    torque = trace.joint_torque.reshape(len(trace), -1)
    moved = trace.times[1:][np.any(np.diff(torque, axis=0) != 0.0, axis=1)]
    assert len(moved) > 150
    np.testing.assert_allclose(np.mod(moved, 0.001), 0.0005, atol=1e-9)


def test_commands_on_their_way_arrive_although_the_period_changes():
    change = {"time": 0.1, "parameter": "controller.control_period", "value": 0.002}
    values = {**SAMPLED, "controller.latency": 0.004}
    plain = simulate(with_values(CASE_2, values)).trace
    other = simulate(with_values(CASE_2, {**values, "changes": [change]})).trace
    for t in (0.101, 0.102, 0.103, 0.104):
        mine = np.flatnonzero(np.abs(other.times - t) < 1e-9)[-1]
        row = np.flatnonzero(np.abs(plain.times - t) < 1e-9)[-1]
        np.testing.assert_allclose(other.joint_torque[mine], plain.joint_torque[row], rtol=1e-7)


def test_latency_that_goes_leaves_nothing_on_its_way():
    """Continuous control follows; a late torque must not act in it."""
    gone = [
        {"time": 0.1, "parameter": "controller.latency", "value": 0.0},
        {"time": 0.1, "parameter": "controller.control_period", "value": 0.0},
    ]
    values = {**SAMPLED, "controller.latency": 0.004, "changes": gone}
    scenario = with_values(CASE_2, values)
    trace = simulate(scenario).trace
    continuous = with_values(
        scenario, {"controller.latency": 0.0, "controller.control_period": 0.0, "changes": []}
    )
    times, torques = commands(continuous, trace)
    after = times > 0.1
    given = trace.joint_torque[at_ticks(trace)].reshape(len(times), -1)
    np.testing.assert_allclose(given[after], torques[after], rtol=1e-9)


@BOTH
def test_no_torque_is_above_its_limit(base):
    free = simulate(with_values(base, SAMPLED))
    limit = 0.9 * float(np.abs(free.trace.joint_torque).max())
    result = simulate(with_values(base, {**SAMPLED, "actuation.torque_limit": limit}))
    assert np.abs(result.trace.joint_torque).max() == limit
    assert np.abs(result.trace.commanded_torque).max() > limit
    (warning,) = [w for w in result.warnings if w.code == "torque_limited"]
    assert warning.count > 0
    assert "torque_limited" not in [w.code for w in free.warnings]


@BOTH
@pytest.mark.parametrize("change", [None, 0.003], ids=["one period", "another period later"])
def test_no_torque_changes_faster_than_its_rate_limit(base, change):
    rate = 200.0
    values = {**SAMPLED, "actuation.torque_rate_limit": rate}
    if change is not None:
        parameter = {"parameter": "controller.control_period", "value": change}
        values["changes"] = [{"time": 0.01, **parameter}]
    result = simulate(with_values(base, values))
    trace = result.trace
    torque = trace.joint_torque.reshape(len(trace), -1)
    ticks = at_ticks(trace)
    moved = [0, *(1 + np.flatnonzero(np.any(np.diff(torque[ticks], axis=0) != 0.0, axis=1)))]
    steps = np.abs(np.diff(torque[ticks][moved], axis=0)).max(axis=1)
    elapsed = np.diff(trace.times[ticks][moved])
    # A step may use the whole period that follows it.
    assert np.all(steps <= rate * np.maximum(elapsed, change or 0.0) + 1e-9)
    assert steps.max() == pytest.approx(rate * (change or 0.001), rel=1e-6)
    assert "torque_limited" in [w.code for w in result.warnings]


@pytest.mark.parametrize(
    "values",
    [
        {"sensing.acceleration_filter_time": 0.05},
        {"sensing.slip_threshold": 0.1, "sensing.slip_delay": 0.1},
        {"simulation.seed": 5},
        {"actuation.torque_limit": 1e6, "actuation.torque_rate_limit": 1e9},
        {"controller.slip_stop": 5.0, "controller.forgetting": 0.6, "controller.force_noise": 9.0},
        {"controller.grip_force": 3.0, "controller.grip_rate": 3.0},
        {"fingers.0.static_friction": 0.25},
    ],
)
def test_what_is_off_leaves_every_bit_as_it_was(values):
    plain = simulate(with_values(CASE_2, SAMPLED)).trace.to_rows()
    assert np.array_equal(
        simulate(with_values(CASE_2, {**SAMPLED, **values})).trace.to_rows(), plain
    )


@BOTH
@pytest.mark.parametrize(("period", "latency"), [(0.0001, 0.01), (0.00029, 0.029), (0.0003, 0.03)])
def test_the_queue_holds_a_latency_of_a_hundred_periods_and_no_more(base, period, latency):
    values = {**SAMPLED, "controller.control_period": period}
    longest = with_values(base, {**values, "controller.latency": latency})
    assert simulate(with_values(longest, {"simulation.duration": 0.05})).end_time == 0.05
    with pytest.raises(ScenarioError) as caught:
        with_values(base, {**values, "controller.latency": 1.01 * latency})
    (error,) = caught.value.errors
    assert error.field == "controller.latency"
    assert f"{latency:g} s" in error.message
