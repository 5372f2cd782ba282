"""Short implicit steps in which a soft contact begins to slip.

The mobility of a spin is hundreds of times less than that along the face. So while a force leaves
its limit surface it moves along it, and the direction in which the slip starts does not hold for as
long as that of a point would. Each step takes friction against the velocity at its end,

    lambda = proj(lambda - rho (w + v^ / h)) on |lambda| <= mu F_n,   w_n = 0,

with v^ = (s', e psi') at its start, until the slip is fast enough to tell its own direction. What
creeps in stick does so here as well.
"""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.numerics.methods import method_of
from slipgrasp.core.kernel.spatial.flow import set_derivative, spatial_plant
from slipgrasp.core.kernel.spatial.guards import sample_guards
from slipgrasp.core.kernel.spatial.kinematics import update_kinematics
from slipgrasp.core.kernel.spatial.selection import normalise
from slipgrasp.core.kernel.spatial.state import velocity_at
from slipgrasp.core.kernel.spatial.torsion import (
    add_velocities,
    begin_contact_problem,
    factor_phases,
    find_modes,
    take_forces,
)
from slipgrasp.core.kernel.spatial.torsion_contacts import spatial_soft_newton
from slipgrasp.core.kernel.spatial.torsion_layout import FREE, NORMAL, ROWS, STUCK
from slipgrasp.core.kernel.spatial.ways import size_with_spin
from slipgrasp.core.kernel.spatial.workspace import SLIP, STICK

AT_REST = 1e-9  # share of its bound by which the friction of a contact at rest is less


@compiled
def rests_again(model: Record, discrete: Record, step: Record) -> bool:
    """Whether no contact that has begun to slip has come any further in the step just taken."""
    found = False
    for i in range(model.num_fingers):
        if discrete.frozen[i, 0] == 0:
            continue
        x, y, z = step.directions[i, 0], step.directions[i, 1], step.directions[i, 2]
        if size_with_spin(x, y, z) >= 1.0 - AT_REST:
            return False
        found = True
    return found


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
def onset_step(model: Record, discrete: Record, h: float, step: Record, work: Record) -> bool:
    """Fills ``end``, ``slopes`` and ``directions``; False where friction has no solution."""
    for i in range(model.num_fingers):
        for part in range(NORMAL):
            step.directions[i, part] = discrete.directions[i, part]
    if not h > 0.0:
        return False
    spatial_plant(model, discrete, step.start, work)
    if not _solve_friction(model, discrete, h, step, work):
        return False
    last = method_of(model, step).last
    first, second, mean = step.slopes[1], step.slopes[2], step.slopes[0]
    set_derivative(model, step.start, first, work)
    for j in range(model.num_states):
        step.end.x[j] = step.start.x[j] + h * first.x[j]
    normalise(step.end)
    update_kinematics(model.hand, discrete.seeds, step.end, work.kin)
    set_derivative(model, step.end, second, work)
    for j in range(model.num_states):
        mean.x[j] = 0.5 * (first.x[j] + second.x[j])
        step.end.x[j] = step.start.x[j] + h * mean.x[j]
    normalise(step.end)
    for row in range(1, last + 1):
        for j in range(model.num_states):
            step.slopes[row].x[j] = mean.x[j]
        sample_guards(model, discrete, step.end, work, step.samples, row)
    return True


@compiled
def _solve_friction(model: Record, discrete: Record, h: float, step: Record, work: Record) -> bool:
    """Forces by which what slips ends the step with a velocity against its friction."""
    n, torsion = model.num_fingers, work.torsion
    for i in range(n):
        torsion.kinds[i] = STUCK if discrete.phases[i] == STICK else FREE
        torsion.bounds[i] = model.truth.friction[i]
    _find_modes(model, discrete, work)
    begin_contact_problem(model, step.start, torsion, h)
    solved = spatial_soft_newton(model, discrete, torsion) == 1
    add_velocities(n, step.start, torsion, -1.0 / h)
    if not solved:
        return False
    take_forces(model, discrete, work)
    for i in range(n):
        _point(model, discrete, h, step, work, i)
    return True


@compiled
def _find_modes(model: Record, discrete: Record, work: Record) -> None:
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
def _point(model: Record, discrete: Record, h: float, step: Record, work: Record, i: int) -> None:
    """The direction that the friction of contact ``i`` is against; at rest it is shorter than 1."""
    n, torsion, first = model.num_fingers, work.torsion, ROWS * i
    if discrete.phases[i] == STICK:
        return
    bound, size = torsion.bounds[i] * torsion.force[first + NORMAL], 0.0
    for part in range(NORMAL):
        direction = -torsion.force[first + part] / bound
        work.gamma[i, part] = step.directions[i, part] = direction
        size += direction * direction
    if size < 1.0 - AT_REST:
        # To rounding it has this acceleration.
        for axis in range(2):
            work.slip_acceleration[i, axis] = -step.start.x[velocity_at(n, i, axis)] / h
        work.spin_acceleration[i] = -step.start.x[velocity_at(n, i, 2)] / h
