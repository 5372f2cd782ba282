"""Executors for the tasks of a study: inline, in processes, or on a Dask cluster.

Results do not depend on the executor or its number of workers.
"""

from __future__ import annotations

import re

from slipgrasp.core.executors.executor import (
    AHEAD,
    ATTEMPTS,
    Cancelled,
    Executor,
    ExecutorError,
    Finished,
    ShouldStop,
    TaskFunction,
)
from slipgrasp.core.executors.inline import InlineExecutor
from slipgrasp.core.executors.processes import ProcessExecutor

__all__ = [
    "AHEAD",
    "ATTEMPTS",
    "SPECIFICATIONS",
    "Cancelled",
    "Executor",
    "ExecutorError",
    "Finished",
    "ShouldStop",
    "TaskFunction",
    "make_executor",
]

_NAMES = ("processes", "inline", "dask")
SPECIFICATIONS = (*_NAMES, "dask://HOST:PORT")

_SCHEDULER = re.compile(r"dask://([\w.-]{1,253}|\[[0-9a-fA-F:.]{2,45}\]):([0-9]{1,5})", re.ASCII)


def make_executor(specification: str = "processes", *, workers: int | None = None) -> Executor:
    """Returns the executor with this name; it starts nothing before it is used.

    Args:
        specification: ``processes`` on this machine, ``inline`` in this process, ``dask`` for a
            Dask cluster on this machine, ``dask://HOST:PORT`` for an existing scheduler.
        workers: Number of processes; as many as there are processors if None.

    Raises:
        ExecutorError: If the executor does not exist or does not allow this number of workers.
    """
    match = _SCHEDULER.fullmatch(specification)
    if match is None and specification not in _NAMES:
        raise ExecutorError(
            f"'{specification[:60]!s}' is not an executor; choose one of "
            f"{', '.join(SPECIFICATIONS)}"
        )
    if specification == "processes":
        return ProcessExecutor(workers)
    if workers is not None and specification != "dask":
        raise ExecutorError(
            f"the executor '{specification[:60]}' has a fixed number of workers; omit it"
        )
    if specification == "inline":
        return InlineExecutor()
    from slipgrasp.core.executors.dask_cluster import DaskExecutor

    address = None if match is None else f"tcp://{match[1]}:{match[2]}"
    return DaskExecutor(address, workers=workers)
