"""Conditions that end a phase on a rail: each is positive before the event.

Per contact: phase, normal force, distance of the fingertip to the end of its face, and distance of
the finger from a singularity; then the determinant of the equations of motion.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.loop.friction import present_friction
from slipgrasp.core.kernel.loop.guards import (
    ENDING_BAND,
    FORCE_BAND,
    FORCE_NOISE,
    SLIP_BAND,
    SLIP_NOISE,
    guards_layout,
    make_guards,
)
from slipgrasp.core.kernel.planar.state import STATE
from slipgrasp.core.kernel.rail.model import FINGER, MODEL, NUM_CONTACTS
from slipgrasp.core.kernel.rail.state import (
    DISCRETE,
    SLIP,
    SLIP_SPEED,
    SPEED,
    WORKSPACE,
)

PHASE, NORMAL_FORCE, FACE, SINGULAR = range(4)
PER_CONTACT = 4
MAX_GUARDS = PER_CONTACT * NUM_CONTACTS + 1
VELOCITY_BAND, VELOCITY_NOISE = 1e-9, 1e-13

GUARDS = guards_layout(MAX_GUARDS)


@compiled
def speed_at(i: int) -> int:
    """Index of the slip velocity of contact i."""
    return SLIP_SPEED if i == FINGER else SPEED


@compiled
def friction_margin(model: Record, discrete: Record, work: Record, i: int) -> float:
    """Mu F_n - |F_t| of contact i [N], positive inside the cone."""
    return present_friction(model, discrete, i) * work.forces[i, 1] - abs(work.forces[i, 0])


@compiled
def guard_of_forces(model: Record, discrete: Record, work: Record, j: int) -> float:
    """Value of guard j if it depends on more than one coordinate; 1 otherwise."""
    i, kind = j // PER_CONTACT, j % PER_CONTACT
    if i == NUM_CONTACTS:
        return float(work.determinant)
    if kind == PHASE and discrete.phases[i] == 0:
        return friction_margin(model, discrete, work, i)
    if kind == NORMAL_FORCE:
        return float(work.forces[i, 1])
    return float(work.kin.extension[0]) if kind == SINGULAR and i == FINGER else 1.0


@compiled
def _update_values(
    model: Record, discrete: Record, state: Record, work: Record, guards: Record
) -> None:
    """Computes all guards at the state evaluated in ``work``."""
    guards.count = MAX_GUARDS
    for j in range(MAX_GUARDS):
        guards.values[j] = guard_of_forces(model, discrete, work, j)
    for i in range(NUM_CONTACTS):
        if discrete.phases[i] != 0:
            guards.values[PER_CONTACT * i + PHASE] = discrete.phases[i] * state.x[speed_at(i)]
    slip = state.x[SLIP]
    guards.values[FACE] = min(model.hand.slip_maximum[0] - slip, slip - model.hand.slip_minimum[0])


@compiled
def sample_guards(model: Record, discrete: Record, work: Record, samples: Floats, row: int) -> None:
    """Stores the guards that depend on forces, at a state inside a step, in ``samples[row]``."""
    for j in range(MAX_GUARDS):
        samples[row, j] = guard_of_forces(model, discrete, work, j)


@compiled
def band_of(_model: Record, discrete: Record, values: Floats, j: int) -> tuple[float, float]:
    """Noise and band of guard j; the sign of a value inside the band is uncertain."""
    i, kind = j // PER_CONTACT, j % PER_CONTACT
    if i == NUM_CONTACTS or kind == SINGULAR:
        return 0.0, ENDING_BAND
    if kind == FACE:
        return SLIP_NOISE, SLIP_BAND
    if kind == PHASE and discrete.phases[i] != 0:
        return VELOCITY_NOISE, VELOCITY_BAND
    scale = 1.0 + abs(values[PER_CONTACT * i + NORMAL_FORCE])
    return FORCE_NOISE * scale, FORCE_BAND * scale


@compiled
def _is_beyond(value: float, level: float, noise: float) -> bool:
    """True if a value is below its level by more than noise."""
    return level - value > noise


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
    "rail_", (MODEL, DISCRETE, STATE, WORKSPACE, GUARDS), _update_values, band_of, _is_beyond
)


@compiled_apart(types.int64, MODEL, DISCRETE, GUARDS, prefix="rail_")
def is_past_band(model: Record, discrete: Record, guards: Record) -> int:
    """1 if a guard that fired is below its level by more than its band."""
    for j in range(guards.count):
        _, band = band_of(model, discrete, guards.values, j)
        if guards.fired[j] == 1 and guards.levels[j] - guards.values[j] > band:
            return 1
    return 0
