"""Checks that every outcome is correct.

Random runs are checked by `benchmarks.outcome_checks`. Most are drawn so that every pair of levels
of all settings occurs; others are objects held by theorem 4 with physical bounds and continuous
control, whose estimates reach those bounds. Further runs are compared with their true results at
tight tolerances (`benchmarks.outcome_truth`).

`python -m benchmarks.outcomes POPULATION INDEX [--seed N]` prints a single run as a scenario file,
and its faults.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from importlib import import_module
from typing import NamedTuple

from benchmarks.outcome_checks import PLANAR, Check, Judge, Judgement
from benchmarks.outcome_truth import QUANTITIES, compare, measure_truth
from benchmarks.random_runs import (
    IN_SPACE,
    ON_BOUNDS,
    PAIRS,
    PAIRS_IN_SPACE,
    POPULATIONS,
    SOFT_GRASPS,
    draw,
    in_processes,
    reported,
)
from benchmarks.report import Table
from slipgrasp.core.run.simulator import prepare_kernel
from slipgrasp.core.scenario.loading import scenario_to_toml

COUNT = 20_000
ON_THEIR_BOUNDS = 2_000  # further runs
SEED = 14
# Those modules import this one.
JUDGED_BY = dict.fromkeys((PAIRS_IN_SPACE, IN_SPACE), "hands_in_space") | {
    SOFT_GRASPS: "soft_grasps"
}


class Campaign(NamedTuple):
    """Checked runs of one population.

    Attributes:
        population: One of `benchmarks.random_runs.POPULATIONS`.
        seed: Seed of the draws.
        checks: The checks by name.
        judgements: Results of the checks, by index.
    """

    population: str
    seed: int
    checks: Mapping[str, Check]
    judgements: list[Judgement]

    def failures(self, check: str) -> dict[int, float]:
        """Deviations of a failed check, by index of the run."""
        return {
            index: judgement.missed[check]
            for index, judgement in enumerate(self.judgements)
            if check in judgement.missed
        }


def run(seed: int = SEED) -> list[Table]:
    """The tables ``outcomes``, ``outcomes-endings`` and ``outcomes-truth``."""
    campaigns = [judge_many(PAIRS, COUNT, seed), judge_many(ON_BOUNDS, ON_THEIR_BOUNDS, seed)]
    return [*tabulate(campaigns), measure_truth(seed)]


def judge_many(population: str, count: int, seed: int, judge: Judge = PLANAR) -> Campaign:
    """Draws and checks runs.

    Args:
        population: One of `benchmarks.random_runs.POPULATIONS`.
        count: Number of runs, from index 0.
        seed: Seed of the draws.
        judge: The checks of these runs.
    """
    judgements = in_processes(partial(_judge, population, seed, judge), count)
    judged = reported(judgements, count, population, lambda judgement: bool(judgement.missed))
    return Campaign(population, seed, judge.checks, list(judged))


def tabulate(campaigns: Sequence[Campaign], part: str = "outcomes") -> list[Table]:
    """Number of failures of each check, and outcomes of the runs.

    Args:
        campaigns: Runs with the same checks.
        part: Name of the first table; the second one ends in ``-endings``.
    """
    checks = campaigns[0].checks
    heads = ["violation"]
    for campaign in campaigns:
        heads += [f"{campaign.population}: of {len(campaign.judgements)}", "worst"]
    rows = tuple(
        (check.text, *(cell for campaign in campaigns for cell in _cells(campaign, name, check)))
        for name, check in checks.items()
    )
    ends = [Counter(judgement.outcome for judgement in c.judgements) for c in campaigns]
    order = sorted(set().union(*ends), key=lambda end: -sum(count[end] for count in ends))
    endings = tuple(
        (f"`{end}`", *(f"{100.0 * count[end] / count.total():.2f} %" for count in ends))
        for end in order
    )
    names = (campaign.population for campaign in campaigns)
    return [
        Table(part, tuple(heads), rows, (_outcome(campaigns),), "verification.md"),
        Table(f"{part}-endings", ("outcome", *names), endings, page="verification.md"),
    ]


def _judge(population: str, seed: int, judge: Judge, index: int) -> Judgement:
    """Checks a run, every second one also with a finer output."""
    return judge.judge(draw(population, seed, index), twice=index % 2 == 0)


def _cells(campaign: Campaign, name: str, check: Check) -> tuple[str, str]:
    failures, unit = campaign.failures(name), check.unit
    worst = f"{max(failures.values()):.1g} {unit}" if failures and unit else "–"
    return str(len(failures)), worst


def _outcome(campaigns: Sequence[Campaign]) -> str:
    checks = campaigns[0].checks
    missed = sum(any(campaign.failures(check) for campaign in campaigns) for check in checks)
    outcome = f"Missed in {missed} of {len(checks)} checks" if missed else "Met"
    return f"Target: no violations. {outcome} (seed {campaigns[0].seed})."


def main() -> None:
    """Prints one run as a scenario file, its end, and the failed checks with their deviations."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.outcomes", description=main.__doc__)
    parser.add_argument("population", choices=POPULATIONS)
    parser.add_argument("index", type=int)
    parser.add_argument("--seed", type=int, default=SEED)
    options = parser.parse_args()
    prepare_kernel()
    scenario = draw(options.population, options.seed, options.index)
    module = JUDGED_BY.get(options.population)
    judge = import_module(f"benchmarks.{module}").JUDGE if module else PLANAR
    judgement = judge.judge(scenario)
    print(scenario_to_toml(scenario))
    print(f"# {judgement.outcome}")
    for name, by in judgement.missed.items():
        print(f"# {judge.checks[name].text}: {by:g} {judge.checks[name].unit}".rstrip())
    if judge is PLANAR:
        comparison = compare(scenario)
        for name, by in comparison.differences.items():
            if comparison.known and by > 1.0:
                print(f"# {QUANTITIES[name]}: {by:g} times that")


if __name__ == "__main__":
    main()
