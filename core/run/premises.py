"""What the paper's theorems suppose and promise, as quantities along a run (Eq. 20 and 50 to 57).

The state of every row is evaluated again by the kernel; nothing here decides anything of a run.
The theorems are about the torque of Eq. 23 and 27: where ``distribution`` shares the forces out
otherwise, what that disturbs is not in tau_d.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.theorem_hand import PlanarTheoremHand, TheoremHand
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

    def describe_excitation(self) -> str:
        """What Eq. 20 says along the desired motion, in one sentence."""
        told = np.isfinite(self.least_excitation)
        if not told.any():
            return (
                f"The run is shorter than a window of {WINDOW:g} s, over which Eq. 20 integrates."
            )
        least, greatest = self.least_excitation[told].min(), self.greatest_excitation[told].max()
        holds = "holds" if least > 0.0 else "does not hold"
        return (
            f"Over every {WINDOW:g} s of the desired motion the eigenvalues of Eq. 20 lie between "
            f"{least:.2g} and {greatest:.2g}, so its premise {holds}; of slip it says nothing."
        )

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


def tell_premises(result: RunResult) -> tuple[str, ...]:
    """What Theorems 1 to 4 suppose of a run and promise, and what it did, a sentence for each.

    Args:
        result: A run for which `has_premises` holds.
    """
    premises, trace = find_premises(result), result.trace
    return (
        f"Theorem 1: joints turned at {np.abs(trace.joint_velocity).max():.3g} rad/s and "
        f"fingertips pressed with {trace.normal_force.max():.3g} N at most.",
        f"Theorem 2: {premises.describe_excitation()}",
        f"Theorems 3 and 4: {premises.describe()}",
    )


def has_premises(scenario: Scenario) -> bool:
    """Whether the theorems speak of a scenario: of their laws and of constants that stay."""
    return scenario.controller.kind in KINDS and not (scenario.changes or scenario.patches)


def find_premises(result: RunResult) -> Premises:
    """Evaluates the premises and bounds of the theorems along a run.

    Args:
        result: A run for which `has_premises` holds.
    """
    assert has_premises(result.scenario), "the theorems do not speak of this run"
    trace, hand, pull = result.trace, _hand_of(result.scenario), _pull(result)
    gains = hand.adaptation_gains
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
    excitation = _excitation(hand, trace.times, hand.desired_poses(trace))
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


def _hand_of(scenario: Scenario) -> TheoremHand:
    if not scenario.in_space:
        return PlanarTheoremHand(scenario)
    # Compiled, and loaded, where someone asks for a hand in space only.
    from slipgrasp.core.run.spatial_theorem_hand import SpatialTheoremHand

    return SpatialTheoremHand(scenario)


def _pull(result: RunResult) -> Floats:
    """sigma_s of Eq. 29, by row."""
    controller = result.scenario.controller
    if controller.kind == "theorem-3":
        return np.zeros(len(result.trace.times))
    sizes = np.linalg.norm(result.trace.estimates, axis=1)
    return np.clip(sizes / controller.estimate_norm_bound - 1.0, 0.0, 1.0)


def _excitation(hand: TheoremHand, times: Floats, desired: Floats) -> Floats:
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
