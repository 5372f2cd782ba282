"""Assumptions and bounds of the paper's theorems along a run (Eq. 20 and 50 to 57).

The kernel evaluates the state of every row again; runs do not depend on these quantities. The
theorems apply to the torque of Eq. 23 and 27: another ``distribution`` of the forces adds a
disturbance that tau_d does not include.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Annotated, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.theorem_hand import PlanarTheoremHand, TheoremHand
from slipgrasp.core.scenario import HandScenario, PlanarScenario, Scenario
from slipgrasp.core.scenario.scenario import of_hand
from slipgrasp.core.trace.columns import Column
from slipgrasp.core.trace.signals import Signal

Floats = NDArray[np.float64]

KINDS = ("theorem-3", "theorem-4")
WINDOW = 0.1  # T of Eq. 20 [s]


def _signal(unit: str, text: str) -> Signal:
    return Signal("premises", "", unit, text, column="premise")


class PremisesError(SlipgraspError, ValueError):
    """Raised if the theorems do not apply to a run."""

    def __init__(self, scenario: Scenario) -> None:
        if not scenario.space.has_hand:
            super().__init__("the theorems apply to hands; this run has none")
            return
        super().__init__(
            f"the theorems apply to {' and '.join(KINDS)} without timed changes and patches; this "
            f"run has controller.kind '{scenario.controller.kind}', {len(scenario.changes)} changes"
            f" and {len(scenario.patches)} patches"
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Premises:
    """Assumptions and bounds of Theorems 2 to 4, one value per row of the trace.

    ``r_1`` of Eq. 50 excludes positions with zero gain, usually those of slips: neither V nor Q
    depends on them, and the smallest eigenvalue of K* would always be 0. Values in different SI
    units are added as in the paper. Each attribute except ``times`` [s] has a `Signal`.
    """

    times: Floats
    least_excitation: Annotated[
        Floats,
        _signal(
            "1",
            f"Smallest eigenvalue of the integral of Eq. 20 over the last {WINDOW:g} s; none "
            f"before {WINDOW:g} s.",
        ),
    ]
    greatest_excitation: Annotated[Floats, _signal("1", "Largest eigenvalue of the same integral.")]
    error: Annotated[
        Floats, _signal("1", "Norm of r_1, the tracking errors and the errors of the estimates.")
    ]
    disturbance: Annotated[Floats, _signal("1", "Norm of tau_d* (Eq. 51).")]
    pull: Annotated[Floats, _signal("1/s", "sigma_s (Eq. 29).")]
    least_eigenvalue: Annotated[Floats, _signal("1", "Smallest eigenvalue of K* (Eq. 53).")]
    radius: Annotated[
        Floats,
        _signal(
            "1",
            "T_d* / lambda_min(K*) of Eq. 55, with the largest disturbance of the run for T_d*; "
            "infinite if Eq. 55 gives no bound.",
        ),
    ]
    decrease: Annotated[
        Floats,
        _signal("1/s", "-r_1' K* r_1 + r_1' tau_d* of Eq. 52, which the paper takes for dV/dt."),
    ]

    def columns(self) -> list[Column]:
        """All attributes as additional columns of the trace, such as ``premise_error``."""
        return [
            Column(f"{signal.prefix}_{name}", signal.prefix, signal.unit, getattr(self, name))
            for name, signal in premise_signals().items()
        ]

    def describe_excitation(self) -> str:
        """Evaluates Eq. 20 along the desired motion, in one sentence."""
        told = np.isfinite(self.least_excitation)
        if not told.any():
            return (
                f"The run is shorter than a window of {WINDOW:g} s, over which Eq. 20 integrates."
            )
        least, greatest = self.least_excitation[told].min(), self.greatest_excitation[told].max()
        holds = "holds" if least > 0.0 else "does not hold"
        return (
            f"Over every {WINDOW:g} s of the desired motion the eigenvalues of Eq. 20 lie between "
            f"{least:.2g} and {greatest:.2g}, so its assumption {holds}; slip is not part of it."
        )

    def describe(self) -> str:
        """Describes the bound of Eq. 55 and the error of this run in one sentence."""
        finite = np.isfinite(self.radius)
        did = f"the error |r_1| went from {self.error[0]:.3g} to {self.error[-1]:.3g}, "
        did += f"at most {self.error.max():.3g}"
        if not finite.any():
            return f"Eq. 55 gives no bound, because sigma_s is always 0; {did}."
        share = 100.0 * float(np.mean(finite))
        return (
            f"The bound of Eq. 55 is finite in {share:.0f} % of the rows, with a radius of at "
            f"least {self.radius[finite].min():.3g}; {did}."
        )


@cache
def premise_signals() -> dict[str, Signal]:
    """The signals of `Premises` by attribute, in their order."""
    hints = get_type_hints(Premises, include_extras=True)
    return {name: get_args(hint)[1] for name, hint in hints.items() if name != "times"}


def describe_premises(result: RunResult) -> tuple[str, ...]:
    """Compares the assumptions and bounds of Theorems 1 to 4 with a run, in one sentence each.

    Args:
        result: A run for which `has_premises` holds.
    """
    premises, trace = find_premises(result), result.trace
    return (
        f"Theorem 1: joint speeds are at most {np.abs(trace.joint_velocity).max():.3g} rad/s, "
        f"normal forces at most {trace.normal_force.max():.3g} N.",
        f"Theorem 2: {premises.describe_excitation()}",
        f"Theorems 3 and 4: {premises.describe()}",
    )


def has_premises(scenario: Scenario) -> bool:
    """True if the theorems apply to a scenario: its law, and constant parameters."""
    is_constant = not (scenario.changes or scenario.patches)
    return scenario.space.has_hand and scenario.controller.kind in KINDS and is_constant


def find_premises(result: RunResult) -> Premises:
    """Evaluates the assumptions and bounds of the theorems along a run.

    Args:
        result: A run for which `has_premises` holds.

    Raises:
        PremisesError: If the theorems do not apply.
    """
    if not has_premises(result.scenario):
        raise PremisesError(result.scenario)
    trace, hand, pull = result.trace, _hand_of(of_hand(result.scenario)), _pull(result)
    gains = hand.adaptation_gains
    errors, disturbances = [], []
    for k in range(len(trace.times)):
        hand.evaluate_row(result, k)
        errors.append(hand.errors())
        disturbances.append(hand.disturbances(result, k))
    tracking, missed = np.array(errors), trace.true_parameters - trace.estimates
    pulled = 2.0 * pull[:, None] / gains
    error = np.hstack([tracking, missed])
    disturbance = np.hstack([disturbances, pulled * trace.true_parameters])
    least = pulled.min(axis=1, initial=np.linalg.eigvalsh(hand.weights)[0])
    sizes = np.linalg.norm(disturbance, axis=1)
    weighed = np.sum(tracking * (tracking @ hand.weights), axis=1)
    weighed += np.sum(pulled * missed**2, axis=1)
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
        decrease=np.sum(error * disturbance, axis=1) - weighed,
    )


def _hand_of(scenario: HandScenario) -> TheoremHand:
    if isinstance(scenario, PlanarScenario):
        return PlanarTheoremHand(scenario)
    # Compiled and loaded only for spatial hands.
    from slipgrasp.core.run.spatial_theorem_hand import SpatialTheoremHand

    return SpatialTheoremHand(scenario)


def _pull(result: RunResult) -> Floats:
    """sigma_s of Eq. 29, by row."""
    controller = of_hand(result.scenario).controller
    if controller.kind == "theorem-3":
        return np.zeros(len(result.trace.times))
    sizes = np.linalg.norm(result.trace.estimates, axis=1)
    return np.clip(sizes / controller.estimate_norm_bound - 1.0, 0.0, 1.0)


def _excitation(hand: TheoremHand, times: Floats, desired: Floats) -> Floats:
    """Smallest and largest eigenvalue of the integral of Eq. 20, by row (trapezoidal rule)."""
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
