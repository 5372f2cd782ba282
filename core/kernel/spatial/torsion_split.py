"""How contacts share moments that no equation determines (docs/space.md, Undetermined moments).

They are against what spin there is of their mode, without spin the least ones, unless a contact
would exceed its friction so: then others take over as much of its moment as they can hold.
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.spatial.plant import to_contact_frame
from slipgrasp.core.kernel.spatial.torsion_equations import spin_of

CREEP = 3e-8  # of spins that no determined moment stops, times e, per F_tau / e [m/(N s)]
SPARE = 1e-3  # share of its friction that a contact keeps which others relieve
LEAST_PART = 1e-3  # of a contact in a mode by which it may be relieved


@compiled
def contacts_creep(torsion: Record) -> bool:
    """Whether some of the moments for which modes were found last are undetermined."""
    return torsion.num_determined < torsion.num_holders


@compiled
def set_creep(model: Record, state: Record, work: Record) -> None:
    """Moments of the undetermined modes: against what there is of their spin."""
    torsion = work.torsion
    for mode in range(torsion.num_determined, torsion.num_holders):
        spin = 0.0
        for k in range(torsion.num_holders):
            i = torsion.holders[k]
            spin += torsion.modes[k, mode] * spin_of(model, state, work, i)
        torsion.amounts[mode] = -spin / CREEP


@compiled
def relieve(model: Record, work: Record) -> bool:
    """Shares the undetermined moments so that no contact exceeds its friction, if that can be.

    Args:
        model: Constants of the run.
        work: With amounts of the modes, which may change, and forces with these.

    Returns:
        Whether any amount has changed.
    """
    torsion, found = work.torsion, False
    if not _some_exceed(model, work):
        return False
    for mode in range(torsion.num_determined, torsion.num_holders):
        low, high = _bounds_of_mode(model, work, mode, 1.0 - SPARE)
        shift = min(max(0.0, low), high)
        if low > high:
            # They are overcome together: none keeps more of what it spares than another.
            least, most = _bounds_of_mode(model, work, mode, 1.0)
            share = (low - high) / (low - high + max(0.0, most - least))
            shift = low + share * (least - low) if least < most else 0.5 * (least + most)
        amount = torsion.amounts[mode]
        # What exceeds its friction by creep slips.
        if shift != 0.0 and abs(amount + shift) >= abs(amount):
            torsion.amounts[mode] += shift
            _add_mode(model, work, mode, shift)
            found = True
    return found


@compiled
def _some_exceed(model: Record, work: Record) -> bool:
    """Whether a contact that holds has more friction than it is to have."""
    for k in range(work.torsion.num_holders):
        i = work.torsion.holders[k]
        most = (1.0 - SPARE) * model.truth.static_friction[i] * work.forces[i, 2]
        size = square(work.forces[i, 0]) + square(work.forces[i, 1]) + square(work.moments[i])
        if size > most * most:
            return True
    return False


@compiled
def _pull_of_moment(model: Record, work: Record, i: int) -> tuple[float, float, float]:
    """The force of contact ``i`` per F_tau / e that moves nothing."""
    e, turning = model.hand.eccentricities[i], work.torsion.turning[i]
    return to_contact_frame(work.kin, i, e * turning[0], e * turning[1], e * turning[2])


@compiled
def _bounds_of_mode(model: Record, work: Record, mode: int, share: float) -> tuple[float, float]:
    """The least and the most of a mode that all contacts can take besides [N].

    Args:
        model: Constants of the run.
        work: With forces.
        mode: Which.
        share: Of their friction that they may use.
    """
    low, high = -np.inf, np.inf
    for k in range(work.torsion.num_holders):
        least, most = _most_of_mode(model, work, k, mode, share)
        low, high = max(low, least), min(high, most)
    return low, high


@compiled
def _most_of_mode(
    model: Record, work: Record, k: int, mode: int, share: float
) -> tuple[float, float]:
    """The same of the k-th contact that holds.

    They have no bounds where it has no part in the mode. Where it exceeds its friction with any of
    it, both are what it exceeds it least with.
    """
    i, part = work.torsion.holders[k], work.torsion.modes[k, mode]
    x, y, z = _pull_of_moment(model, work, i)
    mu = share * model.truth.static_friction[i]
    fx, fy, moment, normal = (
        work.forces[i, 0],
        work.forces[i, 1],
        work.moments[i],
        mu * work.forces[i, 2],
    )
    # |force + amount pull|^2 = (mu F_n)^2
    squared = square(part) * (x * x + y * y + 1.0 - square(mu * z))
    mixed = part * (fx * x + fy * y + moment - normal * mu * z)
    excess = fx * fx + fy * fy + moment * moment - normal * normal
    inside = mixed * mixed - squared * excess
    if abs(part) < LEAST_PART or not squared > 0.0:
        return -np.inf, np.inf
    reach = np.sqrt(max(inside, 0.0))
    return (-mixed - reach) / squared, (reach - mixed) / squared


@compiled
def _add_mode(model: Record, work: Record, mode: int, amount: float) -> None:
    """Adds some of a mode to the forces."""
    torsion = work.torsion
    for k in range(torsion.num_holders):
        i, share = torsion.holders[k], amount * torsion.modes[k, mode]
        x, y, z = _pull_of_moment(model, work, i)
        work.forces[i, 0] += share * x
        work.forces[i, 1] += share * y
        work.forces[i, 2] += share * z
        work.moments[i] += share
