"""Populations of random runs, each determined by a seed and an index, and processes to run them."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from random import Random
from typing import TypeVar

from slipgrasp.core.executors.worker import NICENESS
from slipgrasp.core.run.simulator import prepare_kernel
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values
from tests.core.drawn_hands_in_space import draw_hand_in_space
from tests.core.drawn_pairs import draw_in_pairs
from tests.core.drawn_scenarios import AtEnds, draw_kind, draw_scenario
from tests.core.drawn_soft_grasps import draw_soft_grasp

AT_ENDS, ON_BOUNDS, ANYWHERE = "any, at the ends of ranges", "theorem 4, on its bounds", "any"
IN_SPACE = "in space, at the ends of ranges"
PAIRS, PAIRS_IN_SPACE = "everything, in pairs", "everything in space, in pairs"
SOFT_GRASPS = "soft grasps"

MAX_STEPS = 200_000
MASS, FRICTION = (0.5, 2.0), (0.15, 0.6)
INERTIA_PER_MASS = 0.01042
WEIGHT, SAFETY = (1.0, 50.0), (1.0, 2.0)

PROCESSES = 2
CHUNK = 20
REPORTS = 20

T = TypeVar("T")


def draw(population: str, seed: int, index: int) -> Scenario:
    """One reproducible run.

    Args:
        population: One of `POPULATIONS`.
        seed: Seed of the draws.
        index: Index of the run.
    """
    return POPULATIONS[population](seed, index)


def in_processes(work: Callable[[int], T], count: int, processes: int = PROCESSES) -> Iterator[T]:
    """Results of a function for 0, 1, 2 …, in this order, from processes with low priority.

    Args:
        work: A function that other processes can import.
        count: Number of calls; fewer if the results are not all requested.
        processes: Number of concurrent processes.
    """
    context = get_context("spawn")
    pool = ProcessPoolExecutor(processes, context, initializer=_begin)
    try:
        yield from pool.map(work, range(count), chunksize=CHUNK)
    finally:
        pool.shutdown(cancel_futures=True)


def reported(
    results: Iterable[T], count: int, name: str, is_wrong: Callable[[T], bool]
) -> Iterator[T]:
    """Yields results; reports the progress and faulty runs on standard error."""
    wrong: list[int] = []
    for index, result in enumerate(results):
        wrong += [index] * is_wrong(result)
        if (index + 1) % max(1, count // REPORTS) == 0:
            which = f" {wrong}" if wrong else ""
            said = f"{name}: {index + 1} of {count} runs, {len(wrong)} wrong{which}"
            print(said, file=sys.stderr, flush=True)
        yield result


def _begin() -> None:
    os.nice(NICENESS)
    prepare_kernel()


def _on_bounds(seed: int, index: int) -> Scenario:
    """The hand of case II and an unknown object within physical bounds.

    Continuous control, and adaptation so fast that the estimates reach their bounds.
    """
    rng = Random(f"object {seed} {index}")
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
            "controller.velocity_gain": 10.0,
            "controller.distribution": "exact",
            "controller.prediction": False,
            "controller.probing": 0.0,
            "controller.lyapunov_weight": rng.uniform(*WEIGHT),
            "controller.grip_safety": rng.uniform(*SAFETY),
            "simulation.duration": 1.0,
            "simulation.max_steps": MAX_STEPS,
        },
    )


def _anywhere(seed: int, index: int, *ends: type[AtEnds]) -> Scenario:
    """Any law, motion, outline, push, patch, imperfection; perhaps at the ends of ranges."""
    name = f"{seed} {index}"
    return draw_scenario(draw_kind(Random(f"kind {name}")), name, *ends)


POPULATIONS: dict[str, Callable[[int, int], Scenario]] = {
    PAIRS: lambda *place: draw_in_pairs(*place, spatial=False).scenario,
    PAIRS_IN_SPACE: lambda *place: draw_in_pairs(*place, spatial=True).scenario,
    AT_ENDS: lambda *place: _anywhere(*place, AtEnds),
    ON_BOUNDS: _on_bounds,
    ANYWHERE: _anywhere,
    IN_SPACE: lambda *place: draw_hand_in_space("{} {}".format(*place), AtEnds),
    SOFT_GRASPS: lambda *place: draw_soft_grasp("{} {}".format(*place)),
}
"""Draws by a seed and an index."""
