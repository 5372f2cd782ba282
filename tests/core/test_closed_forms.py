"""Motions whose exact solution is known, through the whole simulator.

With the true friction, the true links and a wrong object mass, both tips of the sample
hand slide exactly on the cone that the controller expects, and the accelerations of tips
and object are constants: a slide under constant forces. A timed change of the true mass
then brakes it.
"""

import numpy as np
import pytest
from scipy.linalg import expm

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values
from slipgrasp.core.trace.types import ContactPhase, Outcome
from tests.references.closed_loop import ClosedLoop
from tests.references.controller import tracking_errors
from tests.references.hand import State

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


BELT = {
    **OPEN_LOOP,
    "object.mass": BELIEVED_MASS,
    "trajectory.acceleration": [0.0, 0.2, 0.0],
    "trajectory.acceleration_time": 0.5,
    "trajectory.coast_time": 0.5,
    **change(0, 0.6, "object.mass", HEAVY),
    **change(1, 0.65, "object.mass", LIGHT),
}


def test_block_on_a_moving_belt_is_dragged_up_to_its_speed():
    """Both fingertips rise like a belt at constant speed; the object slides on them.

    Made heavier it lags, made lighter friction carries it along: constant forces, so time
    and place at which slip ends are those of the block of the textbook. (Torques held over
    a control period would not move the fingertips at exactly constant speed.)
    """
    result = simulate(case(BELT))
    belt_speed = 0.2 * 0.5
    lag = sag(HEAVY) * 0.05  # speed below the belt's at 0.65 s
    stop = 0.65 + lag / -sag(LIGHT)
    slid = 0.5 * lag * (stop - 0.6)
    assert [(c.contact, c.to_phase) for c in result.phase_changes] == [
        (0, ContactPhase.SLIP_FORWARD),
        (1, ContactPhase.SLIP_BACKWARD),
        (0, ContactPhase.STICK),
        (1, ContactPhase.STICK),
    ]
    times = [c.time for c in result.phase_changes]
    np.testing.assert_allclose(times, [0.6, 0.6, stop, stop], rtol=0.0, atol=1e-9)
    trace = result.trace
    end = int(np.flatnonzero(trace.times == times[-1])[-1])
    belt = 0.366 + belt_speed * (stop - 0.25)
    np.testing.assert_allclose(np.abs(trace.slip[end]), slid, atol=1e-9)
    np.testing.assert_allclose(trace.object_velocity[end], [0.0, belt_speed, 0.0], atol=1e-9)
    assert trace.object_pose[end, 1] == pytest.approx(belt - slid, abs=1e-9)


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


KICK_END = 0.2


def three_or_more(n):
    """Fingers below the object next to the two of the sample case, for n = 2 none."""
    below = {"face": "bottom"}
    return {
        2: [],
        3: [{**below, "base": (1.466, -1.3)}],
        4: [
            {**below, "base": (1.3, -1.3), "contact_offset": 0.05},
            {**below, "base": (1.6, -1.3), "contact_offset": -0.05, "elbow": "down"},
        ],
    }[n]


def kicked_hand(n):
    """All parameters known; slow sampled control lets errors grow until it turns continuous."""
    mapping = load_scenario("paper-case-1").to_mapping()
    mapping["fingers"] = [*mapping["fingers"], *three_or_more(n)]
    mapping["estimates"] = []
    mapping["controller"] |= {
        "control_period": 0.05,
        "grasp_force": "minimum" if n == 2 else "none",
        "grip_safety": 1.5,
        "position_gain": [80.0, 120.0, 60.0],
        "velocity_gain": [10.0, 25.0, 8.0, *[12.0] * n],
    }
    mapping["trajectory"] |= {
        "acceleration": (0.3, 0.4, 0.5),
        "acceleration_time": 0.2,
        "coast_time": 0.3,
    }
    mapping["changes"] = [
        {"time": KICK_END, "parameter": "controller.control_period", "value": 0.0}
    ]
    mapping["simulation"] |= {"duration": 1.0}
    return scenario_from_mapping(mapping)


def errors_of_row(loop, trace, k):
    """e and its rate in a stored row, ``(3 + n,)`` each."""
    velocity, slip_velocity = trace.object_velocity[k], trace.slip_velocity[k]
    state = State(trace.object_pose[k], velocity, trace.slip[k], slip_velocity)
    return tracking_errors(state, loop.trajectory.desired(float(trace.times[k])), trace.phase[k])


@pytest.mark.parametrize(("n", "slipping"), [(2, 0), (3, 2), (4, 2)])
def test_run_of_a_hand_that_knows_everything_decays_as_its_gains_say(n, slipping):
    """Along whole runs: all sticking, and with two of three or four contacts slipping."""
    scenario = kicked_hand(n)
    result = simulate(scenario)
    loop, trace = ClosedLoop.from_scenario(scenario), result.trace
    start = int(np.flatnonzero(trace.times == KICK_END)[-1])
    assert np.count_nonzero(trace.phase[start]) == slipping
    assert np.all(trace.phase[start:] == trace.phase[start])
    e0, rate0 = errors_of_row(loop, trace, start)
    assert np.abs(e0[:3]).max() > 1e-3
    gains = zip(loop.law.position_gain, loop.law.velocity_gain, strict=True)
    flows = [np.array([[0.0, 1.0], [-K_p, -K_v]]) for K_p, K_v in gains]
    for k in range(start, len(trace), 10):
        e, rate = errors_of_row(loop, trace, k)
        dt = trace.times[k] - KICK_END
        expected = [expm(A * dt) @ pair for A, pair in zip(flows, np.c_[e0, rate0], strict=True)]
        # The run's tolerance of 1e-9 per step, over about 100 steps.
        np.testing.assert_allclose(np.c_[e, rate], expected, atol=1e-8)
