"""Opening contacts: no force and an accelerating gap (docs/model.md, Phase selection)."""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.planar.flow import (
    forget_mechanics,
    solve_plant,
    update_command,
    update_mechanics,
)
from slipgrasp.core.kernel.planar.kinematics import to_contact_frame
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.reduced import tip_acceleration, torques_to_forces
from slipgrasp.core.kernel.planar.selection import REST_SPEED, SELECTION_ROOM, distance_inside
from slipgrasp.core.kernel.planar.state import STATE, count_coordinates, slip_velocity_at
from slipgrasp.core.kernel.planar.workspace import DISCRETE, WORKSPACE

GAP_ROUNDING = 1e-9  # relative to the largest acceleration, at least 1 m/s^2


@compiled_apart(
    types.int64, MODEL, DISCRETE, types.float64, STATE, types.int64, WORKSPACE, SELECTION_ROOM
)
def find_opening(
    model: Record,
    discrete: Record,
    t: float,
    state: Record,
    instant: int,
    work: Record,
    room: Record,
) -> int:
    """Finds consistent phases with as few opening contacts as possible.

    An open contact has no force, and the free acceleration of its fingertip does not lead into the
    object; the other contacts stick or slip. Called only if no phases with all contacts closed are
    consistent.

    Args:
        model: Constants of the run.
        discrete: Present true and estimated phases; restored on return.
        t: Time [s].
        state: State.
        instant: 1 if the controller recognises each candidate phase at once; the estimated phase
            of an opening contact does not change.
        work: Workspace; contains the last candidate tested on return.
        room: Intermediate values.

    Returns:
        The first contact that opens, -1 if no such phases are consistent.
    """
    n = model.num_fingers
    combinations = 1
    for i in range(n):
        room.previous[i], room.beliefs[i] = discrete.phases[i], discrete.beliefs[i]
        room.free[i] = 1 if abs(state.x[slip_velocity_at(n, i)]) < REST_SPEED else 0
        combinations *= 4 if room.free[i] == 1 else 2
    found = -1
    for count in range(1, n + 1):
        for code in range(combinations):
            if found < 0 and _open_candidate(discrete, room, n, code, instant) == count:
                _solve_candidate(model, discrete, t, state, work, room)
                if _is_possible(model, discrete, work, room):
                    found = _first_open(room, n)
    for i in range(n):
        discrete.phases[i], discrete.beliefs[i] = room.previous[i], room.beliefs[i]
    return found


@compiled
def _open_candidate(discrete: Record, room: Record, n: int, code: int, instant: int) -> int:
    """Sets candidate number ``code`` and returns its number of open contacts."""
    count = 0
    for i in range(n):
        choices = 4 if room.free[i] == 1 else 2
        digit = code % choices
        code //= choices
        room.open[i] = 1 if digit == choices - 1 else 0
        count += room.open[i]
        discrete.phases[i], discrete.beliefs[i] = room.previous[i], room.beliefs[i]
        if room.open[i] == 1:
            discrete.phases[i] = 0
        elif room.free[i] == 1:
            discrete.phases[i] = -1 if digit == 2 else digit
            if instant == 1:
                discrete.beliefs[i] = discrete.phases[i]
    return count


@compiled
def _first_open(room: Record, n: int) -> int:
    for i in range(n):
        if room.open[i] == 1:
            return i
    return -1


@compiled
def _solve_candidate(
    model: Record, discrete: Record, t: float, state: Record, work: Record, room: Record
) -> None:
    """Solves the plant without the opening fingers, and computes the gap accelerations."""
    n = model.num_fingers
    update_mechanics(model, state, work)
    forget_mechanics(work)
    if model.law.period > 0.0:
        torques_to_forces(work.kin, n, discrete.torques, work.tip_forces)
    else:
        update_command(model, discrete, t, state, work)
    for i in range(n):
        if room.open[i] == 1:
            # Holds the free acceleration of the fingertip until the plant is solved.
            room.gaps[i] = _free_acceleration(work, i)
            for k in range(3):
                work.dynamics.inertia[i, k] = 0.0
            for k in range(2):
                work.dynamics.bias[i, k] = 0.0
                work.tip_forces[i, k] = 0.0
    solve_plant(model, discrete, work)
    for i in range(n):
        if room.open[i] == 1:
            x, y = tip_acceleration(work.kin, i, work.acceleration)
            _, normal = to_contact_frame(work.kin, i, x, y)
            room.gaps[i] = normal - room.gaps[i]


@compiled
def _free_acceleration(work: Record, i: int) -> float:
    """Acceleration of fingertip ``i`` along the inward normal under its torque alone [m/s^2].

    The bias b of Eq. 16 is left out, as in `tip_acceleration`.
    """
    dynamics = work.dynamics
    xx, xy, yy = dynamics.inertia[i, 0], dynamics.inertia[i, 1], dynamics.inertia[i, 2]
    fx = work.tip_forces[i, 0] - dynamics.bias[i, 0]
    fy = work.tip_forces[i, 1] - dynamics.bias[i, 1]
    scale = 1.0 / (xx * yy - xy * xy)
    _, normal = to_contact_frame(
        work.kin, i, scale * (yy * fx - xy * fy), scale * (xx * fy - xy * fx)
    )
    return normal


@compiled
def _is_possible(model: Record, discrete: Record, work: Record, room: Record) -> bool:
    """True if the solved candidate is consistent with its phases and gaps.

    A contact with neither force nor gap acceleration counts as open.
    """
    if not work.factors.determinant > 0.0:
        return False
    fastest = 1.0
    for k in range(count_coordinates(model.num_fingers)):
        fastest = max(fastest, abs(work.acceleration[k]))
    for i in range(model.num_fingers):
        if room.open[i] == 1:
            if not room.gaps[i] > -GAP_ROUNDING * fastest:
                return False
            continue
        if not work.forces[i, 1] > 0.0:
            return False
        value, band = distance_inside(model, discrete, work, i)
        if room.free[i] == 1 and not value >= -band:
            return False
    return True
