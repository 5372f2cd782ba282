"""Many viewers, some of which misbehave: remaining frame rate of the others."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from benchmarks.dashboard import serve_dashboard
from benchmarks.dashboard_viewers import Watched, come_and_go, observe, watching
from benchmarks.processes import processor_time_of
from benchmarks.service import Service

SETTLE_EACH, SETTLE = 0.5, 10.0


def mix_viewers(polite: int, rude: int, rounds: int, seconds: float, seed: int) -> dict[str, Any]:
    """Connects viewers to a played run, alone and with others that misbehave, in turns.

    Args:
        polite: Number of well-behaved viewers.
        rude: Number of viewers that misbehave repeatedly, in a separate process.
        rounds: Number of rounds.
        seconds: Duration of each turn.
        seed: Seed of the misbehaviour.

    Returns:
        Numbers of ``rude`` and ``all`` viewers; ``kept``, the updates of the well-behaved ones with
        the others, relative to those alone [%]; ``of_work``, the same per processor time of the
        server, independent of other load [%].

    Raises:
        AssertionError: If a well-behaved viewer is disconnected, or another one is not.
    """
    with serve_dashboard() as served:
        come_and_go(served.socket, 1)
        alone, beside = asyncio.run(_mix(served, polite, rude, rounds, seconds, seed))
    updates, updates_per_work = beside / alone
    kept, of_work = 100.0 * float(updates), 100.0 * float(updates_per_work)
    return {"rude": rude, "all": polite + rude, "kept": kept, "of_work": of_work}


async def _mix(
    served: Service, polite: int, rude: int, rounds: int, seconds: float, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Updates of the well-behaved viewers, also per processor time, alone and with the others."""
    alone, beside = [], []
    command = [sys.executable, "-m", "benchmarks.faults.rude_viewers", served.socket, str(rude)]
    async with watching(served.socket, polite) as seen:
        await asyncio.sleep(SETTLE_EACH * polite)
        for number in range(rounds):
            alone.append(await _count_updates(served, seen, seconds))
            others = await asyncio.create_subprocess_exec(
                *command, f"{seed} {number}", stdin=subprocess.PIPE, stdout=subprocess.PIPE
            )
            assert others.stdout is not None
            await others.stdout.readline()  # They connect now, and each starts a session.
            await asyncio.sleep(SETTLE)
            beside.append(await _count_updates(served, seen, seconds))
            await others.communicate(b"")
            assert others.returncode == 0, "a viewer was not disconnected as expected"
    totals = (np.sum(turns, axis=0) for turns in (alone, beside))
    first, second = (np.array([updates, updates / work]) for updates, work in totals)
    return first, second


async def _count_updates(
    served: Service, seen: Sequence[Watched], seconds: float
) -> tuple[int, float]:
    """Number of updates of all viewers in some time, and processor time of the server [s]."""
    work = await observe(seen, seconds, partial(processor_time_of, served.process.pid))
    return sum(len(one.arrivals) for one in seen), work
