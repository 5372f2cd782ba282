"""Where everything of a hand stands at given times, in the plane or in space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.figures.hand_motion import HandMotion, motion_at
from slipgrasp.figures.hand_motion_in_space import spatial_motion_at


def motion_of(result: RunResult, times: NDArray[np.float64]) -> HandMotion:
    """Reads a run at given times, on straight lines between its samples.

    Args:
        result: The run.
        times: Ascending times within the run, shape ``(times,)`` [s].
    """
    read = spatial_motion_at if result.scenario.in_space else motion_at
    return read(result, times)
