"""Layout of the integrated state of a spatial hand. All other modules use the functions below.

With n fingers, x = (R_o, Q, v, omega, s, s', E_in, E_f, path), followed by (e psi', psi, turned) if
any fingertip is soft:

    R_o    position of the object (3) [m]
    Q      its attitude, unit quaternion w, x, y, z, world from object (4)
    v      its velocity (3) [m/s]
    omega  its angular velocity in world axes (3) [rad/s]
    s      slips of every fingertip along its two tangents (2 n) [m]
    s'     slip velocities (2 n) [m/s]
    E_in   energy supplied by torques, pulses and timed changes [J]
    E_f    energy dissipated by friction [J]
    path   slip path of every fingertip (n) [m]
    e psi' spin velocity of every soft fingertip times its eccentricity e (n) [m/s]
    psi    spin: rotation of the fingertip on the object about the normal (n) [rad]
    turned accumulated absolute spin (n) [rad]

The spin velocity is a function of v, omega and s'. It is integrated nevertheless, because the slip
direction (s', e psi') is stiff, and is reset to this function after every step.

Estimates change only at control ticks and are not part of the state.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Record
from slipgrasp.core.kernel.numerics.elementary import square

POSITION, ATTITUDE, VELOCITY, SPIN, SLIP = 0, 3, 7, 10, 13
BODY_STATES = SLIP  # number of components of pose and velocity of the object

MAX_STATE = SLIP + 8 * MAX_FINGERS + 2

STATE = np.dtype([("x", np.float64, (MAX_STATE,))], align=True)


@compiled
def slip_at(i: int, axis: int) -> int:
    """Index of the slip of contact i along a tangent."""
    return SLIP + 2 * i + axis


@compiled
def slip_velocity_at(n: int, i: int, axis: int) -> int:
    """Index of the slip velocity of contact i along a tangent."""
    return SLIP + 2 * n + 2 * i + axis


def number_of_coordinates(n: int) -> int:
    """Number of reduced coordinates: those of the object, then two slips per contact."""
    return 6 + 2 * n


count_coordinates = compiled(number_of_coordinates)


@compiled
def slip_coordinate(i: int, axis: int) -> int:
    """Number of the reduced coordinate that is the slip of contact i along a tangent."""
    return 6 + 2 * i + axis


@compiled
def rate_at(n: int, k: int) -> int:
    """Index of the rate of reduced coordinate k (object, then slips)."""
    return VELOCITY + k if k < 6 else SLIP + 2 * n + k - 6


@compiled
def supplied_at(model: Record) -> int:
    """Index of the supplied energy."""
    return SLIP + 4 * model.num_fingers


@compiled
def dissipated_at(model: Record) -> int:
    """Index of the dissipated energy."""
    return SLIP + 4 * model.num_fingers + 1


@compiled
def path_at(n: int, i: int) -> int:
    """Index of the slip path of fingertip i."""
    return SLIP + 4 * n + 2 + i


@compiled
def spin_velocity_at(n: int, i: int) -> int:
    """Index of the spin velocity of contact i times its eccentricity."""
    return SLIP + 5 * n + 2 + i


@compiled
def velocity_at(n: int, i: int, axis: int) -> int:
    """Index of the slip velocity of contact i along a tangent, or of its spin velocity (axis 2)."""
    return spin_velocity_at(n, i) if axis == 2 else slip_velocity_at(n, i, axis)


@compiled
def spin_at(n: int, i: int) -> int:
    """Index of the spin of contact i."""
    return SLIP + 6 * n + 2 + i


@compiled
def turned_at(n: int, i: int) -> int:
    """Index of the accumulated absolute spin of contact i."""
    return SLIP + 7 * n + 2 + i


@compiled
def stiff_rate_at(n: int, k: int) -> int:
    """Index of rate k: reduced coordinates, then spins."""
    reduced = count_coordinates(n)
    return rate_at(n, k) if k < reduced else spin_velocity_at(n, k - reduced)


def count_states(n: int, *, soft: bool) -> int:
    """Length of the state for n fingers; ``soft`` if any fingertip is soft."""
    return SLIP + (8 if soft else 5) * n + 2


class StateParts(NamedTuple):
    """Views of the parts of a state; writing to them changes the state."""

    pose: Floats  # (7,)
    velocity: Floats  # (6,)
    slip: Floats  # (2n,)
    slip_velocity: Floats  # (2n,)
    scaled_spin_velocity: Floats  # (n,), of soft fingertips [m/s]


def parts_of(state: Record, n: int) -> StateParts:
    """Returns views of the parts of a state for n fingers, for use in Python."""
    x = state.x
    return StateParts(
        pose=x[POSITION:VELOCITY],
        velocity=x[VELOCITY:SLIP],
        slip=x[SLIP : SLIP + 2 * n],
        slip_velocity=x[SLIP + 2 * n : SLIP + 4 * n],
        scaled_spin_velocity=x[SLIP + 5 * n + 2 : SLIP + 6 * n + 2],
    )


@compiled
def normalise(state: Record) -> None:
    """Normalizes the attitude quaternion."""
    x, total = state.x, 0.0
    for k in range(4):
        total += square(x[ATTITUDE + k])
    scale = 1.0 / np.sqrt(total)
    for k in range(4):
        x[ATTITUDE + k] *= scale
