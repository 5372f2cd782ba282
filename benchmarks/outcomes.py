"""Whether every outcome of a run is true: random runs, each judged by `benchmarks.outcome_checks`.

Half of them are any scenario at all, drawn at the ends of its ranges; half are objects of the
paper's case II under theorem 4 with physical bounds and continuous control, whose estimates
run into those bounds. Every run follows from the seed and its index alone:
`python -m benchmarks.outcomes POPULATION INDEX [--seed N]` prints one of them as a scenario file,
and what is wrong with it.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from random import Random
from typing import NamedTuple, TypeVar

from benchmarks.outcome_checks import CHECKS, Judgement, judge_run
from benchmarks.report import Table
from core.executors.worker import NICENESS
from core.loading import load_scenario, scenario_to_toml, with_values
from core.scenario import Scenario
from core.simulator import prepare_kernel

__all__ = ["POPULATIONS", "Campaign", "draw", "judge_many", "run", "tabulate"]

COUNT = 10_000  # of each population
SEED = 14
PROCESSES = 2
CHUNK = 20
REPORTS = 20
PER_RATE = 10_000  # of so many runs one may differ with the output rate

MAX_STEPS = 200_000
MASS, FRICTION = (0.5, 2.0), (0.15, 0.6)
INERTIA_PER_MASS = 0.01042
WEIGHT, SAFETY = (1.0, 50.0), (1.0, 2.0)

T = TypeVar("T")


class Campaign(NamedTuple):
    """Judged runs of one population.

    Attributes:
        population: One of `POPULATIONS`.
        seed: Of the draws.
        judgements: By index.
    """

    population: str
    seed: int
    judgements: list[Judgement]

    def failures(self, check: str) -> dict[int, float]:
        """By how much a check was missed, by index of the run."""
        return {
            index: judgement.missed[check]
            for index, judgement in enumerate(self.judgements)
            if check in judgement.missed
        }


def run(docs: Path | None = None, seed: int = SEED) -> list[Table]:
    """The tables ``outcomes`` and ``outcomes-endings``.

    Args:
        docs: Where the page is that they are written into.
        seed: Other seeds draw other runs.
    """
    return tabulate([judge_many(population, COUNT, seed) for population in POPULATIONS])


def draw(population: str, index: int, seed: int = SEED) -> Scenario:
    """One run of a population, the same every time.

    Args:
        population: One of `POPULATIONS`.
        index: Which.
        seed: Other seeds draw other runs.
    """
    return POPULATIONS[population](f"{seed} {index}")


def judge_many(population: str, count: int, seed: int, processes: int = PROCESSES) -> Campaign:
    """Draws and judges runs on several processes, and says on standard error how far it is.

    Args:
        population: One of `POPULATIONS`.
        count: How many runs, from index 0 on.
        seed: Other seeds draw other runs.
        processes: How many at a time.
    """
    judgements = in_processes(partial(_judge, population, seed), range(count), processes)
    told = told_while(judgements, count, population, lambda judgement: bool(judgement.missed))
    return Campaign(population, seed, list(told))


def in_processes(
    work: Callable[[int], T], items: Iterable[int], processes: int = PROCESSES
) -> Iterator[T]:
    """Results in the order of the items, made by processes at low priority."""
    context = get_context("spawn")
    with ProcessPoolExecutor(processes, context, initializer=_begin) as pool:
        yield from pool.map(work, items, chunksize=CHUNK)


def told_while(
    results: Iterable[T], count: int, name: str, is_wrong: Callable[[T], bool]
) -> Iterator[T]:
    """Passes results on and reports them on standard error, about twenty times."""
    wrong, step = 0, max(1, count // REPORTS)
    for number, result in enumerate(results, 1):
        wrong += is_wrong(result)
        if number % step == 0:
            print(f"{name}: {number} of {count} runs, {wrong} wrong", file=sys.stderr, flush=True)
        yield result


def tabulate(campaigns: Sequence[Campaign]) -> list[Table]:
    """How often each check failed, and how the runs ended."""
    heads = ["what must not be"]
    for campaign in campaigns:
        heads += [f"{campaign.population}: of {len(campaign.judgements)}", "worst"]
    rows = tuple(
        (check.text, *(cell for campaign in campaigns for cell in _cells(campaign, name)))
        for name, check in CHECKS.items()
    )
    ends = [Counter(judgement.outcome for judgement in c.judgements) for c in campaigns]
    order = sorted(set().union(*ends), key=lambda end: -sum(count[end] for count in ends))
    endings = tuple(
        (f"`{end}`", *(_share(count[end], count.total()) for count in ends)) for end in order
    )
    return [
        Table("outcomes", tuple(heads), rows, (_verdict(campaigns),), "verification.md"),
        Table(
            "outcomes-endings",
            ("outcome", *(campaign.population for campaign in campaigns)),
            endings,
            page="verification.md",
        ),
    ]


def _judge(population: str, seed: int, index: int) -> Judgement:
    return judge_run(draw(population, index, seed))


def _begin() -> None:
    os.nice(NICENESS)
    prepare_kernel()


def _cells(campaign: Campaign, check: str) -> tuple[str, str]:
    failures, unit = campaign.failures(check), CHECKS[check].unit
    worst = f"{max(failures.values()):.1g} {unit}" if failures and unit else "–"
    return str(len(failures)), worst


def _share(part: int, whole: int) -> str:
    return f"{100.0 * part / whole:.1f} %"


def _verdict(campaigns: Sequence[Campaign]) -> str:
    runs = sum(len(campaign.judgements) for campaign in campaigns)
    counts = {check: sum(len(c.failures(check)) for c in campaigns) for check in CHECKS}
    allowed = {"rate": runs / PER_RATE}
    missed = sum(count > allowed.get(check, 0) for check, count in counts.items())
    verdict = f"missed by {missed} of {len(CHECKS)} checks" if missed else "met"
    seeds = ", ".join(str(seed) for seed in sorted({campaign.seed for campaign in campaigns}))
    return (
        f"{runs} runs, seed {seeds}. Target: none, and at most one of {PER_RATE} that changes "
        f"with the output rate: {verdict}."
    )


def _at_the_ends(seed: str) -> Scenario:
    """Any law, motion, outline, push, patch and imperfection, at the ends of their ranges."""
    from tests.core.drawn_scenarios import AtEnds, draw_kind, draw_scenario

    return draw_scenario(draw_kind(Random(f"kind {seed}")), seed, AtEnds)


def _on_the_bounds(seed: str) -> Scenario:
    """An object of unknown mass, inertia and friction under theorem 4, within physical bounds."""
    rng = Random(f"object {seed}")
    mass = rng.uniform(*MASS)
    return with_values(
        load_scenario("composite-case-2"),
        {
            "title": "",
            "object.mass": mass,
            "object.inertia": INERTIA_PER_MASS * mass,
            "fingers.0.friction": rng.uniform(*FRICTION),
            "fingers.1.friction": rng.uniform(*FRICTION),
            "controller.kind": "theorem-4",
            "controller.control_period": 0.0,
            "controller.lyapunov_weight": rng.uniform(*WEIGHT),
            "controller.grip_safety": rng.uniform(*SAFETY),
            "simulation.duration": 1.0,
            "simulation.max_steps": MAX_STEPS,
        },
    )


POPULATIONS: dict[str, Callable[[str], Scenario]] = {
    "at the ends of ranges": _at_the_ends,
    "theorem 4 on its bounds": _on_the_bounds,
}


def main() -> None:
    """Prints one run as a scenario file, and what is wrong with it."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.outcomes", description=main.__doc__)
    parser.add_argument("population", choices=POPULATIONS)
    parser.add_argument("index", type=int)
    parser.add_argument("--seed", type=int, default=SEED)
    options = parser.parse_args()
    prepare_kernel()
    scenario = draw(options.population, options.index, options.seed)
    judgement = judge_run(scenario)
    print(scenario_to_toml(scenario))
    print(f"# {judgement.outcome}")
    for name, by in judgement.missed.items():
        print(f"# {CHECKS[name].text}: {by:g} {CHECKS[name].unit}".rstrip())


if __name__ == "__main__":
    main()
