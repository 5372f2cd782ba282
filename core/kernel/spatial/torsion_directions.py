"""Directions of soft slips at their onset, and contacts that come to rest there."""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.spatial.state import slip_velocity_at
from slipgrasp.core.kernel.spatial.torsion_layout import NORMAL
from slipgrasp.core.kernel.spatial.ways import name_phase

AT_REST = 1e-9  # relative distance of the friction of a contact at rest from its bound
RESTS, LEAVES = 2, 3  # values of ``frozen``: at rest after slip onset; begins at this instant


@compiled
def take_directions(model: Record, directions: Floats, discrete: Record) -> None:
    """Sets the directions of contacts at slip onset."""
    for i in range(model.num_fingers):
        for part in range(NORMAL if discrete.frozen[i, 0] == 1 else 0):
            discrete.directions[i, part] = directions[i, part]


@compiled
def keep_directions_at_rest(
    model: Record, directions: Floats, before: Floats, discrete: Record
) -> None:
    """Keeps the earlier directions of contacts at rest, so that their friction is on its bound.

    Args:
        model: Constants of the run.
        directions: Directions that friction opposes, shorter than 1 for contacts at rest.
        before: Earlier directions.
        discrete: Phases; the directions are changed.
    """
    for i in range(model.num_fingers):
        rests = discrete.frozen[i, 0] == 1 and is_short(directions, i)
        for part in range(NORMAL if rests else 0):
            discrete.directions[i, part] = before[i, part]


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
def let_begin(model: Record, discrete: Record) -> None:
    """From now on, contacts that began to slip at this instant follow their velocity."""
    for i in range(model.num_fingers):
        if discrete.frozen[i, 0] == LEAVES:
            discrete.frozen[i, 0] = 1


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
