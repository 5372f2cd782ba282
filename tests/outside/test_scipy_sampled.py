"""Whole runs of sampled control against NumPy: laws, gains, noise and periods of every kind.

The reference (tests/references) has no line in common with the kernel. Events agree to 1e-9 s,
slip paths to 1e-10 m, states and estimates to 1e-8; ten times that where friction is unknown and
both sides learn at different speeds, on which case II depends much (over 74 mm of slip).
"""

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from tests.outside.test_scipy_hybrid import check, paper_case
from tests.references.continuous import run_continuous
from tests.references.hands import general_gains
from tests.references.hybrid import initial_stage
from tests.references.sampled import follow_ticks, run_sampled, tick_times
from tests.references.world import World

pytestmark = pytest.mark.slow

PERIOD = 0.001
OBJECT_GAINS = {
    "controller.position_gain": [80.0, 120.0, 60.0],
    "controller.velocity_gain": [8.0, 11.0, 9.0, 14.0, 12.0],
    "controller.lyapunov_weight": [5.0, 25.0, 10.0, 40.0, 30.0],
}
GAINS = {
    1: {**OBJECT_GAINS, "controller.adaptation_gain": [1.0, 0.7, 1.3, 0.9, 1.6]},
    2: {**OBJECT_GAINS, "controller.adaptation_gain": [1.0, 0.6, 1.5, 1e-5]},
}
# Where contacts slip on they are pulled back, each by its own gain.
SLIP_GAINS = general_gains(np.random.default_rng(5), 3, 2) | {
    "controller.slip_position_gain": [60.0, 25.0]
}


def composite(duration=0.03, **values):
    scenario = load_scenario("composite-case-2")
    return with_values(scenario, {"simulation.duration": duration, **values})


def change_period(t, period):
    key = "controller.control_period"
    return {"changes": [{"time": t, "parameter": key, "value": period}]}


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("period", [0.0, PERIOD])
def test_gains_per_coordinate_follow_the_reference(number, period):
    scenario = paper_case(number, period=period, duration=0.12, **GAINS[number])
    world, times = World.from_scenario(scenario), [0.04, 0.08, 0.11]
    if period:
        reference = run_sampled(world, period, 0.12, times)
    else:
        reference = run_continuous(world, 0.12, times)
    check(simulate(scenario), reference, slack=10.0 if number == 2 else 1.0)


# In case II the estimate of the inertia, no longer the same on both sides, soon runs through zero.
@pytest.mark.parametrize(("number", "duration"), [(1, 0.12), (2, 0.03)])
@pytest.mark.parametrize("period", [0.0, PERIOD])
def test_gains_of_the_slips_and_a_full_q_follow_the_reference(number, duration, period):
    scenario = paper_case(number, period=period, duration=duration, **SLIP_GAINS)
    world, times = World.from_scenario(scenario), [duration / 3.0, duration / 1.5]
    if period:
        reference = run_sampled(world, period, duration, times)
    else:
        reference = run_continuous(world, duration, times)
    result = simulate(scenario)
    check(result, reference, slack=10.0 if number == 2 else 1.0)
    assert min(result.metrics.slip_path) > 1e-4


COMPOSITES = {
    "as it is": {},
    "gains of the slips": {"controller.slip_position_gain": [60.0, 25.0]},
    "deviation per unknown": {"controller.initial_deviation": [2.0, 1.5, 0.8, 0.02]},
    "one deviation": {"controller.initial_deviation": 0.5},
    "gains per coordinate": OBJECT_GAINS,
    "unequal friction": {"fingers.1.friction": 0.3},
    "links believed too heavy": {"controller.link_mass_ratio": 1.2},
    "links believed too light": {"controller.link_mass_ratio": 0.8},
    "links believed too long": {"controller.link_length_ratio": 1.1},
    "joints that rub": {
        **{f"fingers.{i}.joint_damping": 0.4 for i in range(2)},
        **{f"fingers.{i}.joint_friction": 0.2 + 0.3 * i for i in range(2)},
    },
    "probing": {
        "controller.probing": 2.0,
        "estimates.0.initial": 0.22,
        "estimates.1.initial": 0.24,
    },
}


@pytest.mark.parametrize("name", COMPOSITES)
def test_the_composite_law_follows_the_reference(name):
    scenario = composite(**COMPOSITES[name])
    reference = run_sampled(World.from_scenario(scenario), PERIOD, 0.03, [0.005, 0.015, 0.025])
    check(simulate(scenario), reference)


# A seed that does not amplify rounding: with 7, noise of 1e-12 more moves the estimates by 1e-8.
def test_noisy_accelerations_teach_what_the_reference_learns_from_the_same_noise():
    noise = {"sensing.acceleration_noise": 0.1, "simulation.seed": 0}
    scenario = paper_case(2, period=PERIOD, duration=0.3, **noise)
    reference = run_sampled(World.from_scenario(scenario), PERIOD, 0.3, [0.1, 0.2, 0.29])
    check(simulate(scenario), reference)
    quiet = simulate(with_values(scenario, {"sensing.acceleration_noise": 0.0}))
    assert np.abs(quiet.trace.estimates[-1] - reference.states[-1][10:]).max() > 1e-3


@pytest.mark.parametrize("t", [0.04, 0.0405, 0.0403])
@pytest.mark.parametrize("period", [0.002, 0.0005])
def test_a_period_that_changes_counts_from_the_change(t, period):
    scenario = paper_case(1, period=PERIOD, duration=0.12, **change_period(t, period))
    times = [0.02, round(t + 10 * period, 6), round(t + 30 * period, 6)]
    scenario = with_values(scenario, {"simulation.output_rate": 10000.0})
    reference = run_sampled(World.from_scenario(scenario), PERIOD, 0.12, times)
    check(simulate(scenario), reference)


@pytest.mark.parametrize("t", [0.04, 0.0405])
def test_control_that_becomes_continuous_goes_on_from_its_last_tick(t):
    scenario = paper_case(1, period=PERIOD, duration=0.12, **change_period(t, 0.0))
    world = World.from_scenario(scenario)
    ticks = [tick for tick in tick_times(paper_case(1), PERIOD, 0.12) if tick < t - 1e-9]
    first = follow_ticks(world, [*ticks, t], [], initial_stage(world.plain))
    check(simulate(scenario), run_continuous(world, 0.12, [0.06, 0.1], stage=first.end, t_start=t))


@pytest.mark.parametrize("t", [0.04, 0.0405])
def test_control_that_becomes_sampled_has_its_first_tick_there(t):
    scenario = paper_case(1, duration=0.12, **change_period(t, PERIOD))
    world = World.from_scenario(scenario)
    first = run_continuous(world, t, [])
    ticks = t + PERIOD * np.arange(round((0.12 - t) / PERIOD + 0.499))
    times = [ticks[10], ticks[50]]
    scenario = with_values(scenario, {"simulation.output_rate": 2000.0})
    check(simulate(scenario), follow_ticks(world, [*ticks, 0.12], times, first.end))
