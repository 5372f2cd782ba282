"""Where a continuous control law jumps: velocities go on, and a pole of the grasp force ends it."""

import numpy as np
import pytest

from benchmarks.outcome_checks import ledger_error, velocity_jump
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import scenario_from_mapping, with_values
from slipgrasp.core.trace.types import Outcome
from tests.core.drawn_scenarios import KINDS, AtEnds, draw_scenario

NUM_SEEDS = 20

# Two fingers whose friction the law takes for less than it is: it asks for what its cones do not
# allow, and where they begin to allow it again, the least force that does is infinite.
POLE = {
    "object": {"half_width": 0.05},
    "fingers": [
        {"base": (-0.24, 0.39), "face": "left", "contact_offset": 0.02},
        {
            "base": (2.7, -0.3),
            "friction": 0.4,
            "face": "right",
            "contact_offset": 0.02,
            "link_centre_fractions": (0.4, 0.3),
        },
    ],
    "controller": {"control_period": 0.0, "distribution": "hold"},
    "estimates": [{"parameter": "fingers.0.friction", "initial": 0.25}],
    "simulation": {"gravity": 0.0},
}
CONTINUOUS = [kind for kind in KINDS if kind.law == "theorem-4" and not kind.sampled]


@pytest.fixture(scope="module")
def run():
    return simulate(scenario_from_mapping(POLE))


def test_the_run_ends_where_the_law_asks_for_forces_without_bound(run):
    assert run.outcome is Outcome.DIVERGED
    assert run.reason.code == "unbounded_grasp_force"
    assert run.reason.message.startswith(
        "the control law commands grasp forces that grow without bound, at the limit where its "
        "friction cones become or cease to be satisfiable, at "
    )
    assert run.reason.time == run.end_time


def test_no_energy_is_missing_before_it_and_no_velocity_jumps(run):
    assert velocity_jump(run.trace) == 0.0
    assert ledger_error(run.trace) == 0.0


def test_the_cones_begin_to_be_satisfiable_there(run):
    # Up to the end they are not, by what the law commands.
    assert run.trace.grasp_violation[-1] > 0.0
    assert run.trace.grasp_violation[0] > 0.0


def test_a_step_passes_the_onset_of_a_violation_without_having_felt_it_before():
    values = {"controller.distribution": "hold", "controller.recognition_time": 0.01}
    jumps = 0
    for kind in CONTINUOUS:
        for seed in range(NUM_SEEDS):
            trace = simulate(with_values(draw_scenario(kind, seed, AtEnds), values)).trace
            violated = trace.grasp_violation > 0.0
            at_jump = (np.diff(trace.times) == 0.0) & (violated[1:] != violated[:-1])
            jumps += int(at_jump.sum())
            assert velocity_jump(trace) == 0.0, (kind, seed)
    assert jumps > 0
