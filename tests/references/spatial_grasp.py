"""The grasp force in space: least forces with a given wrench, inside friction cones.

A conic solver finds the optimum to its accuracy and with it the bounds that bind; Newton's
method on the conditions of Karush, Kuhn and Tucker gives it to rounding and proves it, since
the problem is convex.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix

Array = NDArray[np.float64]

RANK = 1e-10  # singular value relative to the largest that counts as zero
SOFT_BELOW = 0.1  # singular value of the scaled G below which its direction is soft
SOFTNESS = 0.1
OPTIMAL = 1e-10


class Choice(NamedTuple):
    """F = base + basis z, of which z with the least sum of weights (z - wish)^2 is wanted."""

    base: Array  # (3n,)
    basis: Array  # (3n, k)
    weights: Array  # (k,)
    wish: Array  # (k,)


class Bound(NamedTuple):
    """norm(rows F) <= slope F[normal] - offset: a cone, a face of a pyramid, or a least force."""

    rows: tuple[int, ...]
    normal: int
    slope: float
    offset: float

    def value(self, F: Array) -> float:
        """Excess over the bound [N]."""
        return float(np.linalg.norm(F[list(self.rows)])) - self.slope * F[self.normal] + self.offset

    def gradient(self, F: Array) -> Array:
        """Of the excess with respect to F."""
        gradient = np.zeros(len(F))
        along = F[list(self.rows)]
        gradient[list(self.rows)] = along / max(float(np.linalg.norm(along)), 1e-300)
        gradient[self.normal] = -self.slope
        return gradient

    def hessian(self, F: Array) -> Array:
        """Of the excess with respect to F."""
        hessian = np.zeros((len(F), len(F)))
        if len(self.rows) == 2:
            length = max(float(np.linalg.norm(F[list(self.rows)])), 1e-300)
            along = F[list(self.rows)] / length
            hessian[np.ix_(self.rows, self.rows)] = (np.eye(2) - np.outer(along, along)) / length
        return hessian


class Grasp(NamedTuple):
    """Forces, ``(n, 3)``, how far they exceed their bounds [N], and which bounds bind."""

    forces: Array
    violation: float
    active: tuple[int, ...]


def distribute(G: Array, d: Array) -> Choice:
    """All F of least squares in G F = d; the one of least norm is wanted."""
    U, sigma, Vt = np.linalg.svd(G)
    rank = int(np.sum(sigma > RANK * sigma[0]))
    base = Vt[:rank].T @ ((U.T @ d)[:rank] / sigma[:rank])
    k = len(Vt) - rank
    return Choice(base, Vt[rank:].T, np.ones(k), np.zeros(k))


def soften(G: Array, d: Array, arm: float) -> Choice:
    """G F = d where G is far from singular; elsewhere it is traded against |F|.

    Args:
        G: Wrench rows, then friction rows.
        d: What they should give.
        arm: Length by which moments are divided [m].
    """
    scale = np.ones(len(d))
    scale[3:6] = 1.0 / arm
    U, sigma, Vt = np.linalg.svd(scale[:, None] * G)
    wanted = np.zeros(len(Vt))
    sigma = np.append(sigma, np.zeros(len(Vt) - len(sigma)))
    wanted[: min(G.shape)] = (U.T @ (scale * d))[: min(G.shape)]
    hard = sigma >= SOFT_BELOW
    base = Vt[hard].T @ (wanted[hard] / sigma[hard])
    soft, wanted = sigma[~hard], wanted[~hard]
    pull = soft / (SOFTNESS**2 * (1.0 - (soft / SOFT_BELOW) ** 2))
    weights = 1.0 + pull * soft
    return Choice(base, Vt[~hard].T, weights, pull * wanted / weights)


def cone_bounds(slopes: Array, minimum: float, *, pyramid: bool) -> list[Bound]:
    """Bounds of all contacts: friction where the slope is a number, and a least F_n.

    Args:
        slopes: Greatest tangential per normal force, NaN where it is not bounded, ``(n, 2)``.
        minimum: Least F_n [N].
        pyramid: Whether each tangent is bounded by itself.
    """
    bounds = []
    for i, pair in enumerate(slopes):
        normal = 3 * i + 2
        if pyramid:
            tangents = [k for k in range(2) if not np.isnan(pair[k])]
            bounds += [Bound((3 * i + k,), normal, pair[k], 0.0) for k in tangents]
        elif not np.isnan(pair[0]):
            bounds.append(Bound((3 * i, 3 * i + 1), normal, pair[0], 0.0))
        bounds.append(Bound((), normal, 1.0, minimum))
    return bounds


def least_forces(choice: Choice, bounds: list[Bound], hint: tuple[int, ...] = ()) -> Grasp:
    """The wanted F within all bounds, else one with the least worst excess.

    ``hint`` names bounds that may bind; it changes how long this takes, not the answer.
    """
    base = choice.base + choice.basis @ choice.wish
    if len(choice.wish) == 0:
        return Grasp(base.reshape(-1, 3), max(0.0, *(b.value(base) for b in bounds)), ())
    for active in dict.fromkeys(((), hint)):
        forces = _polish(choice, bounds, active, choice.wish)
        if forces is not None:
            return Grasp(forces.reshape(-1, 3), 0.0, active)
    z = _solve_by_clarabel(choice, bounds)
    near = None if z is None else choice.base + choice.basis @ z
    if near is None or max(b.value(near) for b in bounds) > 1e-6 * (1.0 + np.abs(near).max()):
        z, excess = _least_excess(choice, bounds)
        return Grasp((choice.base + choice.basis @ z).reshape(-1, 3), excess, ())
    for active in _binding(choice, bounds, z):
        forces = _polish(choice, bounds, active, z)
        if forces is not None:
            return Grasp(forces.reshape(-1, 3), 0.0, active)
    return Grasp(near.reshape(-1, 3), 0.0, ())


def optimality(choice: Choice, bounds: list[Bound], forces: Array) -> tuple[float, float, float]:
    """How far forces are from optimal: stationarity, worst excess, most negative multiplier."""
    F = forces.ravel()
    z = choice.basis.T @ (F - choice.base)
    values = np.array([b.value(F) for b in bounds])
    active = np.flatnonzero(values > -1e-8 * (1.0 + np.abs(F).max()))
    slopes = np.array([choice.basis.T @ bounds[a].gradient(F) for a in active]).reshape(-1, len(z))
    pull = choice.weights * (z - choice.wish)
    nu = np.linalg.lstsq(slopes.T, -pull, rcond=None)[0]
    return float(np.abs(pull + slopes.T @ nu).max()), float(values.max()), float(min(nu, default=0))


def _polish(choice: Choice, bounds: list[Bound], active: tuple[int, ...], z: Array) -> Array | None:
    """Newton on stationarity with the given bounds met; None where that is not the optimum."""
    k, nu = len(z), np.zeros(len(active))
    for iteration in range(40):
        F = choice.base + choice.basis @ z
        values = np.array([bounds[a].value(F) for a in active])
        slopes = np.array([bounds[a].gradient(F) @ choice.basis for a in active]).reshape(-1, k)
        pull = choice.weights * (z - choice.wish)
        if iteration == 0:
            nu = np.linalg.lstsq(slopes.T, -pull, rcond=None)[0]
        residual = np.concatenate((pull + slopes.T @ nu, values))
        scale = 1.0 + np.abs(F).max()
        if np.max(np.abs(residual)) < 1e-13 * scale:
            excess = max(b.value(F) for b in bounds)
            good = excess <= OPTIMAL * scale and np.all(nu >= -OPTIMAL * scale)
            return F if good else None
        if not np.all(np.isfinite(residual)) or scale > 1e9:
            return None
        bend = sum(
            (v * bounds[a].hessian(F) for v, a in zip(nu, active, strict=True)),
            np.zeros((len(F), len(F))),
        )
        H = np.diag(choice.weights) + choice.basis.T @ bend @ choice.basis
        system = np.block([[H, slopes.T], [slopes, np.zeros((len(active), len(active)))]])
        step = np.linalg.lstsq(system, -residual, rcond=1e-12)[0]
        z, nu = z + step[:k], nu + step[k:]
    return None


def _binding(choice: Choice, bounds: list[Bound], z: Array) -> Iterator[tuple[int, ...]]:
    """Sets of bounds that may bind near z."""
    F = choice.base + choice.basis @ z
    values = np.array([b.value(F) for b in bounds])
    for near in (1e-6, 1e-5, 1e-7, 1e-4, 1e-8, 1e-3):
        yield tuple(int(a) for a in np.flatnonzero(values > -near * (1.0 + np.abs(F).max())))


def _rows(bound: Bound, size: int) -> Array:
    """Slope F_n and the bounded components, as rows."""
    rows = np.zeros((1 + len(bound.rows), size))
    rows[0, bound.normal] = bound.slope
    for k, row in enumerate(bound.rows):
        rows[1 + k, row] = 1.0
    return rows


def _solve_by_clarabel(choice: Choice, bounds: list[Bound]) -> Array | None:
    k = len(choice.wish)
    return _conic(np.diag(choice.weights), -choice.weights * choice.wish, choice, bounds, k)


def _least_excess(choice: Choice, bounds: list[Bound]) -> tuple[Array, float]:
    """The z for which the worst excess over the bounds is least, and that excess [N]."""
    k = len(choice.wish)
    wanted = np.append(np.zeros(k), 1.0)
    z = _conic(np.zeros((k + 1, k + 1)), wanted, choice, bounds, k + 1)
    assert z is not None
    F = choice.base + choice.basis @ z[:k]
    return z[:k], max(b.value(F) for b in bounds)


def _conic(H: Array, g: Array, choice: Choice, bounds: list[Bound], size: int) -> Array | None:
    """Least z H z / 2 + g z with all bounds; a further unknown widens every bound."""
    matrix, right, cones = [], [], []
    for bound in bounds:
        rows = _rows(bound, len(choice.base))
        columns = rows @ choice.basis
        if size > columns.shape[1]:
            columns = np.column_stack((columns, np.eye(len(rows))[0]))
        matrix.append(-columns)
        offset = rows @ choice.base
        offset[0] -= bound.offset
        right.append(offset)
        single = len(rows) == 1
        cones.append(
            clarabel.NonnegativeConeT(1) if single else clarabel.SecondOrderConeT(len(rows))
        )
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-11
    A, b = csc_matrix(np.vstack(matrix)), np.concatenate(right)
    answer = clarabel.DefaultSolver(csc_matrix(np.triu(H)), g, A, b, cones, settings).solve()
    return None if "Infeasible" in str(answer.status) else np.array(answer.x)
