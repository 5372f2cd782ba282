"""Common functions of the control laws (docs/model.md, Controllers).

A law receives the state, the estimated phases and the estimates. It receives the masses and
friction of the plant only in a copy in which estimates replace the unknown parameters.
"""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Integers, Record
from slipgrasp.core.kernel.loop.model import (
    FRICTION,
    LINK_MASS,
    OBJECT_INERTIA,
    OBJECT_MASS,
    make_true_value,
)
from slipgrasp.core.kernel.loop.motion import desired_motion
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.numerics.lyapunov import error_value
from slipgrasp.core.kernel.planar.state import (
    count_coordinates,
    estimate_at,
    slip_at,
    slip_coordinate,
    slip_velocity_at,
    velocity_at,
)

LEAST_BRAKE = 0.01  # fraction of slip_stop, prevents creep


@compiled
def believe(law: Record, truth: Record, unknowns: Record, state: Record, believed: Record) -> None:
    """Sets ``believed`` to the known and estimated parameters."""
    n = truth.num_fingers
    believed.num_fingers = n
    for k in range(3):
        believed.object_inertia[k] = truth.object_inertia[k]
    for i in range(n):
        believed.friction[i] = truth.friction[i]
        for link in range(2):
            believed.link_masses[i, link] = law.link_mass_ratio * truth.link_masses[i, link]
    for k in range(unknowns.count):
        kind, finger, value = unknowns.kinds[k], unknowns.fingers[k], state.x[estimate_at(n, k)]
        if kind == OBJECT_MASS:
            believed.object_inertia[0] = value
            believed.object_inertia[1] = value
        elif kind == OBJECT_INERTIA:
            believed.object_inertia[2] = value
        elif kind == FRICTION:
            believed.friction[finger] = value
        elif kind == LINK_MASS:
            believed.link_masses[finger, unknowns.links[k]] = value


@compiled
def demand_acceleration(
    law: Record, motion: Record, piece: int, t: float, state: Record, belief: Integers, room: Record
) -> None:
    """Computes v = x''_des + K_v e' + K_p e, with 0 for contacts in estimated stick.

    The desired slip of a sticking contact is its current slip, so its e is 0. Slipping contacts
    are also decelerated by up to ``slip_stop``, so that their slip ends in finite time (composite
    law; 0 in the others).
    """
    n = law.num_fingers
    for k in range(3):
        position, velocity, acceleration = desired_motion(motion, piece, t, k)
        room.error[k] = position - state.x[k]
        room.error_rate[k] = velocity - state.x[velocity_at(k)]
        room.demand[k] = (
            acceleration
            + law.velocity_gains[k] * room.error_rate[k]
            + law.position_gains[k] * room.error[k]
        )
    for i in range(n):
        k = slip_coordinate(i)
        room.error[k] = 0.0
        room.error_rate[k] = -state.x[slip_velocity_at(n, i)]
        room.demand[k] = 0.0
        if belief[i] != 0:
            room.error[k] = -state.x[slip_at(i)]
            room.demand[k] = (
                law.velocity_gains[k] * room.error_rate[k] + law.position_gains[k] * room.error[k]
            )
            if law.slip_stop > 0.0:
                # Hardly more than is needed to stop before the next torque acts: a larger
                # deceleration would disturb other contacts and, with latency, reverse the slip.
                speed = max(belief[i] * state.x[slip_velocity_at(n, i)], 0.0)
                stopping = speed / (law.period + law.latency)
                brake = min(law.slip_stop, stopping + LEAST_BRAKE * law.slip_stop)
                room.demand[k] -= belief[i] * brake


@compiled
def lyapunov_value(
    law: Record, truth: Record, unknowns: Record, state: Record, room: Record
) -> float:
    """Returns V of Eq. 44 for the errors in ``room``."""
    value = error_value(law, room, count_coordinates(law.num_fingers))
    for k in range(unknowns.count):
        deviation = true_value(truth, unknowns, k) - state.x[estimate_at(law.num_fingers, k)]
        value += square(deviation) / law.adaptation_gains[k]
    return value


@compiled
def _object_value(truth: Record, unknowns: Record, k: int) -> float:
    """Mass or inertia of the object."""
    return truth.object_inertia[0 if unknowns.kinds[k] == OBJECT_MASS else 2]


true_value = make_true_value(_object_value)
