"""What the law expects over its latency, against what happens."""

import numpy as np
import pytest

from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import run_to_end, simulate
from slipgrasp.core.scenario.laws import CONTROL_LAWS
from slipgrasp.core.scenario.loading import load_scenario, parameter_definitions, with_values
from tests.core.test_composite import at_ticks

CASE_2 = load_scenario("composite-case-2")
KNOWN = {f"estimates.{i}.initial": v for i, v in enumerate([0.25, 0.25, 1.0, 0.01042])}
# A step of the desired pose that nothing is slipping in, with everything known.
MOVING = with_values(
    CASE_2,
    {
        **KNOWN,
        "estimates": [],
        "controller.grip_safety": 2.0,
        "trajectory.kind": "circle",
        "trajectory.radius": 0.05,
        "trajectory.period": 1.0,
        "trajectory.acceleration_time": 0.1,
        "simulation.output_rate": 1000.0,
    },
)


def expected_and_true(latency, duration=0.3):
    """Pose and velocity that the law expected at the last tick, and those that came."""
    scenario = with_values(MOVING, {"controller.latency": latency})
    simulation = Simulation(with_values(scenario, {"simulation.duration": duration}))
    run_to_end(simulation, lambda _: None)
    last = simulation.result().trace
    t = last.times[at_ticks(last)[-1]]
    true = simulate(with_values(scenario, {"simulation.duration": 2.0 * duration})).trace
    row = np.searchsorted(true.times, t + latency - 1e-9)
    state = simulation._run.prediction.state.x[:6]
    return state, np.concatenate((true.object_pose[row], true.object_velocity[row]))


def test_what_is_expected_comes_true_up_to_the_kinematics_that_are_kept():
    """Frozen kinematics err with the distance travelled: the error of the velocity falls with L."""
    errors = []
    for latency in (0.04, 0.02, 0.01):
        expected, true = expected_and_true(latency)
        errors.append(np.abs(expected - true))
        assert np.all(errors[-1][:3] < 2e-4)
        assert np.all(errors[-1][3:] < 2e-2)
    # First order in the distance, times the time: at least a third at half the latency.
    assert np.all(np.linalg.norm(errors[1][3:]) < np.linalg.norm(errors[0][3:]) / 2.0)
    assert np.all(np.linalg.norm(errors[2][3:]) < np.linalg.norm(errors[1][3:]) / 2.0)


@pytest.mark.parametrize("latency", [0.03, 0.04])
def test_a_heavy_object_with_little_friction_is_held_through_the_latency(latency):
    """A strong squeeze that acts late turns the object round unless its turning is foreseen."""
    values = {
        "controller.latency": latency,
        "object.mass": 1.7,
        "object.inertia": 0.01042 * 1.7,
        "fingers.0.friction": 0.191,
        "fingers.1.friction": 0.318,
        "simulation.duration": 1.5,
    }
    foreseen = simulate(with_values(CASE_2, values))
    assert foreseen.metrics.held
    if latency == 0.04:
        late = simulate(with_values(CASE_2, {**values, "controller.prediction": False}))
        assert not late.metrics.held


@pytest.mark.parametrize("kind", CONTROL_LAWS)
@pytest.mark.parametrize("preset", ["composite-case-2", "spatial-composite"])
def test_prediction_is_used_by_every_law_that_its_description_names(preset, kind):
    base = load_scenario(preset)
    assert kind in parameter_definitions(base)["controller.prediction"].used_by
    late = {"controller.kind": kind, "controller.latency": 0.01, "simulation.duration": 0.05}
    ahead, behind = (
        simulate(with_values(base, {**late, "controller.prediction": predicts}))
        for predicts in (True, False)
    )
    assert ahead.trace.to_rows().tobytes() != behind.trace.to_rows().tobytes()


def test_without_latency_prediction_is_nothing():
    runs = [
        simulate(
            with_values(CASE_2, {"simulation.duration": 0.1, "controller.prediction": predicts})
        )
        for predicts in (False, True)
    ]
    assert np.array_equal(runs[0].trace.to_rows(), runs[1].trace.to_rows())


def test_pieces_of_the_desired_motion_that_begin_during_the_latency_are_foreseen():
    """Set-points shorter than the latency: the object follows without falling a piece behind."""
    base = load_scenario("three-fingers")
    late = {"controller.latency": 0.02, "simulation.duration": 3.0}
    result = simulate(with_values(base, late))
    assert result.metrics.held
    assert max(result.metrics.rms_tracking_error[:2]) < 2e-3
