"""The grasp force of a spatial hand from tick to tick, where contacts slip and stick again."""

from random import Random

import numpy as np
import pytest
from numpy.testing import assert_allclose

from slipgrasp.core.kernel.compilation.compiler import call
from slipgrasp.core.kernel.compilation.records import make_record
from slipgrasp.core.kernel.spatial.grasp import spatial_grasp
from slipgrasp.core.kernel.spatial.workspace import GRASP, MAX_ASKED

SAME_FORCE = 1e-6  # of two ways to one solution, share of the forces
TICKS = 40


def wrench_matrix(rng, n):
    """Forces at contacts around an object, each pushing inwards, as rows of force and moment."""
    columns = []
    for i in range(n):
        turn = 2.0 * np.pi * i / n + rng.uniform(-0.3, 0.3)
        inward = -np.array([np.cos(turn), np.sin(turn), 0.0])
        up = np.array([0.0, 0.0, 1.0])
        frame = np.column_stack([np.cross(up, inward), up, inward])
        arm = -0.1 * inward + np.array([0.0, 0.0, rng.uniform(-0.05, 0.05)])
        columns.append(np.vstack([frame, np.cross(arm, frame.T).T]))
    return np.hstack(columns)


def pose_problem(rng, grasp, W, friction):
    """The program of one tick: any contacts slip, any limits hold; returns its rows."""
    n = W.shape[1] // 3
    forces = np.array([[rng.uniform(-2, 2), rng.uniform(-2, 2), rng.uniform(2, 15)]] * n)
    rows = [*np.column_stack([W, W @ forces.ravel() * rng.choice((1.0, 1.0, 3.0))])]
    holds = rng.random() < 0.3
    grasp.cones[:, 1] = -1.0
    for i in range(n):
        turn = rng.uniform(0.0, 2.0 * np.pi)
        for way in range(grasp.ways):
            slips = rng.random() < 0.4
            grasp.cones[i, way] = -1.0 if slips and not holds else friction[i]
            for axis in range(2) if grasp.ways == 1 else (way,):
                if not slips or holds:
                    continue
                row = np.zeros(3 * n + 1)
                along = (np.cos(turn), np.sin(turn))[axis] if grasp.ways == 1 else 1.0
                row[3 * i + axis], row[3 * i + 2] = -1.0, -friction[i] * along
                rows.append(row)
    grasp.least = rng.choice((0.0, 0.5, 5.0))
    grasp.most = rng.choice((np.inf, np.inf, 20.0))
    return rows


def solve(grasp, rows, n):
    """Solves the program from what ``grasp`` remembers: violation and forces."""
    grasp.fingers, grasp.size = n, 3 * n
    for row, values in enumerate(rows):
        grasp.rows[row, : 3 * n] = values[:-1]
        grasp.rows[row, MAX_ASKED] = values[-1]
    violation = call(spatial_grasp, grasp, n, len(rows), 1)
    return violation, grasp.force[: 3 * n].copy()


@pytest.mark.parametrize("ways", [1, 2])
@pytest.mark.parametrize("softens", [0, 1])
@pytest.mark.parametrize("n", [2, 3, 4])
def test_what_was_active_at_the_tick_before_decides_nothing_of_the_force(n, softens, ways):
    """Forces stay finite, whatever slips now, and are those that are found without a memory."""
    rng = Random(f"{n} {softens} {ways}")
    compared = 0
    for _ in range(20):
        W = wrench_matrix(rng, n)
        friction = [rng.uniform(0.2, 1.0) for _ in range(n)]
        grasp = make_record(GRASP)
        grasp.ways, grasp.softens = ways, softens
        for _ in range(TICKS):
            fresh = make_record(GRASP)
            fresh.ways, fresh.softens = ways, softens
            rows = pose_problem(rng, grasp, W, friction)
            fresh.cones, fresh.least, fresh.most = grasp.cones, grasp.least, grasp.most
            violation, forces = solve(grasp, rows, n)
            again, wanted = solve(fresh, rows, n)
            assert np.isfinite(violation)
            assert np.isfinite(forces).all()
            assert violation == pytest.approx(again, abs=1e-6)
            if violation == again == 0.0:
                scale = 1.0 + np.abs(wanted).max()
                assert_allclose(forces, wanted, atol=SAME_FORCE * scale)
                compared += 1
    assert compared > 100
