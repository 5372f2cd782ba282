"""Impulses that stop or turn slips and spins of soft contacts."""

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
    contacts_creep,
    creeps_in_stick,
    find_moments,
    holds_turn,
    limit_determined,
    spatial_find_modes,
)
from slipgrasp.core.kernel.spatial.torsion_phases import (
    along_tangent,
    assemble_phases,
    pull_object,
    slip_forces,
    solve_phases,
    twist_of,
)
from slipgrasp.core.kernel.spatial.ways import way_speed
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, SLIP, STICK, WORKSPACE

LEAST_TURNED = 1e-6  # turn of a slip direction that changes the forces [rad]


@compiled_apart(types.void, MODEL, DISCRETE, STATE, WORKSPACE)
def spatial_stop_slips(model: Record, discrete: Record, state: Record, work: Record) -> None:
    """Stops, by an impulse, slips of contacts that were just set to stick.

    Near a singular pose a fingertip has so much inertia that its stop also moves the object.

    Args:
        model: Constants of the run.
        discrete: Phases after the stop.
        state: State; its velocities are changed.
        work: Kinematics and mobility of this state.
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
    """Stops the spin of sticking contacts by an impulse, and updates the spin of the others.

    Otherwise psi' would drift in stick, where only psi'' = 0 is imposed, and would not be zero at
    the end of a slip, where only the state variable is.

    Args:
        model: Constants of the run.
        discrete: Phases; ``crept`` is changed.
        state: State; its velocities are changed.
        work: Kinematics and mobility of this state.

    Returns:
        1 if a velocity has changed, 2 if forces may have, else 0.
    """
    n, x, torsion, changed = model.num_fingers, state.x, work.torsion, 0
    largest = 0.0
    # Impulses do not determine the directions of slow slips.
    add_crept(model, discrete, state, -1.0)
    for i in range(n):
        if holds_turn(model, discrete, i):
            largest = max(largest, abs(spin_of(model, state, work, i)))
    if largest > EXACT:
        _stop_spins(model, discrete, state, work)
        changed = 2 if torsion.some_slip == 1 or contacts_creep(torsion) else 1
    for i in range(n):
        turns = discrete.phases[i] != STICK
        if largest > EXACT and creeps_in_stick(model, discrete, torsion, i):
            turns = True
        spin, at = spin_of(model, state, work, i) if turns else 0.0, spin_velocity_at(n, i)
        if abs(spin) <= EXACT:
            spin = 0.0
        if x[at] != spin:
            turns_slip = abs(x[at] - spin) > LEAST_TURNED * way_speed(model, state, i, 0)
            x[at], changed = spin, max(changed, 2 if turns_slip else 1)
    add_crept(model, discrete, state, 1.0)
    for i in range(n):
        # Other contacts stopped this spin; friction must no longer oppose it.
        if x[spin_velocity_at(n, i)] == 0.0:
            discrete.crept[i, 2] = 0.0
    forget_crept(model, discrete, state)
    return changed


@compiled_apart(
    types.void, MODEL, DISCRETE, STATE, WORKSPACE, types.int64, types.float64, types.float64
)
def spatial_turn_slip(
    model: Record, discrete: Record, state: Record, work: Record, i: int, dx: float, dy: float
) -> None:
    """Changes the slip velocity of contact ``i`` by an impulse between fingertip and object.

    Moving the fingertip alone would change the energy in proportion to its speed.

    Args:
        model: Constants of the run.
        discrete: Phases; ``crept`` is changed.
        state: State; its velocities are changed.
        work: Kinematics and mobility of this state.
        i: Index of a slipping contact.
        dx: Change along its first tangent [m/s].
        dy: The same along the second.
    """
    n, x, torsion, frame = model.num_fingers, state.x, work.torsion, work.kin.frames[i]
    add_crept(model, discrete, state, -1.0)
    discrete.phases[i] = STICK
    assemble_phases(model, discrete, torsion.no_slide, work)
    discrete.phases[i] = SLIP
    spatial_find_modes(model, discrete, work)
    for k in range(6):
        torsion.load[k] = 0.0
    px, py, pz = multiply(
        work.dynamics.inertia[i],
        dx * frame[0, 0] + dy * frame[1, 0],
        dx * frame[0, 1] + dy * frame[1, 1],
        dx * frame[0, 2] + dy * frame[1, 2],
    )
    pull_object(work, i, -px, -py, -pz)
    solve_phases(torsion, torsion.load, torsion.motion)
    _keep_spins(torsion)
    discrete.phases[i] = STICK
    _take_impulse(model, discrete, state, work)
    discrete.phases[i] = SLIP
    x[slip_velocity_at(n, i, 0)] += dx
    x[slip_velocity_at(n, i, 1)] += dy
    for j in range(n):
        if discrete.phases[j] != STICK:
            x[spin_velocity_at(n, j)] = spin_of(model, state, work, j)
    add_crept(model, discrete, state, 1.0)


@compiled
def _keep_spins(torsion: Record) -> None:
    """Adds to the motion impulses that keep the spin of sticking contacts."""
    for k in range(torsion.num_holders):
        torsion.wanted[k] = twist_of(torsion, torsion.holders[k], torsion.motion)
        torsion.amounts[k] = 0.0
    find_moments(torsion)
    add_moments(torsion)


@compiled
def _stop_spins(model: Record, discrete: Record, state: Record, work: Record) -> None:
    """Stops the determined modes by an impulse at sticking contacts and along all normals.

    Their energy is dissipated by friction. A mode that creeps under the friction of slips is not
    stopped, although it may be determined without this friction.
    """
    torsion, work_done, determined = work.torsion, 0.0, work.torsion.num_determined
    assemble_phases(model, discrete, torsion.no_slide, work)
    spatial_find_modes(model, discrete, work)
    limit_determined(torsion, determined)
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
    """Adds to the object and to slipping contacts the motion due to an impulse."""
    n, x, torsion = model.num_fingers, state.x, work.torsion
    for k in range(6):
        x[VELOCITY + k] += torsion.motion[k]
    for i in range(n):
        if discrete.phases[i] == STICK:
            continue
        _, dx, dy, dz = slip_forces(work, torsion.motion, i, 0.0, 0.0, 0.0)
        for axis in range(2):
            x[slip_velocity_at(n, i, axis)] += along_tangent(work.kin, i, axis, dx, dy, dz)
