"""Plant with soft fingertips: moments in stick, and onset of slips.

The equations are those of `slipgrasp.core.kernel.spatial.torsion_phases` and, at slip onset, of
`slipgrasp.core.kernel.spatial.torsion_equations`. Velocities in stick are kept exact.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.state import (
    STATE,
    slip_coordinate,
    velocity_at,
)
from slipgrasp.core.kernel.spatial.torsion_contacts import spatial_soft_newton
from slipgrasp.core.kernel.spatial.torsion_directions import LEAVES, is_short, take_directions
from slipgrasp.core.kernel.spatial.torsion_equations import move_tip, spatial_mobility
from slipgrasp.core.kernel.spatial.torsion_layout import FREE, MOVING, NORMAL, ROWS, STUCK, TURN
from slipgrasp.core.kernel.spatial.torsion_modes import (
    add_moments,
    contacts_creep,
    creeps_in_stick,
    find_moments,
    spatial_find_modes,
)
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
    twist_of,
)
from slipgrasp.core.kernel.spatial.torsion_split import set_creep, spatial_relieve
from slipgrasp.core.kernel.spatial.ways import size_with_spin, way_speed
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, STICK, WORKSPACE

FIRM = 1e3  # penalty that holds given moments in the contact problem [1/kg]
INSTANT = 1e-9  # time after which friction at slip onset opposes the velocity [s]
LEAST_LEFT = 0.1  # least fraction of a slip that impulses leave
EXACT = 1e-14  # spin velocity times e that counts as zero [m/s]


@compiled
def begin_contact_problem(
    model: Record, discrete: Record, state: Record, work: Record, h: float
) -> None:
    """Computes G and c, including slip velocities divided by their time in a step of size ``h``."""
    n, torsion = model.num_fingers, work.torsion
    spatial_mobility(model, state, work)
    _add_velocities(model, discrete, state, torsion, h, 1.0)
    for i in range(n):
        for j in range(n):
            torsion.creep[i, j] = 0.0


@compiled
def _add_velocities(
    model: Record, discrete: Record, state: Record, torsion: Record, h: float, sign: float
) -> None:
    """Adds the velocities of slipping contacts over their time to c, or subtracts them."""
    for i in range(model.num_fingers):
        share = sign / time_of_slip(discrete, i, h)
        x, y, z = slide_velocity(model, discrete, state, i)
        # Velocities at the level of rounding have no direction.
        if discrete.phases[i] != STICK and size_with_spin(x, y, z) > EXACT:
            first = ROWS * i
            torsion.offset[first] += share * x
            torsion.offset[first + 1] += share * y
            torsion.offset[first + TURN] += share * z


@compiled
def time_of_slip(discrete: Record, i: int, h: float) -> float:
    """Time after which the friction of contact ``i`` opposes its velocity, in a step of size ``h``.

    At slip onset it is an instant longer than the step, however short this is.
    """
    return h if h > 0.0 and discrete.frozen[i, 0] == 0 else h + INSTANT


@compiled
def slide_velocity(
    model: Record, discrete: Record, state: Record, i: int
) -> tuple[float, float, float]:
    """(s_x', s_y', e psi') of contact ``i``, at slip onset without the part due to creep."""
    n, share = model.num_fingers, 0.0 if discrete.frozen[i, 0] == 0 else 1.0
    crept = discrete.crept[i]
    return (
        state.x[velocity_at(n, i, 0)] - share * crept[0],
        state.x[velocity_at(n, i, 1)] - share * crept[1],
        state.x[velocity_at(n, i, 2)] - share * crept[2],
    )


@compiled
def add_crept(model: Record, discrete: Record, state: Record, share: float) -> None:
    """Adds a multiple of the velocities of contacts at slip onset to ``crept``."""
    for i in range(model.num_fingers):
        for part in range(NORMAL if discrete.frozen[i, 0] == 1 else 0):
            speed = state.x[velocity_at(model.num_fingers, i, part)]
            discrete.crept[i, part] += share * speed


@compiled
def forget_crept(model: Record, discrete: Record, state: Record) -> None:
    """Clears ``crept`` of slips that impulses would stop again and again."""
    for i in range(model.num_fingers):
        x, y, z = slide_velocity(model, discrete, state, i)
        if way_speed(model, state, i, 0) < LEAST_LEFT * size_with_spin(x, y, z):
            for part in range(NORMAL):
                discrete.crept[i, part] = 0.0


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
    """Computes accelerations and contact forces in the current phases and directions ``gamma``."""
    torsion = work.torsion
    prepare_pads(model, state, work)
    work.system.determinant = assemble_phases(model, discrete, work.gamma, work)
    load_phases(model, discrete, state, work)
    solve_phases(torsion, torsion.load, torsion.motion)
    spatial_find_modes(model, discrete, work)
    for k in range(torsion.num_holders):
        i = torsion.holders[k]
        torsion.wanted[k] = twist_of(torsion, i, torsion.motion) + spin_rest(model, work, i)
    set_creep(model, state, work)
    for is_relieved in range(2):
        _take_phases(model, discrete, work)
        needs_none = is_relieved == 1 or not contacts_creep(torsion)
        if needs_none or spatial_relieve(model, state, work) == 0:
            return
        solve_phases(torsion, torsion.load, torsion.motion)


@compiled
def _take_phases(model: Record, discrete: Record, work: Record) -> None:
    """Computes accelerations and forces, given the amounts of the undetermined modes."""
    torsion = work.torsion
    find_moments(torsion)
    add_moments(torsion)
    for k in range(6):
        work.acceleration[k] = torsion.motion[k]
    for i in range(model.num_fingers):
        if discrete.phases[i] == STICK:
            creeps = creeps_in_stick(model, discrete, torsion, i)
            take_stick(model, work, i, _moment_of(torsion, i), creeps)
        else:
            take_slip(model, work, i)


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


@compiled_apart(types.int64, MODEL, DISCRETE, STATE, WORKSPACE, types.float64, types.int64)
def spatial_begin_slips(
    model: Record, discrete: Record, state: Record, work: Record, h: float, at_once: int
) -> int:
    """Computes friction at slip onset that opposes the velocity after ``h``; 0 on failure.

    Args:
        model: Constants of the run.
        discrete: Phases.
        state: State, with the velocities.
        work: Moments in stick in the current phases, and initial forces of Newton's method; slip
            directions are set opposite to the forces, shorter than 1 for contacts at rest.
        h: Short time [s].
        at_once: 1 if friction of slips in progress opposes their present velocities.
    """
    n, torsion = model.num_fingers, work.torsion
    for i in range(n):
        begins = discrete.frozen[i, 0] == 1 or discrete.frozen[i, 0] == LEAVES
        torsion.kinds[i] = FREE if begins or at_once == 0 else MOVING
        if discrete.phases[i] == STICK:
            torsion.kinds[i] = STUCK
        torsion.bounds[i] = model.truth.friction[i]
        for part in range(NORMAL):
            torsion.slides[i, part] = work.gamma[i, part]
    _take_as_start(model, work)
    begin_contact_problem(model, discrete, state, work, h)
    _hold_amounts(torsion, 1.0)
    solved = spatial_soft_newton(model, torsion) == 1
    _hold_amounts(torsion, -1.0)
    _add_velocities(model, discrete, state, torsion, h, -1.0)
    if not solved:
        return 0
    for i in range(n):
        if torsion.kinds[i] == FREE:
            _point(work, i)
        elif torsion.kinds[i] == MOVING:
            _put_on_surface(model, work, i)
    take_forces(model, discrete, work)
    for i in range(n):
        if torsion.kinds[i] == FREE:
            _hold_at_rest(model, discrete, state, work, i, time_of_slip(discrete, i, h))
    return 1


@compiled_apart(types.void, MODEL, DISCRETE, STATE, WORKSPACE)
def spatial_begin_at_once(model: Record, discrete: Record, state: Record, work: Record) -> None:
    """Sets the directions of contacts at slip onset to those of their velocities an instant later.

    Args:
        model: Constants of the run.
        discrete: Phases; the directions are changed.
        state: State, with the velocities.
        work: Values in the current phases; afterwards in the new directions.
    """
    found = begins_slip(model, discrete)
    for i in range(model.num_fingers):
        for part in range(NORMAL if discrete.frozen[i, 0] == LEAVES else 0):
            discrete.crept[i, part] = state.x[velocity_at(model.num_fingers, i, part)]
            found = True
    if not found or spatial_begin_slips(model, discrete, state, work, 0.0, 1) == 0:
        return
    if _forget_crept_at_rest(model, discrete, work):
        spatial_begin_slips(model, discrete, state, work, 0.0, 1)
    take_directions(model, work.gamma, discrete)
    for i in range(model.num_fingers):
        # The next step determines whether it rests.
        leaves = discrete.frozen[i, 0] == LEAVES and not is_short(work.gamma, i)
        for part in range(NORMAL if leaves else 0):
            discrete.directions[i, part] = work.gamma[i, part]


@compiled
def _forget_crept_at_rest(model: Record, discrete: Record, work: Record) -> bool:
    """Clears ``crept`` of contacts that would begin to slip and rest at once; True if any.

    They would stick, creep too fast for their friction, and begin again.
    """
    found = False
    for i in range(model.num_fingers):
        crept = discrete.crept[i]
        rests = discrete.frozen[i, 0] == LEAVES and is_short(work.gamma, i)
        if rests and size_with_spin(crept[0], crept[1], crept[2]) > EXACT:
            found = True
            for part in range(NORMAL):
                crept[part] = 0.0
    return found


@compiled
def _point(work: Record, i: int) -> None:
    """Sets the direction that the friction of contact ``i`` opposes."""
    torsion, first = work.torsion, ROWS * i
    bound, opening = torsion.bounds[i] * torsion.force[first + NORMAL], torsion.opening
    if bound > 0.0:
        for part in range(NORMAL):
            work.gamma[i, part] = -torsion.force[first + part] / bound
        x, y, z = work.gamma[i, 0], work.gamma[i, 1], work.gamma[i, 2]
        size = 1.0 if is_short(work.gamma, i) else size_with_spin(x, y, z)
        for part in range(NORMAL):
            work.gamma[i, part] /= size
        return
    # Without friction, the slip follows its acceleration.
    size = size_with_spin(opening[first], opening[first + 1], opening[first + 2])
    for part in range(NORMAL if size > 0.0 else 0):
        work.gamma[i, part] = opening[first + part] / size


@compiled
def _hold_at_rest(
    model: Record, discrete: Record, state: Record, work: Record, i: int, h: float
) -> None:
    """Sets the acceleration of contact ``i`` that stops it after ``h``, exact, if it rests then."""
    if is_short(work.gamma, i):
        x, y, z = slide_velocity(model, discrete, state, i)
        work.slip_acceleration[i, 0], work.slip_acceleration[i, 1] = -x / h, -y / h
        work.spin_acceleration[i] = -z / h


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


@compiled
def respond_to_tip_force(model: Record, discrete: Record, work: Record, i: int, axis: int) -> None:
    """Computes the change of the accelerations per tip force of finger ``i``, in ``responding``.

    ``work`` must contain the factored equations of the current phases, and the modes.
    """
    n, torsion = model.num_fingers, work.torsion
    x, y, z = (1.0 if axis == 0 else 0.0), (1.0 if axis == 1 else 0.0), (1.0 if axis == 2 else 0.0)
    for k in range(6):
        torsion.load[k] = 0.0
    if discrete.phases[i] == STICK:
        pull_object(work, i, x, y, z)
    else:
        x, y, z = move_tip(model, work, i, x, y, z)
        press_object(work, i, along_normal(work.kin, i, x, y, z) / torsion.gives[i])
    solve_phases(torsion, torsion.load, torsion.motion)
    for k in range(torsion.num_holders):
        torsion.wanted[k] = twist_of(torsion, torsion.holders[k], torsion.motion)
        torsion.amounts[k] = 0.0
    find_moments(torsion)
    add_moments(torsion)
    for k in range(6):
        torsion.responding[k] = torsion.motion[k]
    for j in range(n):
        slips, own = discrete.phases[j] != STICK, 1.0 if i == j else 0.0
        dx = dy = dz = 0.0
        if slips:
            _, dx, dy, dz = slip_forces(work, torsion.motion, j, own * x, own * y, own * z)
        for tangent in range(2):
            moved = along_tangent(work.kin, j, tangent, dx, dy, dz)
            torsion.responding[slip_coordinate(j, tangent)] = moved
