"""A small sample of `benchmarks.soft_grasps`, and its checks on runs that they must refuse."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.hands_in_space import eccentricities
from benchmarks.outcome_checks import Pair
from benchmarks.random_runs import SOFT_GRASPS, draw
from benchmarks.soft_grasps import JUDGE
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values

pytestmark = pytest.mark.slow

SEED, COUNT = 3, 20


@pytest.fixture(scope="module")
def run():
    """A box that turns between two pads, and stops."""
    return simulate(with_values(load_scenario("parallel-gripper"), {"simulation.duration": 1.3}))


def missed(run):
    """Names of the checks that a run misses."""
    return set(JUDGE.find_missed(Pair(run, np.zeros((2, 3)))))


def test_random_soft_grasps_end_truly():
    drawn = [draw(SOFT_GRASPS, SEED, index) for index in range(COUNT)]
    judgements = [JUDGE.judge(run, twice=index % 4 == 0) for index, run in enumerate(drawn)]
    assert not {index: j for index, j in enumerate(judgements) if j.missed}
    assert len({judgement.outcome for judgement in judgements}) >= 2


@pytest.mark.parametrize(
    "index",
    [
        93,  # a contact that creeps beside its surface, under the composite law
        208,  # the same with three contacts
        242,  # a spin that another contact has held until it slips for itself
        253,  # creep that stops, and takes energy with it
        266,  # a peak of a force while slips begin
        326,  # a slip that begins for a long time
        328,  # a slip that begins beside a fast one with large forces
        96,  # a contact that has begun to slip, and rests
        187,  # others take over moments until their sum turns the wrong way
        374,  # the same, with energy that friction would return
        390,  # a contact with a small part in a moment that no equation determines
        442,  # a contact that creeps while another one begins to slip
        602,  # a chain that becomes singular
        711,  # an impulse that turns the direction of a slip
        1222,  # the speed of a slip that stops near a singular pose
        76,  # moments that were taken to move nothing, and move the object a little
        68,  # a slip that begins and rests while others begin
        20,  # a torque that jumps while a slip begins
        1120,  # a slip that comes to rest in its first steps
        899,  # phases selected again while a slip begins
        1227,  # a contact that creeps too fast for its friction
        2251,  # the same, with another contact that creeps
        341,  # a tip that is 1e9 times heavier across its face than along it, near a singular pose
        245,  # thousands of steps of a slip that creeps beside a fast spin
        884,  # a slip that comes to rest in the step in which it begins
        269,  # a spin that the other velocities correct while a slip begins
        3395,  # a slip at onset whose spin another contact has stopped
        2003,  # implicit steps that are rejected again and again
        4361,  # the same, as the energy grows
        2730,  # a moment that is determined only without the friction of slips
        1307,  # contacts that begin to slip and rest in turn
        3189,  # a slip that begins as fast creep of other contacts ends
        4621,  # a slip that begins with the velocity of fast creep
    ],
)
def test_runs_that_have_ended_falsely_end_truly(index):
    assert not JUDGE.judge(draw(SOFT_GRASPS, 14, index), twice=True).missed


def test_a_contact_without_force_separates_instead_of_pulling():
    judgement = JUDGE.judge(draw(SOFT_GRASPS, 15, 578), twice=True)
    assert judgement.outcome == "separated"
    assert not judgement.missed


def test_draws_have_all_kinds_of_fingers_pads_and_laws():
    drawn = [draw(SOFT_GRASPS, SEED, index) for index in range(60)]
    kinds = {frozenset(finger.kind for finger in scenario.fingers) for scenario in drawn}
    assert {frozenset({kind}) for kind in ("links", "slides", "chain")} < kinds
    assert max(map(len, kinds)) > 1
    assert {len(scenario.fingers) for scenario in drawn} == {2, 3, 4}
    assert len({scenario.controller.kind for scenario in drawn}) == 5
    hard = [(eccentricities(scenario) == 0.0).sum() for scenario in drawn]
    assert all(scenario.has_soft_fingers for scenario in drawn)
    assert 0 in hard and max(hard) > 0
    pressures = {finger.pad_pressure for scenario in drawn for finger in scenario.fingers}
    assert pressures == {"even", "hertz"}


def test_a_run_as_it_should_be_misses_no_check(run):
    assert not missed(run)


def test_a_contact_without_force_at_the_start_may_be_pressed_later():
    assert simulate(draw(SOFT_GRASPS, 14, 373)).end_time == 0.3


@pytest.mark.parametrize("slips", [False, True])
def test_a_moment_off_its_limit_surface_is_found(run, slips):
    trace, e = run.trace, eccentricities(run.scenario)
    row = np.flatnonzero((trace.phase[:, 0] != 0) == slips)[-5]
    moments = trace.torsional_moment.copy()
    bound = e[0] * trace.friction_coefficient[row, 0] * trace.normal_force[row, 0]
    moments[row, 0] = bound * (1.0 + 1e-7)
    assert "cone" in missed(replace(run, trace=replace(trace, torsional_moment=moments)))
