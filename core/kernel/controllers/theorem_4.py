"""Theorem 4: theorem 3 with sigma-modification, which pulls large estimates back (Eq. 28-29)."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compiler import compiled
from slipgrasp.core.kernel.records import Record


@compiled
def pull_back(law: Record, state: Record, count: int) -> float:
    """sigma_s of Eq. 29."""
    square, first = 0.0, 6 + 2 * law.num_fingers
    for k in range(count):
        square += state.x[first + k] ** 2
    return min(max(np.sqrt(square) / law.estimate_norm_bound - 1.0, 0.0), 1.0)
