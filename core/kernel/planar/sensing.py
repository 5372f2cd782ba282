"""Measurements of the controller at a tick, and detection of slip."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import MAX_COORDINATES, MAX_FINGERS, Floats, Record
from slipgrasp.core.kernel.loop.sensing import (
    SAME_TIME,
    filter_velocities,
    filtered_share,
    slip_delay,
)
from slipgrasp.core.kernel.numerics.noise import (
    FORCE_NOISE,
    NOISE,
    STATE_NOISE,
    draw_noise,
)
from slipgrasp.core.kernel.planar.state import (
    STATE,
    count_coordinates,
    reduced_at,
    slip_velocity_at,
)

# Measurements, and the states of filters and detectors.
SENSES = np.dtype(
    [
        ("measured", STATE),
        ("acceleration", np.float64, (MAX_COORDINATES,)),  # measured x''
        ("torques", np.float64, (MAX_FINGERS, 2)),  # torques for this acceleration [N m]
        ("velocities", np.float64, (MAX_COORDINATES,)),  # measured at the previous tick
        ("time", np.float64),  # of the previous tick [s]
        ("num_ticks", np.int64),  # measured so far
        ("num_filtered", np.int64),  # velocities filtered so far
        ("noise", NOISE),  # of the latest tick: positions, velocities, accelerations
        ("doubt", np.float64, (MAX_FINGERS,)),  # last agreement with the estimated phase [s]
        ("since", np.float64, (MAX_FINGERS,)),  # last change of the estimated phase [s]
        ("sums", np.float64, (MAX_FINGERS, 2)),  # of velocities that contradict it [m/s]
        ("num_detected", np.int64, (MAX_FINGERS,)),  # its changes so far
        ("forces", np.float64, (MAX_FINGERS, 2)),  # on the object: tangential, normal [N]
        ("num_forces", np.int64),  # forces filtered so far
    ],
    align=True,
)


@compiled
def _rate_at(n: int, k: int) -> int:
    """Index of the rate of reduced coordinate ``k`` in the state."""
    return reduced_at(n, k)[1]


@compiled
def measure(model: Record, senses: Record, state: Record, torques: Floats, now: float) -> None:
    """Measures positions and velocities; differences velocities if accelerations are not measured.

    Args:
        model: Constants of the run.
        senses: The measurement is written here.
        state: True state.
        torques: ``(n, 2)``, applied since the previous tick [N m].
        now: Time [s].
    """
    sensors, size = model.sensors, count_coordinates(model.num_fingers)
    for k in range(model.num_states):
        senses.measured.x[k] = state.x[k]
    if sensors.noisy == 1:
        draw_noise(senses.noise, sensors.seed, STATE_NOISE, senses.num_ticks, 3 * size)
        for k in range(size):
            at, rate = reduced_at(model.num_fingers, k)
            senses.measured.x[at] += sensors.position_noise * senses.noise.numbers[k]
            senses.measured.x[rate] += sensors.velocity_noise * senses.noise.numbers[size + k]
    if sensors.true_accelerations == 0:
        filter_velocities(model, senses, torques, now, size, _rate_at)
    else:
        senses.num_filtered = 0
    senses.num_ticks += 1


@compiled
def measure_forces(model: Record, senses: Record, forces: Floats) -> None:
    """Measures the contact forces just before a tick, with bias, noise and a low-pass filter.

    Args:
        model: Constants of the run.
        senses: The measurement is written here.
        forces: ``(n, 2)`` of the fingertips on the object, F_x (against the tangent), F_n [N].
    """
    sensors, n = model.sensors, model.num_fingers
    share = filtered_share(model, senses)
    if sensors.force_noise > 0.0:
        # Overwrites the acceleration noise, which custom laws do not use.
        tick = senses.num_ticks - 1  # already incremented
        draw_noise(senses.noise, sensors.seed, FORCE_NOISE, tick, 2 * n)
    for i in range(n):
        for axis in range(2):
            force = -forces[i, 0] if axis == 0 else forces[i, 1]
            force += sensors.force_bias[axis]
            if sensors.force_noise > 0.0:
                force += sensors.force_noise * senses.noise.numbers[2 * i + axis]
            senses.forces[i, axis] += share * (force - senses.forces[i, axis])


@compiled
def detect_slip(model: Record, discrete: Record, senses: Record, now: float) -> None:
    """Updates the estimated phases: true phases, or phases detected for longer than the delay."""
    n, sensors = model.num_fingers, model.sensors
    for i in range(n):
        seen = discrete.phases[i]
        if sensors.true_phases == 0 and sensors.sums_slip == 1:
            _sum_slip(model, discrete, senses, now, i)
            continue
        if sensors.true_phases == 0:
            velocity = senses.measured.x[slip_velocity_at(n, i)]
            seen = 0
            if abs(velocity) > sensors.slip_threshold:
                seen = 1 if velocity > 0.0 else -1
        if seen == discrete.beliefs[i]:
            senses.doubt[i] = now
        elif sensors.true_phases == 1 or now - senses.doubt[i] > _delay(senses, sensors, i):
            discrete.beliefs[i] = seen
            senses.doubt[i] = now
            senses.since[i] = now
            senses.num_detected[i] += 1


@compiled
def _delay(senses: Record, sensors: Record, i: int) -> float:
    """Detection delay of the next phase change of contact ``i``, minus a rounding margin [s]."""
    return slip_delay(sensors, i, senses.num_detected[i]) - SAME_TIME


@compiled
def _sum_slip(model: Record, discrete: Record, senses: Record, now: float, i: int) -> None:
    """Estimates the phase of one contact by cumulative sums (Page's test).

    In stick, one sum per direction accumulates the excess of the velocity over half the
    threshold; in slip, the sums accumulate its shortfall. A sum above its bound changes the
    estimated phase.
    """
    sensors, belief = model.sensors, discrete.beliefs[i]
    velocity = senses.measured.x[slip_velocity_at(model.num_fingers, i)]
    level = 0.5 * sensors.slip_threshold
    delay = _delay(senses, sensors, i) + SAME_TIME
    bound = max(sensors.least_sum, level * delay / model.law.period)
    for side in range(2):
        sign = 1 - 2 * side
        growth = sign * velocity - level if belief == 0 else level - belief * velocity
        senses.sums[i, side] = max(0.0, senses.sums[i, side] + growth)
    if max(senses.sums[i, 0], senses.sums[i, 1]) > bound:
        forward = senses.sums[i, 0] > senses.sums[i, 1]
        discrete.beliefs[i] = 0 if belief != 0 else (1 if forward else -1)
        senses.sums[i, 0] = senses.sums[i, 1] = 0.0
        senses.since[i] = now
        senses.num_detected[i] += 1


@compiled
def measure_acceleration(model: Record, senses: Record, discrete: Record, work: Record) -> None:
    """Measures the acceleration from the true one in ``work``, and stores the applied torques."""
    sensors, size = model.sensors, count_coordinates(model.num_fingers)
    if sensors.true_accelerations == 0:
        return
    for k in range(size):
        senses.acceleration[k] = work.acceleration[k]
        if sensors.noisy == 1:
            noise = senses.noise.numbers[2 * size + k]
            senses.acceleration[k] += sensors.acceleration_noise * noise
    for i in range(model.num_fingers):
        for joint in range(2):
            senses.torques[i, joint] = discrete.torques[i, joint]
