"""A law follows a new segment of the desired motion from the tick on at which it begins."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values
from slipgrasp.core.trace.types import ContactPhase

PERIOD = 0.001
LIFT = 0.4  # desired acceleration [m/s^2]
UP = {"paper-case-1": 1, "spatial-prism": 2}
HANDS = pytest.mark.parametrize("preset", UP)


def lifting(preset, speeding_up, coasting, **controller):
    """A hand that knows its object and lifts it: it speeds up, coasts and brakes."""
    scenario = load_scenario(preset).to_mapping()
    acceleration = [0.0] * len(scenario["trajectory"]["acceleration"])
    acceleration[UP[preset]] = LIFT
    scenario["estimates"] = []
    scenario["controller"] |= {
        "kind": "certainty-equivalence",
        "control_period": PERIOD,
        "grip_safety": 1.5,
        **controller,
    }
    scenario["trajectory"] |= {
        "acceleration": acceleration,
        "acceleration_time": speeding_up,
        "coast_time": coasting,
    }
    scenario["simulation"] |= {"duration": 0.08, "output_rate": 4000.0}
    return scenario_from_mapping(scenario)


def roundings_beside(instant):
    return math.nextafter(instant, 0.0), instant, math.nextafter(instant, 1.0)


@HANDS
@pytest.mark.parametrize(
    "controller",
    [{}, {"latency": 0.002, "prediction": True}, {"latency": 0.0024, "prediction": True}],
)
def test_the_object_accelerates_as_the_segment_asks_from_its_first_tick_on(preset, controller):
    """The ends of segments are sums, as 0.01 + 0.02, and a rounding beside their ticks."""
    latency = controller.get("latency", 0.0)
    for first in roundings_beside(0.01):
        run = simulate(lifting(preset, first, 0.02, **controller))
        assert np.all(run.trace.phase == ContactPhase.STICK)
        times, lift = run.trace.times, run.trace.object_acceleration[:, UP[preset]]
        for begin, before, after in ((0.01, LIFT, 0.0), (0.03, 0.0, -LIFT), (0.04, -LIFT, 0.0)):
            # Torques act a latency after their ticks, for the instants at which they do.
            tick = math.ceil(round((begin - latency) / PERIOD, 6)) * PERIOD + latency
            for moment, wanted in ((tick - 0.5 * PERIOD, before), (tick + 0.5 * PERIOD, after)):
                row = np.abs(times - moment).argmin()
                assert lift[row] == pytest.approx(wanted, abs=0.02 * LIFT)


@HANDS
def test_a_rounding_in_the_end_of_a_segment_changes_no_command(preset):
    below, at, above = (simulate(lifting(preset, t, 0.02)).ticks for t in roundings_beside(0.01))
    for other in (below, above):
        assert_allclose(other.commands, at.commands, atol=1e-9)


@HANDS
def test_a_segment_that_begins_with_a_timed_change_is_followed_at_once(preset):
    changed = with_values(
        lifting(preset, 0.01, 0.02),
        {"changes": [{"time": 0.03, "parameter": "controller.position_gain", "value": 101.0}]},
    )
    trace = simulate(changed).trace
    row = np.abs(trace.times - (0.03 + 0.5 * PERIOD)).argmin()
    assert trace.object_acceleration[row, UP[preset]] == pytest.approx(-LIFT, abs=0.02 * LIFT)
