"""Impulses that stop slips and spins of soft contacts."""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.spatial.dynamics import multiply
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.state import (
    STATE,
    VELOCITY,
    dissipated_at,
    slip_velocity_at,
    spin_velocity_at,
)
from slipgrasp.core.kernel.spatial.torsion import EXACT, add_crept, forget_crept
from slipgrasp.core.kernel.spatial.torsion_equations import spin_of
from slipgrasp.core.kernel.spatial.torsion_modes import (
    add_moments,
    creeps_in_stick,
    find_modes,
    find_moments,
    holds_turn,
)
from slipgrasp.core.kernel.spatial.torsion_phases import (
    along_tangent,
    assemble_phases,
    pull_object,
    slip_forces,
    solve_phases,
    twist_of,
)
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, STICK, WORKSPACE


@compiled_apart(types.void, MODEL, DISCRETE, STATE, WORKSPACE)
def spatial_stop_slips(model: Record, discrete: Record, state: Record, work: Record) -> None:
    """Stops the slips of contacts that stick from now on by an impulse.

    Near a singular pose a fingertip has so much inertia that its speed alone must not change.

    Args:
        model: Constants of the run.
        discrete: Phases after the stop.
        state: Its velocities change.
        work: With kinematics and mobility of this state.
    """
    n, x, torsion = model.num_fingers, state.x, work.torsion
    assemble_phases(model, discrete, torsion.no_slide, work)
    for k in range(6):
        torsion.load[k] = 0.0
    for i in range(n):
        if discrete.phases[i] != STICK:
            continue
        first, second = work.kin.frames[i, 0], work.kin.frames[i, 1]
        along, beside = x[slip_velocity_at(n, i, 0)], x[slip_velocity_at(n, i, 1)]
        px, py, pz = multiply(
            work.dynamics.inertia[i],
            along * first[0] + beside * second[0],
            along * first[1] + beside * second[1],
            along * first[2] + beside * second[2],
        )
        pull_object(work, i, px, py, pz)
        x[slip_velocity_at(n, i, 0)] = x[slip_velocity_at(n, i, 1)] = 0.0
        x[spin_velocity_at(n, i)] = 0.0
    solve_phases(torsion, torsion.load, torsion.motion)
    _take_impulse(model, discrete, state, work)


@compiled_apart(types.int64, MODEL, DISCRETE, STATE, WORKSPACE)
def spatial_keep_stick(model: Record, discrete: Record, state: Record, work: Record) -> int:
    """Stops the spin of contacts that stick by an impulse, and updates the spin of the others.

    In stick psi' = 0 is kept by psi'' = 0 alone, and where a slip ends only its state is set to 0.

    Args:
        model: Constants of the run.
        discrete: Phases; what creep has made of slips that begin changes.
        state: Its velocities change.
        work: With kinematics and mobility of this state.

    Returns:
        1 where a velocity has changed.
    """
    n, x, torsion, changed = model.num_fingers, state.x, work.torsion, 0
    largest = 0.0
    # An impulse does not tell where to what is slow slips.
    add_crept(model, discrete, state, -1.0)
    for i in range(n):
        if holds_turn(model, discrete, i):
            largest = max(largest, abs(spin_of(model, state, work, i)))
    if largest > EXACT:
        _stop_spins(model, discrete, state, work)
        changed = 1
    for i in range(n):
        turns = discrete.phases[i] != STICK
        if largest > EXACT and creeps_in_stick(model, discrete, torsion, i):
            turns = True
        spin, at = spin_of(model, state, work, i) if turns else 0.0, spin_velocity_at(n, i)
        if abs(spin) <= EXACT:
            spin = 0.0
        if x[at] != spin:
            x[at], changed = spin, 1
    add_crept(model, discrete, state, 1.0)
    forget_crept(model, discrete, state)
    return changed


@compiled
def _stop_spins(model: Record, discrete: Record, state: Record, work: Record) -> None:
    """The impulse on what sticks and all normals after which no determined mode turns.

    Friction takes the energy of these turns.
    """
    torsion, work_done = work.torsion, 0.0
    assemble_phases(model, discrete, torsion.no_slide, work)
    find_modes(model, discrete, work)
    for k in range(torsion.num_holders):
        torsion.wanted[k] = spin_of(model, state, work, torsion.holders[k])
        torsion.amounts[k] = 0.0
    find_moments(torsion)
    for k in range(6):
        torsion.motion[k] = 0.0
    add_moments(torsion)
    for k in range(torsion.num_holders):
        turned = twist_of(torsion, torsion.holders[k], torsion.motion)
        work_done += torsion.held[k] * (torsion.wanted[k] + 0.5 * turned)
    state.x[dissipated_at(model)] += max(0.0, -work_done)
    _take_impulse(model, discrete, state, work)


@compiled
def _take_impulse(model: Record, discrete: Record, state: Record, work: Record) -> None:
    """Adds what an impulse changes of the motion of the object, and of the other slips."""
    n, x, torsion = model.num_fingers, state.x, work.torsion
    for k in range(6):
        x[VELOCITY + k] += torsion.motion[k]
    for i in range(n):
        if discrete.phases[i] == STICK:
            continue
        _, dx, dy, dz = slip_forces(work, torsion.motion, i, 0.0, 0.0, 0.0)
        for axis in range(2):
            x[slip_velocity_at(n, i, axis)] += along_tangent(work.kin, i, axis, dx, dy, dz)
