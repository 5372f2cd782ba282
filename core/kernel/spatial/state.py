"""The integrated state of a hand in space: what stands where in it. No other module knows.

With n fingers, x = (R_o, Q, v, omega, s, s', E_in, E_f, path):

    R_o    position of the object (3) [m]
    Q      its attitude, unit quaternion w, x, y, z, world from object (4)
    v      its velocity (3) [m/s]
    omega  its angular velocity in world axes (3) [rad/s]
    s      slips of every fingertip along its two tangents (2 n) [m]
    s'     slip velocities (2 n) [m/s]
    E_in   energy supplied by torques, pulses and timed changes [J]
    E_f    energy dissipated by friction [J]
    path   way that every fingertip has slid (n) [m]

Estimates change at control ticks only and are no part of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Record

POSITION, ATTITUDE, VELOCITY, SPIN, SLIP = 0, 3, 7, 10, 13
BODY_STATES = SLIP  # numbers of the pose and the velocity of the object

MAX_STATE = SLIP + 5 * MAX_FINGERS + 2

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


def count_states(n: int) -> int:
    """Length of the state of n fingers."""
    return SLIP + 5 * n + 2


class StateParts(NamedTuple):
    """Views of the parts of a state: writing to them changes it."""

    pose: Floats  # (7,)
    velocity: Floats  # (6,)
    slip: Floats  # (2n,)
    slip_velocity: Floats  # (2n,)


def parts_of(state: Record, n: int) -> StateParts:
    """The parts of a state of n fingers, for Python to read and to set."""
    x = state.x
    return StateParts(
        pose=x[POSITION:VELOCITY],
        velocity=x[VELOCITY:SLIP],
        slip=x[SLIP : SLIP + 2 * n],
        slip_velocity=x[SLIP + 2 * n : SLIP + 4 * n],
    )
