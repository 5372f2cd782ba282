"""CPU time as the median of rounds, each with a turn of every candidate."""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, NamedTuple, TypeVar

import numpy as np

MILLISECONDS = 1e3

T = TypeVar("T")


class Line(NamedTuple):
    """Cost as a linear function of size.

    Attributes:
        intercept: Cost at size 0 [s].
        slope: Cost per unit of size [s].
        deviation: Largest relative difference between a cost and the line.
    """

    intercept: float
    slope: float
    deviation: float


def median_seconds(
    works: Mapping[str, Callable[[], object]],
    rounds: int,
    clock: Callable[[], float] = time.process_time,
) -> dict[str, float]:
    """Median time of each work [s]; other load of the machine affects all of them equally.

    Every round has another reproducible order, and Python's garbage is collected between rounds: in
    a fixed order, the same work would always pay for memory that another one had released.

    Args:
        works: Functions to time, by name; each is first called once without timing.
        rounds: Number of timings of each, in turns.
        clock: CPU time of the process, or wall time for several threads.
    """
    times: dict[str, list[float]] = {name: [] for name in works}
    for work in works.values():
        work()
    turns = list(works)
    generator = np.random.default_rng(0)
    for _ in range(rounds):
        generator.shuffle(turns)
        with _no_collector():
            for name in turns:
                start = clock()
                works[name]()
                times[name].append(clock() - start)
    return {name: statistics.median(values) for name, values in times.items()}


def on_threads(work: Callable[[Any], T], items: Sequence[Any], threads: int) -> list[T]:
    """Results of the work for every item, with a number of concurrent threads."""
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(work, items))


@contextmanager
def _no_collector() -> Iterator[None]:
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def fit_exponent(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    """The k of ``seconds ~ sizes^k``, by least squares of the logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def fit_line(sizes: Sequence[float], seconds: Sequence[float]) -> Line:
    """The line of least relative deviation from the costs."""
    costs = np.array(seconds)
    slope, intercept = np.polyfit(sizes, costs, 1, w=1.0 / costs)
    deviation = np.abs((intercept + slope * np.array(sizes)) / costs - 1.0).max()
    return Line(float(intercept), float(slope), float(deviation))
