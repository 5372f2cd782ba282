"""What the sensors and actuators are like, as constants of a run."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.scenario import Scenario

SENSORS = np.dtype(
    [
        ("perfect", np.int64),  # 1: everything below is off
        ("noisy", np.int64),
        ("position_noise", np.float64),  # standard deviations, SI units
        ("velocity_noise", np.float64),
        ("acceleration_noise", np.float64),
        ("true_accelerations", np.int64),
        ("filter_time", np.float64),  # [s]
        ("true_phases", np.int64),
        ("slip_threshold", np.float64),  # [m/s]
        ("slip_delay", np.float64),  # [s]
    ],
    align=True,
)

ACTUATORS = np.dtype(
    [
        ("torque_limit", np.float64),  # inf where none [N m]
        ("torque_rate_limit", np.float64),  # inf where none [N m/s]
    ],
    align=True,
)


def pack_sensors(scenario: Scenario, sensors: np.void) -> None:
    """Writes what is measured, and how well."""
    sensing = scenario.sensing
    noise = sensing.position_noise, sensing.velocity_noise, sensing.acceleration_noise
    sensors["position_noise"], sensors["velocity_noise"], sensors["acceleration_noise"] = noise
    sensors["noisy"] = any(noise)
    sensors["true_accelerations"] = sensing.true_accelerations
    sensors["filter_time"] = sensing.acceleration_filter_time
    sensors["true_phases"] = sensing.true_phases
    sensors["slip_threshold"] = sensing.slip_threshold
    sensors["slip_delay"] = sensing.slip_delay
    sensors["perfect"] = sensing.true_accelerations and sensing.true_phases and not any(noise)


def pack_actuators(scenario: Scenario, actuators: np.void) -> None:
    """Writes what the joints can give."""
    for name in ACTUATORS.names or ():
        limit = getattr(scenario.actuation, name)
        actuators[name] = np.inf if limit is None else limit
