"""Conditions that end a phase: each is positive inside and falls through its level at the event.

Per contact: the phase itself (distance to the cone in stick, signed slip velocity in slip),
normal force, end of the face, finger not singular. Then the determinant of M~ (Painleve),
and per unknown its distance to a bound, or the rate that holds it there.
"""

from __future__ import annotations

from core.kernel.compiler import compiled
from core.kernel.records import MAX_FINGERS, MAX_UNKNOWNS, Floats, Integers, Record

PHASE, NORMAL_FORCE, FACE, SINGULAR = range(4)
PER_CONTACT = 4

FORCE_BAND = 1e-9
VELOCITY_BAND = 1e-9
FORCE_NOISE = 1e-11


MAX_GUARDS = PER_CONTACT * MAX_FINGERS + 1 + MAX_UNKNOWNS


@compiled
def num_guards(model: Record) -> int:
    """How many guards a hand has."""
    return PER_CONTACT * model.num_fingers + 1 + model.num_unknowns


@compiled
def friction_margin(model: Record, work: Record, i: int) -> float:
    """Mu F_n - |F_x| of contact i [N], positive inside the cone."""
    return model.truth.friction[i] * work.forces[i, 1] - abs(work.forces[i, 0])


@compiled
def update_guards(
    model: Record, discrete: Record, state: Floats, work: Record, values: Floats
) -> None:
    """Values of all guards at the state that ``work`` holds."""
    n = model.num_fingers
    for i in range(n):
        base = PER_CONTACT * i
        if discrete.phases[i] == 0:
            values[base + PHASE] = friction_margin(model, work, i)
        else:
            values[base + PHASE] = discrete.phases[i] * state[6 + n + i]
        slip = state[6 + i]
        values[base + NORMAL_FORCE] = work.forces[i, 1]
        values[base + FACE] = min(
            model.hand.slip_maximum[i] - slip, slip - model.hand.slip_minimum[i]
        )
        values[base + SINGULAR] = work.kin.extension[i]
    values[PER_CONTACT * n] = work.determinant
    for k in range(model.num_unknowns):
        value = state[6 + 2 * n + k]
        low, high = model.unknowns.minimum[k], model.unknowns.maximum[k]
        if discrete.clamps[k] == 0:
            values[PER_CONTACT * n + 1 + k] = min(value - low, high - value)
        else:
            values[PER_CONTACT * n + 1 + k] = discrete.clamps[k] * work.rates[k]


@compiled
def tolerance(model: Record, discrete: Record, work: Record, j: int) -> tuple[float, float]:
    """Noise and band of guard j: within its band a value does not tell its sign."""
    n = model.num_fingers
    if j < PER_CONTACT * n and j % PER_CONTACT == PHASE:
        i = j // PER_CONTACT
        if discrete.phases[i] != 0:
            return 1e-13, VELOCITY_BAND
        scale = 1.0 + abs(work.forces[i, 1])
        return FORCE_NOISE * scale, FORCE_BAND * scale
    return 0.0, 0.0


@compiled
def arm_guards(
    model: Record, discrete: Record, work: Record, values: Floats, levels: Floats
) -> None:
    """After a jump: a guard that starts inside its band may sink to twice the band before it fires.

    Without this, a contact that starts to slip, or rests exactly on its cone, fires again
    at the same instant by rounding.
    """
    for j in range(num_guards(model)):
        _, band = tolerance(model, discrete, work, j)
        levels[j] = 0.0 if values[j] > band else min(-2.0 * band, values[j] - band)


@compiled
def rearm_guards(
    model: Record, discrete: Record, work: Record, values: Floats, levels: Floats
) -> None:
    """Back to level 0 for guards that have left their band."""
    for j in range(num_guards(model)):
        if levels[j] < 0.0:
            _, band = tolerance(model, discrete, work, j)
            if values[j] > band:
                levels[j] = 0.0


@compiled
def find_fired(
    model: Record,
    discrete: Record,
    work: Record,
    values: Floats,
    levels: Floats,
    fired: Integers,
) -> bool:
    """Marks the guards that are below their level by more than noise; True if any is."""
    found = False
    for j in range(num_guards(model)):
        noise, _ = tolerance(model, discrete, work, j)
        fired[j] = 1 if values[j] < levels[j] - noise else 0
        found = found or fired[j] == 1
    return found
