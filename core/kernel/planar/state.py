"""Layout of the integrated state x. All other modules use the index functions defined here.

With n fingers and p unknowns, x = (q_o, q_o', s, s', phi^, E_in, E_f):

    q_o    pose of the object, x, y and angle (3) [m, m, rad]
    q_o'   its velocity (3) [m/s, m/s, rad/s]
    s      slip of every fingertip along its face (n) [m]
    s'     slip velocity (n) [m/s]
    phi^   estimates of the unknowns (p) [SI]
    E_in   energy supplied by torques, pulses and timed changes [J]
    E_f    energy dissipated by friction, of contacts and joints [J]

A derivative of the state has the same layout.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Record
from slipgrasp.core.scenario import MAX_UNKNOWNS

# Coordinates of the object, equal to their indices in the state.
X, Y, ANGLE = range(3)
_VELOCITY, _SLIP, _ENERGIES = 3, 6, 2

MAX_STATE = _SLIP + 2 * MAX_FINGERS + MAX_UNKNOWNS + _ENERGIES

STATE = np.dtype([("x", np.float64, (MAX_STATE,))], align=True)


@compiled
def count_states(n: int, p: int) -> int:
    """Length of the state for n fingers and p unknowns."""
    return _SLIP + 2 * n + p + _ENERGIES


class StateParts(NamedTuple):
    """Views of the parts of a state; writing to them changes the state."""

    pose: Floats  # (3,)
    velocity: Floats  # (3,)
    slip: Floats  # (n,)
    slip_velocity: Floats  # (n,)
    estimates: Floats  # (p,)


def parts_of(state: Record, n: int, p: int) -> StateParts:
    """Returns views of the parts of a state for n fingers and p unknowns, for use in Python."""
    x, speeds, estimates = state.x, _SLIP + n, _SLIP + 2 * n
    return StateParts(
        pose=x[:_VELOCITY],
        velocity=x[_VELOCITY:_SLIP],
        slip=x[_SLIP:speeds],
        slip_velocity=x[speeds:estimates],
        estimates=x[estimates : estimates + p],
    )


@compiled
def velocity_at(k: int) -> int:
    """Index of the velocity of object coordinate k."""
    return _VELOCITY + k


@compiled
def slip_at(i: int) -> int:
    """Index of the slip of contact i."""
    return _SLIP + i


@compiled
def slip_velocity_at(n: int, i: int) -> int:
    """Index of the slip velocity of contact i."""
    return _SLIP + n + i


@compiled
def count_coordinates(n: int) -> int:
    """Number of reduced coordinates: those of the object, then one slip per contact."""
    return _VELOCITY + n


@compiled
def slip_coordinate(i: int) -> int:
    """Number of the reduced coordinate that is the slip of contact i."""
    return _VELOCITY + i


@compiled
def reduced_at(n: int, k: int) -> tuple[int, int]:
    """Indices of reduced coordinate k (pose, then slip) and of its velocity."""
    if k < _VELOCITY:
        return k, velocity_at(k)
    return slip_at(k - _VELOCITY), slip_velocity_at(n, k - _VELOCITY)


@compiled
def estimate_at(n: int, k: int) -> int:
    """Index of the estimate of unknown k."""
    return _SLIP + 2 * n + k


@compiled
def supplied_at(model: Record) -> int:
    """Index of the supplied energy."""
    return model.num_states - 2


@compiled
def dissipated_at(model: Record) -> int:
    """Index of the energy dissipated by friction."""
    return model.num_states - 1
