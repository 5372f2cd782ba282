"""Slip modes of a contact (``way``); each mode sticks or slips separately.

On the cone a contact has one mode, in which both tangents slip together. In the pyramid of the
paper it has two, one per tangent. ``ways`` of a record is the number of modes.
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.spatial.state import slip_velocity_at, spin_velocity_at
from slipgrasp.core.kernel.spatial.workspace import SLIP, SLIPS_ALONG_TANGENTS, STICK


@compiled
def axes_of(record: Record, way: int) -> range:
    """Tangents of a slip mode."""
    return range(way, way + 3 - record.ways)


@compiled
def parts_of_way(record: Record, way: int) -> range:
    """Components of a slip mode: its tangents and, for soft fingertips, 2 for the spin."""
    return range(way, way + 3 - record.ways + record.soft)


@compiled
def way_of(record: Record, axis: int) -> int:
    """Slip mode of a tangent."""
    return min(axis, record.ways - 1)


@compiled
def way_size(record: Record, way: int, x: float, y: float) -> float:
    """Magnitude of a tangential vector in a slip mode: of both components, or of one."""
    if record.ways == 1:
        return np.sqrt(x * x + y * y)
    return abs(x) if way == 0 else abs(y)


@compiled
def size_with_spin(x: float, y: float, z: float) -> float:
    """Magnitude of a tangential vector with the component ``z`` about the normal."""
    return np.sqrt(x * x + y * y + z * z)


@compiled
def way_speed(model: Record, state: Record, i: int, way: int) -> float:
    """Speed of contact ``i`` in a slip mode, including spin [m/s]."""
    n = model.num_fingers
    first = state.x[slip_velocity_at(n, i, 0)]
    if model.soft == 1:
        second = state.x[slip_velocity_at(n, i, 1)]
        return size_with_spin(first, second, state.x[spin_velocity_at(n, i)])
    return way_size(model, way, first, state.x[slip_velocity_at(n, i, 1)])


@compiled
def friction_margin(model: Record, discrete: Record, work: Record, i: int, way: int) -> float:
    """Friction margin mu F_n - |F_t| in a slip mode of contact ``i`` [N], positive inside."""
    truth, sticks = model.truth, discrete.slips[i, way] == 0.0
    if model.soft == 1:
        size = size_with_spin(work.forces[i, 0], work.forces[i, 1], work.moments[i])
    else:
        size = way_size(model, way, work.forces[i, 0], work.forces[i, 1])
    friction = truth.static_friction[i] if sticks else truth.friction[i]
    return friction * work.forces[i, 2] - size


@compiled
def least_margin(model: Record, discrete: Record, work: Record, i: int) -> float:
    """Smallest friction margin over the slip modes of contact ``i`` [N]."""
    margin = friction_margin(model, discrete, work, i, 0)
    if model.ways == 1:
        return margin
    return min(margin, friction_margin(model, discrete, work, i, 1))


@compiled
def name_of(model: Record, slips: Floats, directions: Floats) -> int:
    """Phase of a contact, from its slips and directions."""
    if slips[0] == 0.0 and slips[1] == 0.0:
        return STICK
    if model.ways == 1:
        return SLIP
    signs = 3.0 * slips[0] * directions[0] + slips[1] * directions[1]
    return SLIPS_ALONG_TANGENTS + int(signs)


@compiled
def name_phase(model: Record, discrete: Record, i: int) -> None:
    """Sets the phase of contact ``i`` from its slips and directions."""
    discrete.phases[i] = name_of(model, discrete.slips[i], discrete.directions[i])
