"""Conditions that end a phase: each is positive before the event and falls below its level there.

Per contact: phase (distance to the cone in stick, signed slip velocity in slip), normal force,
distance to the end of the face or of its friction, and distance of the finger from a singularity.
Then the determinant of M~ (Painleve), per unknown the distance of its estimate to a bound or the
rate that presses it against the bound, and a guard that is negative once the feasibility of the
limits of the grasp force has changed.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Record
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
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.state import STATE, estimate_at, slip_at, slip_velocity_at
from slipgrasp.core.kernel.planar.workspace import DISCRETE, WORKSPACE
from slipgrasp.core.scenario import MAX_UNKNOWNS

PHASE, NORMAL_FORCE, FACE, SINGULAR = range(4)
PER_CONTACT = 4

VELOCITY_BAND, VELOCITY_NOISE = 1e-9, 1e-13
ESTIMATE_BAND = 1e-9  # of an estimate at its bound, and of the rate that presses it there
VIOLATION_BAND = 1e-9  # [N]

GUARDS = guards_layout(PER_CONTACT * MAX_FINGERS + 1 + MAX_UNKNOWNS + 1)
MAX_GUARDS = GUARDS["values"].shape[0]


@compiled
def friction_margin(model: Record, discrete: Record, work: Record, i: int) -> float:
    """Friction margin mu F_n - |F_x| of contact i [N], positive inside the cone."""
    return present_friction(model, discrete, i) * work.forces[i, 1] - abs(work.forces[i, 0])


@compiled
def guard_value(model: Record, discrete: Record, j: int, coordinate: float) -> float:
    """Value of a guard that depends on one coordinate of the state.

    Args:
        model: Constants of the run.
        discrete: Phases.
        j: Index of the guard: phase of a slipping contact, or estimate.
        coordinate: The slip velocity [m/s], or the estimate.
    """
    first = PER_CONTACT * model.num_fingers
    if j < first:
        return discrete.phases[j // PER_CONTACT] * coordinate
    k = j - first - 1
    low, high = coordinate - model.unknowns.minimum[k], model.unknowns.maximum[k] - coordinate
    return min(low, high)


@compiled
def _update_values(
    model: Record, discrete: Record, state: Record, work: Record, guards: Record
) -> None:
    """Computes all guards at the state evaluated in ``work``."""
    n = model.num_fingers
    guards.count = PER_CONTACT * n + 1 + model.num_unknowns + 1
    for i in range(n):
        base = PER_CONTACT * i
        if discrete.phases[i] == 0:
            guards.values[base + PHASE] = friction_margin(model, discrete, work, i)
        else:
            guards.values[base + PHASE] = guard_value(
                model, discrete, base + PHASE, state.x[slip_velocity_at(n, i)]
            )
        slip = state.x[slip_at(i)]
        guards.values[base + NORMAL_FORCE] = work.forces[i, 1]
        guards.values[base + FACE] = min(
            model.hand.slip_maximum[i] - slip, slip - model.hand.slip_minimum[i]
        )
        guards.values[base + SINGULAR] = work.kin.extension[i]
    base = PER_CONTACT * n
    guards.values[base] = work.factors.determinant
    for k in range(model.num_unknowns):
        j = base + 1 + k
        if discrete.clamps[k] == 0:
            guards.values[j] = guard_value(model, discrete, j, state.x[estimate_at(n, k)])
        else:
            guards.values[j] = discrete.clamps[k] * work.rates[k]
    same = model.law.period > 0.0 or is_infeasible(work.room.violation) == guards.infeasible
    guards.values[guards.count - 1] = 1.0 if same else -1.0


@compiled
def is_infeasible(violation: float) -> int:
    """1 if the limits of the grasp force contradict each other, judged by the violation [N]."""
    return 1 if violation > VIOLATION_BAND else 0


@compiled
def sample_guards(model: Record, discrete: Record, work: Record, samples: Floats, row: int) -> None:
    """Stores the guards that do not depend on one coordinate, at a state inside a step.

    Each is stored at its index in ``samples[row]``; for the last guard it is the violation.
    """
    n = model.num_fingers
    for i in range(n):
        base = PER_CONTACT * i
        if discrete.phases[i] == 0:
            samples[row, base + PHASE] = friction_margin(model, discrete, work, i)
        samples[row, base + NORMAL_FORCE] = work.forces[i, 1]
        samples[row, base + SINGULAR] = work.kin.extension[i]
    base = PER_CONTACT * n
    samples[row, base] = work.factors.determinant
    for k in range(model.num_unknowns):
        if discrete.clamps[k] != 0:
            samples[row, base + 1 + k] = discrete.clamps[k] * work.rates[k]
    samples[row, base + 1 + model.num_unknowns] = work.room.violation


@compiled
def band_of(model: Record, discrete: Record, values: Floats, j: int) -> tuple[float, float]:
    """Noise and band of guard j; the sign of a value inside the band is uncertain.

    Args:
        model: Constants of the run.
        discrete: Phases, and the estimates that are at a bound.
        values: Values of all guards.
        j: Index of the guard.
    """
    num_of_contacts = PER_CONTACT * model.num_fingers
    if j >= num_of_contacts:
        if j == num_of_contacts:
            return 0.0, ENDING_BAND
        return 0.0, ESTIMATE_BAND if j <= num_of_contacts + model.num_unknowns else 0.0
    i, kind = j // PER_CONTACT, j % PER_CONTACT
    if kind == FACE:
        return SLIP_NOISE, SLIP_BAND
    if kind == SINGULAR:
        return 0.0, ENDING_BAND
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
    evaluate_ends,
    find_overlooked,
    least_fired,
    pass_step,
    keep_first_fired,
) = make_guards(
    "", (MODEL, DISCRETE, STATE, WORKSPACE, GUARDS), _update_values, band_of, _is_beyond
)


@compiled_apart(types.int64, MODEL, DISCRETE, GUARDS)
def is_past_band(model: Record, discrete: Record, guards: Record) -> int:
    """1 if a guard that fired is below its level by more than its band."""
    for j in range(guards.count - 1):
        _, band = band_of(model, discrete, guards.values, j)
        if guards.fired[j] == 1 and guards.levels[j] - guards.values[j] > band:
            return 1
    return 0
