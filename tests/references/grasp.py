"""The grasp force: the least contact forces within all limits, by libraries."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import clarabel
import numpy as np
from numpy.typing import NDArray
from proxsuite import proxqp
from scipy.optimize import linprog
from scipy.sparse import csc_matrix

Array = NDArray[np.float64]

VIOLATION_WEIGHT = 1e8
MET = 1e-9


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
    if least_violation(G, d, A, b) < MET:
        return minimise(G, d, A, b), 0.0
    forces = _least_with_violation(G, d, A, b)
    return forces, float(np.max(b - A @ forces))


def least_violation(G: Array, d: Array, A: Array, b: Array) -> float:
    """The least t >= 0 with A F + t >= b for some F with G F = d."""
    return float(_violation_program(G, d, A, b).fun)


def _violation_program(G: Array, d: Array, A: Array, b: Array) -> Any:
    """The linear program of it."""
    answer = linprog(
        np.append(np.zeros(G.shape[1]), 1.0),
        A_ub=-np.column_stack((A, np.ones(len(b)))),
        b_ub=-b,
        A_eq=np.column_stack((G, np.zeros(len(d)))),
        b_eq=d,
        bounds=[(None, None)] * G.shape[1] + [(0.0, None)],
    )
    assert answer.status == 0, answer.message
    return answer


def minimise(G: Array, d: Array, A: Array, b: Array) -> Array:
    """The x of least norm with G x = d and A x >= b.

    A library finds x up to its tolerance, and which rows hold with equality there; the
    least-norm point of those rows is x to rounding. Clarabel wants an interior, ProxQP does not.
    """
    for library in (_solve_by_clarabel, _solve_by_proxqp):
        near, pressure = library(G, d, A, b)
        for share in (1e-7, 1e-5, 1e-9):
            active = pressure > share * pressure.max(initial=0.0)
            rows, bounds = np.vstack((G, A[active])), np.concatenate((d, b[active]))
            x = np.linalg.lstsq(rows, bounds, rcond=1e-12)[0]
            scatter = MET * (1.0 + np.abs(x).max())
            if np.all(A @ x > b - scatter) and np.abs(x - near).max() < 1e3 * scatter:
                return x
    raise AssertionError("neither library found an optimum")


def _least_with_violation(G: Array, d: Array, A: Array, b: Array) -> Array:
    """The F of least F^2 + VIOLATION_WEIGHT t^2 with G F = d and A F + t >= b.

    F^2 falls with t at the rate of twice its multipliers, which gives t; the rows that bind
    there give F to rounding, if it meets the conditions of an optimum. Where t is the least to
    rounding, so do those that the linear program names.
    """
    program = _violation_program(G, d, A, b)
    least, decisive = float(program.fun), program.ineqlin.marginals != 0.0
    low, high = np.log(1e-9), np.log(1e6)
    for _ in range(60):
        middle = 0.5 * (low + high)
        t = least + np.exp(middle)
        _, pressure = _solve_by_clarabel(G, d, A, b - t)
        low, high = (middle, high) if pressure.sum() > VIOLATION_WEIGHT * t else (low, middle)
    weight = VIOLATION_WEIGHT**-0.5
    wrench = np.column_stack((G, np.zeros(len(d))))
    relaxed = np.column_stack((A, np.full(len(b), weight)))
    for active in _rows_that_may_bind(G, d, A, b - least, np.exp(high), decisive):
        rows = np.vstack((wrench, relaxed[active]))
        x = np.linalg.lstsq(rows, np.concatenate((d, b[active])), rcond=1e-12)[0]
        multipliers = np.linalg.lstsq(rows.T, x, rcond=1e-12)[0]
        pushes = multipliers[len(d) :] > -MET * np.abs(multipliers).max()
        if np.all(relaxed @ x > b - MET * (1.0 + np.abs(x).max())) and pushes.all():
            return x[:-1]
    raise AssertionError("the rows that bind were not found")


def _rows_that_may_bind(
    G: Array, d: Array, A: Array, b: Array, excess: float, decisive: Array
) -> Iterator[Array]:
    """Which rows may hold with equality near the least violation, the likely ones first."""
    for each in (excess, 1e-6, 1e-4):
        for library in (_solve_by_clarabel, _solve_by_proxqp):
            _, pressure = library(G, d, A, b - each)
            for share in (1e-6, 1e-4, 1e-8):
                active = pressure > share * pressure.max(initial=0.0)
                yield active
                yield active | decisive
    yield decisive


def _solve_by_clarabel(G: Array, d: Array, A: Array, b: Array) -> tuple[Array, Array]:
    """X and the multipliers of the inequalities, by an interior-point method."""
    size = A.shape[1]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-13
    cones = [clarabel.ZeroConeT(len(d)), clarabel.NonnegativeConeT(len(b))]
    rows, bounds = csc_matrix(-np.vstack((G, A))), -np.concatenate((d, b))
    identity = csc_matrix(np.eye(size))
    solver = clarabel.DefaultSolver(identity, np.zeros(size), rows, bounds, cones, settings)
    solution = solver.solve()
    return np.array(solution.x), np.abs(np.array(solution.z)[len(d) :])


def _solve_by_proxqp(G: Array, d: Array, A: Array, b: Array) -> tuple[Array, Array]:
    """The same by a proximal method of multipliers."""
    size = A.shape[1]
    program = proxqp.dense.QP(size, len(d), len(b))
    program.settings.eps_abs, program.settings.eps_rel = 1e-12, 0.0
    program.settings.max_iter = 1000
    program.init(np.eye(size), np.zeros(size), G, d, A, b, np.full(len(b), 1e20))
    program.solve()
    return program.results.x, np.abs(program.results.z)


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
