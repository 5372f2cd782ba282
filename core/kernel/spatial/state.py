"""The integrated state of a hand in space: what stands where in it. No other module knows.

With n fingers, x = (R_o, Q, v, omega, s, s', E_in, E_f, path), and where a fingertip is soft
(e psi', psi, turned):

    R_o    position of the object (3) [m]
    Q      its attitude, unit quaternion w, x, y, z, world from object (4)
    v      its velocity (3) [m/s]
    omega  its angular velocity in world axes (3) [rad/s]
    s      slips of every fingertip along its two tangents (2 n) [m]
    s'     slip velocities (2 n) [m/s]
    E_in   energy supplied by torques, pulses and timed changes [J]
    E_f    energy dissipated by friction [J]
    path   way that every fingertip has slid (n) [m]
    e psi' spin velocity of every soft fingertip times its eccentricity e (n) [m/s]
    psi    spin, by which it has turned on the object about the normal (n) [rad]
    turned the same without sign, added up (n) [rad]

The spin velocity follows from v, omega and s'; it is carried along since the direction of a slip,
(s', e psi'), is stiff, and set to what it follows from after every step.

Estimates change at control ticks only and are no part of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Record

POSITION, ATTITUDE, VELOCITY, SPIN, SLIP = 0, 3, 7, 10, 13
BODY_STATES = SLIP  # numbers of the pose and the velocity of the object

MAX_STATE = SLIP + 8 * MAX_FINGERS + 2

STATE = np.dtype([("x", np.float64, (MAX_STATE,))], align=True)


@compiled
def slip_at(i: int, axis: int) -> int:
    """Where the slip of contact i along a tangent stands."""
    return SLIP + 2 * i + axis


@compiled
def slip_velocity_at(n: int, i: int, axis: int) -> int:
    """Where the slip velocity of contact i along a tangent stands."""
    return SLIP + 2 * n + 2 * i + axis


def number_of_coordinates(n: int) -> int:
    """Coordinates of the reduced form of n fingers: those of the object, then two slips each."""
    return 6 + 2 * n


count_coordinates = compiled(number_of_coordinates)


@compiled
def slip_coordinate(i: int, axis: int) -> int:
    """Number of the coordinate that is the slip of contact i along a tangent."""
    return 6 + 2 * i + axis


@compiled
def rate_at(n: int, k: int) -> int:
    """Where the rate of coordinate k of the reduced form (object, then slips) stands."""
    return VELOCITY + k if k < 6 else SLIP + 2 * n + k - 6


@compiled
def supplied_at(model: Record) -> int:
    """Where the energy supplied stands."""
    return SLIP + 4 * model.num_fingers


@compiled
def dissipated_at(model: Record) -> int:
    """Where the energy dissipated stands."""
    return SLIP + 4 * model.num_fingers + 1


@compiled
def path_at(n: int, i: int) -> int:
    """Where the way of fingertip i stands."""
    return SLIP + 4 * n + 2 + i


@compiled
def spin_velocity_at(n: int, i: int) -> int:
    """Where the spin velocity of contact i, times its eccentricity, stands."""
    return SLIP + 5 * n + 2 + i


@compiled
def velocity_at(n: int, i: int, axis: int) -> int:
    """Where the velocity of contact i along a tangent stands; of axis 2 that of its spin."""
    return spin_velocity_at(n, i) if axis == 2 else slip_velocity_at(n, i, axis)


@compiled
def spin_at(n: int, i: int) -> int:
    """Where the spin of contact i stands."""
    return SLIP + 6 * n + 2 + i


@compiled
def turned_at(n: int, i: int) -> int:
    """Where the angle by which contact i has turned in all stands."""
    return SLIP + 7 * n + 2 + i


@compiled
def stiff_rate_at(n: int, k: int) -> int:
    """Where rate k stands: those of the reduced form, then those of the spins."""
    reduced = count_coordinates(n)
    return rate_at(n, k) if k < reduced else spin_velocity_at(n, k - reduced)


def count_states(n: int, *, soft: bool) -> int:
    """Length of the state of n fingers, of which some may be soft."""
    return SLIP + (8 if soft else 5) * n + 2


class StateParts(NamedTuple):
    """Views of the parts of a state: writing to them changes it."""

    pose: Floats  # (7,)
    velocity: Floats  # (6,)
    slip: Floats  # (2n,)
    slip_velocity: Floats  # (2n,)
    scaled_spin_velocity: Floats  # (n,), of soft fingertips [m/s]


def parts_of(state: Record, n: int) -> StateParts:
    """The parts of a state of n fingers, for Python to read and to set."""
    x = state.x
    return StateParts(
        pose=x[POSITION:VELOCITY],
        velocity=x[VELOCITY:SLIP],
        slip=x[SLIP : SLIP + 2 * n],
        slip_velocity=x[SLIP + 2 * n : SLIP + 4 * n],
        scaled_spin_velocity=x[SLIP + 5 * n + 2 : SLIP + 6 * n + 2],
    )
