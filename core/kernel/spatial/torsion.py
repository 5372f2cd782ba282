"""Plant with soft fingertips: moments in stick, and onset of slips.

The equations are those of `slipgrasp.core.kernel.spatial.torsion_phases` and, at slip onset, of
`slipgrasp.core.kernel.spatial.torsion_equations`. Velocities in stick are kept exact.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.numerics.dense import diagonalise, factor_dense, solve_dense
from slipgrasp.core.kernel.spatial.contact_problem import times
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.state import (
    STATE,
    VELOCITY,
    dissipated_at,
    slip_velocity_at,
    spin_velocity_at,
    velocity_at,
)
from slipgrasp.core.kernel.spatial.torsion_contacts import spatial_soft_newton
from slipgrasp.core.kernel.spatial.torsion_equations import spatial_mobility, spin_of
from slipgrasp.core.kernel.spatial.torsion_layout import FREE, MOVING, NORMAL, ROWS, STUCK, TURN
from slipgrasp.core.kernel.spatial.torsion_phases import (
    along_normal,
    along_tangent,
    assemble_phases,
    load_phases,
    prepare_pads,
    press_object,
    pull_object,
    slip_forces,
    solve_phases,
    spin_rest,
    take_slip,
    take_stick,
    turn_mobility,
    twist_of,
)
from slipgrasp.core.kernel.spatial.torsion_split import contacts_creep, relieve, set_creep
from slipgrasp.core.kernel.spatial.ways import name_phase, size_with_spin, way_speed
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, STICK, WORKSPACE

UNDETERMINED = 1e-3  # relative mobility of a mode below which its moment is undetermined
FIRM = 1e3  # penalty that holds given moments in the contact problem [1/kg]
INSTANT = 1e-9  # time after which friction at slip onset opposes the velocity [s]
AT_REST = 1e-9  # relative distance of the friction of a contact at rest from its bound
RESTS = 2  # value of ``frozen``: at rest after slip onset
EXACT = 1e-14  # spin velocity times e that counts as zero [m/s]


@compiled
def _holds_turn(model: Record, discrete: Record, i: int) -> bool:
    """True if contact ``i`` sticks and resists turning."""
    return discrete.phases[i] == STICK and model.hand.eccentricities[i] > 0.0


@compiled
def find_modes(model: Record, discrete: Record, work: Record) -> None:
    """Computes the modes of the moments in stick, sorted by mobility, and their effect.

    Some modes, such as that of two opposed contacts that twist the object against each other, cause
    no motion: they are undetermined and come last. Sigma must be factored.
    """
    torsion, count, largest = work.torsion, 0, 0.0
    torsion.some_slip = 0
    for i in range(model.num_fingers):
        if discrete.phases[i] != STICK:
            torsion.some_slip = 1
        if _holds_turn(model, discrete, i):
            solve_phases(torsion, torsion.twists[i], torsion.moves[count])
            largest = max(largest, turn_mobility(model, work, i))
            torsion.holders[count] = i
            count += 1
    torsion.num_holders = count
    for k in range(count):
        for j in range(count):
            torsion.turns[k, j] = twist_of(torsion, torsion.holders[k], torsion.moves[j])
    for k in range(count):
        for j in range(count):
            torsion.symmetric[k, j] = 0.5 * (torsion.turns[k, j] + torsion.turns[j, k])
            torsion.modes[k, j] = 1.0 if k == j else 0.0
    diagonalise(torsion.symmetric, torsion.modes, count)
    _put_determined_first(torsion, count, UNDETERMINED * largest)


@compiled
def _put_determined_first(torsion: Record, count: int, least: float) -> None:
    """Sorts the determined modes first, with the mobilities on the diagonal of ``symmetric``."""
    determined = 0
    for k in range(count):
        if not torsion.symmetric[k, k] > least:
            continue
        for row in range(count):
            value = torsion.modes[row, determined]
            torsion.modes[row, determined] = torsion.modes[row, k]
            torsion.modes[row, k] = value
        value = torsion.symmetric[determined, determined]
        torsion.symmetric[determined, determined] = torsion.symmetric[k, k]
        torsion.symmetric[k, k] = value
        determined += 1
    torsion.num_determined = determined


@compiled
def _find_moments(torsion: Record) -> None:
    """Computes the moments in stick, ``held``, with w = -``wanted`` in the determined modes.

    The amounts of the undetermined modes are given in ``amounts``.
    """
    count, determined = torsion.num_holders, torsion.num_determined
    for k in range(count):
        torsion.held[k] = 0.0
        for mode in range(determined, count):
            torsion.held[k] += torsion.modes[k, mode] * torsion.amounts[mode]
    for row in range(determined):
        total = 0.0
        for k in range(count):
            moved = torsion.wanted[k]
            for j in range(count):
                moved += torsion.turns[k, j] * torsion.held[j]
            total -= torsion.modes[k, row] * moved
        torsion.small_right[row] = total
        # If all contacts stick, the mobility is symmetric and the modes are decoupled.
        torsion.amounts[row] = total / torsion.symmetric[row, row]
    if torsion.some_slip == 1:
        _mix_modes(torsion)
    for k in range(count):
        for mode in range(determined):
            torsion.held[k] += torsion.modes[k, mode] * torsion.amounts[mode]


@compiled
def _mix_modes(torsion: Record) -> None:
    """Computes the amounts if slips make the mobility of the moments asymmetric."""
    count, determined = torsion.num_holders, torsion.num_determined
    for row in range(determined):
        for column in range(determined):
            total = 0.0
            for k in range(count):
                for j in range(count):
                    between = torsion.turns[k, j] * torsion.modes[j, column]
                    total += torsion.modes[k, row] * between
            torsion.small[row, column] = total
    factor_dense(torsion.small, determined, torsion.small_order)
    solve_dense(
        torsion.small, determined, torsion.small_order, torsion.small_right, torsion.amounts
    )


@compiled
def begin_contact_problem(
    model: Record, discrete: Record, state: Record, work: Record, h: float
) -> None:
    """Computes G and c, including slip velocities divided by a time ``h``."""
    n, torsion = model.num_fingers, work.torsion
    spatial_mobility(model, state, work)
    _add_velocities(model, discrete, state, torsion, 1.0 / h)
    for i in range(n):
        for j in range(n):
            torsion.creep[i, j] = 0.0


@compiled
def _add_velocities(
    model: Record, discrete: Record, state: Record, torsion: Record, share: float
) -> None:
    """Adds a multiple of the velocities of slipping contacts to c."""
    for i in range(model.num_fingers):
        # Velocities at the level of rounding have no direction.
        slips = discrete.phases[i] != STICK and way_speed(model, state, i, 0) > EXACT
        for part in range(NORMAL if slips else 0):
            speed = state.x[velocity_at(model.num_fingers, i, part)]
            torsion.offset[ROWS * i + part] += share * speed


@compiled
def _hold_amounts(torsion: Record, share: float) -> None:
    """Adds a multiple of the penalty that keeps undetermined moments in stick at their values."""
    for mode in range(torsion.num_determined, torsion.num_holders):
        for k in range(torsion.num_holders):
            i, pull = torsion.holders[k], share * FIRM * torsion.modes[k, mode]
            torsion.offset[ROWS * i + TURN] -= pull * torsion.amounts[mode]
            for j in range(torsion.num_holders):
                torsion.creep[i, torsion.holders[j]] += pull * torsion.modes[j, mode]


@compiled_apart(types.void, MODEL, DISCRETE, STATE, WORKSPACE)
def spatial_soft_phases(model: Record, discrete: Record, state: Record, work: Record) -> None:
    """Computes accelerations and contact forces in the present phases and directions ``gamma``."""
    torsion = work.torsion
    prepare_pads(model, state, work)
    work.system.determinant = assemble_phases(model, discrete, work.gamma, work)
    load_phases(model, discrete, state, work)
    solve_phases(torsion, torsion.load, torsion.motion)
    find_modes(model, discrete, work)
    for k in range(torsion.num_holders):
        i = torsion.holders[k]
        torsion.wanted[k] = twist_of(torsion, i, torsion.motion) + spin_rest(model, work, i)
    set_creep(model, state, work)
    _take_phases(model, discrete, work)
    if contacts_creep(torsion) and relieve(model, work):
        solve_phases(torsion, torsion.load, torsion.motion)
        _take_phases(model, discrete, work)
    if begins_slip(model, discrete):
        _take_as_start(model, work)
        begin_slips(model, discrete, state, work, INSTANT, True)


@compiled
def _take_phases(model: Record, discrete: Record, work: Record) -> None:
    """Computes accelerations and forces, given the amounts of the undetermined modes."""
    torsion = work.torsion
    _find_moments(torsion)
    _add_moments(torsion)
    for k in range(6):
        work.acceleration[k] = torsion.motion[k]
    for i in range(model.num_fingers):
        if discrete.phases[i] == STICK:
            creeps = creeps_in_stick(model, discrete, torsion, i)
            take_stick(model, work, i, _moment_of(torsion, i), creeps)
        else:
            take_slip(model, work, i)


@compiled
def _add_moments(torsion: Record) -> None:
    """Adds the effect of the moments in stick to the motion of the object."""
    for j in range(torsion.num_holders):
        for k in range(6):
            torsion.motion[k] += torsion.held[j] * torsion.moves[j, k]


@compiled
def _moment_of(torsion: Record, i: int) -> float:
    """F_tau / e of a sticking contact [N]."""
    for k in range(torsion.num_holders):
        if torsion.holders[k] == i:
            return torsion.held[k]
    return 0.0


@compiled
def _take_as_start(model: Record, work: Record) -> None:
    """Sets the initial forces of Newton's method."""
    for i in range(model.num_fingers):
        first, torsion = ROWS * i, work.torsion
        torsion.force[first], torsion.force[first + 1] = work.forces[i, 0], work.forces[i, 1]
        torsion.force[first + TURN] = work.moments[i]
        torsion.force[first + NORMAL] = work.forces[i, 2]


@compiled
def begins_slip(model: Record, discrete: Record) -> bool:
    """True if a contact of a hand with soft fingertips is at slip onset."""
    if model.soft == 0:
        return False
    for i in range(model.num_fingers):
        if discrete.frozen[i, 0] == 1:
            return True
    return False


@compiled
def begin_slips(
    model: Record, discrete: Record, state: Record, work: Record, h: float, at_once: bool
) -> bool:
    """Computes friction at slip onset that opposes the velocity after ``h``; False on failure.

    Args:
        model: Constants of the run.
        discrete: Phases.
        state: State, with the velocities.
        work: Moments in stick in the present phases, and initial forces of Newton's method; slip
            directions are set opposite to the forces, shorter than 1 for contacts at rest.
        h: Short time [s].
        at_once: True if friction of slips in progress opposes their present velocities.
    """
    n, torsion = model.num_fingers, work.torsion
    for i in range(n):
        goes_on = at_once and discrete.frozen[i, 0] == 0
        torsion.kinds[i] = MOVING if goes_on else FREE
        if discrete.phases[i] == STICK:
            torsion.kinds[i] = STUCK
        torsion.bounds[i] = model.truth.friction[i]
        for part in range(NORMAL):
            torsion.slides[i, part] = work.gamma[i, part]
    begin_contact_problem(model, discrete, state, work, h)
    _hold_amounts(torsion, 1.0)
    solved = spatial_soft_newton(model, torsion) == 1
    _hold_amounts(torsion, -1.0)
    _add_velocities(model, discrete, state, torsion, -1.0 / h)
    if not solved:
        return False
    for i in range(n):
        if torsion.kinds[i] == FREE:
            _point(work, i)
        elif torsion.kinds[i] == MOVING:
            _put_on_surface(model, work, i)
    take_forces(model, discrete, work)
    for i in range(n):
        if torsion.kinds[i] == FREE:
            _hold_at_rest(model, state, work, i, h)
    return True


@compiled
def _point(work: Record, i: int) -> None:
    """Sets the direction that the friction of contact ``i`` opposes."""
    torsion, first = work.torsion, ROWS * i
    bound, opening = torsion.bounds[i] * torsion.force[first + NORMAL], torsion.opening
    if bound > 0.0:
        for part in range(NORMAL):
            work.gamma[i, part] = -torsion.force[first + part] / bound
        return
    # Without friction, the slip follows its acceleration.
    size = size_with_spin(opening[first], opening[first + 1], opening[first + 2])
    for part in range(NORMAL if size > 0.0 else 0):
        work.gamma[i, part] = opening[first + part] / size


@compiled
def is_short(directions: Floats, i: int) -> bool:
    """True if the friction of contact ``i`` at slip onset is below its bound, so that it rests."""
    x, y, z = directions[i, 0], directions[i, 1], directions[i, 2]
    return x * x + y * y + z * z < 1.0 - AT_REST


@compiled
def mark_resting(model: Record, discrete: Record, directions: Floats) -> bool:
    """Marks contacts that are at slip onset and at rest; True if there are any.

    Until they stick, their friction remains on its bound, opposite to their last direction.

    Args:
        model: Constants of the run.
        discrete: Phases.
        directions: Directions that friction opposes, shorter than 1 for contacts at rest.
    """
    found = False
    for i in range(model.num_fingers):
        if discrete.frozen[i, 0] == 1 and is_short(directions, i):
            discrete.frozen[i, 0] = RESTS
            found = True
    return found


@compiled
def let_marked_stick(model: Record, discrete: Record, state: Record) -> None:
    """Sets the marked contacts to stick."""
    for i in range(model.num_fingers):
        if discrete.frozen[i, 0] == RESTS:
            discrete.frozen[i, 0] = 0
            for axis in range(2):
                discrete.slips[i, axis] = 0.0
                state.x[slip_velocity_at(model.num_fingers, i, axis)] = 0.0
            for part in range(NORMAL):
                discrete.directions[i, part] = 0.0
            name_phase(model, discrete, i)


@compiled
def _hold_at_rest(model: Record, state: Record, work: Record, i: int, h: float) -> None:
    """Sets the acceleration of contact ``i`` that stops it after ``h``, exact, if it rests then."""
    n = model.num_fingers
    if is_short(work.gamma, i):
        for axis in range(2):
            work.slip_acceleration[i, axis] = -state.x[velocity_at(n, i, axis)] / h
        work.spin_acceleration[i] = -state.x[velocity_at(n, i, 2)] / h


@compiled
def _opening(n: int, torsion: Record, a: int) -> float:
    """Component ``a`` of G F + c."""
    total = torsion.offset[a]
    for b in range(ROWS * n):
        total += torsion.mobility[a, b] * torsion.force[b]
    return total


@compiled
def _put_on_surface(model: Record, work: Record, i: int) -> None:
    """Sets the friction of slipping contact ``i`` exactly on its limit surface."""
    torsion, first = work.torsion, ROWS * i
    normal = model.truth.friction[i] * torsion.force[first + NORMAL]
    for row in range(NORMAL):
        torsion.force[first + row] = -work.gamma[i, row] * normal
    if model.hand.eccentricities[i] == 0.0:
        torsion.force[first + TURN] = 0.0


@compiled
def creeps_in_stick(model: Record, discrete: Record, torsion: Record, i: int) -> bool:
    """True if sticking contact ``i`` may turn because moments are undetermined."""
    return contacts_creep(torsion) and _holds_turn(model, discrete, i)


@compiled
def take_forces(model: Record, discrete: Record, work: Record) -> None:
    """Writes forces and accelerations of the solution; sticking contacts do not accelerate."""
    n, torsion = model.num_fingers, work.torsion
    for k in range(6):
        work.acceleration[k] = torsion.fall[k]
    for i in range(n):
        first = ROWS * i
        for row in range(ROWS):
            force = torsion.force[first + row]
            for k in range(6):
                work.acceleration[k] += force * torsion.responses[first + row, k]
        work.forces[i, 0], work.forces[i, 1] = torsion.force[first], torsion.force[first + 1]
        work.forces[i, 2], work.moments[i] = torsion.force[first + NORMAL], torsion.force[first + 2]
        slips = discrete.phases[i] != STICK
        for axis in range(2):
            work.slip_acceleration[i, axis] = _opening(n, torsion, first + axis) if slips else 0.0
        turns = slips or creeps_in_stick(model, discrete, torsion, i)
        work.spin_acceleration[i] = _opening(n, torsion, first + TURN) if turns else 0.0


@compiled_apart(types.int64, MODEL, DISCRETE, STATE, WORKSPACE)
def spatial_keep_stick(model: Record, discrete: Record, state: Record, work: Record) -> int:
    """Stops the spin of sticking contacts by an impulse, and updates the spin of the others.

    Otherwise psi' would drift in stick, where only psi'' = 0 is imposed, and would not be zero at
    the end of a slip, where only its state is set to 0.

    Args:
        model: Constants of the run.
        discrete: Phases.
        state: State; its velocities are changed.
        work: Kinematics and mobility of this state.

    Returns:
        1 if a velocity has changed, else 0.
    """
    n, x, torsion, changed = model.num_fingers, state.x, work.torsion, 0
    largest = 0.0
    for i in range(n):
        if _holds_turn(model, discrete, i):
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
    return changed


@compiled
def _stop_spins(model: Record, discrete: Record, state: Record, work: Record) -> None:
    """Applies the impulse at sticking contacts and all normals that stops the determined modes.

    Their energy is dissipated by friction.
    """
    n, x, torsion, work_done = model.num_fingers, state.x, work.torsion, 0.0
    assemble_phases(model, discrete, torsion.no_slide, work)
    find_modes(model, discrete, work)
    for k in range(torsion.num_holders):
        torsion.wanted[k] = spin_of(model, state, work, torsion.holders[k])
        torsion.amounts[k] = 0.0
    _find_moments(torsion)
    for k in range(6):
        torsion.motion[k] = 0.0
    _add_moments(torsion)
    for k in range(torsion.num_holders):
        turned = twist_of(torsion, torsion.holders[k], torsion.motion)
        work_done += torsion.held[k] * (torsion.wanted[k] + 0.5 * turned)
    x[dissipated_at(model)] += max(0.0, -work_done)
    for k in range(6):
        x[VELOCITY + k] += torsion.motion[k]
    for i in range(n):
        if discrete.phases[i] == STICK:
            continue
        _, dx, dy, dz = slip_forces(work, torsion.motion, i, 0.0, 0.0, 0.0)
        for axis in range(2):
            x[slip_velocity_at(n, i, axis)] += along_tangent(work.kin, i, axis, dx, dy, dz)


@compiled
def respond_to_tip_force(model: Record, discrete: Record, work: Record, i: int, axis: int) -> None:
    """Computes the change of the accelerations per tip force of finger ``i``, in ``responding``.

    ``work`` must contain the factored equations of the present phases, and the modes.
    """
    n, torsion = model.num_fingers, work.torsion
    x, y, z = (1.0 if axis == 0 else 0.0), (1.0 if axis == 1 else 0.0), (1.0 if axis == 2 else 0.0)
    for k in range(6):
        torsion.load[k] = 0.0
    if discrete.phases[i] == STICK:
        pull_object(work, i, x, y, z)
    else:
        x, y, z = times(torsion.tip_mobilities[i], x, y, z)
        press_object(work, i, along_normal(work.kin, i, x, y, z) / torsion.gives[i])
    solve_phases(torsion, torsion.load, torsion.motion)
    for k in range(torsion.num_holders):
        torsion.wanted[k] = twist_of(torsion, torsion.holders[k], torsion.motion)
        torsion.amounts[k] = 0.0
    _find_moments(torsion)
    _add_moments(torsion)
    for k in range(6):
        torsion.responding[k] = torsion.motion[k]
    for j in range(n):
        slips, own = discrete.phases[j] != STICK, 1.0 if i == j else 0.0
        dx = dy = dz = 0.0
        if slips:
            _, dx, dy, dz = slip_forces(work, torsion.motion, j, own * x, own * y, own * z)
        for tangent in range(2):
            moved = along_tangent(work.kin, j, tangent, dx, dy, dz)
            torsion.responding[6 + 2 * j + tangent] = moved
