"""An event that fired is over: nothing that rounding leaves behind makes it fire again."""

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import ContactPhase, Outcome

CASE_2 = load_scenario("paper-case-2")
COMPOSITE = load_scenario("composite-case-2")
# Theorem 4 with physical bounds and continuous control: its moment of inertia sinks to its bound.
BOUNDED = {
    **{"estimates.0.minimum": 0.05, "estimates.0.maximum": 2.0},
    **{"estimates.1.minimum": 0.05, "estimates.1.maximum": 2.0},
    **{"estimates.2.minimum": 0.05, "estimates.2.maximum": 10.0},
    **{"estimates.3.minimum": 0.002, "estimates.3.maximum": 0.2},
    "simulation.duration": 1.0,
}
STALLED_ONCE = {
    "object.mass": 1.8547577163722906,
    "object.inertia": 0.01932657540459927,
    "fingers.0.friction": 0.1804552180627349,
    "fingers.1.friction": 0.45272886634516385,
    "controller.lyapunov_weight": 24.154690592982593,
    "controller.grip_safety": 1.3387138884694068,
}


def bounded(values):
    return with_values(CASE_2, {**BOUNDED, **values})


def test_an_estimate_that_reaches_its_bound_rests_exactly_there_and_the_run_goes_on():
    run = simulate(bounded({**STALLED_ONCE, "simulation.output_rate": 5000.0}))
    assert (run.outcome, run.reason.code) == (Outcome.SEPARATED, "contact_separation")
    assert run.end_time == pytest.approx(0.10983, abs=1e-5)
    inertia = run.trace.estimates[:, 3]
    assert inertia.min() == 0.002
    assert (inertia == 0.002).sum() > 10


@pytest.mark.parametrize("seed", range(12))
def test_bounds_on_estimates_make_no_chatter_of_a_run_without_phase_changes(seed):
    draw = np.random.default_rng(seed)
    mass = float(draw.uniform(0.5, 2.0))
    values = {
        **{"object.mass": mass, "object.inertia": 0.01042 * mass},
        "fingers.0.friction": float(draw.uniform(0.15, 0.6)),
        "fingers.1.friction": float(draw.uniform(0.15, 0.6)),
        "controller.lyapunov_weight": float(draw.uniform(1.0, 100.0)),
    }
    run = simulate(bounded(values))
    if run.outcome is Outcome.CHATTERING:
        assert len(run.phase_changes) >= CASE_2.simulation.chatter_changes
    assert run.reason is None or run.reason.code != "event_stall"
    tight = {"simulation.relative_tolerance": 1e-10, "simulation.absolute_tolerance": 1e-12}
    exact = simulate(bounded({**values, **tight}))
    assert exact.outcome is run.outcome
    assert exact.end_time == pytest.approx(run.end_time, rel=1e-3)


def test_a_released_estimate_moves_back_inside():
    """The friction believed falls to its bound during the slip and is free again later."""
    values = {"estimates.2.minimum": 0.499, "estimates.2.initial": 0.5}
    run = simulate(with_values(CASE_2, {**values, "simulation.duration": 0.5}))
    assert run.outcome is Outcome.COMPLETED
    free = simulate(with_values(CASE_2, {"simulation.duration": 0.5}))
    mass = run.trace.estimates[:, 2]
    assert mass.min() >= 0.499
    assert mass[-1] == pytest.approx(free.trace.estimates[-1, 2], rel=0.05)


@pytest.mark.parametrize("offset", [0.0, 1e-12, -1e-12, 1e-10, -1e-10])
@pytest.mark.parametrize("finger", [0, 1])
def test_a_low_friction_patch_that_begins_where_a_fingertip_stops_stalls_nothing(finger, offset):
    scenario = with_values(COMPOSITE, {"simulation.duration": 0.2})
    rest = float(simulate(scenario).trace.slip[-1, finger])
    values = {
        "patches.0.face": scenario.fingers[finger].face,
        "patches.0.centre": rest + offset + 0.03 * np.sign(rest),
        "patches.0.half_length": 0.03,
        "patches.0.friction_factor": 0.5,
    }
    run = simulate(with_values(scenario, values))
    assert run.outcome is Outcome.COMPLETED
    assert len(run.phase_changes) == 4


@pytest.mark.parametrize("period", [0.00025, 0.001])
def test_switching_that_a_controller_commands_is_simulated_to_the_end(period):
    """At the edge of the cones, safety 1, it commands another phase in most of its periods."""
    values = {"controller.control_period": period, "controller.grip_safety": 1.0}
    run = simulate(with_values(COMPOSITE, {**values, "simulation.duration": 0.3}))
    assert run.outcome is Outcome.COMPLETED
    assert len(run.phase_changes) > 3 * COMPOSITE.simulation.chatter_changes
    times = np.array([change.time for change in run.phase_changes])
    assert np.histogram(times, np.arange(0.0, 0.3 + period, period))[0].max() < 12


def test_two_fingertips_that_stop_together_both_rest_exactly():
    run = simulate(COMPOSITE)
    stops = [change for change in run.phase_changes if change.to_phase is ContactPhase.STICK]
    assert stops[-1].time == stops[-2].time
    after = run.trace.times > stops[-1].time
    assert (run.trace.slip_velocity[after] == 0.0).all()
