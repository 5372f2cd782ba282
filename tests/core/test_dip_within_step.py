"""A guard that sinks below zero and returns within one step is an event all the same."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import root_scalar

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from tests.core.test_hybrid_events import SPIN, TOUCHING, margin, tightest, turning

# (start angle, lack of friction, max_step). Without a look inside the step the contact of the
# second row would stick for 18 ms with up to 3.5e-4 N too much tangential force.
CASES = [
    (-0.4, 4.3e-7, 0.02),
    (-0.415, 2.556837e-5, 0.02),
    (-0.4, 4.4e-5, 0.05),
    (-0.4, 4.4e-5, 0.1),
]


@pytest.mark.parametrize(("start", "lack", "max_step"), CASES)
def test_contact_that_leaves_its_cone_within_one_step_slips_at_the_exact_instant(
    start, lack, max_step
):
    friction = TOUCHING - lack
    angle = root_scalar(
        lambda a: margin(friction, a), bracket=(start, tightest(friction)), xtol=1e-15
    ).root
    onset = np.sqrt(2.0 * (angle - start) / SPIN)
    values = {
        "trajectory.start": [1.466, 0.366, start],
        "simulation.max_step": max_step,
        "simulation.output_rate": 2000.0,
    }
    result = simulate(turning(friction, values))
    assert result.phase_changes
    assert result.phase_changes[0].time == pytest.approx(onset, abs=1e-8)


def test_an_event_before_the_one_that_the_end_of_the_step_shows_is_not_overlooked():
    scenario = load_scenario(Path(__file__).parent / "data" / "overlooked-event.toml")
    whole = simulate(scenario)
    finely = simulate(with_values(scenario, {"simulation.max_step": 1e-3}))
    assert [change.contact for change in whole.phase_changes] == [1, 0]
    for change, fine in zip(whole.phase_changes, finely.phase_changes, strict=True):
        assert (change.contact, change.to_phase) == (fine.contact, fine.to_phase)
        assert change.time == pytest.approx(fine.time, abs=1e-8)
