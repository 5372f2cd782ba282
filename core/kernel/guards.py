"""Conditions that end a phase: each is positive inside and falls through its level at the event.

Per contact: the phase itself (distance to the cone in stick, signed slip velocity in slip),
normal force, end of the face or of its friction, finger not singular. Then the determinant
of M~ (Painleve), and per unknown its distance to a bound, or the rate that holds it there.
"""

from __future__ import annotations

import numpy as np
from numba import types

from core.kernel.compiler import compiled, compiled_apart
from core.kernel.model import MODEL
from core.kernel.records import MAX_FINGERS, MAX_UNKNOWNS, STATE, Record
from core.kernel.workspace import DISCRETE, WORKSPACE

PHASE, NORMAL_FORCE, FACE, SINGULAR = range(4)
PER_CONTACT = 4
MAX_GUARDS = PER_CONTACT * MAX_FINGERS + 1 + MAX_UNKNOWNS

FORCE_BAND = 1e-9
VELOCITY_BAND = 1e-9
FORCE_NOISE = 1e-11
VELOCITY_NOISE = 1e-13

# Values of all guards and what is known of them.
GUARDS = np.dtype(
    [
        ("count", np.int64),
        ("values", np.float64, (MAX_GUARDS,)),
        ("levels", np.float64, (MAX_GUARDS,)),
        ("fired", np.int64, (MAX_GUARDS,)),
    ],
    align=True,
)


@compiled
def present_friction(model: Record, discrete: Record, i: int) -> float:
    """The friction coefficient that bounds, or sets, the force of contact i in its phase."""
    truth = model.truth
    return truth.static_friction[i] if discrete.phases[i] == 0 else truth.friction[i]


@compiled
def friction_margin(model: Record, discrete: Record, work: Record, i: int) -> float:
    """Mu F_n - |F_x| of contact i [N], positive inside the cone."""
    return present_friction(model, discrete, i) * work.forces[i, 1] - abs(work.forces[i, 0])


@compiled
def _update_values(
    model: Record, discrete: Record, state: Record, work: Record, guards: Record
) -> None:
    """Values of all guards at the state that ``work`` holds."""
    n = model.num_fingers
    guards.count = PER_CONTACT * n + 1 + model.num_unknowns
    for i in range(n):
        base = PER_CONTACT * i
        if discrete.phases[i] == 0:
            guards.values[base + PHASE] = friction_margin(model, discrete, work, i)
        else:
            guards.values[base + PHASE] = discrete.phases[i] * state.x[6 + n + i]
        slip = state.x[6 + i]
        guards.values[base + NORMAL_FORCE] = work.forces[i, 1]
        guards.values[base + FACE] = min(
            model.hand.slip_maximum[i] - slip, slip - model.hand.slip_minimum[i]
        )
        guards.values[base + SINGULAR] = work.kin.extension[i]
    base = PER_CONTACT * n
    guards.values[base] = work.factors.determinant
    for k in range(model.num_unknowns):
        value = state.x[6 + 2 * n + k]
        if discrete.clamps[k] == 0:
            low, high = value - model.unknowns.minimum[k], model.unknowns.maximum[k] - value
            guards.values[base + 1 + k] = min(low, high)
        else:
            guards.values[base + 1 + k] = discrete.clamps[k] * work.rates[k]


@compiled
def _band(model: Record, discrete: Record, work: Record, j: int) -> tuple[float, float]:
    """Noise and band of guard j: within its band a value does not tell its sign."""
    if j < PER_CONTACT * model.num_fingers and j % PER_CONTACT == PHASE:
        i = j // PER_CONTACT
        if discrete.phases[i] != 0:
            return VELOCITY_NOISE, VELOCITY_BAND
        scale = 1.0 + abs(work.forces[i, 1])
        return FORCE_NOISE * scale, FORCE_BAND * scale
    return 0.0, 0.0


@compiled_apart(types.void, MODEL, DISCRETE, STATE, WORKSPACE, GUARDS)
def arm_guards(
    model: Record, discrete: Record, state: Record, work: Record, guards: Record
) -> None:
    """After a jump: a guard that starts inside its band may sink to twice the band before it fires.

    Without this, a contact that starts to slip, or rests exactly on its cone, fires again
    at the same instant by rounding.
    """
    _update_values(model, discrete, state, work, guards)
    for j in range(guards.count):
        _, band = _band(model, discrete, work, j)
        value = guards.values[j]
        guards.levels[j] = 0.0 if value > band else min(-2.0 * band, value - band)


@compiled_apart(types.int64, MODEL, DISCRETE, STATE, WORKSPACE, GUARDS)
def is_past_event(
    model: Record, discrete: Record, state: Record, work: Record, guards: Record
) -> int:
    """1 if any guard is below its level by more than noise."""
    _update_values(model, discrete, state, work, guards)
    for j in range(guards.count):
        noise, _ = _band(model, discrete, work, j)
        if guards.values[j] < guards.levels[j] - noise:
            return 1
    return 0


@compiled_apart(types.int64, MODEL, DISCRETE, STATE, WORKSPACE, GUARDS)
def find_fired(model: Record, discrete: Record, state: Record, work: Record, guards: Record) -> int:
    """The same for the end of a step; marks the guards that have fired in it."""
    found = is_past_event(model, discrete, state, work, guards)
    for j in range(guards.count):
        noise, _ = _band(model, discrete, work, j)
        guards.fired[j] = 1 if guards.values[j] < guards.levels[j] - noise else 0
    return found


@compiled_apart(types.int64, MODEL, DISCRETE, WORKSPACE, GUARDS)
def find_overlooked(model: Record, discrete: Record, work: Record, guards: Record) -> int:
    """1 if a guard that did not fire in the whole step is past its level at the event in it.

    Such guards are marked too: the first event is theirs, or at the same time.
    """
    found = 0
    for j in range(guards.count):
        noise, _ = _band(model, discrete, work, j)
        if guards.fired[j] == 0 and guards.values[j] < guards.levels[j] - noise:
            guards.fired[j] = 1
            found = 1
    return found


@compiled_apart(types.float64, MODEL, DISCRETE, STATE, WORKSPACE, GUARDS)
def least_fired(
    model: Record, discrete: Record, state: Record, work: Record, guards: Record
) -> float:
    """The least distance to its level, at this state, among the guards that fired in this step."""
    _update_values(model, discrete, state, work, guards)
    least = np.inf
    for j in range(guards.count):
        if guards.fired[j] == 1:
            least = min(least, guards.values[j] - guards.levels[j])
    return least


@compiled_apart(types.void, MODEL, DISCRETE, WORKSPACE, GUARDS)
def rearm_guards(model: Record, discrete: Record, work: Record, guards: Record) -> None:
    """Back to level 0 for guards that have left their band."""
    for j in range(guards.count):
        if guards.levels[j] < 0.0:
            _, band = _band(model, discrete, work, j)
            if guards.values[j] > band:
                guards.levels[j] = 0.0


@compiled
def keep_first_fired(guards: Record, least: float) -> None:
    """Of the fired guards keeps those at their level here; the others would come later."""
    for j in range(guards.count):
        if guards.values[j] - guards.levels[j] > max(0.0, least):
            guards.fired[j] = 0
