"""The last instant of a run with soft fingertips: whether contacts could stay closed there.

The contact problem is that of the kernel, w = G F + c with four rows per contact; who solves it is
another: least squares of its natural map from many random forces, instead of Newton's method.
"""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.spatial.torsion_layout import MOVING, ROWS, TURN
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import run_to_end
from slipgrasp.core.scenario import Scenario

Array = NDArray[np.float64]

STARTS = 12
SOLVED, SURELY = 1e-8, 1e-6  # residual of an answer, force with which it pushes [N]


class SoftProblem(NamedTuple):
    """A contact problem: rows (x, y, turn, normal) of every contact.

    Attributes:
        G: Mobility, ``(4n, 4n)``.
        c: Accelerations without forces, ``(4n,)``.
        moving: Which contacts go on slipping, ``(n,)``.
        directions: Where these slip to, ``(n, 3)``.
        kinetic: Friction in slip, ``(n,)``.
        static: Friction in stick.
        soft: Which contacts have a moment.
    """

    G: Array
    c: Array
    moving: NDArray[np.bool_]
    directions: Array
    kinetic: Array
    static: Array
    soft: NDArray[np.bool_]


def problem_at_end(scenario: Scenario) -> SoftProblem:
    """The contact problem for which no phases were found at the end of a run."""
    simulation = Simulation(scenario)
    run_to_end(simulation, lambda _: None)
    n, model = len(scenario.fingers), simulation._model
    torsion: Record = simulation._run.work.torsion
    size = ROWS * n
    G = torsion.mobility[:size, :size].copy()
    G[TURN::ROWS, TURN::ROWS] += torsion.creep[:n, :n]
    return SoftProblem(
        G,
        torsion.offset[:size].copy(),
        torsion.kinds[:n] == MOVING,
        torsion.slides[:n].copy(),
        model.truth.friction[:n].copy(),
        model.truth.static_friction[:n].copy(),
        model.hand.eccentricities[:n] > 0.0,
    )


def has_closed_answer(problem: SoftProblem) -> bool:
    """Whether some forces, all of which push, agree with the friction of every contact."""
    rng = np.random.default_rng(0)
    free = np.flatnonzero(~problem.moving & (problem.static > problem.kinetic))
    for sticks in product((False, True), repeat=len(free)):
        bounds = problem.kinetic.copy()
        bounds[free] = np.where(sticks, problem.static[free], problem.kinetic[free])
        for _ in range(STARTS):
            start = rng.normal(size=problem.c.shape) * (1.0 + rng.exponential(20.0))
            start[ROWS - 1 :: ROWS] = np.abs(start[ROWS - 1 :: ROWS])
            found = least_squares(_residual, start, args=(problem, bounds), xtol=1e-15, ftol=1e-15)
            if _agrees(found.x, problem, bounds, free[np.array(sticks, bool)]):
                return True
    return False


def _residual(force: Array, problem: SoftProblem, bounds: Array) -> Array:
    """The natural map, in newtons: 0 where forces and accelerations agree with friction."""
    w, rest = problem.G @ force + problem.c, np.empty_like(force)
    for i, moves in enumerate(problem.moving):
        rows = slice(ROWS * i, ROWS * i + 3)
        scale = 1.0 / max(np.diag(problem.G)[rows][: 3 if problem.soft[i] else 2])
        normal = force[ROWS * i + 3]
        rest[ROWS * i + 3] = scale * w[ROWS * i + 3]
        if moves:
            rest[rows] = force[rows] + problem.kinetic[i] * normal * problem.directions[i]
        else:
            pull = force[rows] - scale * w[rows]
            size, radius = float(np.linalg.norm(pull)), bounds[i] * max(normal, 0.0)
            rest[rows] = force[rows] - pull * min(1.0, radius / max(size, 1e-300))
        if not problem.soft[i]:
            rest[ROWS * i + TURN] = force[ROWS * i + TURN]
    return rest


def _agrees(force: Array, problem: SoftProblem, bounds: Array, sticking: Array) -> bool:
    """Whether forces are an answer beyond doubt, and what has static friction sticks."""
    scale = 1.0 + float(np.abs(force).max())
    if np.abs(_residual(force, problem, bounds)).max() > SOLVED * scale:
        return False
    normals = force[ROWS - 1 :: ROWS]
    sizes = np.linalg.norm(force.reshape(-1, ROWS)[:, :3], axis=1)
    inside = sizes[sticking] < bounds[sticking] * normals[sticking] - SURELY
    return bool(normals.min() > SURELY * scale and inside.all())
