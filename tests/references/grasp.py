"""The grasp force: the least contact forces within all limits, by a library."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from quadprog import solve_qp

__all__ = ["Limits", "least_forces", "squeeze"]

Array = NDArray[np.float64]

VIOLATION_WEIGHT = 1e8


class Limits(NamedTuple):
    """What the forces must keep at every contact.

    Attributes:
        cones: Greatest \\|F_x\\| / F_n, NaN where a contact slips, ``(n,)``.
        minimum: Least F_n [N].
        maximum: Largest F_n [N].
        levers: Torques per contact force, ``(2n, 2n)`` [m].
        own: Torques without contact force, ``(2n,)`` [N m].
        torque: Largest torque of a joint [N m].
    """

    cones: Array
    minimum: float
    maximum: float
    levers: Array
    own: Array
    torque: float

    def rows(self) -> tuple[Array, Array]:
        """A and b of A F >= b, every row in newtons."""
        n = len(self.cones)
        across, normal = np.eye(2 * n)[::2], np.eye(2 * n)[1::2]
        stuck = ~np.isnan(self.cones)
        sides = [(self.cones[:, None] * normal + sign * across)[stuck] for sign in (1.0, -1.0)]
        lengths = np.linalg.norm(self.levers, axis=1)
        levers = self.levers / lengths[:, None]
        A = np.vstack((*sides, normal, -normal, levers, -levers))
        b = np.concatenate(
            (
                np.zeros(2 * stuck.sum()),
                np.full(n, self.minimum),
                np.full(n, -self.maximum),
                (-self.torque - self.own) / lengths,
                (-self.torque + self.own) / lengths,
            )
        )
        return A[np.isfinite(b)], b[np.isfinite(b)]


def least_forces(G: Array, d: Array, limits: Limits) -> tuple[Array, float]:
    """The least F with G F = d within all limits, else with the least worst violation [N].

    Two sticking contacts first look at their cones alone.
    """
    A, b = limits.rows()
    size = G.shape[1]
    if size == 4:
        forces, violation = _within_cones(G, d, limits.cones)
        if np.all((A @ forces >= b)[4:]):
            return forces, violation
    try:
        rows, bounds = np.vstack((G, A)), np.concatenate((d, b))
        return solve_qp(np.eye(size), np.zeros(size), rows.T.copy(), bounds, len(d))[0], 0.0
    except ValueError:
        return _least_violation(G, d, A, b)


def _least_violation(G: Array, d: Array, A: Array, b: Array) -> tuple[Array, float]:
    """Another unknown, by which every limit may be missed, at a price far above that of forces."""
    size = G.shape[1]
    price = np.diag(np.append(np.ones(size), VIOLATION_WEIGHT))
    wrench = np.column_stack((G, np.zeros(len(d))))
    relaxed = np.column_stack((A, np.ones(len(b))))
    rows, bounds = np.vstack((wrench, relaxed)), np.concatenate((d, b))
    solution = solve_qp(price, np.zeros(size + 1), rows.T.copy(), bounds, len(d))[0]
    forces = solution[:size]
    return forces, float(np.max(b - A @ forces))


def _within_cones(W: Array, d: Array, cones: Array) -> tuple[Array, float]:
    """The closed form for the one internal force of two sticking contacts."""
    base, N = np.linalg.lstsq(W, d, rcond=None)[0], np.linalg.svd(W)[2][3]
    c, violation = squeeze(base.reshape(-1, 2), N.reshape(-1, 2), cones)
    return base + c * N, violation


def squeeze(base: Array, direction: Array, cones: Array) -> tuple[float, float]:
    """Smallest \\|c\\| with ``base + c direction`` inside both sides of every cone.

    Args:
        base: Forces without internal part, ``(n, 2)`` as (F_x, F_n) [N].
        direction: Internal force of unit size, ``(n, 2)``.
        cones: Greatest allowed \\|F_x\\| / F_n, ``(n,)``.

    Returns:
        c [N] and the violation [N]: zero, or the least worst excess of \\|F_x\\| over its
        bound where no c is inside all cones.
    """
    margins, slopes = [], []
    for side in (1.0, -1.0):
        margins += list(cones * base[:, 1] - side * base[:, 0])
        slopes += list(cones * direction[:, 1] - side * direction[:, 0])
    a, b = np.array(margins), np.array(slopes)
    bounds = [(-x / y, y) for x, y in zip(a, b, strict=True) if y != 0.0]
    low = max((c for c, y in bounds if y > 0.0), default=-np.inf)
    high = min((c for c, y in bounds if y < 0.0), default=np.inf)
    if low <= high:
        return float(np.clip(0.0, low, high)), 0.0
    crossings = [
        (a[j] - a[i]) / (b[i] - b[j]) for i in range(len(a)) for j in range(i) if b[i] != b[j]
    ]
    worst = [-np.min(a + b * c) for c in crossings]
    best = int(np.argmin(worst))
    return float(crossings[best]), float(worst[best])
