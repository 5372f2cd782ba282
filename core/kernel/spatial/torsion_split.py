"""Distribution of undetermined moments among contacts (docs/space.md, Undetermined moments).

The moments oppose the spin of their mode and are the smallest without spin. If a contact would
exceed its friction, other contacts take over as much of its moment as they can hold.
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.spatial.plant import to_contact_frame
from slipgrasp.core.kernel.spatial.torsion_equations import spin_of

CREEP = 3e-8  # e psi' of undetermined modes per F_tau / e [m/(N s)]
SPARE = 1e-3  # fraction of its friction that a relieved contact keeps in reserve
LEAST_PART = 1e-3  # least part of a contact in a mode that can relieve it


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
def relieve(model: Record, work: Record) -> bool:
    """Changes undetermined moments so that no contact exceeds its friction, if possible.

    Args:
        model: Constants of the run.
        work: Amounts of the modes and corresponding forces; both may change.

    Returns:
        True if any amount has changed.
    """
    torsion, found = work.torsion, False
    if not _some_exceed(model, work):
        return False
    for mode in range(torsion.num_determined, torsion.num_holders):
        low, high = _bounds_of_mode(model, work, mode, 1.0 - SPARE)
        shift = min(max(0.0, low), high)
        if low > high:
            # Friction is exceeded at several contacts: the reserve is reduced equally.
            least, most = _bounds_of_mode(model, work, mode, 1.0)
            share = (low - high) / (low - high + max(0.0, most - least))
            shift = low + share * (least - low) if least < most else 0.5 * (least + most)
        amount = torsion.amounts[mode]
        # A contact that exceeds its friction due to creep must slip.
        if shift != 0.0 and abs(amount + shift) >= abs(amount):
            torsion.amounts[mode] += shift
            _add_mode(model, work, mode, shift)
            found = True
    return found


@compiled
def _some_exceed(model: Record, work: Record) -> bool:
    """True if a sticking contact exceeds its friction, less the reserve."""
    for k in range(work.torsion.num_holders):
        i = work.torsion.holders[k]
        most = (1.0 - SPARE) * model.truth.static_friction[i] * work.forces[i, 2]
        size = square(work.forces[i, 0]) + square(work.forces[i, 1]) + square(work.moments[i])
        if size > most * most:
            return True
    return False


@compiled
def _pull_of_moment(model: Record, work: Record, i: int) -> tuple[float, float, float]:
    """Force of contact ``i`` per F_tau / e of an undetermined mode."""
    e, turning = model.hand.eccentricities[i], work.torsion.turning[i]
    return to_contact_frame(work.kin, i, e * turning[0], e * turning[1], e * turning[2])


@compiled
def _bounds_of_mode(model: Record, work: Record, mode: int, share: float) -> tuple[float, float]:
    """Smallest and largest additional amount of a mode that all contacts can take [N].

    Args:
        model: Constants of the run.
        work: Workspace, with the forces.
        mode: Index of the mode.
        share: Usable fraction of the friction.
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
    """As `_bounds_of_mode`, for the k-th sticking contact.

    There are no bounds if the contact has no part in the mode. If it exceeds its friction for any
    amount, both bounds are the amount with the smallest excess.
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
    """Adds an amount of a mode to the forces."""
    torsion = work.torsion
    for k in range(torsion.num_holders):
        i, share = torsion.holders[k], amount * torsion.modes[k, mode]
        x, y, z = _pull_of_moment(model, work, i)
        work.forces[i, 0] += share * x
        work.forces[i, 1] += share * y
        work.forces[i, 2] += share * z
        work.moments[i] += share
