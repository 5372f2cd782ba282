"""Covering arrays: rows of levels in which every two levels of two factors meet (pairwise testing).

Rows are built level after level, each the one that meets most for the first time, as in AETG
(Cohen, Dalal, Fredman and Patton, 1997). Which levels exclude each other is learnt by trying.
The libraries for this need minutes for a hundred factors and have no seed.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from itertools import islice
from random import Random
from typing import Any

import numpy as np
from numpy.typing import NDArray

Row = tuple[int, ...]
Conflict = frozenset[tuple[int, int]]
"""Levels, each as (factor, level), that no row may have together."""

ATTEMPTS = 20  # orders of the factors in which a row is tried
ENOUGH = 100  # rows after which no further conflict is looked for, where no other is found
MOST = 3  # levels of a conflict; of more the numbers of a row are the cause


def cover(sizes: Sequence[int], conflicts: Collection[Conflict], rng: Random) -> Iterator[Row]:
    """Yields rows without end; when all pairs have met, they meet again in other rows.

    Args:
        sizes: Number of levels of each factor.
        conflicts: What no row may have.
        rng: Decides where several levels would do.
    """
    levels = _Levels(sizes, conflicts)
    needed = levels.pairs()
    while True:
        if not needed.any():
            needed = levels.pairs()
        seed = levels.needed_pair(needed, rng)
        tried = (levels.fill(seed, needed, rng) for _ in range(ATTEMPTS))
        ids = next((ids for ids in tried if ids is not None), None)
        if ids is None:
            needed[seed, seed[::-1]] = False  # three or more levels exclude it
        else:
            needed[np.ix_(ids, ids)] = False
            yield levels.row(ids)


def find_conflicts(
    sizes: Sequence[int], is_allowed: Callable[[Row], bool], rng: Random
) -> frozenset[Conflict]:
    """Levels that are refused together while all other factors are at level 0.

    Args:
        sizes: Number of levels of each factor; level 0 of all factors together is allowed.
        is_allowed: Tries a row.
        rng: Decides which rows are tried.
    """
    conflicts: set[Conflict] = set()
    while True:
        rows = islice(cover(sizes, conflicts, rng), ENOUGH)
        refused = (minimal_conflict(row, is_allowed) for row in rows if not is_allowed(row))
        conflict = next((found for found in refused if len(found) <= MOST), None)
        if conflict is None:
            return frozenset(conflicts)
        conflicts.add(conflict)


def missing_pairs(sizes: Sequence[int], rows: Iterable[Row]) -> set[Conflict]:
    """Pairs of levels that meet in none of some rows.

    Args:
        sizes: Number of levels of each factor.
        rows: With a level of each factor.
    """
    levels = _Levels(sizes, ())
    needed = levels.pairs()
    for row in rows:
        ids = levels.first + row
        needed[np.ix_(ids, ids)] = False
    return {frozenset(map(levels.named, pair)) for pair in np.argwhere(needed)}


def minimal_conflict(row: Row, is_allowed: Callable[[Row], bool]) -> Conflict:
    """Levels of a refused row without any of which it would not be refused.

    One after another is found as the last of the shortest beginning that is refused.

    Args:
        row: Refused.
        is_allowed: Tries a row.
    """
    factors = [factor for factor, level in enumerate(row) if level]
    found: list[int] = []
    while is_allowed(_only(row, found)):
        low, high = 0, len(factors)
        while low < high:
            middle = (low + high) // 2
            if is_allowed(_only(row, [*found, *factors[:middle]])):
                low = middle + 1
            else:
                high = middle
        found.append(factors[low - 1])
        factors = factors[: low - 1]
    return frozenset((factor, row[factor]) for factor in found)


def _only(row: Row, factors: Collection[int]) -> Row:
    return tuple(level if factor in factors else 0 for factor, level in enumerate(row))


class _Levels:
    """All levels of all factors, numbered throughout.

    Args:
        sizes: Number of levels of each factor.
        conflicts: What no row may have.
    """

    def __init__(self, sizes: Sequence[int], conflicts: Collection[Conflict]) -> None:
        self._sizes = sizes
        self.first = np.cumsum([0, *sizes[:-1]])
        self._factor = np.repeat(np.arange(len(sizes)), sizes)
        self._conflicts = np.zeros((len(conflicts), len(self._factor)), bool)
        for members, conflict in zip(self._conflicts, conflicts, strict=True):
            members[[self.first[factor] + level for factor, level in conflict]] = True

    def pairs(self) -> NDArray[np.bool_]:
        """Which two levels may meet, ``(levels, levels)``."""
        allowed = self._factor[:, None] != self._factor
        count = self._conflicts.sum(axis=1)
        alone = self._conflicts[count == 1].any(axis=0)
        allowed[alone] = allowed[:, alone] = False
        for a, b in (np.flatnonzero(pair) for pair in self._conflicts[count == 2]):
            allowed[a, b] = allowed[b, a] = False
        return allowed

    def needed_pair(self, needed: NDArray[np.bool_], rng: Random) -> tuple[int, int]:
        """A pair that has not met yet, of the level for which most are missing."""
        first = _any_largest(needed.sum(axis=1), rng)
        return first, _any_largest(needed[first], rng)

    def fill(
        self, seed: tuple[int, int], needed: NDArray[np.bool_], rng: Random
    ) -> NDArray[np.intp] | None:
        """Levels of a row with a given pair, in the order of the factors; None in a dead end."""
        missing = self._conflicts.sum(axis=1)
        gain = np.zeros(len(self._factor), int)
        ids = np.zeros(len(self._sizes), np.intp)
        others = [factor for factor in range(len(ids)) if factor not in self._factor[list(seed)]]
        rng.shuffle(others)
        for chosen in seed:
            ids[self._factor[chosen]] = chosen
            missing -= self._conflicts[:, chosen]
            gain += needed[chosen]
        for factor in others:
            start, size = self.first[factor], self._sizes[factor]
            blocked = self._conflicts[missing == 1, start : start + size].any(axis=0)
            if blocked.all():
                return None
            own = np.where(blocked, -1, gain[start : start + size])
            chosen = ids[factor] = start + _any_largest(own, rng)
            missing -= self._conflicts[:, chosen]
            gain += needed[chosen]
        return None if (missing == 0).any() else ids

    def row(self, ids: NDArray[np.intp]) -> Row:
        """The levels of a row, each counted within its factor."""
        return tuple((ids - self.first).tolist())

    def named(self, id_: int) -> tuple[int, int]:
        """Factor and level of a level."""
        factor = int(self._factor[id_])
        return factor, int(id_ - self.first[factor])


def _any_largest(values: NDArray[Any], rng: Random) -> int:
    return int(rng.choice(np.flatnonzero(values == values.max())))
