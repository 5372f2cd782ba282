"""Laws that start from the paper's estimates, and the missing parts of the paper's law as printed.

Case II starts from a friction estimate of 1.2, twice the largest friction of the random objects:
the initial grip is too weak for all of them. Runs last one second.
"""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.report import Table
from benchmarks.robustness import COUNT, LAWS, PRINTED, SEED, WORLDS, random_objects, vary_objects
from benchmarks.robustness_gains import GAINS, MORE_GAINS, Gains, Result, measure_best, set_gains
from benchmarks.robustness_tables import describe
from benchmarks.robustness_worlds import FIRST_FORCE, FIRST_FRICTION, Held
from slipgrasp.core.run.batch import simulate_many
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import Outcome

TUNED = 60
_PRINTED_GAINS = ((100.0, 10.0),)


def measure_start(count: int = COUNT, tuned: int = TUNED) -> Table:
    """The table ``robustness-start``.

    Args:
        count: Number of objects of the results.
        tuned: Number of objects for the choice of gains.
    """
    bases = [load_scenario(preset) for preset in WORLDS.values()]
    estimates = {f"estimates.{i}.initial": FIRST_FRICTION for i in range(2)}
    firm = [with_values(base, estimates) for base in bases]
    rows = [(law, law, bases) for law in LAWS]
    rows.append((f"{PRINTED}, first grip {FIRST_FORCE:g} N", PRINTED, firm))
    cells = tuple((name, *_describe_row(law, each, tuned, count)) for name, law, each in rows)
    note = (
        f"{count} objects, 1 s: held, with the 95 % interval; gains K_p/K_v, chosen on {tuned} "
        "other objects (printed law: the paper's)."
    )
    heads = ("law", *(f"{world} world" for world in WORLDS))
    return Table("robustness-start", heads, cells, (note,), "robustness.md")


def hold_at_best(
    base: Scenario,
    law: str,
    tuned: int,
    count: int,
    gains: Sequence[Gains] = GAINS,
) -> Result:
    """Simulates a law with random objects for a second, with its best gains.

    Args:
        base: Hand, motion and sensors.
        law: One of `robustness.LAWS`.
        tuned: Number of objects for the choice of gains.
        count: Number of objects of the results.
        gains: Gains to choose from.
    """

    def run(chosen: Gains, number: int, seed: int) -> list[Held]:
        return hold_for_a_second(with_values(base, set_gains(chosen)), law, number, seed)

    return measure_best(run, tuned, count, gains, MORE_GAINS if gains is GAINS else ())


def hold_for_a_second(base: Scenario, law: str, count: int, seed: int = SEED) -> list[Held]:
    """Simulates a law with random objects for a second.

    Args:
        base: Hand, motion and sensors.
        law: One of `robustness.LAWS`.
        count: Number of objects.
        seed: Seed of their draw.
    """
    objects = random_objects(count, len(base.fingers), seed)
    return [
        Held(run.metrics.held, run.outcome is Outcome.COMPLETED, max(run.metrics.slip_path))
        for run in simulate_many(vary_objects(base, law, objects, seed))
    ]


def _describe_row(law: str, bases: Sequence[Scenario], tuned: int, count: int) -> list[str]:
    gains = _PRINTED_GAINS if law == PRINTED else GAINS
    return [describe(hold_at_best(base, law, tuned, count, gains)) for base in bases]
