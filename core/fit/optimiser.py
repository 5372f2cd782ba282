"""Minimization of an objective: least squares from many starts, with some parameters fixed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from slipgrasp.core.fit.objective import OUTLIER_SIGMAS, Objective
from slipgrasp.core.trace.signals import Floats

DIFFERENCE_STEP = 1e-4
"""Step of finite differences; residuals are rough below it because of event times."""

TOLERANCE = 1e-5
"""Relative change of chi-squared at which a search ends."""

_LEAST_MOVE = 1e-7
_LEAST_SLOPE = 1e-9
MOST_STEPS = 40
SAME_MINIMUM = 1.0
"""Difference of chi-squared below which minima are equal."""


@dataclass(frozen=True, slots=True, eq=False)
class Minimum:
    """A local minimum.

    Attributes:
        shares: The parameters, scaled to [0, 1].
        chi_squared: Its value of the objective.
        jacobian: Derivative of the residuals with respect to the free scaled parameters, shape
            ``(values, free)``.
    """

    shares: Floats
    chi_squared: float
    jacobian: Floats = field(repr=False)


def minimise(
    objective: Objective,
    start: Floats,
    fixed: Mapping[int, float] | None = None,
    limits: Mapping[int, tuple[float, float]] | None = None,
) -> Minimum:
    """Finds the local minimum by least squares.

    Args:
        objective: The objective.
        start: Scaled initial parameters.
        fixed: Fixed scaled parameters, by index.
        limits: Limits of scaled parameters, by index; the whole range of the others.
    """
    # Deferred, because the import takes a third of a second.
    from scipy.optimize import least_squares

    fixed = fixed or {}
    free = [k for k in range(len(start)) if k not in fixed]
    whole = np.array(start, np.float64)
    for k, share in fixed.items():
        whole[k] = share

    def filled(shares: Floats) -> Floats:
        joined = whole.copy()
        joined[free] = shares
        return joined

    def residuals(shares: Floats) -> Floats:
        return objective.residuals(filled(shares))

    def differences(shares: Floats) -> Floats:
        return _differences(residuals, shares)

    jacobian: Any = differences  # scipy's code has a name as default, and no annotation

    if not free:
        return Minimum(whole, objective.chi_squared(whole), np.empty((0, 0)))
    low, high = np.array([(limits or {}).get(k, (0.0, 1.0)) for k in free]).T
    found = least_squares(
        residuals,
        np.clip(whole[free], low + 1e-9, high - 1e-9),
        jacobian,
        bounds=(low, high),
        loss="huber",
        f_scale=OUTLIER_SIGMAS,
        xtol=_LEAST_MOVE,
        ftol=TOLERANCE,
        gtol=_LEAST_SLOPE,
        max_nfev=MOST_STEPS,
    )
    return Minimum(filled(found.x), 2.0 * float(found.cost), jacobian(found.x))


def _differences(residuals: Callable[[Floats], Floats], shares: Floats) -> Floats:
    """Forward differences; backward differences at the upper end of a range."""
    base = residuals(shares)
    columns = []
    for k in range(len(shares)):
        step = DIFFERENCE_STEP if shares[k] + DIFFERENCE_STEP <= 1.0 else -DIFFERENCE_STEP
        moved = shares.copy()
        moved[k] += step
        columns.append((residuals(moved) - base) / step)
    return np.stack(columns, axis=1)


def start_points(first: Floats, count: int, seed: int) -> Floats:
    """Starts: the given point, then a Sobol sequence, shape ``(count, parameters)``."""
    if count == 1:
        return first[None, :]
    from scipy.stats import qmc

    sequence = qmc.Sobol(len(first), rng=np.random.default_rng(seed))
    # A Sobol sequence is balanced in blocks of powers of two.
    points = sequence.random_base2(int(np.ceil(np.log2(count))))[: count - 1]
    return np.vstack([first, points])
