"""How runs end: every hard case in a typed outcome, with what was simulated so far."""

import numpy as np
import pytest

from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import ContactPhase, Outcome
from slipgrasp.core.words.interruptions import describe_stop
from tests.references.continuous import run_continuous
from tests.references.hand import State
from tests.references.sampled import run_sampled
from tests.references.world import World

CASE_1 = load_scenario("paper-case-1")
CASE_2 = load_scenario("paper-case-2")

UNEQUAL = {"fingers.0.friction": 0.25, "fingers.1.friction": 0.30}
PHYSICAL_BOUNDS = {
    "estimates.0.minimum": 0.05,
    "estimates.0.maximum": 2.0,
    "estimates.1.minimum": 0.05,
    "estimates.1.maximum": 2.0,
    "estimates.2.minimum": 0.05,
    "estimates.2.maximum": 10.0,
    "estimates.3.minimum": 0.002,
    "estimates.3.maximum": 0.2,
}
INCONSISTENT_BOUNDARY = {
    "object.mass": 1.4,
    "fingers.0.friction": 0.30,
    "fingers.1.friction": 0.35,
    "controller.lyapunov_weight": 10.0,
    "controller.grip_safety": 1.2,
}


def assert_well_told(result):
    """A run that physics ended says why, where and when, and keeps what was before."""
    assert result.outcome.ended_by_physics
    reason = result.reason
    assert reason.code
    assert reason.message
    assert reason.hint
    assert reason.time == pytest.approx(result.end_time, abs=1e-9)
    assert len(result.trace) >= 1
    assert np.all(np.isfinite(result.trace.to_rows()))


def test_unequal_friction_with_physical_bounds_drops_the_object():
    sampled = {"controller.control_period": 0.001}
    result = simulate(with_values(CASE_2, {**UNEQUAL, **PHYSICAL_BOUNDS, **sampled}))
    assert result.outcome is Outcome.SEPARATED
    assert result.end_time == pytest.approx(0.12, abs=0.01)
    assert result.reason.code == "contact_separation"
    assert result.reason.contact in (0, 1)
    assert_well_told(result)
    assert np.all(result.trace.normal_force[:-1] >= -1e-9)


def test_unequal_friction_without_bounds_may_survive_sampling_with_a_nonsense_inertia():
    sampled = {"controller.control_period": 0.001}
    result = simulate(with_values(CASE_2, {**UNEQUAL, **sampled}))
    assert result.metrics.held
    assert max(result.metrics.slip_path) == pytest.approx(0.050, abs=5e-4)
    assert result.estimates["object.inertia"] == pytest.approx(0.5, abs=0.01)


def test_inertia_estimate_that_runs_through_zero_diverges():
    heavy = {
        "object.mass": 1.5,
        "object.inertia": 0.012,
        "fingers.0.friction": 0.45,
        "fingers.1.friction": 0.35,
    }
    result = simulate(with_values(CASE_2, heavy))
    assert result.outcome is Outcome.DIVERGED
    assert result.end_time == pytest.approx(0.0076, abs=2e-4)
    assert_well_told(result)


@pytest.mark.parametrize("period", [0.0, 0.001])
def test_inconsistent_boundary_is_passed_to_the_end(period):
    values = {**INCONSISTENT_BOUNDARY, "controller.control_period": period}
    result = simulate(with_values(CASE_1, values))
    assert result.outcome is Outcome.COMPLETED
    assert result.metrics.held


def test_recognition_delay_and_fast_sampling_leave_the_same_slip():
    """Continuous control at an inconsistent boundary converges to sampled control."""
    continuous = simulate(with_values(CASE_1, INCONSISTENT_BOUNDARY))
    fast = {**INCONSISTENT_BOUNDARY, "controller.control_period": 0.00025}
    sampled = simulate(with_values(CASE_1, fast))
    holds = [w for w in continuous.warnings if w.code == "recognition_hold"]
    assert holds
    assert holds[0].first_time == pytest.approx(0.15437, abs=1e-5)
    assert f"{1e3 * max(continuous.metrics.slip_path):.2f}" == "23.72"
    assert f"{1e3 * max(sampled.metrics.slip_path):.2f}" == "23.74"


@pytest.mark.slow
@pytest.mark.parametrize("period", [0.0, 0.001])
def test_passage_of_the_inconsistent_boundary_follows_the_scipy_reference(period):
    scenario = with_values(CASE_1, {**INCONSISTENT_BOUNDARY, "controller.control_period": period})
    result = simulate(scenario)
    world = World.from_scenario(scenario)
    if period:
        reference = run_sampled(world, period, 0.19, [0.15])
    else:
        reference = run_continuous(world, 0.19, [0.15])
    assert not any(reference.changes[-1][1])
    np.testing.assert_allclose(result.metrics.slip_path, reference.slip_path, atol=1e-9)
    changes = sorted({change.time for change in result.phase_changes})
    expected = sorted({t for t, _ in reference.changes})
    np.testing.assert_allclose(changes, expected, atol=1e-8)


def test_fingertip_that_reaches_the_end_of_its_face_ends_the_run_there():
    result = simulate(with_values(CASE_2, {"object.face_half_length": 0.02}))
    assert result.outcome is Outcome.LEFT_FACE
    assert_well_told(result)
    contact = result.reason.contact
    assert abs(result.trace.slip[-1, contact]) == pytest.approx(0.02, abs=1e-9)


def test_the_reason_names_a_joint_that_cannot_give_more_and_no_idle_belief():
    composite = load_scenario("composite-case-2")
    result = simulate(with_values(composite, {"actuation.torque_limit": 10.0}))
    assert result.outcome is Outcome.LEFT_FACE
    assert_well_told(result)
    assert "reached its limit actuation.torque_limit, 10 N m" in result.reason.message
    # Far off, but the object does not turn.
    assert result.trace.estimates[-1, 3] == pytest.approx(0.02)
    assert "inertia" not in result.reason.message
    assert "composite" not in result.reason.hint
    assert "raise actuation.torque_limit above 10 N m" in result.reason.hint


def test_arm_that_is_pulled_straight_ends_the_run_as_singular():
    values = {
        "trajectory.acceleration": [0.0, 2.0, 0.0],
        "trajectory.coast_time": 0.0,
        "controller.grip_safety": 2.0,
        **{f"estimates.{i}.initial": 1.0 for i in range(5)},
    }
    result = simulate(with_values(CASE_1, values))
    assert result.outcome is Outcome.SINGULAR
    assert_well_told(result)
    assert result.reason.contact in (0, 1)
    second = result.trace.joint_position[-1, 1::2]
    assert np.abs(np.sin(second)).min() < 0.05
    # Theorem 1 ends there: the object moves no faster than ever, the joints do.
    assert np.abs(result.trace.object_velocity).max() < 2.01
    assert np.abs(result.trace.joint_velocity[-1]).max() > 100.0


def test_a_run_can_be_stopped_and_keeps_what_was_simulated():
    scenario = with_values(CASE_1, {"controller.control_period": 1e-4})
    progress = []
    result = simulate(scenario, progress=progress.append, should_stop=lambda: True)
    assert result.outcome is Outcome.STOPPED
    assert 0.0 < result.end_time < 7.0
    assert progress == sorted(progress)
    assert len(result.trace) > 1


def test_progress_reaches_one_and_pieces_add_up_to_the_same_run():
    scenario = with_values(CASE_2, {"controller.control_period": 0.001})
    progress = []
    whole = simulate(scenario, progress=progress.append)
    assert progress[-1] == 1.0
    simulation = Simulation(scenario)
    while not simulation.finished:
        simulation.advance()
    assert np.array_equal(simulation.result().trace.to_rows(), whole.trace.to_rows())


@pytest.mark.parametrize("period", [0.0, 0.001])
def test_frictionless_contacts_slip_and_end_in_a_typed_outcome(period):
    values = {
        "fingers.0.friction": 0.0,
        "fingers.1.friction": 0.0,
        "controller.control_period": period,
    }
    result = simulate(with_values(CASE_2, values))
    assert result.outcome is not Outcome.LIMIT
    slipping = result.trace.phase[1:] != ContactPhase.STICK
    assert slipping.any()
    if result.outcome is not Outcome.COMPLETED:
        assert_well_told(result)


@pytest.mark.parametrize("name", ["composite-case-2", "spatial-composite"])
def test_a_run_that_is_stopped_before_it_begins_believes_what_it_believed_at_first(name):
    scenario = load_scenario(name)
    simulation = Simulation(scenario)
    simulation.end(Outcome.STOPPED, describe_stop(0.0))
    expected = {estimate.parameter: estimate.initial for estimate in scenario.estimates}
    assert simulation.summary().estimates == expected


@pytest.mark.parametrize("acceleration", [2.0, 10.0, 30.0])
def test_forces_balance_in_the_last_row_of_a_run_that_ends_as_singular(acceleration):
    values = {
        "controller.kind": "theorem-3",
        "controller.grip_safety": 2.0,
        "trajectory.acceleration": [0.0, acceleration, 0.0],
        "trajectory.coast_time": 0.0,
    }
    result = simulate(with_values(CASE_2, values))

    assert result.outcome is Outcome.SINGULAR
    last = result.trace[-1:]
    state = State(last.object_pose[0], last.object_velocity[0], last.slip[0], last.slip_velocity[0])
    hand = World.from_scenario(result.scenario).loop(0.0, {}).hand
    forces = np.column_stack((last.tangential_force[0], last.normal_force[0])).ravel()
    body = result.scenario.object
    inertia = np.array([body.mass, body.mass, body.inertia])
    weight = np.array([0.0, body.mass * result.scenario.simulation.gravity, 0.0])
    missing = inertia * last.object_acceleration[0] + weight - hand.kinematics(state).W @ forces
    assert np.abs(missing).max() < 1e-7 * np.abs(forces).max()
