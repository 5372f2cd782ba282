"""Many runs on threads: equal to each alone, in order, lazily, without traces."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.batch import simulate_many
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values


def varied(count):
    """Scenarios of every outcome: held, separated, chattering, with 1 kHz and timed changes."""
    rng = np.random.default_rng(7)
    for k in range(count):
        values = {
            "object.mass": float(rng.uniform(0.6, 2.0)),
            "fingers.0.friction": float(rng.uniform(0.15, 0.5)),
            "fingers.1.friction": float(rng.uniform(0.15, 0.5)),
            "controller.control_period": 0.001 * (k % 2),
            "controller.grasp_force": "none" if k % 5 == 4 else "minimum",
            "simulation.duration": 0.3,
        }
        if k % 3 == 0:
            change = {"time": 0.1, "parameter": "object.mass", "value": 1.2}
            values |= {f"changes.0.{key}": value for key, value in change.items()}
        yield with_values(load_scenario(f"paper-case-{1 + k % 2}"), values)


@pytest.mark.parametrize("threads", [1, 3])
def test_each_run_of_a_batch_is_the_run_alone(threads):
    scenarios = list(varied(24))
    summaries = list(simulate_many(scenarios, threads=threads))
    assert len({summary.outcome for summary in summaries}) > 1
    for scenario, summary in zip(scenarios, summaries, strict=True):
        alone = simulate(scenario)
        assert summary.scenario is scenario
        assert summary.outcome is alone.outcome
        assert summary.reason == alone.reason
        assert summary.end_time == alone.end_time
        assert summary.metrics == alone.metrics
        assert summary.warnings == alone.warnings
        assert summary.estimates == alone.estimates


def test_scenarios_are_taken_only_as_they_are_needed():
    taken = itertools.count()
    endless = (scenario for scenario in itertools.cycle(varied(2)) if next(taken) >= 0)
    runs = simulate_many(endless, threads=2)
    for _ in range(5):
        next(runs)
    runs.close()
    assert next(taken) < 20


def test_a_scenario_that_cannot_be_simulated_is_refused_at_its_place():
    base = with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.01})
    far = replace(base, trajectory=replace(base.trajectory, start=(9.0, 9.0, 0.0)))
    runs = simulate_many([base, far], threads=1)
    assert next(runs).scenario is base
    with pytest.raises(ScenarioError, match="reach"):
        next(runs)
