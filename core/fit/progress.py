"""Progress of a fit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from slipgrasp.core.fit.optimiser import Minimum
from slipgrasp.core.fit.problem import FitProblem

Points = tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class FitProgress:
    """The progress of a fit.

    Attributes:
        stage: Current stage, in a few words.
        share: Completed fraction of the stage, 0 to 1.
        evaluations: Number of different runs so far, without those of twins.
        best: Values of the best run so far, by key; empty until the first search has ended.
        profiles: Values and rise of chi-squared there, increasing, by key, as far as computed.
        threshold: Rise of chi-squared at the ends of the intervals; None until profiles begin.
    """

    stage: str = ""
    share: float = 0.0
    evaluations: int = 0
    best: Mapping[str, float] | None = None
    profiles: Mapping[str, Points] | None = None
    threshold: float | None = None


Watch = Callable[[FitProgress], None]


class ProgressReports:
    """Collects the progress of a fit, and reports every change.

    Args:
        problem: The fit.
        watch: Called with the progress.
    """

    def __init__(self, problem: FitProblem, watch: Watch) -> None:
        self._parameters = problem.parameters
        self._problem = problem
        self._watch = watch
        self._now = FitProgress()

    def enter(self, stage: str, share: float) -> None:
        """Reports the stage and its completed fraction."""
        self._report(replace(self._now, stage=stage, share=share))

    def count(self, evaluations: int) -> None:
        """Reports the number of runs."""
        self._report(replace(self._now, evaluations=evaluations))

    def improve(self, best: Minimum, threshold: float | None = None) -> None:
        """Reports the lowest minimum so far, from which new profiles start."""
        values = self._problem.values_at(best.shares)
        named = {p.key: value for p, value in zip(self._parameters, values, strict=True)}
        known = {p.key: ((named[p.key], 0.0),) for p in self._parameters}
        profiles = None if threshold is None else known
        self._report(replace(self._now, best=named, profiles=profiles, threshold=threshold))

    def add_point(self, index: int, share: float, rise: float) -> None:
        """Reports a point of the profile of a parameter."""
        parameter = self._parameters[index]
        profiles = dict(self._now.profiles or {})
        point = (parameter.value_at(share), rise)
        profiles[parameter.key] = tuple(sorted({*profiles.get(parameter.key, ()), point}))
        self._report(replace(self._now, profiles=profiles))

    def _report(self, progress: FitProgress) -> None:
        self._now = progress
        self._watch(progress)
