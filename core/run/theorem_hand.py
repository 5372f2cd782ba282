"""Evaluation of the states of a hand for the theorems of the paper."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.kernel.compilation.compiler import call
from slipgrasp.core.kernel.compilation.records import Record, make_record
from slipgrasp.core.kernel.planar.flow import solve_plant, update_command, update_mechanics
from slipgrasp.core.kernel.planar.packing import make_table, pack_model, whole_faces
from slipgrasp.core.kernel.planar.state import STATE, parts_of
from slipgrasp.core.kernel.planar.workspace import DISCRETE, WORKSPACE
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import PlanarScenario
from slipgrasp.core.scenario.scenario import AnyController
from slipgrasp.core.trace.trace import Trace

Floats = NDArray[np.float64]


class TheoremHand(ABC):
    """Quantities of the theorems at a state; for coordinates without K_p, xi has only the rate.

    Args:
        law: The kernel's constants of the law.
        size: Number of coordinates of the reduced form.
        controller: Parameters of the controller.
        num_unknowns: Number of estimates.

    Attributes:
        adaptation_gains: Diagonal of Gamma.
        weights: Q (Eq. 25, 53), ``(x, x)`` for the x entries of xi.
    """

    def __init__(
        self, law: Record, size: int, controller: AnyController, num_unknowns: int
    ) -> None:
        self._size = size
        self.adaptation_gains: Floats = law.adaptation_gains[:num_unknowns].copy()
        self._kept = np.append(law.position_gains[:size] > 0.0, np.full(size, True))
        self.weights: Floats = _weights(controller, size)[np.ix_(self._kept, self._kept)]
        # Rows of P for the rates.
        p12, p22 = np.diag(law.lyapunov_12[:size]), np.diag(law.lyapunov_22[:size])
        self._rate_rows = np.hstack([p12, p22])
        if law.couples:
            self._rate_rows += law.couplings[size : 2 * size, : 2 * size]

    @abstractmethod
    def desired_poses(self, trace: Trace) -> Floats:
        """Desired poses of the object, by row."""

    @abstractmethod
    def evaluate_row(self, result: RunResult, k: int) -> None:
        """Evaluates row ``k`` of a run."""

    @abstractmethod
    def inertia_at(self, pose: Floats) -> Floats:
        """M~ at a pose, without slip; at the desired pose, M~_d of Eq. 20."""

    @abstractmethod
    def _workspace(self) -> Record:
        """Workspace of the law, with e and e'."""

    @abstractmethod
    def _accelerated(self, forces: Floats) -> Floats:
        """Product of the estimated M~^-1 and generalised forces ``(size,)``."""

    @abstractmethod
    def _unmodelled(self, result: RunResult, k: int) -> Floats:
        """Disturbance tau_d of Eq. 33, due to the error of the estimated friction."""

    def errors(self) -> Floats:
        """Errors xi of the evaluated state (Eq. 41), ``(x,)``."""
        work, size = self._workspace(), self._size
        return np.append(work.error[:size], work.error_rate[:size])[self._kept]

    def disturbances(self, result: RunResult, k: int) -> Floats:
        """Disturbance -2 P E M~^-1 tau_d of the evaluated row (Eq. 51), ``(x,)``."""
        moved = self._accelerated(self._unmodelled(result, k))
        return -2.0 * (moved @ self._rate_rows)[self._kept]


def _weights(controller: AnyController, size: int) -> Floats:
    """Q for all coordinates and their rates."""
    if controller.lyapunov_matrix:
        return np.array(controller.lyapunov_matrix)
    diagonal = np.broadcast_to(np.asarray(controller.lyapunov_weight, dtype=float), (size,))
    return np.diag(np.tile(diagonal, 2))


class PlanarTheoremHand(TheoremHand):
    """A planar hand: 3 + n coordinates."""

    def __init__(self, scenario: PlanarScenario) -> None:
        self._n, self._p = len(scenario.fingers), len(scenario.estimates)
        self._model = pack_model(make_table(scenario), whole_faces())
        super().__init__(self._model.law, 3 + self._n, scenario.controller, self._p)
        self._work, self._discrete = make_record(WORKSPACE), make_record(DISCRETE)
        self._state = make_record(STATE)

    def desired_poses(self, trace: Trace) -> Floats:
        """Desired poses of the object, ``(rows, 3)`` [m, m, rad]."""
        return trace.object_pose + trace.tracking_error

    def evaluate_row(self, result: RunResult, k: int) -> None:
        """Evaluates row ``k`` of a run."""
        trace = result.trace
        parts = parts_of(self._state, self._n, self._p)
        parts.pose[:], parts.velocity[:] = trace.object_pose[k], trace.object_velocity[k]
        parts.slip[:], parts.slip_velocity[:] = trace.slip[k], trace.slip_velocity[k]
        parts.estimates[:] = trace.estimates[k]
        self._evaluate(trace.times[k], trace.phase[k])

    def inertia_at(self, pose: Floats) -> Floats:
        """M~ at a pose ``(3,)``, without slip."""
        for part in (parts := parts_of(self._state, self._n, self._p)):
            part[:] = 0.0
        parts.pose[:] = pose
        self._evaluate(0.0, np.zeros(self._n))
        return self._work.inertia[: self._size, : self._size].copy()

    def _workspace(self) -> Record:
        return self._work.room

    def _accelerated(self, forces: Floats) -> Floats:
        believed = self._work.estimated_inertia[: self._size, : self._size]
        return np.linalg.solve(believed, forces)

    def _unmodelled(self, result: RunResult, k: int) -> Floats:
        trace, kin = result.trace, self._work.kin
        found = np.zeros(self._size)
        slips = found[-self._n :]
        for i in range(self._n):
            force = np.linalg.solve(kin.jacobians[i].T, trace.joint_torque[k, 2 * i : 2 * i + 2])
            normal = force[0] * kin.tangents[i, 1] - force[1] * kin.tangents[i, 0]
            missed = trace.friction_coefficient[k, i] - self._work.believed.friction[i]
            slips[i] = -trace.phase[k, i] * missed * normal
        return found

    def _evaluate(self, t: float, phases: Floats) -> None:
        model, discrete = self._model, self._discrete
        discrete.phases[: self._n] = discrete.beliefs[: self._n] = phases
        discrete.piece = int(np.searchsorted(model.motion.breaks, t, side="right"))
        call(update_mechanics, model, self._state, self._work)
        call(update_command, model, discrete, t, self._state, self._work)
        call(solve_plant, model, discrete, self._work)
