"""Ways of a contact to slip: what has a phase of its own.

On the cone a contact has one way, in which both tangents slip together. In the paper's pyramid it
has two, one along each tangent. ``ways`` of a record says how many.
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.spatial.state import slip_velocity_at, spin_velocity_at
from slipgrasp.core.kernel.spatial.workspace import SLIP, SLIPS_ALONG_TANGENTS, STICK


@compiled
def axes_of(record: Record, way: int) -> range:
    """Tangents of a way."""
    return range(way, way + 3 - record.ways)


@compiled
def parts_of_way(record: Record, way: int) -> range:
    """Parts of a way: its tangents, and 2, the turn about the normal, where any is soft."""
    return range(way, way + 3 - record.ways + record.soft)


@compiled
def way_of(record: Record, axis: int) -> int:
    """The way of a tangent."""
    return min(axis, record.ways - 1)


@compiled
def way_size(record: Record, way: int, x: float, y: float) -> float:
    """Size of a tangential vector along a way: its length, or that of its one part."""
    if record.ways == 1:
        return np.sqrt(x * x + y * y)
    return abs(x) if way == 0 else abs(y)


@compiled
def size_with_spin(x: float, y: float, z: float) -> float:
    """Size of a tangential vector with its part about the normal, over the eccentricity."""
    return np.sqrt(x * x + y * y + z * z)


@compiled
def way_speed(model: Record, state: Record, i: int, way: int) -> float:
    """Speed of contact ``i`` along a way, that of its spin included [m/s]."""
    n = model.num_fingers
    first = state.x[slip_velocity_at(n, i, 0)]
    if model.soft == 1:
        second = state.x[slip_velocity_at(n, i, 1)]
        return size_with_spin(first, second, state.x[spin_velocity_at(n, i)])
    return way_size(model, way, first, state.x[slip_velocity_at(n, i, 1)])


@compiled
def friction_margin(model: Record, discrete: Record, work: Record, i: int, way: int) -> float:
    """Mu F_n less the friction force along a way of contact ``i`` [N], positive inside."""
    truth, sticks = model.truth, discrete.slips[i, way] == 0.0
    if model.soft == 1:
        size = size_with_spin(work.forces[i, 0], work.forces[i, 1], work.moments[i])
    else:
        size = way_size(model, way, work.forces[i, 0], work.forces[i, 1])
    friction = truth.static_friction[i] if sticks else truth.friction[i]
    return friction * work.forces[i, 2] - size


@compiled
def least_margin(model: Record, discrete: Record, work: Record, i: int) -> float:
    """The least of these over the ways of contact ``i`` [N]."""
    margin = friction_margin(model, discrete, work, i, 0)
    if model.ways == 1:
        return margin
    return min(margin, friction_margin(model, discrete, work, i, 1))


@compiled
def name_of(model: Record, slips: Floats, directions: Floats) -> int:
    """The phase that the slips and directions of a contact make."""
    if slips[0] == 0.0 and slips[1] == 0.0:
        return STICK
    if model.ways == 1:
        return SLIP
    signs = 3.0 * slips[0] * directions[0] + slips[1] * directions[1]
    return SLIPS_ALONG_TANGENTS + int(signs)


@compiled
def name_phase(model: Record, discrete: Record, i: int) -> None:
    """Writes the phase of contact ``i`` that its slips and directions make."""
    discrete.phases[i] = name_of(model, discrete.slips[i], discrete.directions[i])
