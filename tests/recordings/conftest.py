"""Real runs, short ones, shared by all tests of recordings."""

import json

import numpy as np
import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values
from slipgrasp.core.trace.signals import SIGNALS

SLIP_AND_STOP = {"simulation.duration": 0.3}
LOST_GRIP = {
    "simulation.duration": 0.3,
    "controller.control_period": 0.001,
    "fingers.1.friction": 0.30,
    **{f"estimates.{i}.minimum": m for i, m in enumerate([0.05, 0.05, 0.05, 0.002])},
    **{f"estimates.{i}.maximum": m for i, m in enumerate([2.0, 2.0, 10.0, 0.2])},
}


@pytest.fixture(scope="session")
def short_run() -> RunResult:
    """Both fingertips slip and stop within 0.3 s."""
    return simulate(with_values(load_scenario("paper-case-2"), SLIP_AND_STOP))


@pytest.fixture(scope="session")
def lost_run() -> RunResult:
    """A run that physics ends early, with a reason and warnings."""
    return simulate(with_values(load_scenario("paper-case-2"), LOST_GRIP))


@pytest.fixture(scope="session")
def run_without_unknowns() -> RunResult:
    """A controller that knows everything: the trace has signals of width 0."""
    mapping = json.loads(json.dumps(load_scenario("paper-case-1").to_mapping()))
    mapping["estimates"] = []
    mapping["simulation"]["duration"] = 0.1
    return simulate(scenario_from_mapping(mapping))


@pytest.fixture(params=["short_run", "lost_run", "run_without_unknowns"])
def any_run(request) -> RunResult:
    return request.getfixturevalue(request.param)


def assert_same_run(actual: RunResult, expected: RunResult) -> None:
    """Compares two runs to the last bit, kinds of numbers included."""
    assert actual.trace.shape == expected.trace.shape
    for signal in SIGNALS:
        one, other = getattr(actual.trace, signal.name), getattr(expected.trace, signal.name)
        assert (one.dtype, one.shape) == (other.dtype, other.shape), signal.name
        assert one.tobytes() == np.ascontiguousarray(other).tobytes(), signal.name
    assert actual.scenario == expected.scenario
    assert actual.phase_changes == expected.phase_changes
    assert actual.outcome is expected.outcome
    assert actual.reason == expected.reason
    assert actual.warnings == expected.warnings
    assert actual.metrics == expected.metrics
    assert actual.provenance == expected.provenance


@pytest.fixture(scope="session")
def same_run():
    return assert_same_run
