"""Moments of sticking contacts, sorted into modes by their mobility.

Some may be undetermined: `slipgrasp.core.kernel.spatial.torsion_split` distributes them.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.numerics.dense import diagonalise, factor_dense, solve_dense
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.torsion_phases import (
    push_of_stick,
    solve_phases,
    turn_mobility,
    twist_of,
)
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, STICK, WORKSPACE

UNDETERMINED = 1e-3  # relative mobility of a mode below which its moment is undetermined


@compiled
def holds_turn(model: Record, discrete: Record, i: int) -> bool:
    """True if contact ``i`` sticks and resists turning."""
    return discrete.phases[i] == STICK and model.hand.eccentricities[i] > 0.0


@compiled_apart(types.void, MODEL, DISCRETE, WORKSPACE)
def spatial_find_modes(model: Record, discrete: Record, work: Record) -> None:
    """Computes the modes of the moments in stick, sorted by mobility, and their effect.

    Some modes, such as that of two opposed contacts that twist the object against each other, cause
    no motion: they are undetermined and come last. Sigma must be factored.
    """
    torsion, count, largest = work.torsion, 0, 0.0
    torsion.some_slip = 0
    for i in range(model.num_fingers):
        if discrete.phases[i] != STICK:
            torsion.some_slip = 1
        if holds_turn(model, discrete, i):
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
        _swap_modes(torsion, count, determined, k)
        determined += 1
    torsion.num_determined = determined


@compiled
def _swap_modes(torsion: Record, count: int, first: int, second: int) -> None:
    """Exchanges two modes and their mobilities."""
    for row in range(count):
        value = torsion.modes[row, first]
        torsion.modes[row, first] = torsion.modes[row, second]
        torsion.modes[row, second] = value
    value = torsion.symmetric[first, first]
    torsion.symmetric[first, first] = torsion.symmetric[second, second]
    torsion.symmetric[second, second] = value


@compiled
def limit_determined(torsion: Record, most: int) -> None:
    """Leaves the modes of least mobility undetermined, so that at most ``most`` are determined."""
    while torsion.num_determined > most:
        last = torsion.num_determined - 1
        least = last
        for k in range(last):
            if torsion.symmetric[k, k] < torsion.symmetric[least, least]:
                least = k
        _swap_modes(torsion, torsion.num_holders, last, least)
        torsion.num_determined = last


@compiled
def find_moments(torsion: Record) -> None:
    """Computes the moments in stick, ``held``, that cancel ``wanted`` in the determined modes.

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
def find_reliefs(model: Record, work: Record) -> None:
    """Computes ``reliefs``; ``amounts`` and ``wanted`` are kept."""
    torsion, first, count = work.torsion, work.torsion.num_determined, work.torsion.num_holders
    for k in range(count):
        torsion.right[k], torsion.step[k] = torsion.wanted[k], torsion.amounts[k]
        torsion.wanted[k] = 0.0
    for mode in range(first, count):
        for other in range(first, count):
            torsion.amounts[other] = 1.0 if mode == other else 0.0
        find_moments(torsion)
        for k in range(6):
            torsion.motion[k] = 0.0
        add_moments(torsion)
        for k in range(count):
            relief, i, moment = torsion.reliefs[k, mode], torsion.holders[k], torsion.held[k]
            x, y, z = push_of_stick(model, work, i, moment, torsion.motion)
            relief[0], relief[1], relief[2], relief[3] = x, y, moment, z
    for k in range(count):
        torsion.wanted[k], torsion.amounts[k] = torsion.right[k], torsion.step[k]


@compiled
def add_moments(torsion: Record) -> None:
    """Adds the effect of the moments in stick to the motion of the object."""
    for j in range(torsion.num_holders):
        for k in range(6):
            torsion.motion[k] += torsion.held[j] * torsion.moves[j, k]


@compiled
def contacts_creep(torsion: Record) -> bool:
    """True if any mode of the latest `spatial_find_modes` is undetermined."""
    return torsion.num_determined < torsion.num_holders


@compiled
def creeps_in_stick(model: Record, discrete: Record, torsion: Record, i: int) -> bool:
    """True if sticking contact ``i`` may turn because moments are undetermined."""
    return contacts_creep(torsion) and holds_turn(model, discrete, i)
