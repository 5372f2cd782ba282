"""The order of values of several kinds: numbers, then words and lists, then nothing."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray


def order_of(
    values: Sequence[Any], rows: NDArray[np.intp], *, descending: bool
) -> NDArray[np.intp]:
    """Sorts rows by their values; equal ones keep their order, and None comes last.

    Args:
        values: One per row.
        rows: What to sort.
        descending: Whether the largest comes first.
    """
    ranks = {key: rank for rank, key in enumerate(sorted(set(map(_key, values))))}
    places = np.array([ranks[_key(value)] for value in values], dtype=np.int64)
    if descending:
        nothing = np.array([value is None for value in values], dtype=bool)
        places = np.where(nothing, len(ranks), -places)
    return rows[np.argsort(places, kind="stable")]


def _key(value: Any) -> tuple[int, float, str]:
    if value is None:
        return (2, 0.0, "")
    if isinstance(value, (int, float)):
        return (0, float(value), "")
    return (1, 0.0, value if isinstance(value, str) else json.dumps(value))
