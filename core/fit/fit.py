"""Stages of a fit: many starts, refinement at events, profiles, twins, predictions."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from slipgrasp.core.fit.contacts import StuckContact, contacts_until, stuck_contacts
from slipgrasp.core.fit.neighbourhood import Neighbourhood, explore
from slipgrasp.core.fit.objective import (
    Evaluate,
    Objective,
    evaluate_here,
    event_weights,
    run_at,
)
from slipgrasp.core.fit.optimiser import SAME_MINIMUM, Minimum, minimise
from slipgrasp.core.fit.problem import (
    JUMPY_UNITS,
    FitError,
    FitProblem,
    FreeParameter,
    Observations,
)
from slipgrasp.core.fit.profile import (
    BETTER,
    THRESHOLD_95,
    BetterMinimumError,
    Minimise,
    Profile,
    contains,
    profile,
)
from slipgrasp.core.fit.progress import FitProgress, ProgressReports, Watch
from slipgrasp.core.fit.report import (
    Coverage,
    FitReport,
    FittedParameter,
    HeldOut,
    ModelComparison,
    SignalResidual,
    StartReport,
)
from slipgrasp.core.fit.search import scan_frictions, search_from_starts
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.signals import Floats

MAX_EVALUATIONS = 10_000
"""Largest number of runs of a fit, except for twins; equal to that of a study."""

RECENT_BYTES = 16_000_000
"""Largest memory of the sampled signals that are kept."""

_MOST_BETTER = 10
_AT_LIMIT = 1e-6


def watch_nothing(progress: FitProgress) -> None:
    """Ignores the progress."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FitOptions:
    """Options of a fit.

    Attributes:
        starts: Number of starts; the first is the scenario.
        seed: Seed of the other starts and of the twins.
        twins: Number of synthetic twins; 0 for none.
        held_out: Other data to predict, by name.
        added: Other models to compare: additional free keys, one tuple per model.
    """

    starts: int = 20
    seed: int = 0
    twins: int = 0
    held_out: tuple[tuple[str, Observations], ...] = ()
    added: tuple[tuple[str, ...], ...] = ()

    def check(self) -> None:
        """Raises `FitError` if an option exceeds its limits."""
        for name, value, low, high in (
            ("starts", self.starts, 1, 256),
            ("twins", self.twins, 0, 1000),
            ("seed", self.seed, 0, 2**53 - 1),
        ):
            if not low <= value <= high:
                raise FitError(f"{name} is {value}; allowed: {low} … {high}", name)


def fit(
    problem: FitProblem,
    options: FitOptions | None = None,
    *,
    evaluate: Evaluate = evaluate_here,
    evaluate_twin: Evaluate = evaluate_here,
    watch: Watch = watch_nothing,
) -> FitReport:
    """Fits the free parameters of a problem.

    Args:
        problem: Scenario, free parameters and data.
        options: Options; the defaults if None.
        evaluate: Returns the sampled signals for values of the parameters.
        evaluate_twin: The same for fits of twins.
        watch: Called with the progress, after every run.

    Raises:
        FitError: If it needs too many runs, or runs have no such signal.
        ScenarioError: If even the best run is not allowed.
    """
    options = options or FitOptions()
    options.check()
    reports = ProgressReports(problem, watch)
    counted = _Counted(evaluate, reports)
    objective = Objective(problem, counted)
    minima = search_from_starts(objective, options.starts, options.seed, reports)
    best = scan_frictions(objective, minima, reports)
    starts = _start_report(minima, best)
    objective, best = _refine(objective, best)
    best, profiles, threshold, around = _profiles(objective, best, reports)
    models = _compare(problem, objective, best, options, counted, reports)
    twin = Objective(problem, evaluate_twin, weights=objective.weights)
    coverage = _cover(twin, best, around, options, threshold, reports) if options.twins else None
    run = run_at(problem, problem.values_at(best.shares))
    stuck = stuck_contacts(objective, best, profiles, threshold)
    return replace(
        _report(objective, best, profiles, threshold, run, stuck),
        starts=starts,
        evaluations=counted.count,
        held_out=tuple(_predict(problem, best, *each) for each in options.held_out),
        models=models,
        coverage=coverage,
    )


class _Counted:
    """Counts the runs, ends a fit that needs too many, and keeps recent ones: many are repeated."""

    def __init__(self, evaluate: Evaluate, reports: ProgressReports) -> None:
        self._evaluate = evaluate
        self._reports = reports
        self._seen: set[tuple[float, ...]] = set()
        self._recent: OrderedDict[tuple[float, ...], Floats] = OrderedDict()

    @property
    def count(self) -> int:
        """Number of different runs."""
        return len(self._seen)

    def __call__(self, problem: FitProblem, values: tuple[float, ...]) -> Floats:
        if values in self._recent:
            self._recent.move_to_end(values)
            return self._recent[values]
        found = self._recent[values] = self._run(problem, values)
        while len(self._recent) * found.nbytes > RECENT_BYTES:
            self._recent.popitem(last=False)
        return found

    def _run(self, problem: FitProblem, values: tuple[float, ...]) -> Floats:
        self._seen.add(values)
        if self.count > MAX_EVALUATIONS:
            raise FitError(
                f"the fit needs more than {MAX_EVALUATIONS} runs; free fewer parameters, give "
                "narrower ranges, or use fewer starts"
            )
        self._reports.count(self.count)
        return self._evaluate(problem, values)


def _start_report(minima: Sequence[Minimum], best: Minimum) -> StartReport:
    ends = tuple(minimum.chi_squared for minimum in minima)
    same = sum(end - best.chi_squared < SAME_MINIMUM for end in ends)
    return StartReport(count=len(ends), same_minimum=same, chi_squared=ends)


def _refine(objective: Objective, best: Minimum) -> tuple[Objective, Minimum]:
    """Reduces the weights of samples near events of the best run, where signals may jump."""
    problem = objective.problem
    if not set(problem.data.units) & set(JUMPY_UNITS):
        return objective, best
    run = run_at(problem, problem.values_at(best.shares))
    weights = event_weights(problem.data, [change.time for change in run.phase_changes])
    weighted = objective.with_weights(weights)
    return weighted, minimise(weighted, best.shares)


def _profiles(
    objective: Objective, best: Minimum, reports: ProgressReports
) -> tuple[Minimum, list[Profile], float, Neighbourhood]:
    """All profiles, starting from the lowest minimum found, with runs around it."""
    for _ in range(_MOST_BETTER):
        scale = max(1.0, best.chi_squared / max(objective.degrees_of_freedom, 1.0))
        threshold = THRESHOLD_95 * scale
        try:
            profiles = _profiles_from(objective, best, threshold, reports)
            around = explore(objective, best, profiles, threshold)
            if around.lines:
                lowest = around.minimise(objective, best.shares)
                if lowest.chi_squared < best.chi_squared - BETTER:
                    raise BetterMinimumError(lowest)
                best = lowest
                profiles = _profiles_from(objective, best, threshold, reports, around.minimise)
        except BetterMinimumError as better:
            best = minimise(objective, better.minimum.shares)
            continue
        return best, profiles, threshold, around
    raise FitError(
        f"chi-squared has {_MOST_BETTER} minima, each lower than the last; free fewer parameters, "
        "or give narrower ranges"
    )


def _profiles_from(
    objective: Objective,
    best: Minimum,
    threshold: float,
    reports: ProgressReports,
    search: Minimise = minimise,
) -> list[Profile]:
    """All profiles from one minimum."""
    reports.improve(best, threshold)
    profiles: list[Profile] = []
    count = len(best.shares)
    for index in range(count):
        reports.enter("profiles", index / count)
        note = partial(reports.add_point, index)
        profiles.append(profile(objective, best, index, threshold, note, search))
    return profiles


def _cover(
    objective: Objective,
    best: Minimum,
    around: Neighbourhood,
    options: FitOptions,
    threshold: float,
    reports: ProgressReports,
) -> Coverage:
    """Fits twins, and counts the intervals that contain the true value."""
    problem = objective.problem
    truth = objective.model(best.shares)
    truth = np.where(np.isnan(truth), problem.data.values, truth)
    noise = problem.data.sigmas * np.sqrt(threshold / THRESHOLD_95)
    covered = dict.fromkeys((parameter.key for parameter in problem.parameters), 0)
    for number in range(options.twins):
        reports.enter("twins", number / options.twins)
        generator = np.random.default_rng([options.seed, number])
        data = truth + noise * generator.standard_normal(truth.shape)
        twin = objective.with_data(data)
        for key, inside in zip(covered, _contained(twin, best, around, threshold), strict=True):
            covered[key] += inside
    return Coverage(twins=options.twins, seed=options.seed, covered=covered)


def _contained(
    twin: Objective, truth: Minimum, around: Neighbourhood, threshold: float
) -> list[bool]:
    """For each parameter, whether its interval contains the true value."""
    search, shares = around.minimise, truth.shares
    found = search(twin, shares)
    while True:
        try:
            return [
                contains(twin, found, index, threshold, shares, search)
                for index in range(len(shares))
            ]
        except BetterMinimumError as better:
            found = search(twin, better.minimum.shares)


def _compare(
    problem: FitProblem,
    objective: Objective,
    best: Minimum,
    options: FitOptions,
    evaluate: Evaluate,
    reports: ProgressReports,
) -> tuple[ModelComparison, ...]:
    """Fits the other models from the best run, and evaluates their predictions."""
    if not options.added:
        return ()
    compared = [_judged(problem, best, (), options)]
    for number, added in enumerate(options.added):
        reports.enter("other models", number / len(options.added))
        free = FitProblem.make(problem.scenario, added, problem.data).parameters
        known = len(problem.parameters) - sum(p.nuisance for p in problem.parameters)
        parameters = (*problem.parameters[:known], *free, *problem.parameters[known:])
        larger = replace(problem, parameters=parameters)
        shares = np.insert(best.shares, known, [p.share_of(p.start) for p in free])
        found = minimise(Objective(larger, evaluate, weights=objective.weights), shares)
        keys = tuple(parameter.key for parameter in free)
        compared.append(_judged(larger, found, keys, options))
    return tuple(compared)


def _judged(
    problem: FitProblem, found: Minimum, added: tuple[str, ...], options: FitOptions
) -> ModelComparison:
    predicted = [_predict(problem, found, *each) for each in options.held_out]
    return ModelComparison(
        added=added,
        chi_squared=found.chi_squared,
        held_out={each.name: each.chi_squared_per_value for each in predicted},
        values=_named(problem, found),
    )


def _named(problem: FitProblem, found: Minimum) -> dict[str, float]:
    values = problem.values_at(found.shares)
    return {p.key: value for p, value in zip(problem.parameters, values, strict=True)}


def _predict(problem: FitProblem, best: Minimum, name: str, data: Observations) -> HeldOut:
    """The residuals of the best run on other data."""
    objective = Objective(problem.with_data(data))
    residuals = objective.residuals(best.shares).reshape(data.values.shape)
    signals = tuple(_residuals(data, residuals))
    final = residuals[-1] * data.sigmas
    return HeldOut(
        name=name,
        chi_squared_per_value=float(np.mean(residuals**2)),
        signals=signals,
        final=dict(zip(data.names, map(float, final), strict=True)),
    )


def _residuals(data: Observations, residuals: Floats) -> list[SignalResidual]:
    """Residuals by signal, from residuals in standard deviations, shape (samples, signals)."""
    found = []
    for k, (name, unit) in enumerate(zip(data.names, data.units, strict=True)):
        column = residuals[:, k]
        apart = column - column.mean()
        power = float(apart @ apart)
        found.append(
            SignalResidual(
                name=name,
                unit=unit,
                sigma=float(data.sigmas[k]),
                rms=float(np.sqrt(np.mean(column**2)) * data.sigmas[k]),
                max=float(np.abs(column).max() * data.sigmas[k]),
                autocorrelation=float(apart[1:] @ apart[:-1]) / power if power > 0.0 else 0.0,
            )
        )
    return found


def _report(
    objective: Objective,
    best: Minimum,
    profiles: Sequence[Profile],
    threshold: float,
    run: RunResult,
    stuck: Mapping[int, StuckContact],
) -> FitReport:
    problem, end = objective.problem, float(objective.problem.data.times[-1])
    fitted = {
        parameter.key: _fitted(parameter, float(best.shares[k]), profiles[k], stuck.get(k))
        for k, parameter in enumerate(problem.parameters)
    }
    plain = Objective(problem, lambda _, values: objective.model(best.shares))
    residuals = plain.residuals(best.shares).reshape(problem.data.values.shape)
    edges = zip(problem.parameters, best.shares, strict=True)
    return FitReport(
        parameters=fitted,
        starts=StartReport(count=0, same_minimum=0, chi_squared=()),
        evaluations=0,
        held_out=(),
        chi_squared=best.chi_squared,
        degrees_of_freedom=objective.degrees_of_freedom,
        threshold=threshold,
        best=_named(problem, best),
        on_limit=tuple(p.key for p, s in edges if min(s, 1.0 - s) < _AT_LIMIT),
        residuals=tuple(_residuals(problem.data, residuals)),
        events=tuple(change.time for change in run.phase_changes),
        contacts=contacts_until(run, end),
    )


def _fitted(
    parameter: FreeParameter,
    share: float,
    found: Profile,
    stuck: StuckContact | None,
) -> FittedParameter:
    low, high = (None if s is None else parameter.value_at(s) for s in (found.low, found.high))
    kind, note = found.kind, ""
    if stuck is not None:
        kind, low, high, note = "only below", stuck.used, None, stuck.note
    return FittedParameter(
        key=parameter.key,
        unit=parameter.unit,
        value=parameter.value_at(share) if kind == "bounded" else None,
        low=low,
        high=high,
        kind=kind,
        limits=(parameter.low, parameter.high),
        start=parameter.start,
        profile=tuple((parameter.value_at(s), rise) for s, rise in found.points),
        note=note,
    )


def sampled_at(problem: FitProblem, report: FitReport) -> Floats:
    """The signals of the best run without noise, shape ``(samples, signals)``."""
    values = [report.best[parameter.key] for parameter in problem.parameters]
    return problem.sample(run_at(problem, values), values)
