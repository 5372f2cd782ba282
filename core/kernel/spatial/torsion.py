"""The plant where fingertips are soft: which contacts turn, and with which moments.

It solves the equations of `slipgrasp.core.kernel.spatial.torsion_equations` for the phases of the
contacts, keeps stick exact, and begins slips.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.numerics.dense import diagonalise, factor_dense, solve_dense
from slipgrasp.core.kernel.spatial.contact_problem import inverse_of, times
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.state import (
    STATE,
    VELOCITY,
    slip_velocity_at,
    spin_velocity_at,
    velocity_at,
)
from slipgrasp.core.kernel.spatial.torsion_contacts import spatial_soft_newton
from slipgrasp.core.kernel.spatial.torsion_equations import spatial_mobility, spin_of
from slipgrasp.core.kernel.spatial.torsion_layout import FREE, NORMAL, ROWS, STUCK, TURN
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, SLIP, STICK, WORKSPACE

UNDETERMINED = 1e-3  # share of the mobility of one turn, below which moments are not determined
CREEP = 3e-8  # of spins that no determined moment stops, times e, per F_tau / e [m/(N s)]
ONSET = 1e-6  # after which what begins to slip has the velocity that its friction is against [s]
AT_REST = 1e-9  # share of its bound by which the friction of a contact at rest is less
EXACT = 1e-14  # a spin velocity times e that counts as none [m/s]


@compiled
def _holds_turn(model: Record, discrete: Record, i: int) -> bool:
    """Whether contact ``i`` sticks and resists turning."""
    return discrete.phases[i] == STICK and model.hand.eccentricities[i] > 0.0


@compiled
def factor_phases(model: Record, discrete: Record, gamma: Floats, torsion: Record) -> float:
    """Factors the equations of the present phases in which the moments of stick are given.

    Args:
        model: Constants of the run.
        discrete: Phases.
        gamma: Directions of slip; without them what slips has no friction.
        torsion: With G.

    Returns:
        Their determinant over that of the diagonal, positive while regular.
    """
    n, size, scale = model.num_fingers, ROWS * model.num_fingers, 1.0
    for i in range(n):
        first = ROWS * i
        for row in range(ROWS):
            a = first + row
            is_given = row == TURN or (row < NORMAL and discrete.phases[i] != STICK)
            for b in range(size):
                torsion.matrix[a, b] = 0.0 if is_given else torsion.mobility[a, b]
            if is_given:
                torsion.matrix[a, a] = 1.0
            if row < NORMAL and discrete.phases[i] != STICK:
                slope = model.truth.friction[i] * gamma[i, row]
                has_part = torsion.mobility[a, a] > 0.0
                torsion.matrix[a, first + NORMAL] = slope if has_part else 0.0
            scale *= torsion.matrix[a, a]
    return factor_dense(torsion.matrix, size, torsion.order) / scale


@compiled
def find_modes(model: Record, discrete: Record, torsion: Record) -> None:
    """The moments of stick by their mobility, and how all forces follow from them.

    Where contacts hold the object against the turning of their fingers alone, as two opposed ones
    do, some moments move nothing: they are undetermined, and come last.
    """
    n, count = model.num_fingers, 0
    for i in range(n):
        if not _holds_turn(model, discrete, i):
            continue
        for a in range(ROWS * n):
            torsion.right[a] = 0.0
        torsion.right[ROWS * i + TURN] = 1.0
        solve_dense(torsion.matrix, ROWS * n, torsion.order, torsion.right, torsion.follows[count])
        torsion.holders[count] = i
        count += 1
    torsion.num_holders = count
    for k in range(count):
        for j in range(count):
            torsion.turns[k, j] = _row_times(n, torsion, torsion.holders[k], torsion.follows[j])
    for k in range(count):
        for j in range(count):
            torsion.symmetric[k, j] = 0.5 * (torsion.turns[k, j] + torsion.turns[j, k])
            torsion.modes[k, j] = 1.0 if k == j else 0.0
    diagonalise(torsion.symmetric, torsion.modes, count)
    _put_determined_first(torsion, count)


@compiled
def _row_times(n: int, torsion: Record, i: int, force: Floats) -> float:
    """The turn row of G of contact ``i`` times all forces."""
    total, a = 0.0, ROWS * i + TURN
    for b in range(ROWS * n):
        total += torsion.mobility[a, b] * force[b]
    return total


@compiled
def _put_determined_first(torsion: Record, count: int) -> None:
    """Sorts the modes, with their mobilities on the diagonal of ``symmetric``."""
    largest, determined = 0.0, 0
    for k in range(count):
        a = ROWS * torsion.holders[k] + TURN
        largest = max(largest, torsion.mobility[a, a])
    for k in range(count):
        if not torsion.symmetric[k, k] > UNDETERMINED * largest:
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
    """Moments of stick, in ``held``, with w = -``wanted`` in the determined modes.

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
    for k in range(count):
        for mode in range(determined):
            torsion.held[k] += torsion.modes[k, mode] * torsion.amounts[mode]


@compiled
def _set_creep(model: Record, state: Record, work: Record) -> None:
    """Moments of the undetermined modes: against what there is of their spin."""
    torsion = work.torsion
    for mode in range(torsion.num_determined, torsion.num_holders):
        spin = 0.0
        for k in range(torsion.num_holders):
            i = torsion.holders[k]
            spin += torsion.modes[k, mode] * spin_of(model, state, work, i)
        torsion.amounts[mode] = -spin / CREEP


@compiled
def begin_contact_problem(model: Record, state: Record, torsion: Record, h: float) -> None:
    """Takes the velocities over a time ``h`` and the creep of the present modes into G and c."""
    n = model.num_fingers
    add_velocities(n, state, torsion, 1.0 / h)
    for i in range(n):
        for j in range(n):
            torsion.creep[i, j] = 0.0
    for mode in range(torsion.num_determined, torsion.num_holders):
        for k in range(torsion.num_holders):
            for j in range(torsion.num_holders):
                both = torsion.modes[k, mode] * torsion.modes[j, mode]
                torsion.creep[torsion.holders[k], torsion.holders[j]] += CREEP / h * both


@compiled
def add_velocities(n: int, state: Record, torsion: Record, share: float) -> None:
    """Adds a multiple of the velocities of slip and spin to c."""
    for i in range(n):
        for part in range(NORMAL):
            speed = state.x[velocity_at(n, i, part)]
            torsion.offset[ROWS * i + part] += share * speed


@compiled_apart(types.void, MODEL, DISCRETE, STATE, WORKSPACE)
def spatial_soft_phases(model: Record, discrete: Record, state: Record, work: Record) -> None:
    """Accelerations and contact forces in the present phases, with directions in ``gamma``."""
    n, torsion, size = model.num_fingers, work.torsion, ROWS * model.num_fingers
    spatial_mobility(model, state, work)
    work.system.determinant = factor_phases(model, discrete, work.gamma, torsion)
    find_modes(model, discrete, torsion)
    for i in range(n):
        for row in range(ROWS):
            at_rest = row == NORMAL or (row != TURN and discrete.phases[i] == STICK)
            a = ROWS * i + row
            torsion.right[a] = -torsion.offset[a] if at_rest else 0.0
    solve_dense(torsion.matrix, size, torsion.order, torsion.right, torsion.force)
    for k in range(torsion.num_holders):
        i = torsion.holders[k]
        torsion.wanted[k] = torsion.offset[ROWS * i + TURN] + _row_times(
            n, torsion, i, torsion.force
        )
    _set_creep(model, state, work)
    _find_moments(torsion)
    for k in range(torsion.num_holders):
        for a in range(size):
            torsion.force[a] += torsion.held[k] * torsion.follows[k, a]
    for i in range(n):
        if discrete.phases[i] != STICK:
            _put_on_surface(model, work, i)
    if not begins_slip(model, discrete) or not begin_slips(model, discrete, state, work, ONSET):
        take_forces(model, discrete, work)


@compiled
def begins_slip(model: Record, discrete: Record) -> bool:
    """Whether a contact of a hand with soft fingertips has just begun to slip."""
    if model.soft == 0:
        return False
    for i in range(model.num_fingers):
        if discrete.frozen[i, 0] == 1:
            return True
    return False


@compiled
def begin_slips(model: Record, discrete: Record, state: Record, work: Record, h: float) -> bool:
    """Forces while slips begin, against the velocities after a time ``h``; False if there are none.

    Args:
        model: Constants of the run.
        discrete: Phases.
        state: With velocities.
        work: With G and c, and the forces from which Newton's method starts; directions of slip
            become those against which the forces are, shorter than 1 where a contact rests.
        h: Short time [s].
    """
    n, torsion = model.num_fingers, work.torsion
    for i in range(n):
        torsion.kinds[i] = STUCK if discrete.phases[i] == STICK else FREE
        torsion.bounds[i] = model.truth.friction[i]
    _find_modes_of_all(model, discrete, work)
    begin_contact_problem(model, state, torsion, h)
    solved = spatial_soft_newton(model, discrete, torsion) == 1
    add_velocities(n, state, torsion, -1.0 / h)
    if not solved:
        return False
    take_forces(model, discrete, work)
    for i in range(n):
        if discrete.phases[i] != STICK:
            _point(model, state, work, i, h)
    return True


@compiled
def _find_modes_of_all(model: Record, discrete: Record, work: Record) -> None:
    """The modes of stick of all contacts that stick or have just begun to slip."""
    for i in range(model.num_fingers):
        if discrete.frozen[i, 0] == 1:
            discrete.phases[i] = STICK
    factor_phases(model, discrete, work.gamma, work.torsion)
    find_modes(model, discrete, work.torsion)
    for i in range(model.num_fingers):
        if discrete.frozen[i, 0] == 1:
            discrete.phases[i] = SLIP


@compiled
def _point(model: Record, state: Record, work: Record, i: int, h: float) -> None:
    """The direction that the friction of contact ``i`` is against."""
    n, torsion, first, size = model.num_fingers, work.torsion, ROWS * i, 0.0
    bound = torsion.bounds[i] * torsion.force[first + NORMAL]
    for part in range(NORMAL):
        work.gamma[i, part] = -torsion.force[first + part] / bound
        size += work.gamma[i, part] * work.gamma[i, part]
    if size < 1.0 - AT_REST:
        # To rounding it has this acceleration.
        for axis in range(2):
            work.slip_acceleration[i, axis] = -state.x[velocity_at(n, i, axis)] / h
        work.spin_acceleration[i] = -state.x[velocity_at(n, i, 2)] / h


@compiled
def _opening(n: int, torsion: Record, a: int) -> float:
    """Row ``a`` of G F + c."""
    total = torsion.offset[a]
    for b in range(ROWS * n):
        total += torsion.mobility[a, b] * torsion.force[b]
    return total


@compiled
def _put_on_surface(model: Record, work: Record, i: int) -> None:
    """The friction of contact ``i``, which slips, to rounding."""
    torsion, first = work.torsion, ROWS * i
    normal = model.truth.friction[i] * torsion.force[first + NORMAL]
    for row in range(NORMAL):
        torsion.force[first + row] = -work.gamma[i, row] * normal
    if model.hand.eccentricities[i] == 0.0:
        torsion.force[first + TURN] = 0.0


@compiled
def contacts_creep(torsion: Record) -> bool:
    """Whether some of the moments for which modes were found last are undetermined."""
    return torsion.num_determined < torsion.num_holders


@compiled
def creeps_in_stick(model: Record, discrete: Record, torsion: Record, i: int) -> bool:
    """Whether contact ``i``, which sticks, may turn since its moment is undetermined."""
    return contacts_creep(torsion) and _holds_turn(model, discrete, i)


@compiled
def take_forces(model: Record, discrete: Record, work: Record) -> None:
    """Forces and accelerations of the solution; what sticks does not accelerate."""
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
    """Stops the spin of contacts that stick by an impulse, and updates the spin of the others.

    In stick psi' = 0 is kept by psi'' = 0 alone, and where a slip ends only its state is set to 0.

    Args:
        model: Constants of the run.
        discrete: Phases.
        state: Its velocities change.
        work: With kinematics and mobility of this state.

    Returns:
        1 where a velocity has changed.
    """
    n, x, torsion, changed = model.num_fingers, state.x, work.torsion, 0
    largest = 0.0
    for i in range(n):
        if _holds_turn(model, discrete, i):
            largest = max(largest, abs(spin_of(model, state, work, i)))
    torsion.num_holders = torsion.num_determined = 0
    if largest > EXACT:
        _stop_spins(model, discrete, state, work)
        changed = 1
    for i in range(n):
        turns = discrete.phases[i] != STICK or creeps_in_stick(model, discrete, torsion, i)
        spin, at = spin_of(model, state, work, i) if turns else 0.0, spin_velocity_at(n, i)
        if x[at] != spin:
            x[at], changed = spin, 1
    return changed


@compiled
def _stop_spins(model: Record, discrete: Record, state: Record, work: Record) -> None:
    """The impulse on what sticks and all normals after which no determined mode turns."""
    n, x, torsion, size = model.num_fingers, state.x, work.torsion, ROWS * model.num_fingers
    factor_phases(model, discrete, torsion.no_slide, torsion)
    find_modes(model, discrete, torsion)
    for k in range(torsion.num_holders):
        torsion.wanted[k] = spin_of(model, state, work, torsion.holders[k])
        torsion.amounts[k] = 0.0
    _find_moments(torsion)
    for a in range(size):
        torsion.step[a] = 0.0
        for k in range(torsion.num_holders):
            torsion.step[a] += torsion.held[k] * torsion.follows[k, a]
    for a in range(size):
        for k in range(6):
            x[VELOCITY + k] += torsion.step[a] * torsion.responses[a, k]
    for i in range(n):
        if discrete.phases[i] == STICK:
            continue
        for axis in range(2):
            total, a = 0.0, ROWS * i + axis
            for b in range(size):
                total += torsion.mobility[a, b] * torsion.step[b]
            x[slip_velocity_at(n, i, axis)] += total


@compiled
def respond_to_tip_force(model: Record, discrete: Record, work: Record, i: int, axis: int) -> None:
    """What a unit tip force of finger ``i`` changes of the accelerations, in ``responding``.

    ``work`` has the equations of the present phases factored, and the modes.
    """
    n, torsion, size = model.num_fingers, work.torsion, ROWS * model.num_fingers
    unit = (1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0)
    ax, ay, az = times(inverse_of(work.dynamics.inertia[i]), unit[0], unit[1], unit[2])
    for a in range(size):
        torsion.right[a] = torsion.pushed[a] = 0.0
    for row in range(ROWS):
        a, pull = ROWS * i + row, torsion.pulls[ROWS * i + row]
        torsion.pushed[a] = -(pull[0] * ax + pull[1] * ay + pull[2] * az)
        if row == NORMAL or (row != TURN and discrete.phases[i] == STICK):
            torsion.right[a] = -torsion.pushed[a]
    solve_dense(torsion.matrix, size, torsion.order, torsion.right, torsion.step)
    for k in range(torsion.num_holders):
        holder = torsion.holders[k]
        pushed = torsion.pushed[ROWS * holder + TURN]
        torsion.wanted[k] = pushed + _row_times(n, torsion, holder, torsion.step)
        torsion.amounts[k] = 0.0
    _find_moments(torsion)
    for k in range(torsion.num_holders):
        for a in range(size):
            torsion.step[a] += torsion.held[k] * torsion.follows[k, a]
    for k in range(6):
        torsion.responding[k] = 0.0
        for a in range(size):
            torsion.responding[k] += torsion.step[a] * torsion.responses[a, k]
    for k in range(2 * n):
        a = ROWS * (k // 2) + k % 2
        total = torsion.pushed[a]
        for b in range(size):
            total += torsion.mobility[a, b] * torsion.step[b]
        slips = discrete.phases[k // 2] != STICK
        torsion.responding[6 + k] = total if slips else 0.0
