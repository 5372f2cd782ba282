"""Measurements of the controller of a spatial hand, and its estimated slips.

Noise and filters are those of planar hands. The measured attitude has a small random rotation; the
slip direction is known or computed from the measured slip velocity.
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Record
from slipgrasp.core.kernel.loop.sensing import (
    SAME_TIME,
    filter_velocities,
    filtered_share,
    slip_delay,
)
from slipgrasp.core.kernel.numerics.noise import FORCE_NOISE, STATE_NOISE, draw_number
from slipgrasp.core.kernel.spatial.flow import LEAST_SPEED, set_directions
from slipgrasp.core.kernel.spatial.law import exponential, product
from slipgrasp.core.kernel.spatial.model import MAX_COORDINATES
from slipgrasp.core.kernel.spatial.state import (
    ATTITUDE,
    POSITION,
    SLIP,
    STATE,
    count_coordinates,
    rate_at,
    slip_velocity_at,
)
from slipgrasp.core.kernel.spatial.ways import axes_of, name_of, way_size, way_speed

# Measurements and estimates, and the memory of filters and detectors.
SENSES = np.dtype(
    [
        ("measured", STATE),
        ("slips", np.float64, (MAX_FINGERS, 2)),  # estimated, 1 along slipping tangents
        ("gamma", np.float64, (MAX_FINGERS, 3)),  # estimated directions, spin last; 0 in stick
        ("acceleration", np.float64, (MAX_COORDINATES,)),  # of object and slips, measured
        ("torques", np.float64, (MAX_FINGERS, 3)),  # torques for this acceleration [N m]
        ("velocities", np.float64, (MAX_COORDINATES,)),  # measured at the previous tick
        ("forces", np.float64, (MAX_FINGERS, 3)),  # on the object: tangential, normal [N]
        ("moments", np.float64, (MAX_FINGERS,)),  # of soft contacts on the object [N m]
        ("num_forces", np.int64),  # number of samples in their filter
        ("time", np.float64),  # of the previous tick [s]
        ("num_ticks", np.int64),  # measured so far
        ("num_filtered", np.int64),  # number of velocities in the filter
        ("doubt", np.float64, (MAX_FINGERS, 2)),  # start of a contradiction to the estimate [s]
        ("since", np.float64, (MAX_FINGERS,)),  # last change of the estimate [s]
        ("sums", np.float64, (MAX_FINGERS, 2)),  # of slip velocities against stick [m/s]
        ("ends", np.float64, (MAX_FINGERS, 2)),  # the same per slip mode against slip [m/s]
        ("slide", np.float64, (MAX_FINGERS, 2)),  # filtered slip velocity [m/s]
        ("num_detected", np.int64, (MAX_FINGERS, 2)),  # number of changes of the estimate
    ],
    align=True,
)


@compiled
def measure(model: Record, senses: Record, state: Record, torques: Floats, now: float) -> None:
    """Measures positions and velocities, and differentiates velocities if necessary.

    Args:
        model: Constants of the run.
        senses: Output.
        state: True state.
        torques: ``(n, 3)`` since the previous tick [N m].
        now: Time [s].
    """
    sensors, n, x = model.sensors, model.num_fingers, senses.measured.x
    size = count_coordinates(n)
    for k in range(model.num_states):
        x[k] = state.x[k]
    if sensors.position_noise > 0.0:
        _blur_pose(model, senses)
    if sensors.velocity_noise > 0.0:
        for k in range(size):
            x[rate_at(n, k)] += sensors.velocity_noise * _draw(model, senses, size + k)
    if sensors.true_accelerations == 0:
        filter_velocities(model, senses, torques, now, size, rate_at)
    else:
        senses.num_filtered = 0
    senses.num_ticks += 1


@compiled
def measure_forces(model: Record, senses: Record, work: Record) -> None:
    """Measures the contact forces just before a tick, with bias, noise and a low-pass filter.

    The tangential bias applies to each tangent. Moments about normals are filtered too, but have
    neither bias nor noise.

    Args:
        model: Constants of the run.
        senses: Output.
        work: Forces of the fingertips on the object, F_x and F_y (against the tangents), F_n, and
            moments about the normals.
    """
    forces = work.forces
    sensors, tick = model.sensors, senses.num_ticks - 1  # already incremented
    share = filtered_share(model, senses)
    for i in range(model.num_fingers):
        for axis in range(3):
            force = forces[i, 2] if axis == 2 else -forces[i, axis]
            force += sensors.force_bias[axis // 2]
            if sensors.force_noise > 0.0:
                number = draw_number(sensors.seed, FORCE_NOISE, 3 * i + axis, tick)
                force += sensors.force_noise * number
            senses.forces[i, axis] += share * (force - senses.forces[i, axis])
        if model.soft == 1:
            moment = -model.hand.eccentricities[i] * work.moments[i]
            senses.moments[i] += share * (moment - senses.moments[i])


@compiled
def _draw(model: Record, senses: Record, k: int) -> float:
    """Noise number ``k`` of the current tick: the first of pair k of the planar stream."""
    return draw_number(model.sensors.seed, STATE_NOISE, k, senses.num_ticks)


@compiled
def _blur_pose(model: Record, senses: Record) -> None:
    """Adds noise to positions and slips, and a small random rotation to the attitude."""
    x, noise = senses.measured.x, model.sensors.position_noise
    for k in range(3):
        x[POSITION + k] += noise * _draw(model, senses, k)
    turn = exponential(
        (
            noise * _draw(model, senses, 3),
            noise * _draw(model, senses, 4),
            noise * _draw(model, senses, 5),
        )
    )
    a = ATTITUDE
    x[a], x[a + 1], x[a + 2], x[a + 3] = product(turn, (x[a], x[a + 1], x[a + 2], x[a + 3]))
    for k in range(2 * model.num_fingers):
        x[SLIP + k] += noise * _draw(model, senses, 6 + k)


@compiled
def measure_acceleration(model: Record, senses: Record, discrete: Record, work: Record) -> None:
    """Measures the acceleration from the true one in ``work``, and stores the applied torques."""
    sensors, n = model.sensors, model.num_fingers
    if sensors.true_accelerations == 0:
        return
    size = count_coordinates(n)
    for k in range(size):
        true = work.acceleration[k] if k < 6 else work.slip_acceleration[k // 2 - 3, k % 2]
        senses.acceleration[k] = true
        if sensors.acceleration_noise > 0.0:
            # Of this tick, which is already counted.
            noise = draw_number(sensors.seed, STATE_NOISE, 2 * size + k, senses.num_ticks - 1)
            senses.acceleration[k] += sensors.acceleration_noise * noise
    for i in range(n):
        for joint in range(3):
            senses.torques[i, joint] = discrete.torques[i, joint]


@compiled
def detect_slip(model: Record, discrete: Record, senses: Record, state: Record, now: float) -> None:
    """Updates the estimated phases and directions: true ones before the tick, or detected ones."""
    sensors, n = model.sensors, model.num_fingers
    if sensors.true_phases == 1:
        set_directions(model, discrete, state, senses.gamma)
    for i in range(n):
        if sensors.true_phases == 1:
            _be_told(model, discrete, senses, now, i)
            continue
        _follow_slide(model, senses, i)
        for way in range(model.ways):
            if sensors.sums_slip == 1:
                _sum_slip(model, senses, now, i, way)
            else:
                _time_slip(model, senses, now, i, way)
        if model.ways == 1:
            _point(senses, i)
        discrete.beliefs[i] = name_of(model, senses.slips[i], senses.gamma[i])


@compiled
def _be_told(model: Record, discrete: Record, senses: Record, now: float, i: int) -> None:
    """Sets the estimated phase of one contact to the true one."""
    if discrete.beliefs[i] != discrete.phases[i]:
        senses.since[i] = now
    discrete.beliefs[i] = discrete.phases[i]
    for axis in range(2):
        senses.slips[i, axis] = discrete.slips[i, axis]
        senses.doubt[i, axis] = now
        senses.sums[i, axis] = senses.ends[i, axis] = 0.0


@compiled
def _follow_slide(model: Record, senses: Record, i: int) -> None:
    """Filters the slip velocity of one contact, as the velocity differences."""
    share = model.law.period / (model.sensors.filter_time + model.law.period)
    for axis in range(2):
        velocity = senses.measured.x[slip_velocity_at(model.num_fingers, i, axis)]
        senses.slide[i, axis] += share * (velocity - senses.slide[i, axis])


@compiled
def _point(senses: Record, i: int) -> None:
    """Sets the estimated slip direction on the cone to that of the filtered slip velocity."""
    x, y = senses.slide[i, 0], senses.slide[i, 1]
    scale = senses.slips[i, 0] / max(np.sqrt(x * x + y * y), LEAST_SPEED)
    senses.gamma[i, 0], senses.gamma[i, 1] = scale * x, scale * y


@compiled
def _along(model: Record, senses: Record, i: int, way: int) -> float:
    """Measured slip velocity along the estimated direction."""
    total = 0.0
    for axis in axes_of(model, way):
        velocity = senses.measured.x[slip_velocity_at(model.num_fingers, i, axis)]
        total += senses.gamma[i, axis] * velocity
    return total


@compiled
def _change_belief(
    model: Record, senses: Record, now: float, i: int, way: int, slips: float
) -> None:
    """Changes one estimated slip; in the pyramid towards the sign of the cumulative sum."""
    for axis in axes_of(model, way):
        senses.slips[i, axis] = slips
        forward = senses.sums[i, axis] > 0.0
        senses.gamma[i, axis] = slips * (1.0 if forward else -1.0)
        senses.sums[i, axis] = 0.0
    senses.ends[i, way] = 0.0
    senses.doubt[i, way] = senses.since[i] = now
    senses.num_detected[i, way] += 1


@compiled
def _delay(model: Record, senses: Record, i: int, way: int) -> float:
    """Time for which the next change of an estimate must last [s]."""
    return slip_delay(model.sensors, model.ways * i + way, senses.num_detected[i, way])


@compiled
def _time_slip(model: Record, senses: Record, now: float, i: int, way: int) -> None:
    """Estimates one slip from the time for which its speed was above or below the threshold."""
    threshold, believed = model.sensors.slip_threshold, senses.slips[i, way] != 0.0
    slides = way_speed(model, senses.measured, i, way) > threshold
    turned = model.ways == 2 and _along(model, senses, i, way) < -threshold
    if slides == believed and not turned:
        senses.doubt[i, way] = now
    elif now - senses.doubt[i, way] > _delay(model, senses, i, way) - SAME_TIME:
        for axis in axes_of(model, way):
            velocity = senses.measured.x[slip_velocity_at(model.num_fingers, i, axis)]
            senses.sums[i, axis] = velocity
        _change_belief(model, senses, now, i, way, 1.0 if slides else 0.0)


@compiled
def _sum_slip(model: Record, senses: Record, now: float, i: int, way: int) -> None:
    """Estimates one slip by cumulative sums of the measured slip velocity.

    In stick, a vector is accumulated and reduced by half the threshold at every tick (Crosier,
    Technometrics 30, 1988); in slip, the deficit of the velocity along it is accumulated. A sum
    that exceeds its bound changes the estimate.
    """
    sensors, sums = model.sensors, senses.sums
    level = 0.5 * sensors.slip_threshold
    bound = max(sensors.least_sum, level * _delay(model, senses, i, way) / model.law.period)
    if senses.slips[i, way] != 0.0:
        growth = level - _along(model, senses, i, way)
        senses.ends[i, way] = max(0.0, senses.ends[i, way] + growth)
        if senses.ends[i, way] > bound:
            _change_belief(model, senses, now, i, way, 0.0)
        return
    for axis in axes_of(model, way):
        sums[i, axis] += senses.measured.x[slip_velocity_at(model.num_fingers, i, axis)]
    size = way_size(model, way, sums[i, 0], sums[i, 1])
    for axis in axes_of(model, way):
        sums[i, axis] *= 1.0 - min(level / max(size, LEAST_SPEED), 1.0)
    if size - level > bound:
        _change_belief(model, senses, now, i, way, 1.0)
