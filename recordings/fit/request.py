"""Request of a fit to a service: a stored recording, a scenario, and free parameters."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from slipgrasp.core.fit.fit import FitOptions
from slipgrasp.core.fit.problem import FitError, FitProblem
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.scenario.field_errors import nearest
from slipgrasp.core.scenario.loading import scenario_from_mapping
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.trace import Trace
from slipgrasp.recordings.fit.run_fit import read_observations
from slipgrasp.recordings.store.store import RecordingStore


def split(text: str) -> list[str]:
    """Splits a list with commas."""
    return [part.strip() for part in text.split(",") if part.strip()]


def read_noise(text: str) -> dict[str, float]:
    """Parses signals with the standard deviations of their noise, such as ``slip:2e-4,x:1e-3``.

    Raises:
        FitError: If a deviation is not a number.
    """
    noise: dict[str, float] = {}
    for part in split(text):
        name, _, value = part.partition(":")
        try:
            noise[name.strip()] = float(value)
        except ValueError:
            message = f"signals needs SIGNAL:NOISE, such as slip:2e-4, not '{part[:60]}'"
            raise FitError(message, "signals") from None
    return noise


@dataclass(frozen=True, slots=True, kw_only=True)
class FitRequest:
    """Request of a fit.

    Attributes:
        recording: Id of the recording, measured data or a run.
        scenario: Scenario to simulate, as plain values.
        free: Parameters to find, as in `FitProblem.make`.
        signals: Standard deviation of the noise, in SI units, by signal or column.
        nuisance: Measurement errors to find in addition.
        held_out: Ids of other recordings to predict.
        compare: Additional free parameters of other models, one tuple per model.
        starts: Number of starts.
        twins: Number of synthetic twins.
        seed: Seed of starts and twins.
        title: Title by the user; may be empty.
    """

    recording: str
    scenario: dict[str, Any]
    free: tuple[str, ...]
    signals: dict[str, float]
    nuisance: tuple[str, ...] = ()
    held_out: tuple[str, ...] = ()
    compare: tuple[tuple[str, ...], ...] = ()
    starts: int = 20
    twins: int = 0
    seed: int = 0
    title: str = ""

    def paths(self, runs: RecordingStore) -> list[Path]:
        """Files of its recordings, of which the first is fitted.

        Raises:
            RecordingNotFoundError: If a recording is missing.
        """
        return [runs.get(each).path for each in (self.recording, *self.held_out)]

    def read(self, runs: RecordingStore) -> tuple[FitProblem, FitOptions]:
        """Reads the recordings, and checks the fit.

        Raises:
            FitError: If the fit is not possible.
            ScenarioError: If the scenario is not valid, or cannot be as long as the data.
            RecordingError: If a recording is missing or damaged.
        """
        data, *others = [read_observations(path, self.signals) for path in self.paths(runs)]
        scenario = scenario_from_mapping(self.scenario)
        problem = FitProblem.make(scenario, self.free, data, self.nuisance)
        for keys in self.compare:
            FitProblem.make(scenario, keys, data)
        _check_signals(problem)
        held_out = tuple(zip(self.held_out, others, strict=True))
        options = FitOptions(
            starts=self.starts,
            seed=self.seed,
            twins=self.twins,
            held_out=held_out,
            added=self.compare,
        )
        options.check()
        return problem, options


def _check_signals(problem: FitProblem) -> None:
    """Checks that runs have all signals, before simulating any."""
    shape = Simulation(problem.scenario).shape
    names = [c.name for c in columns_of(Trace.from_rows(shape, np.zeros((1, shape.num_columns))))]
    for name in problem.data.names:
        if name not in names:
            near = nearest(name, names)
            message = f"signals: runs of this scenario have no {name}{near}; leave it out"
            raise FitError(message, "signals")
