"""Phases of the contacts that tests go through: 0 stick, 1 and -1 slip."""

from itertools import product

_LEVELS = (0, 1, -1)
_OF_FEW = [phase for n in (2, 3) for phase in product(_LEVELS, repeat=n)]
# In these nine, an orthogonal array, any two contacts have every two phases.
_OF_FOUR = [
    tuple(_LEVELS[level % 3] for level in (a, b, a + b, a + 2 * b))
    for a, b in product(range(3), repeat=2)
]
PHASES = [*_OF_FEW, *_OF_FOUR]
"""All of two and of three contacts, and nine of four, ``(36 + 9,)`` tuples."""


def label(phase: tuple[int, ...]) -> str:
    """Phases as a word of 0, + and -."""
    return "".join("0+-"[each] for each in phase)
