"""A guard of a spatial hand that sinks below zero and returns within one step is an event."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar, root_scalar

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import ContactPhase

pytestmark = pytest.mark.slow

SHAKEN = load_scenario(Path(__file__).parent / "data" / "spatial-dip.toml")
CONTACT, PERIOD = 2, (0.1205, 0.1595)  # the contact, and the control period of its dip [s]


def shaken(friction, output_rate, **simulation):
    """PD control: no torque depends on friction."""
    values = {f"fingers.{CONTACT}.friction": friction, "simulation.output_rate": output_rate}
    return with_values(SHAKEN, {**values, **simulation})


@cache
def friction_needed():
    """What the contact needs to stick, |F_t| / F_n, in the period where friction is plenty."""
    trace = simulate(shaken(2.0, 10_000.0)).trace
    assert np.all(trace.phase[:, CONTACT] == ContactPhase.STICK)
    forces = trace.tangential_force.reshape(len(trace), -1, 2)[:, CONTACT]
    needed = np.linalg.norm(forces, axis=1) / trace.normal_force[:, CONTACT]
    inside = (trace.times > PERIOD[0]) & (trace.times < PERIOD[1])
    assert needed[trace.times < PERIOD[0]].max() < needed[inside].max() - 2e-3
    return CubicSpline(trace.times[inside], needed[inside])


def most_needed():
    """When the contact needs most friction, and how much."""
    needed = friction_needed()
    found = minimize_scalar(
        lambda t: -needed(t), bounds=PERIOD, method="bounded", options={"xatol": 1e-9}
    )
    return found.x, -found.fun


@pytest.mark.parametrize("output_rate", [1.0, 200.0, 10_000.0])
@pytest.mark.parametrize("lack", [1e-7, 1e-5, 1e-3])
def test_a_contact_that_leaves_its_cone_within_one_step_slips_at_that_instant(lack, output_rate):
    needed, (when, most) = friction_needed(), most_needed()
    friction = most - lack
    onset = root_scalar(lambda t: needed(t) - friction, bracket=(PERIOD[0], when)).root
    run = simulate(shaken(friction, output_rate))
    _, slip, *_ = run.phase_changes
    assert (slip.contact, slip.to_phase) == (CONTACT, ContactPhase.SLIP)
    # The flatter its force meets the cone, the more an error of it is in time.
    assert slip.time == pytest.approx(onset, abs=1e-8 + 2e-9 / float(needed(onset, 1)))


@pytest.mark.parametrize("max_step", [0.1, 1e-3])
def test_a_contact_that_only_comes_near_its_cone_within_a_step_sticks_on(max_step):
    _, most = most_needed()
    run = simulate(shaken(most + 1e-7, 1.0, **{"simulation.max_step": max_step}))
    assert [change.contact for change in run.phase_changes] == [3]
