"""Many viewers, some of which misbehave: remaining frame rate of the others."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from benchmarks.dashboard import Served, serve_dashboard
from benchmarks.dashboard_viewers import Watched, come_and_go, view
from benchmarks.processes import processor_time_of

SETTLE_EACH, SETTLE = 0.5, 10.0


@dataclass(frozen=True, slots=True)
class MixedViewers:
    """Update rates of well-behaved viewers, alone and with others that misbehave.

    Attributes:
        alone: Updates per second, the mean over all viewers, round by round.
        beside: The same while the others misbehaved.
        alone_work: Processor time of the server in each round alone [s].
        beside_work: Processor time of the server in each round with others [s].
        sent_away: Number of disconnections of the others, by behaviour and close code.
    """

    alone: list[float] = field(default_factory=list)
    beside: list[float] = field(default_factory=list)
    alone_work: list[float] = field(default_factory=list)
    beside_work: list[float] = field(default_factory=list)
    sent_away: Counter[str] = field(default_factory=Counter)

    @property
    def share_kept(self) -> float:
        """Ratio of all updates with the others to all updates alone."""
        return float(np.sum(self.beside) / np.sum(self.alone))

    @property
    def share_of_work(self) -> float:
        """Fraction of the server's work that is left for them, independent of other load."""
        alone = np.sum(self.alone) / np.sum(self.alone_work)
        return float(np.sum(self.beside) / np.sum(self.beside_work) / alone)


def mix_viewers(polite: int, rude: int, rounds: int, seconds: float, seed: int) -> MixedViewers:
    """Connects viewers to a played run, alone and with others that misbehave, in turns.

    Args:
        polite: Number of well-behaved viewers.
        rude: Number of viewers that misbehave repeatedly, in a separate process.
        rounds: Number of rounds.
        seconds: Duration of each turn.
        seed: Seed of the misbehaviour.

    Raises:
        AssertionError: If a well-behaved viewer is disconnected, or another one is not.
    """
    with serve_dashboard() as served:
        come_and_go(served.socket, 1)
        return asyncio.run(_mix(served, polite, rude, rounds, seconds, seed))


async def _mix(
    served: Served, polite: int, rude: int, rounds: int, seconds: float, seed: int
) -> MixedViewers:
    found, seen = MixedViewers(), [Watched() for _ in range(polite)]
    viewers = [asyncio.create_task(view(served.socket, one)) for one in seen]
    command = [sys.executable, "-m", "benchmarks.faults.rude_viewers", served.socket, str(rude)]
    await asyncio.sleep(SETTLE_EACH * polite)
    for number in range(rounds):
        await _watch(served, seen, seconds, found.alone, found.alone_work)
        others = await asyncio.create_subprocess_exec(
            *command, f"{seed} {number}", stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        assert others.stdout is not None
        await others.stdout.readline()  # They connect now, and each starts a session.
        await asyncio.sleep(SETTLE)
        await _watch(served, seen, seconds, found.beside, found.beside_work)
        told, _ = await others.communicate(b"")
        assert others.returncode == 0, "somebody was not sent away as expected"
        found.sent_away.update(json.loads(told))
    gone = sum(viewer.done() for viewer in viewers)
    for viewer in viewers:
        viewer.cancel()
        with suppress(asyncio.CancelledError):
            await viewer
    assert not gone, f"{gone} of {polite} well-mannered viewers were sent away"
    return found


async def _watch(
    served: Served,
    seen: Sequence[Watched],
    seconds: float,
    rates: list[float],
    works: list[float],
) -> None:
    """Records updates per second, the mean over all viewers, and the server's processor time."""
    for one in seen:
        one.forget()
    began = processor_time_of(served.process)
    await asyncio.sleep(seconds)
    works.append(processor_time_of(served.process) - began)
    rates.append(float(np.mean([len(one.arrivals) for one in seen])) / seconds)
