"""Evaluation of the states of a spatial hand for the theorems of the paper."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.kernel.compilation.compiler import call
from slipgrasp.core.kernel.compilation.records import Record, make_record
from slipgrasp.core.kernel.spatial.command import spatial_believe
from slipgrasp.core.kernel.spatial.flow import spatial_plant
from slipgrasp.core.kernel.spatial.model import pack_model
from slipgrasp.core.kernel.spatial.sensing import SENSES
from slipgrasp.core.kernel.spatial.state import STATE, number_of_coordinates, parts_of
from slipgrasp.core.kernel.spatial.workspace import (
    DISCRETE,
    SLIP,
    SLIPS_ALONG_TANGENTS,
    STICK,
    WORKSPACE,
)
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.theorem_hand import TheoremHand
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.trace.trace import Trace

Floats = NDArray[np.float64]


class SpatialTheoremHand(TheoremHand):
    """Spatial hand with 6 + 2n coordinates; the attitude error is a rotation vector."""

    def __init__(self, scenario: SpatialScenario) -> None:
        self._n, self._p = len(scenario.fingers), len(scenario.estimates)
        self._model = pack_model(scenario, [0.0] * 6)
        size = number_of_coordinates(self._n)
        super().__init__(self._model.law, size, scenario.controller, self._p)
        self._work, self._discrete = make_record(WORKSPACE), make_record(DISCRETE)
        self._state, self._senses = make_record(STATE), make_record(SENSES)

    def desired_poses(self, trace: Trace) -> Floats:
        """Desired poses of the object, ``(rows, 7)`` [m], unit quaternion w, x, y, z."""
        poses = trace.object_pose.copy()
        poses[:, :3] += trace.tracking_error[:, :3]
        poses[:, 3:] = _turned(poses[:, 3:], trace.tracking_error[:, 3:])
        return poses

    def evaluate_row(self, result: RunResult, k: int) -> None:
        """Evaluates row ``k`` of a run."""
        trace, discrete, n = result.trace, self._discrete, self._n
        parts = parts_of(self._state, n)
        parts.pose[:], parts.velocity[:] = trace.object_pose[k], trace.object_velocity[k]
        parts.slip[:], parts.slip_velocity[:] = trace.slip[k], trace.slip_velocity[k]
        discrete.estimates[: self._p] = trace.estimates[k]
        discrete.seeds["positions"][:n] = trace.joint_position[k].reshape(n, 3)
        discrete.piece = int(
            np.searchsorted(self._model.motion.breaks, trace.times[k], side="right")
        )
        self._set_phases(trace, k)
        # The theorems assume perfect measurements.
        senses, discrete.beliefs[:n] = self._senses, discrete.phases[:n]
        senses.measured.x[:] = self._state.x
        senses.slips[:n] = discrete.slips[:n]
        senses.gamma[:n, :2] = discrete.slips[:n] * discrete.directions[:n, :2]
        call(spatial_believe, self._model, discrete, trace.times[k], senses, self._work)
        discrete.torques[:n] = trace.joint_torque[k].reshape(n, 3)
        call(spatial_plant, self._model, discrete, self._state, self._work)

    def inertia_at(self, pose: Floats) -> Floats:
        """M~ at a pose ``(7,)``, without slip."""
        for part in (parts := parts_of(self._state, self._n)):
            part[:] = 0.0
        parts.pose[:] = pose
        self._discrete.phases[:], self._discrete.slips[:] = STICK, 0.0
        call(spatial_plant, self._model, self._discrete, self._state, self._work)
        return self._inertia(self._work.dynamics, self._model.truth, self._work.system)

    def _workspace(self) -> Record:
        return self._work.room

    def _accelerated(self, forces: Floats) -> Floats:
        """In the coordinates of the law, M~ is blkdiag(I, A, I)^T M~ blkdiag(I, A, I)."""
        work = self._work
        believed = self._inertia(work.believed_dynamics, work.believed, work.believed_system)
        found = np.zeros(self._size)
        found[:] = np.linalg.solve(believed, forces)
        found[3:6] = np.linalg.solve(work.room.rotation, found[3:6])
        return found

    def _unmodelled(self, result: RunResult, k: int) -> Floats:
        trace, work, n = result.trace, self._work, self._n
        found = np.zeros(self._size)
        missed = trace.friction_coefficient[k] - work.believed.friction[:n]
        normal = np.einsum("ic,ic->i", work.kin.frames[:n, 2], work.tip_forces[:n])
        pushed = -(missed * normal)[:, None] * work.gamma[:n, :2] * self._discrete.slips[:n]
        found[6:] = pushed.ravel()
        return found

    def _set_phases(self, trace: Trace, k: int) -> None:
        """Sets the phases of a row, with slip directions from the friction forces."""
        n, discrete, phases = self._n, self._discrete, trace.phase[k]
        along = trace.tangential_force[k].reshape(n, 2)
        sizes = np.linalg.norm(along, axis=1, keepdims=True)
        directions = -along / np.where(sizes > 0.0, sizes, 1.0)
        slips = np.repeat(phases != STICK, 2).reshape(n, 2).astype(float)
        if self._model.ways == 2:
            code = phases - SLIPS_ALONG_TANGENTS
            first = np.rint(code / 3.0)
            signs = np.stack([first, code - 3.0 * first], axis=1)
            directions = np.where(slips > 0.0, signs, 0.0)
            slips = np.abs(directions)
        discrete.phases[:n] = np.where(slips.any(axis=1), np.maximum(phases, SLIP), STICK)
        discrete.slips[:n], discrete.directions[:n, :2] = slips, directions
        discrete.frozen[:n] = 1

    def _inertia(self, dynamics: Record, truth: Record, system: Record) -> Floats:
        """M~ of Eq. 18, ``(6 + 2n, 6 + 2n)``."""
        kin, slips = self._work.kin, self._discrete.slips
        found = np.zeros((self._size, self._size))
        found[:3, :3] = truth.object_mass * np.eye(3)
        found[3:6, 3:6] = _symmetric(system.body)
        for i in range(self._n):
            slip = number_of_coordinates(i)  # The slips of contact i follow those before it.
            columns = [*range(6), slip, slip + 1]
            moves = np.hstack([np.eye(3), -_cross(kin.arms[i]), kin.frames[i, :2].T])
            forces = _symmetric(dynamics.inertia[i]) @ moves
            found[:6, columns] += moves[:, :6].T @ forces
            for axis, row in enumerate(columns[6:]):
                if slips[i, axis]:
                    found[row, columns] = system.normals[i, axis] @ forces
                else:
                    found[row, row] = 1.0
        return found


def _symmetric(entries: Floats) -> Floats:
    return entries[np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])]


def _cross(v: Floats) -> Floats:
    """Skew-symmetric matrix S(v) with S(v) w = v x w."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def _turned(quaternions: Floats, turns: Floats) -> Floats:
    """Rotates unit quaternions ``(rows, 4)`` by rotation vectors ``(rows, 3)`` [rad]."""
    angles = np.linalg.norm(turns, axis=1, keepdims=True)
    w, v = np.cos(0.5 * angles), 0.5 * np.sinc(0.5 * angles / np.pi) * turns
    w0, v0 = quaternions[:, :1], quaternions[:, 1:]
    scalar = w * w0 - np.sum(v * v0, axis=1, keepdims=True)
    return np.hstack([scalar, w * v0 + w0 * v + np.cross(v, v0)])
