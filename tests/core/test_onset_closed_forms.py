"""Slip onset at instants known in closed form: the cone is reached under a known force.

With masses known, the object moves exactly as commanded, so the contact forces follow from
the commanded motion alone. Two fingertips opposite each other at half width L exert, in the
axes of the object (X towards finger 1, Y along the left face, M the moment),

    F_n0 - F_n1 = X,   F_x1 - F_x0 = Y,   L (F_x0 + F_x1) - s_0 F_n0 - s_1 F_n1 = M.

What is left free is set by the least squeeze (both stick) or by Coulomb's law (one slips).
"""

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import ContactPhase

HALF_WIDTH = 0.1

# Without feedback no error of the state becomes a force.
OPEN_LOOP = {"controller.position_gain": 0.0, "controller.velocity_gain": 1e-12}
FIXED_ESTIMATES = {
    "controller.lyapunov_weight": 0.0,
    "controller.estimate_norm_bound": 1e3,
    "estimates.2.initial": 1.0,
}


def case(values):
    return with_values(load_scenario("paper-case-2"), {**FIXED_ESTIMATES, **values})


def first_change(result, contact):
    """When a contact leaves its first phase, and the phase it goes to."""
    return next((c.time, c.to_phase) for c in result.phase_changes if c.contact == contact)


RAMP = {
    "fingers.0.friction": 0.2,
    "fingers.1.friction": 0.3,
    "estimates.0.initial": 0.25,
    "estimates.1.initial": 0.3,
    "estimates.3.initial": 0.01042,
    "controller.position_gain": 2500.0,
    "controller.velocity_gain": [100.0, 100.0, 100.0, 1e-12, 1e-12],
    "controller.grip_safety": 1.1,
    "trajectory.acceleration": [0.0, 0.0, 0.0],
    "simulation.duration": 0.75,
    # Until then the first contact has less friction than believed and starts to slip.
    "changes.0.time": 0.002,
    "changes.0.parameter": "fingers.0.friction",
    "changes.0.value": 0.25,
}


def test_cone_is_reached_under_a_linear_ramp_at_its_exact_time():
    """One fingertip slides at constant speed, and the force on the other grows with its way.

    With F_x0 = -mu_0 F_n0 and a weight Y = m g the equations above give, at contact 1,
    F_x1 / F_n1 = mu_0 + (s_0 + s_1) / L: a linear function of time as s_0 is one. Contact 1
    starts to slip where that is mu_1. By 0.5 s the start is forgotten (e^-25).
    """
    result = simulate(case(RAMP))
    trace = result.trace
    at = int(np.flatnonzero(trace.times >= 0.5)[0])
    speed = trace.slip_velocity[at, 0]
    assert speed > 1e-3
    onset = trace.times[at] + ((0.3 - 0.25) * HALF_WIDTH - trace.slip[at, 0]) / speed
    t, phase = first_change(result, contact=1)
    assert t == pytest.approx(onset, abs=1e-9)
    assert phase is ContactPhase.SLIP_BACKWARD
    ramp = (trace.times > 0.5) & (trace.times < t)
    ratio = trace.tangential_force[ramp, 1] / trace.normal_force[ramp, 1]
    expected = 0.3 + speed / HALF_WIDTH * (trace.times[ramp] - onset)
    # Ratios of about 0.3 from forces of about 20 N, balanced to the run's tolerance.
    np.testing.assert_allclose(ratio, expected, atol=1e-9)


@pytest.mark.parametrize("law", [OPEN_LOOP, {}], ids=["no feedback", "feedback"])
@pytest.mark.parametrize("friction", [0.42, 0.45, 0.48])
def test_cone_is_reached_while_the_object_turns_at_constant_speed(friction, law):
    """The weight X = m g sin(theta) leans on one finger less and less as theta goes to zero.

    Both contacts carry m g cos(theta) / 2; the least squeeze keeps the lighter pressed one,
    finger 0, on the believed cone mu^, and presses finger 1 by -X more. It slips where
    tan(theta) = (1 / mu^ - 1 / mu_1) / 2.
    """
    believed, start, spin, speeding_up = 0.5, -0.35, 2.0, 0.2
    result = simulate(
        case(
            {
                **law,
                "fingers.0.friction": 0.9,
                "fingers.1.friction": friction,
                "estimates.0.initial": believed,
                "estimates.1.initial": believed,
                "estimates.3.initial": 0.01042,
                "trajectory.start": [1.466, 0.366, start],
                "trajectory.acceleration": [0.0, 0.0, spin],
                "trajectory.acceleration_time": speeding_up,
                "simulation.duration": 1.0,
            }
        )
    )
    angle = np.arctan(0.5 * (1.0 / believed - 1.0 / friction))
    coasting = (angle - start - 0.5 * spin * speeding_up**2) / (spin * speeding_up)
    assert coasting > 0.0
    t, _ = first_change(result, contact=1)
    assert t == pytest.approx(speeding_up + coasting, abs=1e-9)
    assert result.phase_changes[0].contact == 1
