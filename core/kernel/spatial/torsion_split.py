"""Distribution of undetermined moments among contacts (docs/space.md, Undetermined moments).

They are against what spin there is of their mode, without spin the least ones, unless a contact
would exceed its friction so: then others take over as much of its moment as they can hold. With the
amounts a of the modes, a_c by the spin, the excess x_i of the friction of contact i over what it is
to have, and the softness k, they minimise

    |a - a_c|^2 / 2 + sum max(0, x_i)^2 / 2 k,

which is convex, so that they change without jumps whatever contacts can hold.
"""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.numerics.dense import factor_dense, solve_dense
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.spatial.torsion_equations import spin_of
from slipgrasp.core.kernel.spatial.ways import size_with_spin

CREEP = 3e-9  # of spins that no determined moment stops, times e, per F_tau / e [m/(N s)]
SPARE = 1e-3  # share of its friction that a contact at rest keeps which others relieve
FASTEST_RELIEVED = 1e-9  # spin times e against which a contact spares nothing any more [m/s]
SOFTNESS = 1e-6  # k
SPLIT_STEPS, SPLIT_HALVINGS, SPLIT_ERROR = 40, 20, 1e-12  # of Newton's method


@compiled
def contacts_creep(torsion: Record) -> bool:
    """True if any mode of the latest `find_modes` is undetermined."""
    return torsion.num_determined < torsion.num_holders


@compiled
def set_creep(model: Record, state: Record, work: Record) -> None:
    """Sets the moments of the undetermined modes, opposite to their spin."""
    torsion = work.torsion
    for mode in range(torsion.num_determined, torsion.num_holders):
        spin = 0.0
        for k in range(torsion.num_holders):
            i = torsion.holders[k]
            spin += torsion.modes[k, mode] * spin_of(model, state, work, i)
        torsion.amounts[mode] = -spin / CREEP


@compiled
def need_relief(model: Record, state: Record, work: Record) -> bool:
    """Whether a contact has more friction than it is to have; also sets how much that is.

    Args:
        model: Constants of the run.
        state: With velocities.
        work: With amounts of the modes, and forces with these.
    """
    torsion = work.torsion
    _spare(model, state, work)
    for k in range(torsion.num_holders):
        i = torsion.holders[k]
        x, y, z = work.forces[i, 0], work.forces[i, 1], work.moments[i]
        if size_with_spin(x, y, z) > torsion.most[k] * work.forces[i, 2]:
            return True
    return False


@compiled
def relieve(model: Record, work: Record) -> None:
    """Shares the undetermined moments so that no contact exceeds its friction, if that can be.

    Args:
        model: Constants of the run.
        work: With amounts of the modes, which change, forces with these, and ``reliefs``.
    """
    torsion = work.torsion
    first, count = torsion.num_determined, torsion.num_holders
    for mode in range(first, count):
        torsion.shift[mode] = torsion.step[mode] = 0.0
    for _ in range(SPLIT_STEPS):
        if _improve_split(work) <= SPLIT_ERROR:
            break
    for mode in range(first, count):
        torsion.amounts[mode] += torsion.shift[mode]


@compiled
def _spare(model: Record, state: Record, work: Record) -> None:
    """What friction every contact is to have at most, as a share of its bound.

    The faster it turns against its friction, the less it spares: others that relieve it push it on.
    """
    torsion = work.torsion
    for k in range(torsion.num_holders):
        i = torsion.holders[k]
        x, y, moment = work.forces[i, 0], work.forces[i, 1], work.moments[i]
        size = size_with_spin(x, y, moment)
        opposed = -moment * spin_of(model, state, work, i)
        speed = opposed / size if opposed > 0.0 else 0.0
        share = 1.0 - SPARE + SPARE * speed / FASTEST_RELIEVED
        torsion.most[k] = share * model.truth.static_friction[i]


@compiled
def _relieved(work: Record, k: int, share: float) -> tuple[float, float, float, float]:
    """(F_x, F_y, F_tau / e, F_n) of the k-th contact that holds, ``share`` of ``step`` further."""
    torsion, i = work.torsion, work.torsion.holders[k]
    x, y, z, normal = work.forces[i, 0], work.forces[i, 1], work.moments[i], work.forces[i, 2]
    for mode in range(torsion.num_determined, torsion.num_holders):
        relief = torsion.reliefs[k, mode]
        amount = torsion.shift[mode] + share * torsion.step[mode]
        x, y, z = x + amount * relief[0], y + amount * relief[1], z + amount * relief[2]
        normal += amount * relief[3]
    return x, y, z, normal


@compiled
def _split_loss(work: Record, share: float) -> float:
    """What is minimised, with a share of ``step`` more in ``shift``."""
    torsion, loss = work.torsion, 0.0
    for mode in range(torsion.num_determined, torsion.num_holders):
        loss += square(torsion.shift[mode] + share * torsion.step[mode])
    for k in range(torsion.num_holders):
        x, y, z, normal = _relieved(work, k, share)
        loss += square(max(0.0, size_with_spin(x, y, z) - torsion.most[k] * normal)) / SOFTNESS
    return 0.5 * loss


@compiled
def _improve_split(work: Record) -> float:
    """One step of Newton's method; its largest part, relative to the amounts and 1 N."""
    torsion = work.torsion
    first, count = torsion.num_determined, torsion.num_holders
    _set_split(work)
    size = count - first
    factor_dense(torsion.small, size, torsion.small_order)
    solve_dense(torsion.small, size, torsion.small_order, torsion.small_right, torsion.right)
    for mode in range(first, count):
        torsion.step[mode] = torsion.right[mode - first]
    loss, share = _split_loss(work, 0.0), 1.0
    for _ in range(SPLIT_HALVINGS):
        if _split_loss(work, share) <= loss:
            break
        share *= 0.5
    largest, scale = 0.0, 1.0
    for mode in range(first, count):
        torsion.shift[mode] += share * torsion.step[mode]
        scale = max(scale, abs(torsion.shift[mode]))
        largest = max(largest, abs(torsion.step[mode]))
    return largest / scale


@compiled
def _set_split(work: Record) -> None:
    """Second derivatives of what is minimised, and the first ones with sign changed."""
    torsion = work.torsion
    first, size = torsion.num_determined, torsion.num_holders - torsion.num_determined
    for a in range(size):
        torsion.small_right[a] = -torsion.shift[first + a]
        for b in range(size):
            torsion.small[a, b] = 1.0 if a == b else 0.0
    for k in range(torsion.num_holders):
        x, y, z, normal = _relieved(work, k, 0.0)
        friction = size_with_spin(x, y, z)
        excess = friction - torsion.most[k] * normal
        if not (excess > 0.0 and friction > 0.0):
            continue
        x, y, z = x / friction, y / friction, z / friction
        for a in range(size):
            by = torsion.reliefs[k, first + a]
            along = x * by[0] + y * by[1] + z * by[2]
            slope = (along - torsion.most[k] * by[3]) / SOFTNESS
            torsion.small_right[a] -= excess * slope
            for b in range(size):
                to = torsion.reliefs[k, first + b]
                beside = x * to[0] + y * to[1] + z * to[2]
                bend = by[0] * to[0] + by[1] * to[1] + by[2] * to[2] - along * beside
                torsion.small[a, b] += slope * (beside - torsion.most[k] * to[3])
                torsion.small[a, b] += excess * bend / friction / SOFTNESS
