"""Conditions that end a phase or a spatial run: each falls below its level at the event.

Per contact: phase of each slip mode (distance to the cone in stick, speed in slip), normal force,
distance to the edges of the face and of its patches, and distance of the finger from a singularity.
Then the determinant of M~ and, if joints have limits, the distance of every finger to its limits.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Record
from slipgrasp.core.kernel.loop.guards import (
    ENDING_BAND,
    FORCE_BAND,
    FORCE_NOISE,
    SLIP_BAND,
    SLIP_NOISE,
    guards_layout,
    make_guards,
)
from slipgrasp.core.kernel.loop.links import BY_CHAIN
from slipgrasp.core.kernel.loop.status import JOINT_LIMIT, RUNNING
from slipgrasp.core.kernel.spatial.chain import limit_margin
from slipgrasp.core.kernel.spatial.flow import LEAST_SPEED
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.state import STATE, slip_at, velocity_at
from slipgrasp.core.kernel.spatial.torsion_directions import LEAVES, is_short
from slipgrasp.core.kernel.spatial.ways import (
    friction_margin,
    parts_of_way,
    way_speed,
)
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, STICK, WORKSPACE

# The phase guard of the second slip mode follows that of the first.
PHASE, _, NORMAL_FORCE, FACE, SINGULAR = range(5)
PER_CONTACT = 5
BACKWARD = 1e-9  # backward speed up to which a slip at its onset does not end [m/s]

GUARDS = guards_layout((PER_CONTACT + 1) * MAX_FINGERS + 1)
MAX_GUARDS = GUARDS["values"].shape[0]


@compiled
def _distance_to_edge(model: Record, state: Record, i: int) -> float:
    """Smallest distance of contact ``i`` to an edge of its face or of a patch [m].

    It is positive while the contact does not cross an edge.
    """
    least, first, second = np.inf, state.x[slip_at(i, 0)], state.x[slip_at(i, 1)]
    for k in range(model.hand.num_edges[i]):
        edge = model.hand.edges[i, k]
        least = min(least, edge[0] * first + edge[1] * second + edge[2])
    disc = model.hand.discs[i]
    if disc[2] > 0.0:
        x, y = first - disc[0], second - disc[1]
        least = disc[2] - np.sqrt(x * x + y * y)
    for k in range(model.hand.num_rims[i]):
        rim = model.hand.rims[i, k]
        x, y = first - rim.centre[0], second - rim.centre[1]
        least = min(least, rim.side * (rim.radius - np.sqrt(x * x + y * y)))
    return least


@compiled
def _phase_value(
    model: Record, discrete: Record, state: Record, work: Record, i: int, way: int
) -> float:
    """Distance to the bound of friction in stick [N], speed in slip [m/s]."""
    if discrete.slips[i, way] == 0.0:
        return friction_margin(model, discrete, work, i, way)
    has_begun = discrete.frozen[i, way] == 0
    if has_begun and model.ways == 1:
        return way_speed(model, state, i, way) - LEAST_SPEED
    if model.soft == 1 and discrete.frozen[i, way] == LEAVES:
        return 0.0  # in its band: the next step determines whether it rests
    if model.soft == 1:
        # The steps of slip onset include stops and changes of direction; only a rest is an event.
        return -BACKWARD if is_short(work.gamma, i) else 2.0 * BACKWARD
    along = 0.0
    for part in parts_of_way(model, way):
        at = velocity_at(model.num_fingers, i, part)
        along += discrete.directions[i, part] * state.x[at]
    return along if has_begun else along + BACKWARD


@compiled
def _update_values(
    model: Record, discrete: Record, state: Record, work: Record, guards: Record
) -> None:
    """Computes all guards at the state evaluated in ``work``."""
    n, values = model.num_fingers, guards.values
    guards.count = PER_CONTACT * n + 1
    for i in range(n):
        base = PER_CONTACT * i
        values[base + PHASE + 1] = np.inf
        for way in range(model.ways):
            values[base + PHASE + way] = _phase_value(model, discrete, state, work, i, way)
        values[base + NORMAL_FORCE] = work.forces[i, 2]
        values[base + FACE] = _distance_to_edge(model, state, i)
        values[base + SINGULAR] = min(work.kin.extension[i], work.kin.clearance[i])
    values[PER_CONTACT * n] = work.system.determinant
    if model.hand.has_limits == 1:
        guards.count += n
        for i in range(n):
            values[limit_at(n, i)] = _limit_margin(model, work, i)


@compiled
def limit_at(n: int, i: int) -> int:
    """Index of the guard of the joint limits of finger ``i``."""
    return PER_CONTACT * n + 1 + i


@compiled
def _limit_margin(model: Record, work: Record, i: int) -> float:
    """Smallest distance of a joint of finger ``i`` to its limits [rad, m]."""
    if model.hand.kinds[i] != BY_CHAIN:
        return np.inf
    return limit_margin(model.hand.chains[i], work.kin.chains[i])


@compiled
def sample_guards(
    model: Record, discrete: Record, state: Record, work: Record, samples: Floats, row: int
) -> None:
    """Stores the guards that may fall below their level and recover inside a step.

    Each is stored at its index in ``samples[row]``; distances to edges only in slip.
    """
    for i in range(model.num_fingers):
        base = PER_CONTACT * i
        for way in range(model.ways):
            value = _phase_value(model, discrete, state, work, i, way)
            samples[row, base + PHASE + way] = value
        samples[row, base + NORMAL_FORCE] = work.forces[i, 2]
        if discrete.phases[i] != STICK:
            samples[row, base + FACE] = _distance_to_edge(model, state, i)
        samples[row, base + SINGULAR] = min(work.kin.extension[i], work.kin.clearance[i])
        if model.hand.has_limits == 1:
            samples[row, limit_at(model.num_fingers, i)] = _limit_margin(model, work, i)
    samples[row, PER_CONTACT * model.num_fingers] = work.system.determinant


@compiled
def band_of(model: Record, discrete: Record, values: Floats, j: int) -> tuple[float, float]:
    """Noise and band of guard j; the sign of a value inside the band is uncertain."""
    i, kind = j // PER_CONTACT, j % PER_CONTACT
    if i >= model.num_fingers or kind == SINGULAR:
        return 0.0, ENDING_BAND
    if kind == FACE:
        return SLIP_NOISE, SLIP_BAND
    if kind < NORMAL_FORCE and discrete.slips[i, kind - PHASE] != 0.0:
        begins = model.soft == 1 and discrete.frozen[i, 0] != 0
        return 0.0, BACKWARD if begins else 0.0
    scale = 1.0 + abs(values[PER_CONTACT * i + NORMAL_FORCE])
    return FORCE_NOISE * scale, FORCE_BAND * scale


@compiled
def _is_beyond(value: float, level: float, noise: float) -> bool:
    """True if a value is below its level by more than noise, or NaN."""
    return not value >= level - noise


(
    arm_guards,
    is_past_event,
    find_fired,
    _,
    find_overlooked,
    least_fired,
    pass_step,
    keep_first_fired,
) = make_guards(
    "spatial_", (MODEL, DISCRETE, STATE, WORKSPACE, GUARDS), _update_values, band_of, _is_beyond
)


@compiled
def find_limited(model: Record, run: Record) -> int:
    """JOINT_LIMIT if a joint has reached a limit, else RUNNING; stores its finger."""
    n = model.num_fingers
    if model.hand.has_limits == 1:
        for i in range(n):
            if run.guards.fired[limit_at(n, i)] == 1:
                run.concerned = i
                return JOINT_LIMIT
    return RUNNING


@compiled_apart(types.int64, MODEL, DISCRETE, GUARDS)
def spatial_past_band(model: Record, discrete: Record, guards: Record) -> int:
    """1 if a force that fired is below its level by more than its band."""
    for j in range(PER_CONTACT * model.num_fingers):
        if guards.fired[j] == 0 or j % PER_CONTACT > NORMAL_FORCE:
            continue
        _, band = band_of(model, discrete, guards.values, j)
        # Slip speeds have no band.
        if band > 0.0 and guards.levels[j] - guards.values[j] > band:
            return 1
    return 0
