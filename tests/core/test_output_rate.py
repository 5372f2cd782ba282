"""How often a trace is stored decides nothing but which samples it has."""

from random import Random

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import run_to_end, simulate
from slipgrasp.core.scenario.loading import scenario_from_mapping, with_values
from tests.core.drawn_hands_in_space import draw_hand_in_space
from tests.core.drawn_motions import MOTIONS, draw_motion
from tests.core.drawn_scenarios import KINDS, draw_scenario

pytestmark = pytest.mark.slow

RATES = (7.0, 630.0, 1000.0, 10_000.0)  # beside 200 Hz
SEEDS = range(12)


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
    return simulate(with_values(scenario, {"simulation.output_rate": rate}))


def course_of(run):
    """How a run ends, and its phase changes without their times."""
    phases = [(c.contact, c.from_phase, c.to_phase) for c in run.phase_changes]
    return run.outcome, run.reason and run.reason.code, phases


def instants_of(run):
    return [*(change.time for change in run.phase_changes), run.end_time]


@pytest.mark.parametrize("kind", MOTIONS)
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("draw", [planar, spatial])
def test_no_bit_of_a_run_depends_on_the_output_rate(draw, kind, seed):
    scenario = draw(kind, seed)
    plain = simulate(scenario)
    for rate in RATES:
        other = at_rate(scenario, rate)
        assert course_of(other) == course_of(plain)
        assert instants_of(other) == instants_of(plain)
        assert_array_equal(other.ticks.commands, plain.ticks.commands)
        assert_array_equal(other.ticks.estimates, plain.ticks.estimates)
        assert_array_equal(other.trace.object_pose[-1], plain.trace.object_pose[-1])


@pytest.mark.parametrize("kind", MOTIONS)
@pytest.mark.parametrize("draw", [planar, spatial])
def test_the_extremes_that_steps_show_are_the_same_to_the_bit_at_every_output_rate(draw, kind):
    """So samples have no part in where extremes are looked for."""
    for seed in SEEDS:
        plain, fine = (tally_of(draw(kind, seed), rate) for rate in (200.0, 10_000.0))
        for name in ("peak_normal_force", "least_margin"):
            assert_array_equal(plain[name], fine[name])


def tally_of(scenario, rate):
    simulation = Simulation(with_values(scenario, {"simulation.output_rate": rate}))
    run_to_end(simulation, lambda _: None)
    return simulation._run.tally


@pytest.mark.parametrize("kind", MOTIONS)
@pytest.mark.parametrize("draw", [planar, spatial])
def test_samples_at_one_instant_are_the_same_at_every_output_rate(draw, kind):
    """Of samples inside a step too, which are no end of any step."""
    compared = 0
    for seed in SEEDS:
        scenario = draw(kind, seed)
        plain, fine = simulate(scenario).trace, at_rate(scenario, 10_000.0).trace
        mine, other = at_output_times(plain.times), at_output_times(fine.times)
        _, at, there = np.intersect1d(plain.times[mine], fine.times[other], return_indices=True)
        compared += len(at)
        for signal in ("object_pose", "slip", "object_velocity", "tracking_error"):
            here, again = getattr(plain, signal)[mine[at]], getattr(fine, signal)[other[there]]
            assert_allclose(here, again, rtol=1e-7, atol=1e-9)
    assert compared > 100


def at_output_times(times):
    """Samples at the output times of 200 Hz where they are the only ones: an event gives two."""
    later = np.diff(times) > 0.0
    alone = np.append(later, True) & np.insert(later, 0, True)
    return np.flatnonzero(alone & np.isin(times, np.arange(61) / 200.0))
