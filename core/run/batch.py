"""Parallel runs on several threads, for their metrics without traces."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from threading import Event

from slipgrasp.core.processors import available_processors
from slipgrasp.core.run.result import RunSummary
from slipgrasp.core.run.simulator import prepare_kernel, summarise
from slipgrasp.core.scenario import Scenario

_AHEAD_PER_THREAD = 4


def simulate_many(
    scenarios: Iterable[Scenario], *, threads: int | None = None
) -> Generator[RunSummary, None, None]:
    """Runs scenarios on several threads, without the GIL in the compiled part.

    Scenarios are read and results returned one by one, so that memory use does not depend on their
    number. The results are equal to those of `simulate`, for any number of threads.

    Args:
        scenarios: Scenarios to simulate.
        threads: Number of concurrent runs; all processors if None.

    Yields:
        Outcome and metrics of every run, in order.

    Raises:
        ScenarioError: When a scenario that cannot be simulated is reached.
    """
    prepare_kernel()
    count = threads or available_processors()
    pending: deque[Future[RunSummary]] = deque()
    abandoned = Event()
    with ThreadPoolExecutor(count, thread_name_prefix="slipgrasp-batch") as pool:
        try:
            for scenario in scenarios:
                pending.append(pool.submit(summarise, scenario, abandoned.is_set))
                if len(pending) >= count * _AHEAD_PER_THREAD:
                    yield pending.popleft().result()
            while pending:
                yield pending.popleft().result()
        finally:
            # The pool waits for running simulations even though their results are not used.
            abandoned.set()
            for future in pending:
                future.cancel()
