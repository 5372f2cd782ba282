"""Which contacts stick and in which direction the others slip (docs/space.md, Selection).

Slip directions are a continuum, so phases are not enumerated: the contact problem

    w = G F + c,   F in its cone,   w_n = 0,   F_t = -mu F_n w_t / |w_t| where w_t != 0,

w the accelerations of slip and separation, is solved by a semi-smooth Newton method from the forces
with which every free contact would stick.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.elementary import square
from slipgrasp.core.kernel.records import MAX_FINGERS, Record
from slipgrasp.core.kernel.space.flow import (
    SURE_SPEED,
    set_derivative,
    slip_speed,
    spatial_phases,
    spatial_plant,
)
from slipgrasp.core.kernel.space.linear import factor_dense, solve_dense
from slipgrasp.core.kernel.space.model import MODEL
from slipgrasp.core.kernel.space.plant import object_bias
from slipgrasp.core.kernel.space.state import ATTITUDE, STATE, slip_velocity_at
from slipgrasp.core.kernel.space.workspace import DISCRETE, MAX_FORCES, SLIP, STICK, WORKSPACE

SELECTED, NONE_CONSISTENT, OPENS, NONE_REGULAR = range(4)
REST_SPEED = 3.1e-9  # just above that at which a slip ends, so that contacts stop together [m/s]
FORCE_BAND = 1e-9  # and share of the normal force [N]
REST_ACCELERATION = 1e-7  # [m/s^2]
PROBE_TIME, MARGIN_SLOPE = 1e-6, 1e-5
AGREEMENT = 1e-6  # of Newton's forces and those of the reduced form [N], and share
NEWTON_STEPS, FULL_STEPS, NEWTON_ERROR = 100, 30, 1e-12
RANDOM_STARTS = 8

# Intermediate values of a selection.
SELECTION_ROOM = np.dtype(
    [
        ("free", np.int64, (MAX_FINGERS,)),  # 1 where the slip velocity is zero
        ("leaving", np.int64, (MAX_FINGERS,)),  # 1 where a force on its cone is about to leave it
        ("concerned", np.int64),  # contact for which nothing is consistent, -1 if none
        ("restarts", np.int64),  # of Newton's method
        ("margins", np.float64, (MAX_FINGERS,)),
        ("derivative", STATE),
        ("probe", STATE),
        ("mobility", np.float64, (MAX_FORCES, MAX_FORCES)),  # G
        ("offset", np.float64, (MAX_FORCES,)),  # c
        ("force", np.float64, (MAX_FORCES,)),
        ("opening", np.float64, (MAX_FORCES,)),  # w
        ("matrix", np.float64, (MAX_FORCES, MAX_FORCES)),
        ("right", np.float64, (MAX_FORCES,)),
        ("step", np.float64, (MAX_FORCES,)),
        ("order", np.int64, (MAX_FORCES,)),
        ("body", np.float64, (6, 6)),  # M_o, factored
        ("column", np.float64, (6,)),
        ("solution", np.float64, (6,)),
        ("responses", np.float64, (MAX_FORCES, 6)),  # M_o^-1 W, column by column
        ("wrenches", np.float64, (MAX_FORCES, 6)),  # W, column by column
    ],
    align=True,
)


@compiled
def friction_margin(model: Record, work: Record, i: int) -> float:
    """Mu F_n - |F_t| of contact ``i`` [N], positive inside the cone."""
    x, y, normal = work.forces[i, 0], work.forces[i, 1], work.forces[i, 2]
    return model.truth.friction[i] * normal - np.sqrt(x * x + y * y)


@compiled
def set_phase(discrete: Record, i: int, phase: int) -> None:
    """Contact ``i`` sticks, or slips."""
    discrete.phases[i] = phase
    discrete.slips[i, 0] = discrete.slips[i, 1] = 1.0 if phase == SLIP else 0.0
    if phase == STICK:
        discrete.frozen[i] = 0


@compiled
def _free_contacts(model: Record, discrete: Record, state: Record, room: Record) -> None:
    """Contacts at rest are free and stick for a start; the others keep their direction."""
    n = model.num_fingers
    room.restarts = 0
    for i in range(n):
        speed = slip_speed(n, state, i)
        room.free[i] = 1 if speed < REST_SPEED else 0
        if room.free[i] == 1:
            set_phase(discrete, i, STICK)
            for axis in range(2):
                state.x[slip_velocity_at(n, i, axis)] = 0.0
            continue
        set_phase(discrete, i, SLIP)
        discrete.frozen[i] = 1 if speed < SURE_SPEED else 0
        for axis in range(2):
            velocity = state.x[slip_velocity_at(n, i, axis)]
            discrete.directions[i, axis] = velocity / speed


@compiled
def _all_consistent(model: Record, work: Record, room: Record) -> bool:
    """Whether all free contacts may stick, judged by the forces alone."""
    for i in range(model.num_fingers):
        if room.free[i] == 0:
            continue
        normal, margin = work.forces[i, 2], friction_margin(model, work, i)
        room.margins[i] = margin
        if not normal > 0.0 or margin < -FORCE_BAND * (1.0 + normal):
            return False
    return True


@compiled
def _opens(n: int, work: Record, room: Record) -> int:
    """Whether every contact pushes."""
    for i in range(n):
        if not work.forces[i, 2] > 0.0:
            room.concerned = i
            return OPENS
    return SELECTED


@compiled
def _find_leaving(
    model: Record, discrete: Record, state: Record, work: Record, room: Record
) -> bool:
    """Whether a sticking contact on its cone is about to leave it, along the motion in stick."""
    n, doubtful = model.num_fingers, False
    for i in range(n):
        band = FORCE_BAND * (1.0 + work.forces[i, 2])
        near = room.free[i] == 1 and room.margins[i] <= band
        room.leaving[i] = room.leaving[i] if near else 0
        doubtful = doubtful or (near and room.leaving[i] == 0)
    if doubtful:
        set_derivative(model, state, room.derivative, work)
        for k in range(model.num_states):
            room.probe.x[k] = state.x[k] + PROBE_TIME * room.derivative.x[k]
        normalise(room.probe)
        spatial_plant(model, discrete, room.probe, work)
        for i in range(n):
            normal = work.forces[i, 2]
            slope = (friction_margin(model, work, i) - room.margins[i]) / PROBE_TIME
            near = room.free[i] == 1 and room.margins[i] <= FORCE_BAND * (1.0 + normal)
            if near and slope < -MARGIN_SLOPE * (1.0 + normal):
                room.leaving[i] = 1
        spatial_plant(model, discrete, state, work)
    found = False
    for i in range(n):
        found = found or room.leaving[i] == 1
    return found


@compiled
def normalise(state: Record) -> None:
    """Gives the attitude its length 1."""
    x, total = state.x, 0.0
    for k in range(4):
        total += square(x[ATTITUDE + k])
    scale = 1.0 / np.sqrt(total)
    for k in range(4):
        x[ATTITUDE + k] *= scale


@compiled
def _let_leave(n: int, discrete: Record, work: Record, room: Record) -> None:
    """A slip that begins smoothly starts against its friction force: g = -F_t / |F_t|."""
    for i in range(n):
        if room.leaving[i] == 1:
            x, y = work.forces[i, 0], work.forces[i, 1]
            size = np.sqrt(x * x + y * y)
            if size > 0.0:
                _begin_slip(discrete, i, -x / size, -y / size)


@compiled
def _begin_slip(discrete: Record, i: int, first: float, second: float) -> None:
    set_phase(discrete, i, SLIP)
    discrete.frozen[i] = 1
    discrete.directions[i, 0], discrete.directions[i, 1] = first, second


@compiled_apart(types.void, MODEL, STATE, WORKSPACE, SELECTION_ROOM)
def spatial_contacts(model: Record, state: Record, work: Record, room: Record) -> None:
    """G and c of the contact problem, from what does not depend on phases."""
    n, kin, body = model.num_fingers, work.kin, room.body
    entries = work.system.body
    for a in range(6):
        for b in range(6):
            body[a, b] = 0.0
    for a in range(3):
        body[a, a] = model.truth.object_mass
    body[3, 3], body[3, 4], body[3, 5] = entries[0], entries[1], entries[2]
    body[4, 3], body[4, 4], body[4, 5] = entries[1], entries[3], entries[4]
    body[5, 3], body[5, 4], body[5, 5] = entries[2], entries[4], entries[5]
    factor_dense(body, 6, room.order)
    object_bias(state, work.system, model.truth, model.hand.gravity, room.column)
    for k in range(6):
        room.column[k] = model.load[k] - room.column[k]
    solve_dense(body, 6, room.order, room.column, room.right)
    for i in range(n):
        rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
        for k in range(3):
            sign = 1.0 if k == 2 else -1.0
            column = room.wrenches[3 * i + k]
            x = sign * kin.frames[i, k, 0]
            y = sign * kin.frames[i, k, 1]
            z = sign * kin.frames[i, k, 2]
            column[0], column[1], column[2] = x, y, z
            column[3], column[4], column[5] = ry * z - rz * y, rz * x - rx * z, rx * y - ry * x
            solve_dense(body, 6, room.order, column, room.responses[3 * i + k])
    for a in range(3 * n):
        for b in range(3 * n):
            total = 0.0
            for k in range(6):
                total += room.wrenches[a, k] * room.responses[b, k]
            room.mobility[a, b] = total
        total = 0.0
        for k in range(6):
            total += room.wrenches[a, k] * room.right[k]
        room.offset[a] = total
    for i in range(n):
        _add_finger(work, room, i)


@compiled
def _add_finger(work: Record, room: Record, i: int) -> None:
    """What the mobility of finger ``i``, the inverse of Lambda, adds to G and c."""
    kin, inertia = work.kin, work.dynamics.inertia[i]
    m = _inverse(inertia)
    ux = work.tip_forces[i, 0] - work.dynamics.bias[i, 0]
    uy = work.tip_forces[i, 1] - work.dynamics.bias[i, 1]
    uz = work.tip_forces[i, 2] - work.dynamics.bias[i, 2]
    ax, ay, az = _times(m, ux, uy, uz)
    ax, ay, az = ax - kin.bias[i, 0], ay - kin.bias[i, 1], az - kin.bias[i, 2]
    for a in range(3):
        row = room.wrenches[3 * i + a]
        x, y, z = row[0], row[1], row[2]
        room.offset[3 * i + a] -= x * ax + y * ay + z * az
        px, py, pz = _times(m, x, y, z)
        for b in range(3):
            other = room.wrenches[3 * i + b]
            room.mobility[3 * i + a, 3 * i + b] += px * other[0] + py * other[1] + pz * other[2]


@compiled
def _inverse(m: np.ndarray) -> tuple[float, float, float, float, float, float]:
    """The inverse of a symmetric 3x3 matrix, six entries."""
    xx, xy, xz, yy, yz, zz = m[0], m[1], m[2], m[3], m[4], m[5]
    a, b, c = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    scale = 1.0 / (xx * a + xy * b + xz * c)
    return (
        scale * a,
        scale * b,
        scale * c,
        scale * (xx * zz - xz * xz),
        scale * (xy * xz - xx * yz),
        scale * (xx * yy - xy * xy),
    )


@compiled
def _times(
    m: tuple[float, float, float, float, float, float], x: float, y: float, z: float
) -> tuple[float, float, float]:
    return (
        m[0] * x + m[1] * y + m[2] * z,
        m[1] * x + m[3] * y + m[4] * z,
        m[2] * x + m[4] * y + m[5] * z,
    )


@compiled
def _set_rows(model: Record, discrete: Record, room: Record, i: int) -> None:
    """Rows of Newton's matrix for contact ``i``, residuals in newtons with sign changed."""
    n, matrix, right, mobility = model.num_fingers, room.matrix, room.right, room.mobility
    size, first = 3 * n, 3 * i
    force, opening, mu = room.force, room.opening, model.truth.friction[i]
    scale = 1.0 / max(mobility[first, first], mobility[first + 1, first + 1])
    for b in range(size):
        matrix[first + 2, b] = scale * mobility[first + 2, b]
    right[first + 2] = -scale * opening[first + 2]
    normal = force[first + 2]
    if room.free[i] == 0:
        for k in range(2):
            g = discrete.directions[i, k]
            for b in range(size):
                matrix[first + k, b] = 0.0
            matrix[first + k, first + k] = 1.0
            matrix[first + k, first + 2] = mu * g
            right[first + k] = -(force[first + k] + mu * normal * g)
        return
    y0 = force[first] - scale * opening[first]
    y1 = force[first + 1] - scale * opening[first + 1]
    length, radius = np.sqrt(y0 * y0 + y1 * y1), mu * max(normal, 0.0)
    if length <= radius:
        for k in range(2):
            for b in range(size):
                matrix[first + k, b] = scale * mobility[first + k, b]
            right[first + k] = -scale * opening[first + k]
        return
    e0, e1 = y0 / length, y1 / length
    ratio = radius / length
    p00, p01, p11 = ratio * (1.0 - e0 * e0), -ratio * e0 * e1, ratio * (1.0 - e1 * e1)
    for b in range(size):
        m0, m1 = scale * mobility[first, b], scale * mobility[first + 1, b]
        matrix[first, b] = p00 * m0 + p01 * m1
        matrix[first + 1, b] = p01 * m0 + p11 * m1
    matrix[first, first] += 1.0 - p00
    matrix[first, first + 1] -= p01
    matrix[first + 1, first] -= p01
    matrix[first + 1, first + 1] += 1.0 - p11
    if normal > 0.0:
        matrix[first, first + 2] -= mu * e0
        matrix[first + 1, first + 2] -= mu * e1
    right[first] = -(force[first] - radius * e0)
    right[first + 1] = -(force[first + 1] - radius * e1)


@compiled_apart(types.int64, MODEL, DISCRETE, SELECTION_ROOM)
def spatial_newton(model: Record, discrete: Record, room: Record) -> int:
    """Newton's method from the forces in ``room``; 1 if it has converged."""
    n = model.num_fingers
    size = 3 * n
    for trial in range(NEWTON_STEPS):
        worst, scale = 0.0, 0.0
        for a in range(size):
            total = room.offset[a]
            for b in range(size):
                total += room.mobility[a, b] * room.force[b]
            room.opening[a] = total
            scale += square(room.force[a])
        for i in range(n):
            _set_rows(model, discrete, room, i)
            for k in range(3):
                worst = max(worst, abs(room.right[3 * i + k]))
        if worst <= NEWTON_ERROR * (1.0 + np.sqrt(scale)):
            return 1
        if not worst < np.inf or not abs(factor_dense(room.matrix, size, room.order)) > 0.0:
            return 0
        solve_dense(room.matrix, size, room.order, room.right, room.step)
        share = 1.0 if trial < FULL_STEPS else 0.5
        for a in range(size):
            room.force[a] += share * room.step[a]
    return 0


@compiled
def _solve_contacts(model: Record, discrete: Record, work: Record, room: Record) -> int:
    """Newton's method from the forces of stick, then from random ones; 1 if it has converged."""
    n, seed = model.num_fingers, 12345
    for i in range(n):
        for k in range(3):
            room.force[3 * i + k] = work.forces[i, k]
    if spatial_newton(model, discrete, room) == 1:
        return 1
    for _ in range(RANDOM_STARTS):
        room.restarts += 1
        for i in range(n):
            for k in range(3):
                # A linear congruence, as in Numerical Recipes: the same on every machine.
                seed = (1664525 * seed + 1013904223) % 4294967296
                share = seed / 4294967296.0
                size = 1.0 + abs(float(work.forces[i, 2]))
                room.force[3 * i + k] = size * (2.0 * share if k == 2 else share - 0.5)
        if spatial_newton(model, discrete, room) == 1:
            return 1
    return 0


@compiled
def _take_solution(model: Record, discrete: Record, room: Record) -> int:
    """Phases and directions from the solved forces and accelerations."""
    status = SELECTED
    for i in range(model.num_fingers):
        first = 3 * i
        if not room.force[first + 2] > 0.0:
            room.concerned = i
            status = OPENS
        if room.free[i] == 0:
            continue
        x, y = room.opening[first], room.opening[first + 1]
        size = np.sqrt(x * x + y * y)
        if size > REST_ACCELERATION:
            _begin_slip(discrete, i, x / size, y / size)
        elif room.leaving[i] == 1:
            fx, fy = room.force[first], room.force[first + 1]
            force = np.sqrt(fx * fx + fy * fy)
            cone = model.truth.friction[i] * room.force[first + 2]
            if force >= cone * (1.0 - FORCE_BAND) and force > 0.0:
                _begin_slip(discrete, i, -fx / force, -fy / force)
    return status


@compiled
def _agrees(n: int, work: Record, room: Record) -> bool:
    """Whether the reduced form in the selected phases has the forces that were solved for."""
    for i in range(n):
        for k in range(3):
            force = room.force[3 * i + k]
            if not abs(force - work.forces[i, k]) <= AGREEMENT * (1.0 + abs(force)):
                return False
    return True


@compiled_apart(types.int64, MODEL, DISCRETE, STATE, WORKSPACE, SELECTION_ROOM)
def spatial_select(
    model: Record, discrete: Record, state: Record, work: Record, room: Record
) -> int:
    """Selects the phases for the torque that is held; ``work`` is left evaluated in them.

    Args:
        model: Constants of the run.
        discrete: Its phases and directions are set.
        state: Slip velocities that count as zero become exactly zero.
        work: For the evaluation.
        room: Of contacts whose force has just reached its cone ``leaving`` is 1.
    """
    n = model.num_fingers
    _free_contacts(model, discrete, state, room)
    spatial_plant(model, discrete, state, work)
    room.concerned = -1
    if not work.system.determinant > 0.0:
        return NONE_REGULAR
    if _all_consistent(model, work, room):
        if not _find_leaving(model, discrete, state, work, room):
            return _opens(n, work, room)
        _let_leave(n, discrete, work, room)
        spatial_phases(model, discrete, state, work)
        return _opens(n, work, room)
    spatial_contacts(model, state, work, room)
    if _solve_contacts(model, discrete, work, room) == 0:
        return NONE_CONSISTENT
    status = _take_solution(model, discrete, room)
    spatial_phases(model, discrete, state, work)
    if status != SELECTED:
        return status
    if not work.system.determinant > 0.0:
        return NONE_REGULAR
    return SELECTED if _agrees(n, work, room) else NONE_CONSISTENT
