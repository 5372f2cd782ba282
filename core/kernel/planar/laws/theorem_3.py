"""Theorem 3: the estimates follow the gradient of the Lyapunov function (Eq. 24)."""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.numerics.lyapunov import error_weights
from slipgrasp.core.kernel.planar.inertia import solve_transposed
from slipgrasp.core.kernel.planar.reduced import multiply_regressor
from slipgrasp.core.kernel.planar.state import count_coordinates


@compiled
def weigh_error(law: Record, factors: Record, room: Record) -> None:
    """Computes r = M~^-T E^T P xi of Eq. 46 from the factors of the estimated M~."""
    size = count_coordinates(law.num_fingers)
    error_weights(law, room, size, room.weighted_error)
    solve_transposed(factors, law.num_fingers, room.weighted_error)


@compiled
def gradient_rates(model: Record, discrete: Record, work: Record) -> None:
    """Writes U^T M~^-T E^T P xi to ``work.rates`` ``(p,)``: Eq. 24 without its gain."""
    weigh_error(model.law, work.estimated_factors, work.room)
    multiply_regressor(model, discrete, work, work.room.weighted_error, work.rates)
