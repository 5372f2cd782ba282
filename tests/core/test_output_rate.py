"""How often a trace is stored decides nothing but which samples it has."""

from random import Random

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import run_to_end
from slipgrasp.core.scenario.loading import scenario_from_mapping, with_values
from tests.core.drawn_hands_in_space import draw_hand_in_space
from tests.core.drawn_motions import MOTIONS, draw_motion
from tests.core.drawn_scenarios import KINDS, draw_scenario

pytestmark = pytest.mark.slow

RATES = (7.0, 630.0, 10_000.0)
SEEDS = range(6)


def on_motion(scenario, kind, seed):
    """The scenario with another motion, whose segments end on, beside and between its ticks."""
    rng, mapping = Random(f"{kind} {seed}"), scenario.to_mapping()
    pose = tuple(mapping["trajectory"]["start"])
    period = scenario.controller.control_period or 0.001
    return scenario_from_mapping({**mapping, "trajectory": draw_motion(rng, kind, pose, period)})


def spatial(kind, seed):
    return on_motion(draw_hand_in_space(f"rate {seed}"), kind, seed)


def planar(kind, seed):
    return on_motion(draw_scenario(KINDS[seed % len(KINDS)], f"rate {seed}"), kind, seed)


def at_rate(scenario, rate):
    """The run, and its extremes of the steps alone, without those of the samples."""
    simulation = Simulation(with_values(scenario, {"simulation.output_rate": rate}))
    run_to_end(simulation, lambda _: None)
    tally = simulation._run.tally
    return simulation.result(), [
        tally[each].copy() for each in ("peak_normal_force", "least_margin")
    ]


def course_of(run):
    """How a run ends, and its phase changes without their times."""
    phases = [(c.contact, c.from_phase, c.to_phase) for c in run.phase_changes]
    return run.outcome, run.reason and run.reason.code, phases


def instants_of(run):
    return [*(change.time for change in run.phase_changes), run.end_time]


@pytest.mark.parametrize("kind", MOTIONS)
@pytest.mark.parametrize("draw", [planar, spatial])
def test_no_bit_of_a_run_depends_on_the_output_rate(draw, kind, subtests):
    """Nor do the extremes that steps show, or samples of one instant, inside a step too."""
    compared = 0
    for seed in SEEDS:
        scenario = draw(kind, seed)
        plain, extremes = at_rate(scenario, 200.0)
        for rate in RATES:
            with subtests.test(seed=seed, rate=rate):
                other, others_extremes = at_rate(scenario, rate)
                assert_same_run(other, plain)
                assert_array_equal(others_extremes, extremes)
                compared += compare_samples(plain.trace, other.trace)
    assert compared > 100


def assert_same_run(other, plain):
    assert course_of(other) == course_of(plain)
    assert instants_of(other) == instants_of(plain)
    assert_array_equal(other.ticks.commands, plain.ticks.commands)
    assert_array_equal(other.ticks.estimates, plain.ticks.estimates)
    assert_array_equal(other.trace.object_pose[-1], plain.trace.object_pose[-1])


def compare_samples(plain, fine):
    """How many samples two traces have at one instant, and the same in them."""
    mine, other = at_output_times(plain.times), at_output_times(fine.times)
    _, at, there = np.intersect1d(plain.times[mine], fine.times[other], return_indices=True)
    for signal in ("object_pose", "slip", "object_velocity", "tracking_error"):
        here, again = getattr(plain, signal)[mine[at]], getattr(fine, signal)[other[there]]
        assert_allclose(here, again, rtol=1e-7, atol=1e-9)
    return len(at)


def at_output_times(times):
    """Samples at the output times of 200 Hz where they are the only ones: an event gives two."""
    later = np.diff(times) > 0.0
    alone = np.append(later, True) & np.insert(later, 0, True)
    return np.flatnonzero(alone & np.isin(times, np.arange(61) / 200.0))
