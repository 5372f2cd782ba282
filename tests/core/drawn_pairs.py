"""Random valid scenarios in which every two levels of everything that can be set meet.

Each is a row of a covering array over the factors of `tests.core.drawn_levels` and
`tests.core.drawn_draft`, with its own geometry and its own numbers within the levels. Levels that
validation refuses together are learnt, and left out.
"""

from __future__ import annotations

from functools import cache, lru_cache
from itertools import islice
from random import Random
from typing import NamedTuple
from unittest.mock import patch

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import scenario_from_mapping
from tests.core.covering_array import Conflict, Row, cover, find_conflicts, minimal_conflict
from tests.core.drawn_draft import CHANGED, NOTHING, STRUCTURE, Draft, changeable
from tests.core.drawn_levels import Factor, all_factors

BLOCK = 500  # rows of one covering array, and some of the next
TRIES = 3  # draws of the numbers of a row, of which validation has to accept one


class Drawn(NamedTuple):
    """A scenario, and the levels that it has.

    Attributes:
        scenario: Valid.
        row: A level of each of `factors`.
    """

    scenario: Scenario
    row: Row


def draw_in_pairs(seed: int | str, index: int, spatial: bool) -> Drawn:
    """A scenario of at most 0.3 s, the same every time.

    Args:
        seed: Other seeds draw other scenarios.
        index: Which; in `BLOCK` of them all pairs meet, or in twice as many where validation
            refuses a row.
        spatial: Whether the hand stands in space.
    """
    block, number = divmod(index, BLOCK)
    row = rows_of_block(spatial, f"{seed} {block}")[number]
    name = f"{seed} {index}"
    while (scenario := draw_levels(spatial, row, name)) is None:
        # Three or more levels that exclude each other, or numbers that mostly do.
        refused = minimal_conflict(row, lambda row: draw_levels(spatial, row, name) is not None)
        # A factor with few levels has each of them in many other rows.
        _, reset = min((sizes(spatial)[factor], factor) for factor, _ in refused)
        row = (*row[:reset], 0, *row[reset + 1 :])
    return Drawn(scenario, row)


@cache
def factors(spatial: bool) -> tuple[Factor, ...]:
    """Everything that is varied."""
    # Last, because a scenario without changes is validated in a fraction of the time.
    changed = Factor(CHANGED, (NOTHING, *changeable(spatial)))
    return (*STRUCTURE, *all_factors(spatial), changed)


@cache
def conflicts(spatial: bool) -> frozenset[Conflict]:
    """Levels that validation refuses together."""
    return find_conflicts(
        sizes(spatial), lambda row: draw_levels(spatial, row, "") is not None, Random(0)
    )


def sizes(spatial: bool) -> list[int]:
    """Number of levels of each factor."""
    return [len(factor.levels) for factor in factors(spatial)]


# To find what a refused name may have meant takes most of the time of a refusal.
@patch("difflib.get_close_matches", lambda *_, **__: [])
def draw_levels(spatial: bool, row: Row, seed: str) -> Scenario | None:
    """A scenario with given levels; None if validation refuses all that are drawn.

    Args:
        spatial: Whether the hand stands in space.
        row: A level of each of `factors`.
        seed: Of the numbers within the levels.
    """
    named = zip(factors(spatial), row, strict=True)
    levels = {factor.name: factor.levels[level] for factor, level in named}
    for number in range(TRIES):
        draft = Draft(spatial, levels, Random(f"{seed} {row} {number}"))
        for count in range(len(draft.further_changes), -1, -1):
            changes = [*draft.mapping["changes"], *draft.further_changes[:count]]
            try:
                return scenario_from_mapping({**draft.mapping, "changes": changes})
            except ScenarioError:
                continue
    return None


@lru_cache(maxsize=4)
def rows_of_block(spatial: bool, seed: str) -> list[Row]:
    """Rows in which all pairs of levels meet but those of known conflicts.

    Args:
        spatial: Whether the hand stands in space.
        seed: Seed and number of the block.
    """
    return list(islice(cover(sizes(spatial), conflicts(spatial), Random(seed)), BLOCK))
