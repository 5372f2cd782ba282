"""What the paper's theorems suppose and promise, as quantities along a run (Eq. 20 and 50 to 57).

The state of every row is evaluated again by the kernel; nothing here decides anything of a run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.kernel.compiler import call
from slipgrasp.core.kernel.flow import solve_plant, update_command, update_mechanics
from slipgrasp.core.kernel.packing import make_table, pack_model, whole_faces
from slipgrasp.core.kernel.records import make_record
from slipgrasp.core.kernel.state import STATE, parts_of
from slipgrasp.core.kernel.workspace import DISCRETE, WORKSPACE
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario

Floats = NDArray[np.float64]

KINDS = ("theorem-3", "theorem-4")
WINDOW = 0.1  # T of Eq. 20 [s]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Premises:
    """Premises and bounds of Theorems 2 to 4, one value per row of the trace.

    ``r_1`` of Eq. 50 is taken without the slips themselves: their gain is 0, so that neither V nor
    Q depends on them, and the least eigenvalue of K* would be 0 always. SI units throughout, as
    the paper adds them up.

    Attributes:
        times: Of the rows [s].
        least_excitation: Least eigenvalue of the integral of Eq. 20 over the last `WINDOW`; NaN
            before the end of the first.
        greatest_excitation: Its greatest eigenvalue.
        error: Norm of r_1, the tracking errors and the errors of the estimates.
        disturbance: Norm of tau_d* (Eq. 51).
        pull: sigma_s (Eq. 29).
        least_eigenvalue: That of K* (Eq. 53).
        radius: T_d* / lambda_min(K*) of Eq. 55, with the greatest disturbance of the run for T_d*;
            infinite where it says nothing.
        decrease: ``-r_1' K* r_1 + r_1' tau_d*`` of Eq. 52, which the paper takes for dV/dt.
    """

    times: Floats
    least_excitation: Floats
    greatest_excitation: Floats
    error: Floats
    disturbance: Floats
    pull: Floats
    least_eigenvalue: Floats
    radius: Floats
    decrease: Floats

    def describe(self) -> str:
        """What the bound of Eq. 55 says of this run, and what the error did, in one sentence."""
        finite = np.isfinite(self.radius)
        did = f"the error |r_1| went from {self.error[0]:.3g} to {self.error[-1]:.3g}, "
        did += f"at most {self.error.max():.3g}"
        if not finite.any():
            return f"The bound of Eq. 55 is empty, for sigma_s is 0 throughout; {did}."
        share = 100.0 * float(np.mean(finite))
        return (
            f"The bound of Eq. 55 is finite in {share:.0f} % of the rows, where its radius is "
            f"{self.radius[finite].min():.3g} at least; {did}."
        )


def has_premises(scenario: Scenario) -> bool:
    """Whether the theorems speak of a scenario: of their laws and of constants that stay."""
    if scenario.in_space:
        return False
    return scenario.controller.kind in KINDS and not (scenario.changes or scenario.patches)


def find_premises(result: RunResult) -> Premises:
    """Evaluates the premises and bounds of the theorems along a run.

    Args:
        result: A run for which `has_premises` holds.
    """
    assert has_premises(result.scenario), "the theorems do not speak of this run"
    trace, hand = result.trace, _Hand(result.scenario)
    law = hand.model.law
    gains, pull = law.adaptation_gains[: hand.p], _pull(result)
    errors, disturbances = [], []
    for k in range(len(trace.times)):
        hand.evaluate_row(result, k)
        missed = trace.true_parameters[k] - trace.estimates[k]
        leak = 2.0 * pull[k] / gains * trace.true_parameters[k]
        errors.append(np.concatenate([*hand.errors(), missed]))
        disturbances.append(np.concatenate([*hand.disturbances(result, k), leak]))
    error, disturbance = np.array(errors), np.array(disturbances)
    pulled = 2.0 * pull[:, None] / gains
    weights = np.hstack([np.tile(hand.weights, (len(pull), 1)), pulled])
    least, sizes = weights.min(axis=1), np.linalg.norm(disturbance, axis=1)
    radius = np.full(len(least), np.inf)
    np.divide(sizes.max(), least, out=radius, where=least > 0.0)
    excitation = _excitation(hand, trace.times, trace.object_pose + trace.tracking_error)
    return Premises(
        times=trace.times,
        least_excitation=excitation[:, 0],
        greatest_excitation=excitation[:, 1],
        error=np.linalg.norm(error, axis=1),
        disturbance=sizes,
        pull=pull,
        least_eigenvalue=least,
        radius=radius,
        decrease=np.sum(error * (disturbance - weights * error), axis=1),
    )


def _pull(result: RunResult) -> Floats:
    """sigma_s of Eq. 29, by row."""
    controller = result.scenario.controller
    if controller.kind == "theorem-3":
        return np.zeros(len(result.trace.times))
    sizes = np.linalg.norm(result.trace.estimates, axis=1)
    return np.clip(sizes / controller.estimate_norm_bound - 1.0, 0.0, 1.0)


def _excitation(hand: _Hand, times: Floats, desired: Floats) -> Floats:
    """Least and greatest eigenvalue of the integral of Eq. 20, by row (trapezoidal rule)."""
    inertias = np.array([hand.inertia_at(pose) for pose in desired])
    squares = inertias @ inertias.transpose(0, 2, 1)
    pieces = 0.5 * (squares[1:] + squares[:-1]) * np.diff(times)[:, None, None]
    sums = np.concatenate([np.zeros((1, *squares.shape[1:])), np.cumsum(pieces, axis=0)])
    found = np.full((len(times), 2), np.nan)
    for k in np.flatnonzero(times >= WINDOW):
        first = int(np.searchsorted(times, times[k] - WINDOW, side="right")) - 1
        share = (times[k] - WINDOW - times[first]) / (times[first + 1] - times[first])
        start = (1.0 - share) * sums[first] + share * sums[first + 1]
        eigenvalues = np.linalg.eigvalsh(sums[k] - start)
        found[k] = eigenvalues[0], eigenvalues[-1]
    return found


class _Hand:
    """A hand whose states the kernel evaluates.

    Attributes:
        model: Its constants.
        p: How many unknowns it has.
        weights: Diagonal of Q, without the slips themselves (Eq. 25, 53).
    """

    def __init__(self, scenario: Scenario) -> None:
        self.n, self.p = len(scenario.fingers), len(scenario.estimates)
        self.size = 3 + self.n
        self.model = pack_model(make_table(scenario), whole_faces())
        law = self.model.law
        self._p12, self._p22 = law.lyapunov_12[: self.size], law.lyapunov_22[: self.size]
        self._moved = law.position_gains[: self.size] > 0.0
        # 2 (K_v P_22 - P_12) = Q, also where K_p = 0 and Q weighs the velocity alone.
        weights = 2.0 * (law.velocity_gains[: self.size] * self._p22 - self._p12)
        self.weights = np.concatenate([weights[self._moved], weights])
        self._work, self._discrete = make_record(WORKSPACE), make_record(DISCRETE)
        self._state = make_record(STATE)

    def evaluate_row(self, result: RunResult, k: int) -> None:
        """Evaluates row ``k`` of a run."""
        trace = result.trace
        parts = parts_of(self._state, self.n, self.p)
        parts.pose[:], parts.velocity[:] = trace.object_pose[k], trace.object_velocity[k]
        parts.slip[:], parts.slip_velocity[:] = trace.slip[k], trace.slip_velocity[k]
        parts.estimates[:] = trace.estimates[k]
        self._evaluate(trace.times[k], trace.phase[k])

    def inertia_at(self, pose: Floats) -> Floats:
        """M~ at a pose, without slip: M~_d of Eq. 20 at the desired one."""
        parts = parts_of(self._state, self.n, self.p)
        for part in parts:
            part[:] = 0.0
        parts.pose[:] = pose
        self._evaluate(0.0, np.zeros(self.n))
        return self._work.inertia[: self.size, : self.size].copy()

    def errors(self) -> tuple[Floats, Floats]:
        """Xi of the evaluated state (Eq. 41), without the slips themselves."""
        room = self._work.room
        return room.error[: self.size][self._moved].copy(), room.error_rate[: self.size].copy()

    def disturbances(self, result: RunResult, k: int) -> tuple[Floats, Floats]:
        """-2 P E M~^-1 tau_d of the evaluated row (Eq. 51), without the slips themselves."""
        estimated = self._work.estimated_inertia[: self.size, : self.size]
        moved = np.linalg.solve(estimated, self._unmodelled(result, k))
        return -2.0 * (self._p12 * moved)[self._moved], -2.0 * self._p22 * moved

    def _unmodelled(self, result: RunResult, k: int) -> Floats:
        """tau_d of Eq. 33: what the true friction makes of the torques, beyond what is believed."""
        trace, kin = result.trace, self._work.kin
        found = np.zeros(self.size)
        for i in range(self.n):
            force = np.linalg.solve(kin.jacobians[i].T, trace.joint_torque[k, 2 * i : 2 * i + 2])
            normal = force[0] * kin.tangents[i, 1] - force[1] * kin.tangents[i, 0]
            missed = trace.friction_coefficient[k, i] - self._work.believed.friction[i]
            found[3 + i] = -trace.phase[k, i] * missed * normal
        return found

    def _evaluate(self, t: float, phases: Floats) -> None:
        model, discrete = self.model, self._discrete
        discrete.phases[: self.n] = discrete.beliefs[: self.n] = phases
        discrete.piece = int(np.searchsorted(model.motion.breaks, t, side="right"))
        call(update_mechanics, model, self._state, self._work)
        call(update_command, model, discrete, t, self._state, self._work)
        call(solve_plant, model, discrete, self._work)
