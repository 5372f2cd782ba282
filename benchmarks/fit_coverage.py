"""How often the 95 % intervals of fits contain the true values, on synthetic twins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from benchmarks.report import Table, format_share
from slipgrasp.core.fit.fit import FitOptions, fit
from slipgrasp.core.fit.objective import Objective, event_weights
from slipgrasp.core.fit.optimiser import minimise
from slipgrasp.core.fit.problem import DELAY, FitProblem, Observations
from slipgrasp.core.fit.profile import THRESHOLD_95
from slipgrasp.core.fit.report import FitReport
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.signals import Floats

SEED = 1
TWINS = 200
DURATION = 0.5  # [s]
POSES = {"object_pose": 2e-4, "slip": 2e-4}


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A fit problem.

    Attributes:
        preset: The scenario.
        truth: True values of the free parameters; the delay is that of the measurement.
        noise: Standard deviations of the noise, by signal.
    """

    preset: str
    truth: dict[str, float]
    noise: dict[str, float] = field(default_factory=lambda: POSES)

    @property
    def name(self) -> str:
        """The preset, and the signals measured in addition to poses and slips."""
        late = ", late" if DELAY in self.truth else ""
        return self.preset + (f", forces{late}" if set(self.noise) - set(POSES) else "")


CASES = (
    Case(
        preset="paper-case-1",
        truth={"object.mass": 1.13, "fingers.0.friction": 0.27, "fingers.1.friction": 0.23},
    ),
    Case(preset="tilted-object", truth={"object.mass": 1.1, "fingers.0.friction": 0.42}),
    Case(preset="spatial-prism", truth={"object.mass": 1.1, "fingers.0.friction": 0.35}),
    Case(
        preset="paper-case-1",
        truth={"object.mass": 1.13, "fingers.0.friction": 0.27, DELAY: 3e-3},
        noise={**POSES, "normal_force": 0.1},
    ),
    Case(
        preset="gripper-lift",
        truth={"object.mass": 0.9, "fingers.0.friction": 0.5},
        noise={"object_pose": 2e-4, "tangential_force": 0.1},
    ),
)


def run(seed: int = SEED, twins: int = TWINS) -> list[Table]:
    """The table ``fit-coverage``."""
    rows = []
    for case in CASES:
        problem = make_problem(case)
        report = fit(problem, FitOptions(starts=1, seed=seed, twins=twins))
        assert report.coverage is not None
        linear = cover_linear(problem, report, seed, twins)
        for index, (key, covered) in enumerate(report.coverage.covered.items()):
            found, share = report.parameters[key], format_share(covered, twins)
            expected = f"{linear[index]:.0f}"
            rows.append((case.name, key, found.kind, str(covered), share, expected))
    heads = ("scenario", "parameter", "class", f"of {twins}", "share (95 % interval)")
    return [Table("fit-coverage", (*heads, "of a linear model"), tuple(rows), page="fit.md")]


def cover_linear(problem: FitProblem, report: FitReport, seed: int, twins: int) -> Floats:
    """The number of intervals that contain the truth if the signals were linear in the parameters.

    With the noise of the twins: a number that differs from that of the fit is due to the model,
    another one to chance.

    Args:
        problem: The fitted problem.
        report: Its fit, whose best run is the truth of the twins.
        seed: Seed of the twins.
        twins: Their number.
    """
    weights = event_weights(problem.data, report.events)
    start = [p.share_of(report.best[p.key]) for p in problem.parameters]
    jacobian = minimise(Objective(problem, weights=weights), np.array(start)).jacobian
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    gain = covariance @ jacobian.T / np.sqrt(np.diag(covariance))[:, None]
    covered = np.zeros(len(start))
    for number in range(twins):
        noise = weights * np.random.default_rng([seed, number]).standard_normal(weights.shape)
        covered += (gain @ noise.ravel()) ** 2 <= THRESHOLD_95
    return covered


def make_problem(case: Case) -> FitProblem:
    """A fit of a run with the true values, with data without noise: its twins are centred on it."""
    values = {key: value for key, value in case.truth.items() if key != DELAY}
    run = simulate_briefly(case.preset, values)
    problem = problem_of(run, [*values], case.noise, [DELAY] if DELAY in case.truth else [])
    measured = problem.sample(run, [*case.truth.values()])
    return problem.with_data(replace(problem.data, values=measured))


def simulate_briefly(preset: str, values: Mapping[str, Any]) -> RunResult:
    """The run of a preset with other values, for half a second."""
    return simulate(with_values(load_scenario(preset), {**values, "simulation.duration": DURATION}))


def problem_of(
    run: RunResult, keys: Sequence[str], noise: dict[str, float], nuisance: Sequence[str] = ()
) -> FitProblem:
    """A fit of parameters to the signals of a run.

    Args:
        run: The run.
        keys: The parameters.
        noise: Standard deviations of the signals.
        nuisance: Parameters of the measurement.
    """
    columns = {c.name: (c.unit, c.values) for c in columns_of(run.trace) if not c.holds_phases}
    data = Observations.choose(run.trace.times, columns, noise)
    return FitProblem.make(run.scenario, [*keys], data, [*nuisance])
