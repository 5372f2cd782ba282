"""Theorem 4: theorem 3 with sigma-modification, which bounds the estimates (Eq. 28-29)."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.planar.state import estimate_at


@compiled
def pull_back(law: Record, state: Record, count: int) -> float:
    """sigma_s of Eq. 29."""
    total = 0.0
    for k in range(count):
        total += square(state.x[estimate_at(law.num_fingers, k)])
    return min(max(np.sqrt(total) / law.estimate_norm_bound - 1.0, 0.0), 1.0)
