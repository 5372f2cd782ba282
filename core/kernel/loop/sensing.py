"""Filters and delays of the controller's measurements."""

from __future__ import annotations

from typing import Any

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.numerics.elementary import exp
from slipgrasp.core.kernel.numerics.noise import DELAY_NOISE, draw_number

SAME_TIME = 1e-9


@compiled
def filter_velocities(
    model: Record, senses: Record, torques: Floats, now: float, size: int, rate_at: Any
) -> None:
    """Filters velocity differences and torques with the same first-order low-pass filter.

    Initially the filter is the mean of all differences so far.

    Args:
        model: Constants of the run.
        senses: Measurements, with the velocities of this tick.
        torques: Torques since the previous tick [N m].
        now: Time [s].
        size: Number of coordinates.
        rate_at: Returns the index of the rate of a coordinate in the state.
    """
    elapsed, seen = now - senses.time, senses.num_filtered
    share = 1.0
    if seen > 1:
        share = max(elapsed / (model.sensors.filter_time + elapsed), 1.0 / seen)
    for k in range(size):
        velocity = senses.measured.x[rate_at(model.num_fingers, k)]
        if seen > 0:
            slope = (velocity - senses.velocities[k]) / elapsed
            senses.acceleration[k] += share * (slope - senses.acceleration[k])
        senses.velocities[k] = velocity
    for i in range(model.num_fingers):
        for joint in range(torques.shape[1]):
            senses.torques[i, joint] += share * (torques[i, joint] - senses.torques[i, joint])
    senses.time = now
    senses.num_filtered += 1


@compiled
def filtered_share(model: Record, senses: Record) -> float:
    """Counts a new force measurement and returns its weight in the filter."""
    senses.num_forces += 1
    share = model.law.period / (model.sensors.force_filter_time + model.law.period)
    return max(share, 1.0 / senses.num_forces)


@compiled
def slip_delay(sensors: Record, contact: int, event: int) -> float:
    """Time for which the next change of a contact must last to be accepted [s].

    Args:
        sensors: Delay and its deviation.
        contact: Index of the contact or tangent.
        event: Number of previous changes.
    """
    delay = sensors.slip_delay
    if sensors.slip_delay_deviation > 0.0:
        number = draw_number(sensors.seed, DELAY_NOISE, contact, event)
        delay = max(0.0, delay + sensors.slip_delay_deviation * number)
    return delay


@compiled
def trust(model: Record, senses: Record) -> float:
    """Confidence in the filtered accelerations, from 0 to 1 in the steady state."""
    if model.sensors.true_accelerations == 1:
        return 1.0
    period = model.law.period
    return min(1.0, (senses.num_filtered - 1) * period / (model.sensors.filter_time + period))


@compiled
def trust_in_contact(model: Record, senses: Record, now: float, i: int) -> float:
    """Fraction of the filtered force of contact ``i`` that is from its current phase, 0 to 1."""
    if model.sensors.true_accelerations == 1:
        return 1.0
    if model.sensors.filter_time == 0.0:
        return 1.0 if now > senses.since[i] else 0.0
    return 1.0 - exp((senses.since[i] - now) / model.sensors.filter_time)
